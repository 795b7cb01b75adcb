"""The default builder: surface area heuristic, references clipped exactly, a whole level of the tree at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clrt.kdtree.binning import Level, Splits, best_splits, bin_count
from clrt.kdtree.clip import clipped_bounds
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
    spread_runs,
    starts_of,
)
from clrt.kdtree.tree import TRAVERSAL_COST, KdTree

#: Share of a split's cost forgiven when it cuts off empty space.
EMPTY_BONUS = 0.1


def build_sah(
    vertices: F64,
    max_depth: int,
    progress: Progress | None = None,
    *,
    traversal_cost: float = TRAVERSAL_COST,
    empty_bonus: float = EMPTY_BONUS,
) -> KdTree:
    """Build a tree over vertices (n, 3, 3), all finite.

    A node with at most `traversal_cost` triangles stays a leaf: no split can pay.
    """
    writer = TreeWriter()
    if len(vertices) == 0:
        writer.empty_root()
        return writer.tree(vertices, "sah")
    level = _root(vertices)
    depth, numbered = 0, 1
    while level.node.size:
        splits = best_splits(level, bin_count(len(vertices), depth), traversal_cost, empty_bonus)
        inner = np.asarray(splits.cost < level.count)
        if depth == max_depth:
            inner[:] = False
        writer.leaves(level.node[~inner], level.count[~inner], level.ref[np.repeat(~inner, level.count)])
        writer.splits(level.node[inner], splits.axis[inner], splits.position[inner])
        depth += 1
        smallest = traversal_cost if depth < max_depth else np.inf
        level = _descend(vertices, level, splits, inner, numbered, smallest, writer)
        numbered += 2 * int(inner.sum())
        if progress is not None:
            progress(depth / (max_depth + 1))
    if progress is not None:
        progress(1.0)
    return writer.tree(vertices, "sah")


def _root(vertices: F64) -> Level:
    """The level of the root alone."""
    n = len(vertices)
    exact_lo, exact_hi = corner_bounds(vertices)
    lo, hi = round_down(exact_lo), round_up(exact_hi)
    cell_lo, cell_hi = (bound[:, None].astype(np.float64) for bound in (lo.min(axis=1), hi.max(axis=1)))
    return Level(np.array([n]), cell_lo, cell_hi, np.zeros(1, np.int64), np.arange(n, dtype=np.int32), lo, hi)


def _descend(
    vertices: F64, level: Level, splits: Splits, inner: Bools, numbered: int, smallest: float, writer: TreeWriter
) -> Level:
    """Sort the references of the inner nodes into children; write children of at most `smallest` triangles, return the others."""
    count = level.count[inner]
    source = np.flatnonzero(np.repeat(inner, level.count))
    lower, upper = _sides(level, splits, inner, source, count)
    cell_lo, cell_hi = child_cells(level.cell_lo[:, inner], level.cell_hi[:, inner], splits.axis[inner], splits.position[inner])
    pieces = _cut(vertices, level, source, np.repeat(np.arange(len(count)), count), lower, upper, cell_lo, cell_hi)
    child_count, order, piece = _lay_out(count, source, lower, upper, pieces)
    node = numbered + np.arange(len(child_count))
    leaf = child_count <= smallest
    in_leaf = np.repeat(leaf, child_count)
    writer.leaves(node[leaf], child_count[leaf], level.ref[order[in_leaf]])
    rest = ~in_leaf
    ref, lo, hi = _gather(level, order[rest], piece[rest], pieces)
    return Level(child_count[~leaf], cell_lo[:, ~leaf], cell_hi[:, ~leaf], node[~leaf], ref, lo, hi)


def _sides(level: Level, splits: Splits, inner: Bools, source: Ints, count: Ints) -> tuple[Bools, Bools]:
    """Which references reach below and above the split of their node; a triangle flat in the plane goes to one side."""
    row = np.repeat(splits.axis[inner] * len(level.ref), count) + source
    plane = np.repeat(splits.position[inner], count)
    lower = level.lo.ravel()[row] < plane
    upper = level.hi.ravel()[row] > plane
    flat = np.flatnonzero(~(lower | upper))
    if flat.size:
        up = np.repeat(splits.flats_up[inner], count)[flat]
        lower[flat], upper[flat] = ~up, up
    return lower, upper


@dataclass
class _Pieces:
    """Parts of triangles cut by a split: `of` (s,) gives a source's piece below, + half for that above, or -1; lo, hi (3, 2 half)."""

    of: Ints
    half: int
    lo: F32
    hi: F32


def _cut(
    vertices: F64, level: Level, source: Ints, parent: Ints, lower: Bools, upper: Bools, cell_lo: F64, cell_hi: F64
) -> _Pieces:
    """Clip triangles that reach into both children; where nothing is left of a part, clear its flag in `lower` or `upper`."""
    both = np.flatnonzero(lower & upper)
    cells = np.concatenate([2 * parent[both], 2 * parent[both] + 1])
    triangles = vertices[level.ref[source[both]]]
    lo, hi = clipped_bounds(np.concatenate([triangles, triangles]), cell_lo[:, cells], cell_hi[:, cells])
    left: Bools = np.all(lo <= hi, axis=0)
    lower[both], upper[both] = left[: len(both)], left[len(both) :]
    of = np.full(len(source), -1)
    of[both] = np.arange(len(both))
    return _Pieces(of, len(both), round_down(lo), round_up(hi))


def _lay_out(count: Ints, source: Ints, lower: Bools, upper: Bools, pieces: _Pieces) -> tuple[Ints, Ints, Ints]:
    """Sizes of the children, pair by pair; and, child by child, the reference each entry comes from and its piece or -1."""
    starts = starts_of(count)
    below, above = (np.add.reduceat(side, starts, dtype=np.int64) if len(starts) else starts for side in (lower, upper))
    child_count = np.stack([below, above], axis=1).ravel()
    place = starts_of(child_count)
    order = np.empty(int(child_count.sum()), np.int64)
    piece = np.empty_like(order)
    for side, goes in enumerate((lower, upper)):
        taken = np.flatnonzero(goes)
        spot = spread_runs(place[side::2], child_count[side::2])
        order[spot] = source[taken]
        of = pieces.of[taken]
        piece[spot] = np.where(of >= 0, of + side * pieces.half, -1)
    return child_count, order, piece


def _gather(level: Level, order: Ints, piece: Ints, pieces: _Pieces) -> tuple[Refs, F32, F32]:
    """References and bounds in their new order; those cut by a split get the bounds of their piece."""
    lo, hi = (np.take(bound, order, axis=1) for bound in (level.lo, level.hi))
    cut = np.flatnonzero(piece >= 0)
    lo[:, cut], hi[:, cut] = pieces.lo[:, piece[cut]], pieces.hi[:, piece[cut]]
    return np.take(level.ref, order), lo, hi
