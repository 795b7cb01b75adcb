"""The report's splitter: the median of the triangles' centroids on the longest axis, a whole level of the tree at a time.

A node is cut on the longest axis of its triangles' bounding box, at the median of their centroids. A triangle with any corner below the
plane goes to the lower child, one with any above to the upper, one flat in the plane to the lower. A node stays a leaf where the
share of triangles that would go to both, times log10 of the object's number of triangles, reaches 1, and where a child would get
them all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from clrt.kdtree.common import (
    F32,
    F64,
    Bools,
    Ints,
    Progress,
    Refs,
    TreeWriter,
    child_cells,
    corner_bounds,
    round_down,
    round_up,
    split_positions,
    starts_of,
)
from clrt.kdtree.tree import KdTree


@dataclass
class _Level:
    """The nodes of one depth: numbers and references (m,), cells (3, m), and the triangles, node by node."""

    node: Ints
    count: Ints
    cell_lo: F64
    cell_hi: F64
    ref: Refs


class _Object:
    """Bounds (3, n), and centroids in ascending order with each triangle's rank among them (3, n)."""

    def __init__(self, vertices: F64) -> None:
        self.size = len(vertices)
        self.lo, self.hi = corner_bounds(vertices)
        centroids = vertices.mean(axis=1).T
        order = np.argsort(centroids, axis=1, kind="stable")
        self.ascending = np.take_along_axis(centroids, order, axis=1)
        self.rank = np.empty_like(order)
        np.put_along_axis(self.rank, order, np.arange(self.size)[None, :], axis=1)


def build_median(vertices: F64, max_depth: int, progress: Progress | None = None) -> KdTree:
    """Build a tree over vertices (n, 3, 3), all finite. `progress` is called with a fraction after each level."""
    writer = TreeWriter()
    if len(vertices) == 0:
        writer.empty_root()
        return writer.tree(vertices, "median")
    geometry = _Object(vertices)
    level = _root(geometry)
    depth, numbered = 0, 1
    while level.node.size:
        axis = _longest_axes(geometry, level)
        plane = _medians(geometry, level, axis)
        lower, upper = _sides(geometry, level, axis, plane)
        inner = _worth_splitting(geometry, level, lower, upper) & _inside(level, axis, plane)
        if depth == max_depth:
            inner[:] = False
        writer.leaves(level.node[~inner], level.count[~inner], level.ref[np.repeat(~inner, level.count)])
        writer.splits(level.node[inner], axis[inner], plane[inner])
        level = _descend(level, axis, plane, lower, upper, inner, numbered)
        numbered += len(level.node)
        depth += 1
        if progress is not None:
            progress(depth / (max_depth + 1) if level.node.size else 1.0)
    return writer.tree(vertices, "median")


def _root(geometry: _Object) -> _Level:
    """The level of the root alone."""
    lo, hi = round_down(geometry.lo.min(axis=1)), round_up(geometry.hi.max(axis=1))
    cell_lo, cell_hi = (bound[:, None].astype(np.float64) for bound in (lo, hi))
    return _Level(np.zeros(1, np.int64), np.array([geometry.size]), cell_lo, cell_hi, np.arange(geometry.size, dtype=np.int32))


def _longest_axes(geometry: _Object, level: _Level) -> Ints:
    """Longest axis of the bounding box of each node's triangles, which are not clipped to its cell."""
    starts = starts_of(level.count)
    lo = np.minimum.reduceat(geometry.lo[:, level.ref], starts, axis=1)
    hi = np.maximum.reduceat(geometry.hi[:, level.ref], starts, axis=1)
    return np.asarray(np.argmax(hi - lo, axis=0))


def _medians(geometry: _Object, level: _Level, axis: Ints) -> F32:
    """Median of the centroids of each node on its axis: of an even number, the mean of the middle two."""
    n = geometry.size
    row = np.repeat(axis * n, level.count) + level.ref
    keys = np.repeat(np.arange(len(level.node)) * n, level.count) + geometry.rank.ravel()[row]
    keys.sort()
    starts = starts_of(level.count)
    below, above = (keys[starts + (level.count - odd) // 2] % n for odd in (1, 0))
    return split_positions((geometry.ascending[axis, below] + geometry.ascending[axis, above]) / 2)


def _sides(geometry: _Object, level: _Level, axis: Ints, plane: F32) -> tuple[Bools, Bools]:
    """Which references have a corner below, which one above the plane of their node; flat ones count as below."""
    row = np.repeat(axis * geometry.size, level.count) + level.ref
    at = np.repeat(plane, level.count)
    upper = geometry.hi.ravel()[row] > at
    return (geometry.lo.ravel()[row] < at) | ~upper, upper


def _worth_splitting(geometry: _Object, level: _Level, lower: Bools, upper: Bools) -> Bools:
    """The report's rule, and progress: neither child has all the triangles."""
    starts = starts_of(level.count)
    below, above = (np.add.reduceat(side, starts, dtype=np.int64) for side in (lower, upper))
    share = (below + above - level.count) / level.count
    return (share * math.log10(geometry.size) < 1) & (np.maximum(below, above) < level.count)


def _inside(level: _Level, axis: Ints, plane: F32) -> Bools:
    """Planes strictly within their cell: those of triangles, not clipped, that are mostly outside or flat in a bound are not."""
    column = np.arange(len(plane))
    return np.asarray((plane > level.cell_lo[axis, column]) & (plane < level.cell_hi[axis, column]))


def _descend(level: _Level, axis: Ints, plane: F32, lower: Bools, upper: Bools, inner: Bools, numbered: int) -> _Level:
    """The next level: children of the inner nodes, pair by pair, each with its triangles in ascending order."""
    parent = np.repeat(np.cumsum(inner) - 1, level.count)
    open_ = np.repeat(inner, level.count)
    below, above = np.flatnonzero(lower & open_), np.flatnonzero(upper & open_)
    child = np.concatenate([2 * parent[below], 2 * parent[above] + 1])
    order = np.argsort(child, kind="stable")
    count = np.bincount(child, minlength=2 * int(inner.sum()))
    cell_lo, cell_hi = child_cells(level.cell_lo[:, inner], level.cell_hi[:, inner], axis[inner], plane[inner])
    return _Level(numbered + np.arange(len(count)), count, cell_lo, cell_hi, level.ref[np.concatenate([below, above])[order]])
