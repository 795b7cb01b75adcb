"""What clrt promises of its speed, and whether a run of the harness kept it: made of the numbers of the JSON alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from clrt.bench.commands import CLRT
from clrt.bench.table import interval, size
from clrt.bench.versus import EMBREEX, KINDS
from clrt.bench.worker import EMBREE
from clrt.precision import DEFAULT
from clrt.timing import FEWEST

#: (side of the picture, peer) -> how many times as many rays a second
_OVER = {(1024, EMBREE): 1.5, (1024, EMBREEX): 4.5, (1024, "Mitsuba"): 1.2, (512, EMBREE): 1.2}
_KIND_WORDS = {"primary": "primary rays", "shadow": "shadow rays", "both": "primary and shadow rays"}
_GENERAL, _INCOHERENT = 1.0, 1.2
_TIMES_FAST = {"watertight": 1.02, "exact": 1.06, "double": 2.6}
_FIRST_S, _CACHED_S = 1.3, 0.45
_IMPORTS_S = {"import clrt": 0.15, "clrt --help": 0.25}
_RABBIT_TREE_S = 0.12
#: triangles -> seconds of building, bytes of the process at most
_TREES = {1_000_000: (2.0, None), 10_000_000: (30.0, 12 * 10**9)}
_NEAR = 0.05  #: of the number of triangles that a tree's mark speaks of
_BINDS = 1_100_000  #: triangles beyond which hardly anything comes from a cache: memory binds there
_BEYOND = 1.25  #: times what the curve of small meshes foretells: a logarithm still, with room for noise and caches
_TESTS_PER_RAY = {"rabbit": 40.0, "monkey": 30.0}
_TIMES_BRUTE = 300.0
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
    """All marks of what a run has measured. Quick runs, few rounds and generated scenes in the place of the report's give no verdicts."""
    reason = "a quick run" if results["quick"] else ""
    generated = {scene["role"]: scene["name"] for scene in results["scenes"] if scene["generated"]}
    rabbit, rounds = reason or generated.get("rabbit", ""), fewest_rounds(results)
    turns = rabbit or (f"of {rounds} rounds no interval can be had" if rounds < FEWEST else "")
    marks: list[Mark] = []
    if "versus" in results:
        marks += [*_versus(results["versus"], turns), _general(results["versus"]["general"], turns)]
    if "incoherent" in results:
        marks.append(_incoherent(results["incoherent"], turns))
    if "ladder" in results:
        marks += _ladder(results["ladder"], turns)
    if "commands" in results:
        marks += _commands(results["commands"], turns)
    if "imports" in results:
        marks += [_under(name, results["imports"][name]["best"], limit, reason) for name, limit in _IMPORTS_S.items()]
    if "trees" in results:
        marks += _trees(results, rabbit)
    if "growth" in results:
        marks += _growth(results["growth"], reason)
    for row in results.get("tests", ()):
        marks += _tests(row, reason or generated.get(row["role"], ""))
    if "programs" in results:
        # What a composed program holds does not depend on sizes, so it counts for every run.
        absent = sum(row["absent_bytes"] for row in results["programs"])
        marks.append(_mark("source of absent effects in a scene's program", "0 bytes", f"{absent} bytes", absent == 0, ""))
    return marks


def fewest_rounds(results: dict[str, Any]) -> int:
    """Of the parts in which contenders take turns; FEWEST where none of them was measured."""
    plan = {"versus": "peer_rounds", "incoherent": "peer_rounds", "ladder": "ladder_rounds", "commands": "command_rounds"}
    return min((int(results["plan"][rounds]) for part, rounds in plan.items() if part in results), default=FEWEST)


def _mark(what: str, target: str, measured: str, passed: bool, reason: str) -> Mark:
    """A verdict, unless there is a reason against one."""
    return Mark(what, target, measured, None if reason else passed, f"no verdict: {reason}" if reason else "")


def _under(what: str, measured_s: float, limit: float, reason: str) -> Mark:
    return _mark(what, f"under {limit:.2f} s", f"{measured_s:.3f} s", measured_s < limit, reason)


def _over(what: str, limit: float, ratio: dict[str, Any] | None, missing: str, reason: str) -> Mark:
    """At least so many times as fast as a peer, by the median of the rounds."""
    target = f"at least {limit:.1f} times"
    if ratio is None:
        return Mark(what, target, "-", None, f"no verdict: {missing}")
    return _mark(what, target, interval(ratio), ratio["median"] >= limit, reason)


