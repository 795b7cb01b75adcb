"""The rungs of the precision ladder: what each costs, and how right it is."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from clrt.device import program
from clrt.device.prepare import prepare
from clrt.features import Features
from clrt.precision import DEFAULT, RUNGS, rung
from clrt.renderer import fill_buffers, render
from clrt.study import metrics
from clrt.study.compile_times import compile_times
from clrt.study.numbers import Number, counted, in_turns, measured, number, ratios
from clrt.study.oracle import leak_rates, wrong_primitives
from clrt.study.pictures import write_pictures
from clrt.study.reference import RUNG, Reference
from clrt.study.subject import Shot, Subject
from clrt.timing import Series

BASE = "fast"  #: what the others are compared with


def measure(subject: Subject, reference: Reference) -> dict[str, Any]:
    """The part `precision`, and its pictures. Raises DeviceError, LimitError, ClrtError, OSError."""
    plan = subject.plan
    compiled = compile_times(subject)
    shots: dict[str, Shot] = {}
    for i, name in enumerate(RUNGS):
        subject.tell("precision: programs", i / len(RUNGS))
        shots[name] = subject.shot(name)
    subject.tell("precision: timing", 0.5)
    builds = _builds(subject, shots)
    traces = in_turns({name: shot.run for name, shot in shots.items()}, plan.rounds, plan.part_s)
    pictures = {name: shot.picture() for name, shot in shots.items()}
    rays = _rays(subject)
    judged, leaking = wrong_primitives(subject), leak_rates(subject)
    rows = []
    for name in RUNGS:
        row: dict[str, Any] = {
            "rung": name, "build": measured(builds[name], "s"), "compile_cold": None, "compile_warm": None,
            "trace": measured(traces[name].seconds, "s"), "ratio_to_fast": _ratio(traces, name), "rays_per_s": _rate(traces[name], rays),
            "wrong_primitives": None, "leaks_per_million": None, "t_error": None,
            "picture_error": counted(metrics.rmse(pictures[name], pictures[RUNG].astype(np.float64)), "radiance"),
        }  # fmt: skip
        if name in compiled:
            row["compile_cold"], row["compile_warm"] = compiled[name]
        rows.append({**row, **judged.rows.get(name, {}), **leaking.rows.get(name, {})})
    shown = write_pictures(subject.folder, reference.mean, pictures)
    others = "" if len(compiled) == len(RUNGS) else f" Compiling is timed for {', '.join(compiled)} alone, to be quick."
    return {"rows": rows, "note": f"{judged.note}. {leaking.note}.{others}", **shown}


def _builds(subject: Subject, shots: dict[str, Shot]) -> dict[str, list[float]]:
    """Seconds of packing, uploading and preparing the records of each rung, in turns."""
    programs = {name: program.build(subject.device, shot.source) for name, shot in shots.items()}
    turns = {name: partial(_build, subject, name, built) for name, built in programs.items()}
    series = in_turns(turns, subject.plan.rounds, subject.plan.part_s)
    return {name: list(each.seconds) for name, each in series.items()}


def _build(subject: Subject, name: str, built: Any) -> None:
    prepare(fill_buffers(subject.prepared, Features.of(subject.scene), rung(name), subject.device)[0], built)


def _ratio(traces: dict[str, Series], name: str) -> Number:
    return number(1.0, 1.0, 1.0, "x", len(traces[BASE].seconds)) if name == BASE else ratios(traces[name], traces[BASE])


def _rays(subject: Subject) -> int:
    """Rays of all kinds of one picture: those of the rung DEFAULT, from which the others' differ by few."""
    subject.tell("precision: counting rays", 0.8)
    stats = render(subject.scene, samples=subject.samples, device=subject.device.info.name, precision=DEFAULT, count=True).stats
    assert stats is not None
    return stats.rays or 0


def _rate(trace: Series, rays: int) -> Number:
    return measured([rays / seconds for seconds in trace.seconds], "1/s")
