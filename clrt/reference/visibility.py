"""The two questions of a ray tracer, answered over all primitives: what does a ray meet first, and does a segment meet anything.

Each answer comes with its margin: how far, in units of the ray's own error (crossings.py), the numbers are from another answer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.reference import rational
from clrt.reference.crossings import Crossings, Rays, find_crossings, search_band
from clrt.reference.geometry import Primitives

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

SAME_T = 1e-12  #: relative difference of two float64 t below which their order is decided by exact arithmetic


def closest(prims: Primitives, rays: Rays, tile_bytes: int) -> tuple[IndexArray, FloatArray, FloatArray]:
    """The first primitive along each ray: prim (m,), -1 for none; t (m,) in lengths of the direction, inf for none; margin (m,)."""
    found = find_crossings(prims, rays, tile_bytes)
    prim, t = np.full(len(rays.own), -1, np.int64), np.full(len(rays.own), np.inf)
    hits = np.flatnonzero(found.ahead)
    best = hits[_first(prims, rays, found, hits)]
    prim[found.ray[best]], t[found.ray[best]] = found.prim[best], found.t[best]
    margin = search_band(prims, rays)[1]
    np.minimum.at(margin, found.ray, _closest_margins(prims, rays, found, prim, t))
    return prim, t, margin


def occluded(prims: Primitives, segments: Rays, tile_bytes: int) -> tuple[BoolArray, FloatArray]:
    """Does anything but its own primitive meet the open segment (0 < t < 1)? (m,) bool, and the margin (m,)."""
    found, blocks, firmness, nearest = blockers(prims, segments, tile_bytes)
    blocked = np.zeros(len(segments.own), np.bool_)
    blocked[found.ray[blocks]] = True
    # One firm blocker is enough: the firmest decides. Where nothing blocks, the nearest to blocking does.
    firmest = np.zeros(len(segments.own))
    np.maximum.at(firmest, found.ray[blocks], firmness[blocks])
    return blocked, np.where(blocked, firmest, nearest)


def blockers(prims: Primitives, segments: Rays, tile_bytes: int) -> tuple[Crossings, BoolArray, FloatArray, FloatArray]:
    """What meets open segments, or nearly does: k crossings, whether each meets its segment (k,), how firmly (k,); and how near the
    nearest of those that do not is to meeting each segment (m,)."""
    found = find_crossings(prims, segments, tile_bytes)
    blocks = found.ahead & found.short
    start, end = _gap_margins(segments, found)
    firmness = np.minimum(np.minimum(found.boundary.min(axis=1, initial=np.inf), start), end)
    unit = segments.pos_err + segments.speed
    beyond = _lag(found.depth, np.ones(len(unit)), segments.speed / unit, found.ray)
    miss = np.maximum(found.boundary, beyond).min(axis=1, initial=np.inf)
    needed = np.where(found.meets, np.maximum(np.where(found.ahead, 0.0, start), np.where(found.short, 0.0, end)), miss)
    nearest = search_band(prims, segments)[1]
    np.minimum.at(nearest, found.ray[~blocks], needed[~blocks])
    return found, blocks, firmness, nearest


def _first(prims: Primitives, rays: Rays, found: Crossings, hits: IndexArray) -> IndexArray:
    """Places in `hits` of each ray's first hit; equal t goes to the lowest primitive."""
    ray, prim, t = found.ray[hits], found.prim[hits], found.t[hits]
    order = np.lexsort((prim, t, ray))
    leads = np.r_[True, ray[order][1:] != ray[order][:-1]] if len(order) else np.zeros(0, np.bool_)
    best = order[leads]
    # Triangles that float64 cannot order are compared exactly.
    lead_t = np.full(len(rays.own), -np.inf)
    lead_t[ray[best]] = t[best]
    tied = np.flatnonzero((t <= lead_t[ray] * (1.0 + SAME_T)) & (prim < prims.triangle_count))
    tied = tied[np.bincount(ray[tied], minlength=len(rays.own))[ray[tied]] > 1]
    _, numerator, denominator = rational.evaluate(prims.vertices[prim[tied]], rays.origin[ray[tied]], rays.direction[ray[tied]])
    winners = tied[rational.nearest(ray[tied], prim[tied], rational.rounded(numerator, denominator), numerator, denominator)]
    chosen = np.full(len(rays.own), -1, np.int64)
    chosen[ray[best]] = best
    replaceable = prim[chosen[ray[winners]]] < prims.triangle_count
    chosen[ray[winners[replaceable]]] = winners[replaceable]
    return chosen[chosen >= 0]


def _closest_margins(prims: Primitives, rays: Rays, found: Crossings, prim: IndexArray, t: FloatArray) -> FloatArray:
    """(k,) what each crossing needs to change the answer (prim, t)."""
    is_first = found.ahead & (found.prim == prim[found.ray])
    start, _ = _gap_margins(rays, found)
    unit = rays.pos_err + np.where(np.isfinite(t), t, 0.0) * rays.speed * rays.dir_err
    per_t = np.divide(rays.speed, unit, where=unit > 0.0, out=np.full_like(unit, np.inf))
    later = _lag(np.where(found.meets, found.t, np.inf)[:, None], t, per_t, found.ray)[:, 0]
    same = prims.same_look(found.prim, np.where(prim >= 0, prim, 0)[found.ray])
    miss = np.maximum(found.boundary, _lag(found.depth, t, per_t, found.ray)).min(axis=1, initial=np.inf)
    met = np.where(found.ahead, np.where(same, np.inf, later), start)
    firm = np.minimum(found.boundary.min(axis=1, initial=np.inf), start)
    result: FloatArray = np.where(is_first, firm, np.where(found.meets, met, miss))
    return result


def _lag(depth: FloatArray, t: FloatArray, per_t: FloatArray, ray: IndexArray) -> FloatArray:
    """(k, c): how far `depth` (k, c) lies behind its ray's `t` (m,), times `per_t` (m,); 0 where it is nearer or t is infinite."""
    behind = np.isfinite(t)[ray][:, None] & (depth > t[ray][:, None])
    gap = np.subtract(depth, t[ray][:, None], where=behind, out=np.zeros_like(depth))
    return np.multiply(gap, per_t[ray][:, None], where=behind, out=np.zeros_like(depth))


def _gap_margins(rays: Rays, found: Crossings) -> tuple[FloatArray, FloatArray]:
    """(k,) each: the surface's distance from the ray's start and from the segment's end, over the error there."""
    pos = rays.pos_err[found.ray]
    start = np.divide(found.start_gap, pos, where=pos > 0.0, out=np.full_like(pos, np.inf))
    return start, found.end_gap / (rays.pos_err + rays.speed)[found.ray]
