"""Programs of what a scene calls for beside programs of all effects, on the smallest scenes: pictures, times, compiling.

`python -m clrt.bench.effects` measures and prints; with --write-docs it fills the table of docs/effects.md.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import click
import numpy as np

from clrt.bench import machine
from clrt.bench.export import BEGIN, END
from clrt.bench.table import interval
from clrt.cli import failure
from clrt.device.context import Device, open_device
from clrt.errors import ClrtError
from clrt.features import Features
from clrt.files import atomic_write, check_writable
from clrt.precision import DEFAULT, rung
from clrt.renderer import build_trees, open_tracer, run_rows, with_options
from clrt.scene.build import load_scene
from clrt.scene.model import Scene
from clrt.timing import FEWEST, Series, interleave, paired

_ROOT = Path(__file__).resolve().parents[2]
_PAGE = _ROOT / "docs" / "effects.md"
_SIDE, _SAMPLES, _DEPTH = 256, 4, 5  #: large enough to time; bounces that the stacks of all effects have room for


@dataclass(frozen=True)
class Row:
    """One scene. own, every : seconds of its pictures; differs : the most by which a channel does; cold_s, again_s : of compiling."""

    scene: str
    effects: tuple[str, ...]
    own: Series
    every: Series
    own_bytes: int
    every_bytes: int
    differs: float
    cold_s: float
    again_s: float

    def cells(self) -> list[str]:
        return [
            self.scene, ", ".join(self.effects), f"{self.own_bytes:,}", "equal" if self.differs == 0.0 else f"{self.differs:.1e}",
            f"{self.own.median * 1e3:.2f} ms", f"{self.every.median * 1e3:.2f} ms",
            interval(paired(self.own.seconds, self.every.seconds).to_json()), f"{self.cold_s:.2f} s", f"{self.again_s:.2f} s",
        ]  # fmt: skip


_HEADINGS = ["scene", "effects", "bytes", "pictures", "its own", "all effects", "ratio, 95%", "compiled cold", "again"]
_WORDS = 2


def measure(path: Path, device: Device, rounds: int) -> Row:
    """A smallest scene by both programs, in turns. Raises ClrtError, OSError."""
    scene = _sized(load_scene(path))
    prepared, features = build_trees(scene, "sah", _silent), Features.of(scene)
    opened = {name: open_tracer(prepared, f, rung(DEFAULT), device, _silent) for name, f in
              (("own", features), ("every", features.with_every()))}  # fmt: skip
    series = interleave({name: partial(run_rows, each[1], "render", _silent) for name, each in opened.items()}, rounds)
    own, every = (opened[name][1].picture().astype(np.float64) for name in ("own", "every"))
    sizes = {name: len(each[2].encode()) for name, each in opened.items()}
    cold, again = _compiling(path)
    return Row(path.stem, features.effects, series["own"], series["every"], sizes["own"], sizes["every"], float(np.abs(own - every).max()),
               cold, again)  # fmt: skip


def _sized(scene: Scene) -> Scene:
    """At a size that takes some milliseconds, with the shape of its picture kept."""
    camera = scene.camera
    scale = _SIDE / max(camera.width, camera.height)
    size = max(1, round(scale * camera.width)), max(1, round(scale * camera.height))
    return with_options(replace(scene, depth=min(scene.depth, _DEPTH)), size, None, min(scene.samples, _SAMPLES), 0)


def _compiling(path: Path) -> tuple[float, float]:
    """Seconds that a new process compiles for, with no cache and with what that left in it."""
    with tempfile.TemporaryDirectory(prefix="clrt-bench-") as folder:
        command = [sys.executable, "-m", "clrt", str(path), "-o", f"{folder}/picture.png", "--size", "16x16", "--stats"]
        environment = os.environ | {"POCL_CACHE_DIR": f"{folder}/cache"}
        times = []
        for number in range(2):
            figures = Path(folder, f"{number}.json")
            done = subprocess.run([*command, str(figures), "--quiet"], env=environment, capture_output=True, text=True, check=False)
            if done.returncode:
                raise ClrtError(f"clrt could not render {path}: {done.stderr.strip()}")
            times.append(float(json.loads(figures.read_text())["compile_s"]))
    return times[0], times[1]


def _silent(phase: str, fraction: float) -> None:
    """No progress."""


def page(rows: list[Row], device: Device, rounds: int) -> str:
    """The table as Markdown, after what it was measured on."""
    info = device.info
    where = f"{machine.cpu_model()}, {machine.cores()} cores, load {machine.load_average()[0]}; {info.platform} {info.driver}"
    rule = [":--" if column < _WORDS else "--:" for column in range(len(_HEADINGS))]
    lines = "\n".join(f"| {' | '.join(line)} |" for line in (_HEADINGS, rule, *(row.cells() for row in rows)))
    note = (
        f"A program of all effects has {max(row.every_bytes for row in rows):,} bytes. Pictures: the most by which a channel "
        "differs. "
        f"Times are medians of {rounds} rounds in turns, with {_SIDE} pixels on the longer side, at most {_SAMPLES} samples and a depth of "
        f"{_DEPTH}; "
        "the ratio is the scene's own program over that of all effects in the same round, with an interval that holds the median with 95%. "
        "Compiled: by a new process with an empty cache, and by the next one."
    )
    return f"Measured {machine.now()[:10]}, {where}.\n\n{lines}\n\n{note}"


@click.command("effects", context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--rounds", type=click.IntRange(FEWEST), default=11, show_default=True, metavar="N", help="Of each scene.")
@click.option("--device", metavar="NAME", help="Part of the name of an OpenCL device.")
@click.option("--write-docs", is_flag=True, help="Write the table to docs/effects.md.")
@click.argument("scenes", nargs=-1, type=click.Path(path_type=Path))
def bench(rounds: int, device: str | None, write_docs: bool, scenes: tuple[Path, ...]) -> None:
    """Render SCENES, or all smallest scenes, with the program of each and with one of all effects."""
    text = _PAGE.read_text(encoding="utf-8") if write_docs else f"{BEGIN}\n{END}"
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise ClrtError(f"{_PAGE}: the table goes between the lines {BEGIN} and {END}, which this file must have once")
    if write_docs:
        check_writable(_PAGE)
    opened, rows = open_device(device), []
    for path in scenes or sorted((_ROOT / "scenes").glob("*.txt")):
        click.echo(f"measuring {path.stem} ...", err=True)
        rows.append(measure(path, opened, rounds))
    table = page(rows, opened, rounds)
    click.echo(table)
    if write_docs:
        with atomic_write(_PAGE) as file:
            file.write(f"{text.partition(BEGIN)[0]}{BEGIN}\n{table}\n{END}{text.partition(END)[2]}".encode())


def main() -> None:
    """As the command line of clrt: every failure is one line and an exit code."""
    try:
        bench.main(prog_name="python -m clrt.bench.effects", standalone_mode=False)
    except (Exception, KeyboardInterrupt) as error:
        sys.exit(failure.report(error))


if __name__ == "__main__":
    main()