def _versus(versus: dict[str, Any], reason: str) -> Iterator[Mark]:
    views = {row["size"]: row for row in versus["views"]}
    for (side, peer), limit in _OVER.items():
        ratios = views[side]["ratios"].get(peer) if side in views else None
        missing = f"{peer} is not there" if side in views else f"{side} squared was not measured"
        for kind in KINDS:
            what = f"{_KIND_WORDS[kind]}, {DEFAULT}, {versus['scene']}, {side} squared, over {peer}"
            yield _over(what, limit, None if ratios is None else ratios[kind], missing, reason)


def _general(general: dict[str, Any], reason: str) -> Mark:
    what = f"rays of any origin, {general['size']} squared, over {EMBREE}"
    return _over(what, _GENERAL, general["ratios"].get(EMBREE), f"{EMBREE} is not there", reason)


def _incoherent(incoherent: dict[str, Any], reason: str) -> Mark:
    what = f"incoherent rays, {incoherent['rays']:,} in one call, over {EMBREEX}"
    return _over(what, _INCOHERENT, incoherent.get("ratio"), f"{EMBREEX} is not there", reason)


def _ladder(rows: list[dict[str, Any]], reason: str) -> Iterator[Mark]:
    for row in rows:
        if row["effects"] == "shadows alone" and row["rung"] in _TIMES_FAST:
            limit, ratio = _TIMES_FAST[row["rung"]], row["ratio"]
            what = f"{row['rung']} over fast, {row['scene']}, {row['size']} squared, shadows alone"
            yield _mark(what, f"at most {limit:.2f} times", interval(ratio, 3), ratio["median"] <= limit, reason)


def _commands(commands: dict[str, Any], reason: str) -> Iterator[Mark]:
    what = f"{commands['scene']} {commands['size']} squared, from text to PNG"
    limits = {"first": ("first run ever", _FIRST_S), "cached": ("cached", _CACHED_S)}
    for which, (words, limit) in limits.items():
        own = commands[which][CLRT]["best"]
        yield _under(f"{what}, {words}", own, limit, reason)
        for name, times in commands[which].items():
            if name != CLRT:
                target, measured = f"sooner than {name}", f"{own:.3f} s; {name} {times['best']:.3f} s"
                yield _mark(f"{what}, {words}", target, measured, own < times["best"], reason)


def _trees(results: dict[str, Any], reason: str) -> Iterator[Mark]:
    rabbit = next(scene["name"] for scene in results["scenes"] if scene["role"] == "rabbit")
    largest = max(row["size"] for row in results["trees"])
    for row in results["trees"]:
        if row["scene"] == rabbit and row["tree"] == "sah" and row["size"] == largest:
            yield _under(f"sah tree of {rabbit}", row["build_s"]["best"], _RABBIT_TREE_S, reason)
            what, ratio = f"kd-tree against brute force, {rabbit}, {row['size']} squared", row["speed_up"]
            yield _mark(what, f"over {_TIMES_BRUTE:.0f} times", f"{ratio:.0f} times", ratio > _TIMES_BRUTE, reason)


def _growth(growth: dict[str, Any], reason: str) -> Iterator[Mark]:
    built = [row for row in growth["points"] if row["kind"] == "triangles"]
    for triangles, (limit, most) in _TREES.items():
        row = next((row for row in built if abs(row["triangles"] - triangles) <= _NEAR * triangles), None)
        what, target = f"sah tree of {triangles // 10**6} million triangles", f"under {limit:.0f} s"
        target += f", {most / 1e9:.0f} GB" if most is not None else ""
        if row is None:
            yield Mark(what, target, "-", None, f"no verdict: not measured, --largest {triangles} does")
            continue
        taken, peak = row["build_s"]["best"], row["peak_bytes"]["built"]
        passed = taken < limit and (most is None or peak < most)
        yield _mark(what, target, f"{taken:.2f} s, {size(peak)}", passed, reason)
    beyond = growth["fits"].get("beyond", {"points": []})
    if before := [point for point in beyond["points"] if point["triangles"] <= _BINDS]:
        point = before[-1]
        what = f"time a ray at {point['triangles']:,} triangles, over the logarithm fitted up to {beyond['fitted_up_to']:,}"
        ratio = point["measured"] / point["foretold"]
        yield _mark(what, f"at most {_BEYOND:.2f} times", f"{ratio:.2f} times", ratio <= _BEYOND, reason)


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
