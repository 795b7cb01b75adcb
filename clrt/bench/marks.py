"""What clrt promises of its speed, and whether a run of the harness kept it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

_TIMES_EMBREEX = 2.0
_TESTS_PER_RAY = {"rabbit": 40.0, "monkey": 30.0}
_COMMAND_S = 2.0
_TIMES_BRUTE = 300.0
_TIMES_FAST = {"watertight": 1.10, "exact": 1.20, "double": 2.6}
#: depth and nodes of the report's trees; its splitter leaves open what a corner in the plane is, so ours need only be near
_REPORT_TREES = {"monkey": (9, 138), "rabbit": (17, 18_094)}
_DEPTH_SLACK, _NODES_FACTOR = 3, 2.5


@dataclass(frozen=True)
class Mark:
    """One promise. `passed`: None where it was not put to the test, for the reason in `note`."""

    what: str
    target: str
    measured: str
    passed: bool | None
    note: str = ""

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


def marks_of(results: dict[str, Any]) -> list[Mark]:
    """All marks of a run. They are about the report's scenes at full size; quick runs and generated scenes give values, not verdicts."""
    reason = "a quick run" if results["quick"] else ""
    generated = {scene["role"]: scene["name"] for scene in results["scenes"] if scene["generated"]}
    marks = list(_versus(results, reason or generated.get("rabbit", "")))
    for row in results["tests"]:
        marks += _tests(row, reason or generated.get(row["role"], ""))
    marks += _brute(results, reason or generated.get("rabbit", ""))
    marks += _ladder(results, reason or generated.get("rabbit", ""))
    command = results["command"]
    marks.append(_mark(
        f"whole command, {command['scene']}, {command['size']} squared, after a first run", f"under {_COMMAND_S:.1f} s",
        f"{command['seconds']['best']:.2f} s", command["seconds"]["best"] < _COMMAND_S, reason or generated.get("rabbit", ""),
    ))  # fmt: skip
    # What a composed program holds does not depend on sizes, so it counts for every run.
    absent = sum(row["absent_bytes"] for row in results["programs"])
    marks.append(_mark("source of absent effects in a scene's program", "0 bytes", f"{absent} bytes", absent == 0, ""))
    return marks


def _mark(what: str, target: str, measured: str, passed: bool, reason: str) -> Mark:
    """A verdict, unless there is a reason against one."""
    return Mark(what, target, measured, None if reason else passed, f"no verdict: {reason}" if reason else "")


def _versus(results: dict[str, Any], reason: str) -> Iterator[Mark]:
    versus = results["versus"]
    for kind, words in (("primary", "primary rays"), ("shadow", "shadow rays"), ("both", "primary and shadow rays")):
        what, target = f"{words}, {versus['scene']}, {versus['size']} squared", f"{_TIMES_EMBREEX:.0f} times embreex"
        if "ratio" in versus["rates"]:
            ratio = versus["rates"]["ratio"][kind]
            yield _mark(what, target, f"{ratio:.2f} times", ratio >= _TIMES_EMBREEX, reason)
        else:
            rate = versus["rates"]["clrt"][kind]
            yield Mark(what, target, f"{rate:.1f} million a second", None, "no verdict: embreex is not installed")


def _brute(results: dict[str, Any], reason: str) -> Iterator[Mark]:
    rabbit = next(scene["name"] for scene in results["scenes"] if scene["role"] == "rabbit")
    largest = max(row["size"] for row in results["trees"])
    for row in results["trees"]:
        if row["scene"] == rabbit and row["tree"] == "sah" and row["size"] == largest:
            what, ratio = f"kd-tree against brute force, {rabbit}, {row['size']} squared", row["speed_up"]
            yield _mark(what, f"over {_TIMES_BRUTE:.0f} times", f"{ratio:.0f} times", ratio > _TIMES_BRUTE, reason)


def _ladder(results: dict[str, Any], reason: str) -> Iterator[Mark]:
    for row in results["ladder"]:
        if row["effects"] == "shadows alone" and row["rung"] in _TIMES_FAST:
            limit, ratio = _TIMES_FAST[row["rung"]], row["ratio_median"]
            what = f"{row['rung']} over fast, {row['scene']}, {row['size']} squared, shadows alone"
            yield _mark(what, f"at most {limit:.2f} times", f"{ratio:.3f} times", ratio <= limit, reason)


def _tests(row: dict[str, Any], reason: str) -> Iterator[Mark]:
    role, where = row["role"], f"{row['scene']}, {row['size']} squared"
    if row["tree"] == "sah":
        limit, tests = _TESTS_PER_RAY[role], row["tests_per_ray"]
        yield _mark(f"ray-triangle tests a ray, sah, {where}", f"under {limit:.0f}", f"{tests:.1f}", tests < limit, reason)
    else:
        depth, nodes = _REPORT_TREES[role]
        near = abs(row["depth"] - depth) <= _DEPTH_SLACK and nodes / _NODES_FACTOR <= row["nodes"] <= nodes * _NODES_FACTOR
        target = f"about the report's {nodes:,} nodes, depth {depth}"
        yield _mark(f"median tree, {row['scene']}", target, f"{row['nodes']:,} nodes, depth {row['depth']}", near, reason)
