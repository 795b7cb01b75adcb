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
    middle = (lo[level.order] + hi[level.order]) / 2.0
    segment = np.repeat(np.arange(len(level.count)), level.count)
    low, high = np.minimum.reduceat(middle, level.start), np.maximum.reduceat(middle, level.start)
    width = high - low
    scale = np.divide(_BINS, width, where=width > 0.0, out=np.zeros_like(width))
    bins = np.minimum(((middle - low[segment]) * scale[segment]).astype(np.int64), _BINS - 1)
    axis, plane = _best_planes(lo[level.order], hi[level.order], bins, segment, len(level.count), most)
    rows = np.arange(len(segment))
    right = bins[rows, axis[segment]] >= plane[segment]
    # Where no plane will do, by half: the greater half of the middles along the longest side.
    stuck = (plane <= 0)[segment]
    if stuck.any():
        longest = width.argmax(axis=1)[segment]
        ranked = np.lexsort((middle[rows, longest], segment))
        place = np.empty(len(rows), np.int64)
        place[ranked] = rows - level.start[segment]
        right = np.where(stuck, place >= (level.count // 2)[segment], right)
    order = np.lexsort((right, segment))
    to_right = np.bincount(segment[right], minlength=len(level.count))
    count = np.stack([level.count - to_right, to_right], axis=1).ravel()
    return _Level(level.order[order], np.cumsum(count) - count, count, np.stack([firsts, firsts + 1], axis=1).ravel())


def _best_planes(lo: F64, hi: F64, bins: Ints, segment: Ints, segments: int, most: int) -> tuple[Ints, Ints]:
    """Axis and first bin on the right (k,) of each node's best plane; the bin 0 where none leaves `most` boxes or fewer on both sides."""
    key = ((segment[:, None] * 3 + np.arange(3)) * _BINS + bins).ravel()
    size = segments * 3 * _BINS
    counts = np.bincount(key, minlength=size).reshape(segments, 3, _BINS)
    ends = []
    for values, extreme, empty in ((lo, np.minimum, np.inf), (hi, np.maximum, -np.inf)):
        box = np.full((size, 3), empty)
        extreme.at(box, key, np.repeat(values, 3, axis=0))
        ends.append(box.reshape(segments, 3, _BINS, 3))
    areas = []
    for turn in (slice(None), slice(None, None, -1)):
        sides = np.maximum.accumulate(ends[1][:, :, turn], axis=2) - np.minimum.accumulate(ends[0][:, :, turn], axis=2)
        sides = np.where(np.isfinite(sides), sides, 0.0)
        areas.append((sides * np.roll(sides, 1, axis=3)).sum(3)[:, :, turn])
    left = np.cumsum(counts, axis=2)[:, :, :-1]
    right = counts.sum(2, keepdims=True) - left
    cost = areas[0][:, :, :-1] * left + areas[1][:, :, 1:] * right
    usable = (left > 0) & (right > 0) & (left <= most) & (right <= most)
    cost = np.where(usable, cost, np.inf).reshape(segments, -1)
    best = cost.argmin(axis=1)
    found = np.isfinite(cost[np.arange(segments), best])
    return best // (_BINS - 1), np.where(found, best % (_BINS - 1) + 1, 0)
