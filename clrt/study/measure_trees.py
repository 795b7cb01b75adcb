"""The kd-trees that there are, one against the other, and brute force where it ends in time."""

from __future__ import annotations

from functools import partial
from typing import Any

from clrt.renderer import Prepared, build_trees, render
from clrt.study.numbers import counted, in_turns, measured
from clrt.study.subject import Subject, silent, sized
from clrt.timing import Series

TREES = ("sah", "median", "brute")
_COUNTED_SIDE = 48  #: of the picture that brute force's tests are counted on: counting takes longer than tracing
_COUNTED_SAMPLES = 2


def measure(subject: Subject) -> dict[str, Any]:
    """The part `trees`. Raises DeviceError, LimitError."""
    scene, plan = subject.scene, subject.plan
    if not scene.triangle_count:
        return {"rows": [], "note": "the scene has no triangles, so no kd-tree"}
    pairs = scene.triangle_count * scene.camera.width * scene.camera.height * scene.samples
    names = [name for name in TREES if name != "brute" or pairs <= plan.brute_pairs]
    subject.tell("trees: building", 0.0)
    built: dict[str, Prepared] = {}
    builds = in_turns({name: partial(_build, subject, name, built) for name in names}, plan.rounds, plan.part_s)
    shots = {}
    for i, name in enumerate(names):
        subject.tell("trees: programs", 0.3 + 0.2 * i / len(names))
        shots[name] = subject.shot_of(built[name])
    subject.tell("trees: timing", 0.5)
    traces = in_turns({name: shot.run for name, shot in shots.items()}, plan.rounds, plan.part_s)
    rows = []
    for i, name in enumerate(names):
        subject.tell("trees: counting tests", 0.7 + 0.3 * i / len(names))
        rows.append(_row(subject, name, built[name], builds[name], traces[name]))
    if "brute" not in names:
        rows.append({"tree": "brute", "build": None, "nodes": None, "depth": None, "tests_per_ray": None, "trace": None,
                     "note": f"left out: {pairs:,} pairs of a ray and a triangle take too long"})  # fmt: skip
    return {"rows": rows}


def _build(subject: Subject, name: str, built: dict[str, Prepared]) -> None:
    built[name] = build_trees(subject.scene, name, silent, subject.device)


def _row(subject: Subject, name: str, prepared: Prepared, build: Series, trace: Series) -> dict[str, Any]:
    tests, note = None, "tests are not counted, to be quick"
    if name != "brute" or subject.plan.count_brute:
        size = sized(subject.scene, _COUNTED_SIDE) if name == "brute" else subject.size
        stats = render(subject.scene, size=size, samples=min(subject.samples, _COUNTED_SAMPLES), tree=name,
                       device=subject.device.info.name, count=True).stats  # fmt: skip
        assert stats is not None
        tests = counted(stats.tests_per_ray or 0.0, "tests")
        note = "" if size == subject.size else f"tests are counted on a picture of {size[0]} x {size[1]}"
    row: dict[str, Any] = {
        "tree": name, "build": measured(build.seconds, "s"), "nodes": counted(sum(t.node_count for t in prepared.trees), "nodes"),
        "depth": counted(max(t.depth for t in prepared.trees), "edges"), "tests_per_ray": tests,
        "trace": measured(trace.seconds, "s"), "built_on": " and ".join(sorted({t.built_on for t in prepared.trees})),
    }  # fmt: skip
    return {**row, "note": note} if note else row
