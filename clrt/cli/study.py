"""`clrt study`: what accuracy costs in time on a scene, measured; two studies compared."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from clrt.cli import arguments as kinds
from clrt.cli import failure, interrupt, paths, streams
from clrt.cli.progress import PhaseProgress
from clrt.files import check_writable

if TYPE_CHECKING:
    from rich.table import Table

    from clrt.scene.model import Scene
    from clrt.study.compare import Comparison


class _StudyProgress(PhaseProgress):
    """One bar for all parts; what remains is reckoned from the start, or from where a study goes on."""

    def __call__(self, phase: str, fraction: float) -> None:
        first, start = not self._phase, self._phase_start
        super().__call__(phase, max(fraction, self._fraction))
        if not first:
            self._phase_start = start


@click.command("study", epilog="docs/study.md tells how to read each part.")
@click.argument("scene", type=kinds.file, required=False)
@click.option("-o", "--out", type=kinds.file, metavar="DIR", help="Folder of the study; made if it is not there.")
@click.option("--quick", is_flag=True, help="A smaller picture, fewer runs: under a minute. The figures say so.")
@click.option("--resume", is_flag=True, help="Go on with the study in DIR, which was interrupted.")
@click.option("--size", type=kinds.size, metavar="WxH", help="Width and height in pixels, instead of the scene's made smaller.")
@click.option("--seeds", type=kinds.whole(10, 1000), metavar="N", help="Independent seeds of each point.  [default: 12, quick 10]")
@click.option("--device", metavar="NAME", help="Part of the name of an OpenCL device; `clrt devices` lists them.")
@click.option("--right-handed", is_flag=True, help="Mirror x: for scenes made in right-handed axes.")
@click.option("--split-objects", is_flag=True, help="Make each connected component an object, where the scene marks none.")
@click.option("--allow-path", type=kinds.file, multiple=True, metavar="DIR", help="Permit the scene to name files in DIR, too.")
@click.option("--compare", "compared", type=kinds.file, nargs=2, metavar="A B", help="Compare two studies instead: files or folders.")
@click.option("--json", "json_path", type=kinds.file_or_stdout, metavar="FILE",
              help="Write what --compare finds as JSON; - for standard output.")
@click.option("-q", "--quiet", is_flag=True, help="Print no verdict and no progress.")
def study(
    scene: Path | None, out: Path | None, compared: tuple[Path, Path] | None, json_path: Path | None, quiet: bool, **options: Any
) -> None:
    """Measure what accuracy costs in time on SCENE.

    DIR/study.json has every number with its interval; study.md and study.html beside it show them. Ctrl-C keeps the parts that are
    measured; --resume goes on.
    """
    if compared is not None:
        if scene is not None or out is not None:
            raise click.UsageError("--compare takes two studies and nothing else; leave out the scene and -o")
        _compare(compared, json_path, quiet)
        return
    if scene is None or out is None:
        raise click.UsageError("give a scene, and a folder with -o: clrt study scene.txt -o DIR")
    if json_path is not None:
        raise click.UsageError("--json goes with --compare; a study's JSON is DIR/study.json")
    paths.check_scene(scene)
    found = _measure(scene, out, quiet, **options)
    if not quiet:
        streams.write("".join(f"{line}\n" for line in found["verdict"]) + f"kept in {out}\n")


def _measure(
    path: Path, out: Path, quiet: bool, *, quick: bool, resume: bool, size: tuple[int, int] | None, seeds: int | None, device: str | None,
    right_handed: bool, split_objects: bool, allow_path: tuple[Path, ...],
) -> dict[str, Any]:  # fmt: skip
    from dataclasses import replace

    from clrt.scene.build import load_scene
    from clrt.study.plan import FULL, QUICK
    from clrt.study.run import check_folder, run_study
    from clrt.study.store import FILE

    check_folder(out)
    interrupt.advise(lambda: f"what is measured is kept in {out}, and --resume goes on with it" if (out / FILE).exists() else "")
    plan = QUICK if quick else FULL
    plan = plan if seeds is None else replace(plan, seeds=seeds)
    read = partial(load_scene, path, right_handed=right_handed, split_objects=split_objects, allow_paths=allow_path)
    with _StudyProgress(quiet=quiet) as progress, failure.warnings_told():
        return run_study(path, _telling(read), out, plan, size=size, device=device, resume=resume, tell=progress)


class _telling:
    """Reads the scene, and says its warnings the first time."""

    def __init__(self, read: Any) -> None:
        self._read, self._told = read, False

    def __call__(self) -> Scene:
        scene: Scene = self._read()
        for warning in scene.warnings if not self._told else ():
            failure.warn(f"{scene.source}: {warning}")
        self._told = True
        return scene


def _compare(files: tuple[Path, Path], json_path: Path | None, quiet: bool) -> None:
    from clrt.study.compare import compare
    from clrt.study.store import read

    if json_path is not None and json_path is not kinds.STDOUT:
        check_writable(json_path)
    found = compare(read(files[0]), read(files[1]))
    if json_path is not None:
        paths.write_text(json.dumps(found.to_json(), indent=1, allow_nan=False) + "\n", json_path)
    if not quiet and json_path is not kinds.STDOUT:
        from rich.text import Text

        from clrt.cli.report import print_plainly

        heads = [Text(f"{name}: {a} | {b}") for name, (a, b) in found.differing.items()]
        summary = Text(f"{found.agreeing} of {found.shared} numbers of both agree within their intervals", style="bold")
        print_plainly([*heads, Text(), comparison_table(found), Text(), summary])


def comparison_table(found: Comparison) -> Table:
    """A row a number. The ratio is b over a."""
    from rich.text import Text

    from clrt.cli.report import table

    shown = table(["part", "row", "quantity", "a", "b", "b / a", "difference"], words=3)
    for pair in found.pairs:
        ratio = f"{pair.ratio[0]:.3g} ({pair.ratio[1]:.3g} to {pair.ratio[2]:.3g})" if pair.ratio else "-"
        words = (Text(name) for name in (pair.part, pair.row, pair.quantity))
        style = "" if pair.verdict == "no difference" else "bold"
        shown.add_row(*words, _cell(pair.a), _cell(pair.b), ratio, pair.verdict, style=style)
    return shown


def _cell(number: dict[str, Any] | None) -> str:
    if number is None:
        return "-"
    unit = "" if number["unit"] == "1" else f" {number['unit']}"
    if number["low"] == number["high"]:
        return f"{number['median']:.4g}{unit}"
    return f"{number['median']:.4g} ({number['low']:.4g} to {number['high']:.4g}){unit}"
