"""Where the time of a picture goes, from the text to the file."""

from __future__ import annotations

import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

from clrt.image.image import Image
from clrt.precision import DEFAULT
from clrt.renderer import Prepared, build_trees
from clrt.study.numbers import Number, in_turns, measured
from clrt.study.subject import Picture, Shot, Subject, silent

PHASES = ("read", "trees", "compile cold", "compile warm", "upload", "trace", "shade", "read back", "write")
_ONE_KERNEL = "one kernel traces and shades, so that its time is with `trace`; the part `effects` has what shading costs, effect by effect"


def measure(subject: Subject, precision: dict[str, Any]) -> dict[str, Any]:
    """The part `phases`: whole runs, phase by phase; what compiles is from the part `precision`. Raises ClrtError, DeviceError, OSError."""
    taken: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory(prefix="clrt-study-") as folder:
        subject.tell("phases", 0.0)
        in_turns({"run": partial(_whole_run, subject, Path(folder) / "picture.png", taken)}, subject.plan.rounds, subject.plan.part_s)
    known: dict[str, Any] = next((row for row in precision["rows"] if row["rung"] == DEFAULT), {})
    compiled = {"compile cold": known.get("compile_cold"), "compile warm": known.get("compile_warm")}
    return {"rows": [_row(phase, taken, compiled) for phase in PHASES], "rung": DEFAULT}


def _row(phase: str, taken: dict[str, list[float]], compiled: dict[str, Number | None]) -> dict[str, Any]:
    if phase == "shade":
        return {"phase": phase, "seconds": None, "note": _ONE_KERNEL}
    if phase in compiled:
        return {"phase": phase, "seconds": compiled[phase]}
    # The first run warms up what runs in this process.
    return {"phase": phase, "seconds": measured(taken[phase][1:], "s")}


def _whole_run(subject: Subject, path: Path, taken: dict[str, list[float]]) -> None:
    def clocked(phase: str, run: Any) -> Any:
        start = time.perf_counter()
        result = run()
        taken.setdefault(phase, []).append(time.perf_counter() - start)
        return result

    clocked("read", subject.read)
    prepared: Prepared = clocked("trees", partial(build_trees, subject.scene, "sah", silent, subject.device))
    shot: Shot = subject.shot_of(prepared)
    taken.setdefault("upload", []).append(shot.upload_s)
    clocked("trace", shot.run)
    pixels: Picture = clocked("read back", shot.tracer.picture)
    clocked("write", partial(Image(pixels).save, path))
