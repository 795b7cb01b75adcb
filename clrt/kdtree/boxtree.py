"""A tree over boxes: of objects, instances and spheres, so that rays need not ask each. Two children a node, one box a leaf.

Built from the root down, all nodes of a level at once, by the surface area heuristic over bins (Wald 2007): of the planes between bins
of the boxes' middles, the one of the least sum of area times count on both sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Ints = NDArray[np.int64]

NOTHING = -1  #: `child` of the root of a tree over no boxes
_FIRST_LEAF = -2
_BINS = 16
_SPARE = 8  #: levels beyond those of a balanced tree


@dataclass(frozen=True, eq=False)
class BoxTree:
    """m nodes, the root first. lo, hi : (m, 3) float64; child : (m,) number of the first of two children in a row, or -2 - i for box i."""

    lo: F64
    hi: F64
    child: Ints
    depth: int


def depth_limit(count: int) -> int:
    """No path from the root of a tree over `count` boxes is longer: as many inner nodes at most wait on a ray's stack."""
    return max(0, count - 1).bit_length() + _SPARE


@dataclass(frozen=True, eq=False)
class _Level:
    """The nodes of a level: `order` holds their boxes one node after the other; start, count : (k,) of each; node : (k,) its number."""

    order: Ints
    start: Ints
    count: Ints
    node: Ints


def build_box_tree(lo: F64, hi: F64) -> BoxTree:
    """The tree over boxes lo, hi (n, 3), finite, lo <= hi. Its depth is at most `depth_limit(n)`."""
    n = len(lo)
    if n == 0:
        return BoxTree(np.zeros((1, 3)), np.zeros((1, 3)), np.array([NOTHING]), 0)
    nodes_lo, nodes_hi = np.empty((2 * n - 1, 3)), np.empty((2 * n - 1, 3))
    child = np.empty(2 * n - 1, np.int64)
    level, made, depth, limit = _Level(np.arange(n), np.zeros(1, np.int64), np.array([n]), np.zeros(1, np.int64)), 1, 0, depth_limit(n)
    while True:
        nodes_lo[level.node] = np.minimum.reduceat(lo[level.order], level.start)
        nodes_hi[level.node] = np.maximum.reduceat(hi[level.order], level.start)
        single = level.count == 1
        child[level.node[single]] = _FIRST_LEAF - level.order[level.start[single]]
        if single.all():
            return BoxTree(nodes_lo, nodes_hi, child, depth)
        depth += 1
        level = _without(level, single)
        firsts = made + 2 * np.arange(len(level.node))
        child[level.node] = firsts
        made += 2 * len(level.node)
        level = _split(lo, hi, level, firsts, 1 << (limit - depth))


def _without(level: _Level, gone: NDArray[np.bool_]) -> _Level:
    kept = level.order[~np.repeat(gone, level.count)]
    count = level.count[~gone]
    return _Level(kept, np.cumsum(count) - count, count, level.node[~gone])


def _split(lo: F64, hi: F64, level: _Level, firsts: Ints, most: int) -> _Level:
    """The two halves of each node, of `most` boxes at most."""
    lo, hi = lo[level.order], hi[level.order]
    middle = (lo + hi) / 2.0
    segment = np.repeat(np.arange(len(level.count)), level.count)
    low, high = np.minimum.reduceat(middle, level.start), np.maximum.reduceat(middle, level.start)
    width = high - low
    axis, plane = np.zeros(len(level.count), np.int64), np.zeros(len(level.count), np.int64)
    right = np.zeros(len(segment), np.bool_)
    more = level.count > 2  # two boxes go apart by whatever plane
    if more.any():
        rows, owner = more[segment], (np.cumsum(more) - 1)[segment]
        scale = np.divide(_BINS, width, where=width > 0.0, out=np.zeros_like(width))
        bins = np.minimum(((middle[rows] - low[segment[rows]]) * scale[segment[rows]]).astype(np.int64), _BINS - 1)
        axis[more], plane[more] = _best_planes(lo[rows], hi[rows], bins, owner[rows], int(more.sum()), most)
        right[rows] = bins[np.arange(len(bins)), axis[segment[rows]]] >= plane[segment[rows]]
    # Where no plane will do, by half: the greater half of the middles along the longest side.
    stuck = np.flatnonzero((plane <= 0)[segment])
    if len(stuck):
        longest = width.argmax(axis=1)[segment[stuck]]
        ranked = stuck[np.lexsort((middle[stuck, longest], segment[stuck]))]
        right[ranked] = stuck - level.start[segment[stuck]] >= (level.count // 2)[segment[stuck]]
    to_right = np.bincount(segment[right], minlength=len(level.count))
    count = np.stack([level.count - to_right, to_right], axis=1).ravel()
    order = np.argsort(2 * segment + right, kind="stable")
    return _Level(level.order[order], np.cumsum(count) - count, count, np.stack([firsts, firsts + 1], axis=1).ravel())


def _best_planes(lo: F64, hi: F64, bins: Ints, segment: Ints, segments: int, most: int) -> tuple[Ints, Ints]:
    """Axis and first bin on the right (k,) of each node's best plane; the bin 0 where none leaves `most` boxes or fewer on both sides."""
    keys = [bins[:, axis] * segments + segment for axis in range(3)]
    counts = np.stack([np.bincount(key, minlength=_BINS * segments).reshape(_BINS, segments) for key in keys], axis=1)
    lows, highs = _bin_ends(np.minimum, np.inf, lo, keys, segments), _bin_ends(np.maximum, -np.inf, hi, keys, segments)
    left = np.cumsum(counts, axis=0)[:-1]
    right = counts.sum(0) - left
    cost = _areas(lows, highs)[:-1] * left + _areas(lows[::-1], highs[::-1])[:-1][::-1] * right
    usable = (left > 0) & (right > 0) & (left <= most) & (right <= most)
    cost = np.where(usable, cost, np.inf).transpose(2, 1, 0).reshape(segments, -1)
    best = cost.argmin(axis=1)
    found = np.isfinite(cost[np.arange(segments), best])
    return best // (_BINS - 1), np.where(found, best % (_BINS - 1) + 1, 0)


def _bin_ends(extreme: np.ufunc, empty: float, values: F64, keys: list[Ints], segments: int) -> F64:
    """(bins, 3, 3, k): of each bin along each axis of k nodes the extreme x, y, z of `values` (n, 3); `empty` where it has no box."""
    ends = np.empty((3, 3, _BINS * segments))
    ends.fill(empty)
    for own, key in zip(ends, keys, strict=True):
        for end, coordinate in zip(own, values.T, strict=True):
            extreme.at(end, key, np.ascontiguousarray(coordinate))
    # Bins first: NumPy goes through long rows several times as fast as along short ones.
    return np.ascontiguousarray(ends.reshape(3, 3, _BINS, segments).transpose(2, 0, 1, 3))


def _areas(lows: F64, highs: F64) -> F64:
    """(bins, 3, k): half the area of the box around all up to each bin."""
    lo, hi = lows[0], highs[0]
    areas = np.empty((len(lows), 3, lows.shape[-1]))
    for i in range(len(lows)):
        lo, hi = np.minimum(lo, lows[i]), np.maximum(hi, highs[i])
        sides = hi - lo
        x, y, z = np.where(sides >= 0.0, sides, 0.0).transpose(1, 0, 2)
        areas[i] = x * z + y * x + z * y
    return areas
