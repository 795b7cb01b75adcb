"""Bounds of triangles clipped to boxes, in float64, rounded outward: what a builder needs to sort the pieces of a triangle.

Sutherland and Hodgman's polygon clip (1974) over all polygons at once: corners lie one polygon after another in flat arrays, so that
polygons grow and shrink without padding. In each round every polygon is cut by one plane that it still crosses, and those that
cross none are done; most triangles cross one plane only.

Error bound. A new corner lies between two given ones, at t = d0 / (d0 - d1) with distances of one rounding each, so each of its
coordinates is off by at most 4 u * scale (u = 2^-53, scale = the triangle's greatest |coordinate|). After six planes a
corner is off by at most 24 u * scale. Boxes are grown by PAD = 2^-47 * scale = 64 u * scale before the clip and the bounds are grown by it
afterwards, so the true piece always lies within the bounds given (tests/test_kdtree_clip.py, exact rationals).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.kdtree.common import F64, Bools, Ints, corner_bounds, starts_of

PAD = 2.0**-47


def clipped_bounds(triangles: F64, box_lo: F64, box_hi: F64) -> tuple[F64, F64]:
    """Bounds of each triangle's part in its box.

    triangles : (k, 3, 3) corners; box_lo, box_hi : (3, k). Returns lo, hi : (3, k), within the box; lo > hi where nothing is left.
    """
    k = len(triangles)
    points = np.ascontiguousarray(triangles.reshape(-1, 3).T)
    counts = np.full(k, 3)
    # Planes and bounds in pairs of three: x, y, z from below, then -x, -y, -z; a polygon is inside where bound >= plane.
    lo, hi = corner_bounds(triangles)
    bounds = np.concatenate([lo, -hi])
    pad = PAD * np.maximum.reduce([np.maximum(-lo[axis], hi[axis]) for axis in range(3)])
    planes = np.concatenate([box_lo, -box_hi]) - pad
    crossed = bounds < planes
    open_ = np.arange(k)
    while True:
        crosses = crossed[:, open_]
        some = crosses.any(axis=0)
        if not some.any():
            break
        points, counts, open_ = points[:, np.repeat(some, counts)], counts[some], open_[some]
        which = crosses[:, some].argmax(axis=0)
        points, counts = _clip(points, counts, which, planes[which, open_])
        _store_bounds(bounds, open_, points, counts)
        # Rounding may leave a corner a hair beyond a plane that has cut it: no plane cuts twice.
        planes[which, open_] = -np.inf
        crossed[:, open_] = bounds[:, open_] < planes[:, open_]
    bounds -= pad
    return np.maximum(bounds[:3], box_lo), np.minimum(-bounds[3:], box_hi)


def _store_bounds(bounds: F64, which: Ints, points: F64, counts: Ints) -> None:
    """Put the bounds of polygons into columns `which`; infinite where no corner is left."""
    some = counts > 0
    if not some.all():
        bounds[:, which[~some]] = np.inf
        which, counts = which[some], counts[some]
    if which.size:
        starts = starts_of(counts)
        bounds[:3, which] = np.minimum.reduceat(points, starts, axis=1)
        bounds[3:, which] = -np.maximum.reduceat(points, starts, axis=1)


def _clip(points: F64, counts: Ints, which: Ints, plane: F64) -> tuple[F64, Ints]:
    """Cut each polygon (none of them empty) by its plane: `which` of x, y, z, -x, -y, -z must not be below `plane`."""
    axis, sign = which % 3, np.where(which < 3, 1.0, -1.0)
    columns = np.arange(points.shape[1])
    distance = points[np.repeat(axis, counts), columns] * np.repeat(sign, counts) - np.repeat(plane, counts)
    keeps = distance >= 0
    starts = starts_of(counts)
    following = columns + 1
    following[starts + counts - 1] = starts
    crosses = keeps != keeps[following]
    # Each corner gives itself, if inside, and then the crossing of the edge that starts there.
    gives = keeps.astype(np.int64) + crosses
    place = starts_of(gives)
    clipped = np.empty((3, int(gives.sum())))
    kept, edge = np.flatnonzero(keeps), np.flatnonzero(crosses)
    clipped[:, place[kept]] = points[:, kept]
    new = place[edge] + keeps[edge]
    clipped[:, new] = _crossings(points, distance, edge, following[edge], keeps)
    owner = np.repeat(np.arange(len(counts)), counts)[edge]
    clipped[axis[owner], new] = sign[owner] * plane[owner]
    return clipped, np.add.reduceat(gives, starts)


def _crossings(points: F64, distance: F64, start: Ints, end: Ints, keeps: Bools) -> NDArray[np.float64]:
    """Where edges from `start` to `end` cross their plane; computed from the inner corner, so that both directions agree."""
    inner, outer = np.where(keeps[start], start, end), np.where(keeps[start], end, start)
    t = distance[inner] / (distance[inner] - distance[outer])
    from_inner = points[:, inner]
    return from_inner + (points[:, outer] - from_inner) * t
