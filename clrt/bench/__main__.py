"""`python -m clrt.bench`: measure, print, keep, and, when asked, fill the tables of the documentation."""

from __future__ import annotations

import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from clrt.bench import export, machine, measure, report, scenes
from clrt.bench.incoherent import measure_incoherent
from clrt.bench.ladder import measure_ladder
from clrt.bench.marks import marks_of
from clrt.bench.programs import measure_programs
from clrt.bench.versus import measure_versus
from clrt.cli import failure
from clrt.device.context import open_device

_ROOT = Path(__file__).resolve().parents[2]
_FILE = click.Path(path_type=Path)


@click.command("bench", context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--quick", is_flag=True, help="Small generated scenes and few rounds: does the harness work?")
@click.option("--scenes", "folder", type=_FILE, metavar="FOLDER", help="Where rabbit.txt and monkey.txt are, instead of generated ones.")
@click.option("--device", metavar="NAME", help="Part of the name of an OpenCL device.")
@click.option("--out", type=_FILE, default=Path("bench-results"), show_default=True, metavar="FOLDER", help="Where the JSON goes.")
@click.option("--from", "earlier", type=_FILE, metavar="JSON", help="Show the results of an earlier run instead of measuring.")
@click.option("--write-docs", is_flag=True, help="Write the tables to docs/performance.md and README.md.")
def bench(quick: bool, folder: Path | None, device: str | None, out: Path, earlier: Path | None, write_docs: bool) -> None:
    """Measure clrt on this machine: trees against brute force, rays against embreex, tests a ray, the whole command."""
    if write_docs and quick:
        raise click.UsageError("a quick run is not for the documentation; leave out --quick or --write-docs")
    if write_docs:
        export.check_docs(_ROOT)
    if earlier is not None:
        results = export.read(earlier)
    else:
        results = run(folder, device, quick)
        click.echo(f"kept in {export.save(results, out)}", err=True)
    report.print_results(results)
    if write_docs:
        click.echo(f"written: {', '.join(str(path) for path in export.write_docs(results, _ROOT))}", err=True)


def run(folder: Path | None, device_name: str | None, quick: bool) -> dict[str, Any]:
    """All measurements, as JSON types; what is under way is told on standard error. Raises ClrtError, OSError."""
    plan = measure.QUICK if quick else measure.FULL
    device = open_device(device_name)
    results: dict[str, Any] = {
        "started": machine.now(), "quick": quick, "machine": machine.describe(device.info), "load_before": machine.load_average(),
        "plan": asdict(plan),
    }  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="clrt-bench-") as scratch:
        loaded = scenes.load(folder, Path(scratch), quick=quick)
        rabbit = next(scene for scene in loaded if scene.role == "rabbit")
        results["scenes"] = [
            {"role": s.role, "name": s.name, "generated": s.generated, "triangles": s.scene.triangle_count} for s in loaded
        ]
        _tell("trees against brute force")
        results["trees"] = [row for scene in loaded for row in measure.measure_trees(scene, plan, device)]
        _tell("rays against embreex")
        results["versus"] = measure_versus(rabbit, plan.versus_size, plan.rounds, device)
        _tell("incoherent rays")
        results["incoherent"] = measure_incoherent(rabbit, plan.incoherent_rays, plan.rounds, device)
        _tell("the precision ladder")
        results["ladder"] = measure_ladder(rabbit, plan.versus_size, plan.ladder_rounds, device)
        _tell("tests a ray")
        results["tests"] = [row for scene in loaded for row in measure.count_tests(scene, plan.count_size, device)]
        _tell("the whole command")
        results["command"] = measure.measure_command(rabbit, plan.command_size, plan.rounds, Path(scratch))
        results["programs"] = measure_programs(rabbit, device)
    results |= {"finished": machine.now(), "load_after": machine.load_average()}
    return results | {"marks": [mark.to_json() for mark in marks_of(results)]}


def _tell(what: str) -> None:
    click.echo(f"measuring {what} ...", err=True)


def main() -> None:
    """As the command line of clrt: every failure is one line and an exit code."""
    try:
        bench.main(prog_name="python -m clrt.bench", standalone_mode=False)
    except (Exception, KeyboardInterrupt) as error:
        sys.exit(failure.report(error))


if __name__ == "__main__":
    main()
