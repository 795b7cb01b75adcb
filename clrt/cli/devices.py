"""`clrt devices`: what this machine can render on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rich.table import Table

    from clrt.device.context import DeviceInfo


@click.command("devices", epilog="docs/devices.md tells how to add one: Intel's runtime for processors, or a distribution's PoCL.")
def devices() -> None:
    """List the OpenCL devices; a star marks the one that is used."""
    from clrt.cli.report import print_plainly
    from clrt.device.context import list_devices

    print_plainly([device_table(list_devices())])


def device_table(found: list[DeviceInfo]) -> Table:
    from rich.text import Text

    from clrt.cli.report import table

    result = table(["", "device", "platform", "version", "units", "lanes", "fp64", "memory"], words=4)
    for d in found:
        result.add_row(
            "*" if d.default else "",
            Text(d.name),
            Text(d.platform),
            Text(f"{d.version}, driver {d.driver}"),
            str(d.compute_units),
            str(d.lanes),
            "yes" if d.fp64 else "no",
            f"{d.global_mem / 2**30:.1f} GiB",
        )
    return result
