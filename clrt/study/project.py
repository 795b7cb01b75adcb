"""The project's own study: six scenes, a process each, and docs/accuracy.md of what they say.

`python -m clrt.study.project` measures into study-results/ and fills the page; with --quick the page goes beside the results instead, since
quick figures are none to publish. A study that was interrupted goes on; one that is whole is kept, unless --anew is given.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from clrt.errors import ClrtError
from clrt.files import atomic_write, check_writable
from clrt.generate import make
from clrt.study import store
from clrt.study.numbers import student
from clrt.study.project_page import page
from clrt.study.reference import FILE as REFERENCE

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "accuracy.md"
BEGIN, END = "<!-- study:begin -->", "<!-- study:end -->"
_REPORTS = ROOT.parent / "shared" / "scenes"  #: where the scenes of the classic report are looked for: beside the checkout


@dataclass(frozen=True)
class ProjectScene:
    """One scene. file : in the checkout, or of the report's; stand_in : kind and triangles of what is made where that is missing

    known : the radiance of every pixel, where it is known in closed form; words : what it is there for
    """

    name: str
    words: str
    file: str
    stand_in: tuple[str, int] | None = None
    known: float | None = None


SCENES = (
    ProjectScene("monkey", "a small mesh, hard shadows", "monkey.txt", ("sphere", 968)),
    ProjectScene("rabbit", "a large mesh, hard shadows, a mirror", "rabbit.txt", ("rabbit-like", 69_451)),
    ProjectScene("glass", "refraction and total reflection", "scenes/glass.txt"),
    ProjectScene("soft shadows", "an area light", "scenes/arealight.txt"),
    ProjectScene("indirect light", "light from wall to wall", "scenes/study/room.txt"),
    ProjectScene("furnace", "light from wall to wall, with a known answer", "scenes/indirect.txt", None, 1.0),
)


def text_of(scene: ProjectScene, folder: Path) -> tuple[Path, bool]:
    """Where the scene's text is, made in `folder` if need be, and whether it stands in for the report's."""
    if scene.stand_in is None:
        return ROOT / scene.file, False
    path = _REPORTS / scene.file
    if path.is_file():
        return path, False
    kind, triangles = scene.stand_in
    made = folder / f"{kind}.txt"
    if not made.exists():
        make(kind, made, triangles, seed=1)
    return made, True


def measure(scene: ProjectScene, folder: Path, quick: bool, anew: bool) -> dict[str, Any]:
    """The study of one scene, in folder/name. Raises ClrtError where its process fails."""
    path, stands_in = text_of(scene, folder)
    out = folder / scene.name.replace(" ", "-")
    found = None if anew else _kept(out)
    if found is None or found["verdict"] is None:
        command = [sys.executable, "-m", "clrt", "study", str(path), "-o", str(out), "--quiet", *(["--quick"] if quick else [])]
        done = subprocess.run([*command, *(["--resume"] if found is not None else [])], check=False)
        if done.returncode:
            raise ClrtError(f"the study of {scene.name} ended with {done.returncode}")
        found = store.read(out)
    return {"name": scene.name, "words": scene.words, "stands_in": stands_in, "study": found, "known": _known(scene, out)}


def _kept(out: Path) -> dict[str, Any] | None:
    try:
        return store.read(out)
    except ClrtError:
        return None


def _known(scene: ProjectScene, out: Path) -> dict[str, float] | None:
    """The mean over the reference's picture beside the known answer, with its 95% interval over the reference's seeds."""
    if scene.known is None:
        return None
    with np.load(out / REFERENCE, allow_pickle=False) as file:
        means = file["batches"].mean(axis=(1, 2, 3))
    half = student(len(means) - 1) * float(means.std(ddof=1)) / len(means) ** 0.5
    return {"known": scene.known, "mean": float(means.mean()), "low": float(means.mean()) - half, "high": float(means.mean()) + half}


def write_page(text: str, quick: bool, folder: Path) -> Path:
    """The text into the marked place of docs/accuracy.md, or, of quick studies, into folder/accuracy.md. Raises ClrtError, OSError."""
    target, whole = (folder / PAGE.name, f"{text}\n") if quick else (PAGE, f"{_outside()[0]}{BEGIN}\n{text}\n{END}{_outside()[1]}")
    with atomic_write(target) as file:
        file.write(whole.encode())
    return target


def _outside() -> tuple[str, str]:
    """What stands before and after the marked place. Raises ClrtError where there is none."""
    if not PAGE.is_file():
        raise ClrtError(f"{PAGE}: no such file; the project's study is written in a checkout")
    text = PAGE.read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise ClrtError(f"{PAGE}: the tables go between the lines {BEGIN} and {END}, which this file must have once")
    return text.partition(BEGIN)[0], text.partition(END)[2]


@click.command("project", context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--quick", is_flag=True, help="Quick studies; the page goes beside them, not into docs/.")
@click.option("--out", type=click.Path(path_type=Path), metavar="FOLDER", help="Where they go.  [default: study-results, quick: out/study]")
@click.option("--only", multiple=True, type=click.Choice([s.name for s in SCENES]), help="This scene alone; may be repeated. No page then.")
@click.option("--anew", is_flag=True, help="Measure again what is there already.")
def project(quick: bool, out: Path | None, only: tuple[str, ...], anew: bool) -> None:
    """Study the project's six scenes and write docs/accuracy.md."""
    if not quick and not only:
        _outside()
        check_writable(PAGE)
    folder = out or ROOT / ("out/study" if quick else "study-results")
    folder.mkdir(parents=True, exist_ok=True)
    results = []
    for scene in SCENES:
        if not only or scene.name in only:
            click.echo(f"studying {scene.name} ...", err=True)
            results.append(measure(scene, folder, quick, anew))
    if not only:
        click.echo(f"written: {write_page(page(results), quick, folder)}", err=True)


def main() -> None:
    """What the user can mend is one line and exit code 2."""
    try:
        project.main(prog_name="python -m clrt.study.project", standalone_mode=False)
    except KeyboardInterrupt:
        sys.exit(130)
    except (ClrtError, click.UsageError, OSError) as error:
        click.echo(f"clrt: error: {error}", err=True)
        sys.exit(2)


if __name__ == "__main__":
    main()
