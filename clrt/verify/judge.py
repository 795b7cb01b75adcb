"""What counts as a disagreement: hits of a rung against an oracle, by what each rung promises."""

from __future__ import annotations

from collections.abc import Hashable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from clrt.reference import exact, rational
from clrt.verify.case import Context
from clrt.verify.naive import Ints
from clrt.verify.rays import Rays, Triangles

Bools = NDArray[np.bool_]
F64 = NDArray[np.float64]
ULPS = 4.0  #: of float32: how far t may be from the oracle's where the triangle is the same
_FLOAT32 = np.finfo(np.float32)


class Truth(NamedTuple):
    """prim_id (m,), -1 for a miss; t (m,) float64, inf for a miss."""

    prim_id: Ints
    t: F64


def truth(tri: Triangles, rays: Rays) -> Truth:
    """What exact rational arithmetic says of these numbers."""
    return Truth(*exact.first_hit(tri, rays.origins, rays.directions))


def unusable(hits: NDArray[np.void]) -> Bools:
    """Answers that are not numbers: NaN anywhere, a hit at infinity, a miss that is not inf and zeros."""
    missed = hits["prim_id"] < 0
    numbers = np.column_stack([hits["t"], hits["u"], hits["v"], hits["normal"]])
    bad = np.isnan(numbers).any(axis=1)
    bad |= ~missed & ~np.isfinite(numbers).all(axis=1)
    return np.asarray(bad | (missed & (~np.isposinf(hits["t"]) | (hits["normal"] != 0).any(axis=1) | (hits["object_id"] != -1))))


def far_off(t: F64, expected: F64, ulps: float = ULPS) -> Bools:
    """Whether t is farther from the finite `expected` than so many ulps of float32."""
    with np.errstate(invalid="ignore"):
        return np.asarray(~(np.abs(t - expected) <= ulps * np.abs(expected) * _FLOAT32.eps + _FLOAT32.tiny))


def disagreements(rung: str, hits: NDArray[np.void], expected: Truth) -> Bools:
    """Rays on which a rung breaks its word (m,).

    exact: another triangle than the oracle's. The others: a true hit that is reported as a miss; they may take the neighbour of the
    triangle at an edge. All: an answer that is no number, or where the triangle is the same, a t that is off.
    """
    hit = expected.prim_id >= 0
    same = hits["prim_id"] == expected.prim_id
    wrong = ~same if rung == "exact" else hit & (hits["prim_id"] < 0)
    return np.asarray(wrong | unusable(hits) | (hit & same & far_off(hits["t"], np.where(hit, expected.t, 0.0))))


def against(context: Context, key: Hashable, tri: Triangles, rays: Rays, expected: Truth) -> dict[str, int | None]:
    """Disagreements of every rung with the oracle, on a mesh."""

    def count(rung: str) -> int:
        hits = context.caster(key, tri, rung).first_hit(rays.origins, rays.directions)
        return int(disagreements(rung, hits, expected).sum())

    return context.each_rung(count)


def leaks(context: Context, key: Hashable, tri: Triangles, rays: Rays) -> dict[str, int | None]:
    """Rays that start inside a closed mesh and are said to hit nothing, as their first hit or any: no oracle needed, so any number."""

    def count(rung: str) -> int:
        caster = context.caster(key, tri, rung)
        hits, blocked = caster.first_hit(rays.origins, rays.directions), caster.any_hit(rays.origins, rays.directions)
        return int(np.count_nonzero((hits["prim_id"] < 0) | ~blocked | unusable(hits)))

    return context.each_rung(count)


def lost_in_tree(tri: Triangles, rays: Rays, by_tree: Truth, by_brute_force: Truth, exactly: bool) -> int:
    """Rays whose hit the tree has lost, against the same predicate on all triangles.

    exactly : any difference counts. Otherwise the tree's answer must be farther by more than the rounding of t, since either neighbour
    may be taken at an edge, and rational arithmetic must confirm the nearer hit: a rounded predicate may also accept a triangle that the
    ray misses by a hair, and whether a traversal meets that one is chance.
    """
    if exactly:
        return int(np.count_nonzero((by_tree.t != by_brute_force.t) | (by_tree.prim_id != by_brute_force.prim_id)))
    found = by_brute_force.prim_id >= 0
    farther = found & (by_tree.t > by_brute_force.t)
    rows = np.flatnonzero(farther & far_off(by_tree.t, np.where(found, by_brute_force.t, 0.0)))
    parts = (tri[by_brute_force.prim_id[rows]], rays.origins[rows], rays.directions[rows])
    return int(rational.evaluate(*(np.asarray(x, np.float64) for x in parts))[0].sum())


def plus(*counts: dict[str, int | None]) -> dict[str, int | None]:
    """Sums a rung; None where a part does not apply."""
    total: dict[str, int | None] = {}
    for rung in counts[0]:
        parts = [c[rung] for c in counts]
        total[rung] = None if None in parts else sum(p for p in parts if p is not None)
    return total
