"""Bounds of triangles clipped to boxes, in float64, rounded outward: what a builder needs to sort the pieces of a triangle.

Sutherland and Hodgman's polygon clip (1974) over all polygons at once: corners lie one polygon after another in flat arrays, a
plane is applied to all of them together, and polygons grow and shrink without padding.

Error bound. A new corner lies between two given ones, at t = d0 / (d0 - d1) with distances of one rounding each, so each of its
coordinates is off by at most 4 u * scale (u = 2^-53, scale = the triangle's greatest |coordinate|). After six planes a
corner is off by at most 24 u * scale. Boxes are grown by PAD = 2^-47 * scale = 64 u * scale before the clip and the bounds are grown by it
afterwards, so the true piece always lies within the bounds given (tests/test_kdtree_clip.py, exact rationals).
"""

from __future__ import annotations

import numpy as np

from clrt.kdtree.common import F64, Bools, Ints, starts_of

PAD = 2.0**-47


def clipped_bounds(triangles: F64, box_lo: F64, box_hi: F64) -> tuple[F64, F64]:
    """Bounds of each triangle's part in its box.

    triangles : (k, 3, 3) corners; box_lo, box_hi : (3, k). Returns lo, hi : (3, k), within the box; lo > hi where nothing is left.
    """
    k = len(triangles)
    pad = PAD * np.abs(triangles).max(axis=(1, 2))
    points = np.ascontiguousarray(triangles.reshape(-1, 3).T)
    counts = np.full(k, 3)
    for axis in range(3):
        points, counts = _clip(points, counts, axis, box_lo[axis] - pad, upper=False)
        points, counts = _clip(points, counts, axis, box_hi[axis] + pad, upper=True)
    lo, hi = np.full((3, k), np.inf), np.full((3, k), -np.inf)
    some = np.flatnonzero(counts)
    if some.size:
        starts = starts_of(counts[some])
        lo[:, some] = np.minimum.reduceat(points, starts, axis=1) - pad[some]
        hi[:, some] = np.maximum.reduceat(points, starts, axis=1) + pad[some]
    return np.maximum(lo, box_lo), np.minimum(hi, box_hi)


def _clip(points: F64, counts: Ints, axis: int, plane: F64, *, upper: bool) -> tuple[F64, Ints]:
    """Cut away what lies above (`upper`) or below each polygon's plane."""
    distance = points[axis] - np.repeat(plane, counts)
    outside = distance > 0 if upper else distance < 0
    if not outside.any():
        return points, counts
    following = _next_corner(counts)
    crosses = outside != outside[following]
    keeps = ~outside
    # Each corner gives itself, if inside, and then the crossing of the edge that starts there.
    gives = keeps.astype(np.int64) + crosses
    place = starts_of(gives)
    clipped = np.empty((3, int(gives.sum())))
    clipped[:, place[keeps]] = points[:, keeps]
    edge = np.flatnonzero(crosses)
    clipped[:, place[edge] + keeps[edge]] = _crossings(points, distance, edge, following[edge], axis, keeps)
    owner = np.repeat(np.arange(len(counts)), counts)
    return clipped, np.bincount(owner, weights=gives, minlength=len(counts)).astype(np.int64)


def _crossings(points: F64, distance: F64, start: Ints, end: Ints, axis: int, keeps: Bools) -> F64:
    """Where edges from `start` to `end` cross the plane; computed from the inner corner, so that both directions agree."""
    inner, outer = np.where(keeps[start], start, end), np.where(keeps[start], end, start)
    t = distance[inner] / (distance[inner] - distance[outer])
    crossing = points[:, inner] + (points[:, outer] - points[:, inner]) * t
    crossing[axis] = points[axis, inner] - distance[inner]
    return crossing


def _next_corner(counts: Ints) -> Ints:
    """Index of the corner after each, around its own polygon."""
    following = np.arange(1, int(counts.sum()) + 1)
    some = counts[counts > 0]
    starts = starts_of(some)
    following[starts + some - 1] = starts
    return following
