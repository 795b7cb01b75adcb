"""`python -m clrt.bench`: measure, print, keep, and, when asked, fill the tables of the documentation."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import click

from clrt.bench import export, machine, measure, report, scenes
from clrt.bench.commands import measure_commands, measure_imports
from clrt.bench.growth import measure_growth
from clrt.bench.incoherent import measure_incoherent
from clrt.bench.ladder import measure_ladder
from clrt.bench.marks import marks_of
from clrt.bench.programs import measure_programs
from clrt.bench.versus import measure_versus
from clrt.bench.view import view_of
from clrt.cli import failure
from clrt.device.context import open_device

_ROOT = Path(__file__).resolve().parents[2]
_FILE = click.Path(path_type=Path)
_STEP = 8  #: pixels


@click.command("bench", context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--quick", is_flag=True, help="Small generated scenes and few rounds: does the harness work?")
@click.option("--only", multiple=True, type=click.Choice(export.PARTS), help="This part alone; may be repeated.")
@click.option("--size", "sizes", multiple=True, type=click.IntRange(8, 8192), metavar="N",
              help="Side of the view that tracers are compared in, a multiple of 8; may be repeated.  [default: 512, 1024]")
@click.option("--rounds", type=click.IntRange(1), metavar="N", help="Of everything that takes turns; 6 or more give intervals.")
@click.option("--largest", type=click.IntRange(1000, 10_000_000), metavar="N",
              help="Triangles at the end of the growth curve.  [default: 1000000]")
@click.option("--objects", type=click.IntRange(1, 100_000), metavar="N", help="Objects at the end of theirs.  [default: 10000]")
@click.option("--scenes", "folder", type=_FILE, metavar="FOLDER", help="Where rabbit.txt and monkey.txt are, instead of generated ones.")
@click.option("--device", metavar="NAME", help="Part of the name of an OpenCL device.")
@click.option("-o", "--out", type=_FILE, default=Path("bench-results"), show_default=True, metavar="FOLDER", help="Where the JSON goes.")
@click.option("--from", "earlier", type=_FILE, metavar="JSON", help="Show the results of an earlier run instead of measuring.")
@click.option("--write-docs", is_flag=True, help="Write tables and plots to docs/ and README.md.")
def bench(
    quick: bool, only: tuple[str, ...], sizes: tuple[int, ...], rounds: int | None, largest: int | None,
    objects: int | None, folder: Path | None, device: str | None, out: Path, earlier: Path | None, write_docs: bool,
) -> None:  # fmt: skip
    """Measure clrt on this machine beside other tracers: rays a second, whole commands, trees, growth."""
    if write_docs and (quick or only):
        raise click.UsageError("the documentation takes a whole run at full size; leave out --quick and --only, or --write-docs")
    if write_docs:
        export.check_docs(_ROOT)
    if earlier is not None:
        results = export.read(earlier)
    else:
        results = run(_plan(quick, sizes, rounds, largest, objects), folder, device, quick, only or export.PARTS)
        click.echo(f"kept in {export.save(results, out)}", err=True)
    report.print_results(results)
    if write_docs:
        click.echo(f"written: {', '.join(str(path) for path in export.write_docs(results, _ROOT))}", err=True)


def _plan(quick: bool, sizes: tuple[int, ...], rounds: int | None, largest: int | None, objects: int | None) -> measure.Plan:
    plan = measure.QUICK if quick else measure.FULL
    if odd := [size for size in sizes if size % _STEP]:
        raise click.UsageError(f"a size of {odd[0]}: give a multiple of {_STEP}, the side of a group of packets")
    if sizes:
        plan = replace(plan, view_sizes=tuple(sorted(set(sizes))))
    if rounds is not None:
        plan = replace(plan, rounds=rounds, peer_rounds=rounds, ladder_rounds=rounds, command_rounds=rounds)
    reach = {name: number for name, number in (("triangles", largest), ("separate", objects)) if number is not None}
    return replace(plan, reach=replace(plan.reach, **reach))


def run(plan: measure.Plan, folder: Path | None, device_name: str | None, quick: bool, parts: Sequence[str]) -> dict[str, Any]:
    """The measurements as JSON types; what is under way is told on standard error. Raises ClrtError, OSError."""
    device = open_device(device_name)
    results: dict[str, Any] = {
        "format": export.FORMAT, "started": machine.now(), "quick": quick, "machine": machine.describe(device.info),
        "load_before": machine.load_average(), "plan": asdict(plan),
    }  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="clrt-bench-") as name:
        scratch = Path(name)
        loaded = scenes.load(folder, scratch, quick=quick)
        rabbit = next(scene for scene in loaded if scene.role == "rabbit")
        results["scenes"] = [
            {"role": s.role, "name": s.name, "generated": s.generated, "triangles": s.scene.triangle_count} for s in loaded
        ]
        works: dict[str, tuple[str, Callable[[], Any]]] = {
            "versus": ("rays against other tracers", lambda: measure_versus(rabbit, plan.view_sizes, plan.peer_rounds, device, scratch)),
            "incoherent": ("incoherent rays", lambda: measure_incoherent(rabbit, plan.incoherent_rays, plan.peer_rounds, device)),
            "ladder": ("the precision ladder", lambda: measure_ladder(rabbit, plan.ladder_size, plan.ladder_rounds, device)),
            "trees": ("trees against brute force", lambda: [r for s in loaded for r in measure.measure_trees(s, plan, device)]),
            "tests": ("tests a ray", lambda: [r for s in loaded for r in measure.count_tests(s, plan.count_size, device)]),
            "commands": ("whole commands", lambda: measure_commands(
                view_of(rabbit, plan.command_size), rabbit.name, plan.command_size, plan.command_rounds, scratch)),
            "imports": ("imports", lambda: measure_imports(plan.command_rounds)),
            "programs": ("specialised programs", lambda: measure_programs(rabbit, device)),
            "growth": ("growth", lambda: measure_growth(plan.reach)),
        }  # fmt: skip
        for part in (part for part in export.PARTS if part in parts):
            words, work = works[part]
            click.echo(f"measuring {words} ...", err=True)
            results[part] = work()
            for missing in _missing(results[part]):
                click.echo(f"  without {missing['name']}: {missing['reason']}", err=True)
    results |= {"finished": machine.now(), "load_after": machine.load_average()}
    return results | {"marks": [mark.to_json() for mark in marks_of(results)]}


def _missing(measured: Any) -> list[dict[str, str]]:
    """The peers that a part went without."""
    if not isinstance(measured, dict):
        return []
    found: list[dict[str, str]] = measured.get("missing") or measured.get("peers", {}).get("missing") or []
    return found


def main() -> None:
    """As the command line of clrt: every failure is one line and an exit code."""
    try:
        bench.main(prog_name="python -m clrt.bench", standalone_mode=False)
    except (Exception, KeyboardInterrupt) as error:
        sys.exit(failure.report(error))


if __name__ == "__main__":
    main()
