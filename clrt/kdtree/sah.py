"""The default builder: surface area heuristic, references clipped exactly, a whole level of the tree at a time."""

from __future__ import annotations

import numpy as np

from clrt.kdtree.binning import Level, Splits, best_splits
from clrt.kdtree.clip import clipped_bounds
from clrt.kdtree.common import F64, Bools, Ints, Progress, TreeWriter, round_down, round_up, spread_runs, starts_of
from clrt.kdtree.tree import KdTree

#: Cost of one step down the tree in triangle tests.
TRAVERSAL_COST = 8.0

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
        splits = best_splits(level, traversal_cost, empty_bonus)
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
    lo = round_down(np.ascontiguousarray(vertices.min(axis=1).T))
    hi = round_up(np.ascontiguousarray(vertices.max(axis=1).T))
    cell_lo, cell_hi = (bound[:, None].astype(np.float64) for bound in (lo.min(axis=1), hi.max(axis=1)))
    return Level(np.zeros(1, np.int64), np.array([n]), cell_lo, cell_hi, np.arange(n, dtype=np.int32), lo, hi)


def _descend(
    vertices: F64, level: Level, splits: Splits, inner: Bools, numbered: int, smallest: float, writer: TreeWriter
) -> Level:
    """Sort the references of the inner nodes into children; write children of at most `smallest` triangles, return the others."""
    count = level.count[inner]
    source = np.flatnonzero(np.repeat(inner, level.count))
    lower, upper = _sides(level, splits, inner, source, count)
    cell_lo, cell_hi = _child_cells(level, splits, inner)
    # Clip those that reach into both; a part may turn out to be empty.
    both = np.flatnonzero(lower & upper)
    parent = np.repeat(np.arange(len(count)), count)[both]
    cells = np.concatenate([2 * parent, 2 * parent + 1])
    lo, hi = clipped_bounds(vertices[level.ref[np.tile(source[both], 2)]], cell_lo[:, cells], cell_hi[:, cells])
    filled = (lo <= hi).all(axis=0)
    lower[both], upper[both] = filled[: len(both)], filled[len(both) :]
    piece = np.full(len(source), -1)
    piece[both] = np.arange(len(both))
    # Lay the children out side by side.
    starts = starts_of(count)
    children = np.stack([_per_node(lower, starts), _per_node(upper, starts)], axis=1)
    child_count = children.ravel()
    place = starts_of(child_count).reshape(-1, 2)
    order = np.empty(int(child_count.sum()), np.int64)
    piece_of = np.empty_like(order)
    for side, goes in enumerate((lower, upper)):
        taken = np.flatnonzero(goes)
        spot = spread_runs(place[:, side], children[:, side])
        order[spot] = source[taken]
        piece_of[spot] = np.where(piece[taken] >= 0, piece[taken] + side * len(both), -1)
    node = numbered + np.arange(len(child_count))
    leaf = child_count <= smallest
    in_leaf = np.repeat(leaf, child_count)
    writer.leaves(node[leaf], child_count[leaf], level.ref[order[in_leaf]])
    kept = np.flatnonzero(~in_leaf)
    return _next_level(level, node[~leaf], child_count[~leaf], cell_lo[:, ~leaf], cell_hi[:, ~leaf], order[kept], piece_of[kept], lo, hi)


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


def _child_cells(level: Level, splits: Splits, inner: Bools) -> tuple[F64, F64]:
    """Cells of the children, (3, 2 k), pair by pair."""
    cell_lo, cell_hi = (np.repeat(cell[:, inner], 2, axis=1) for cell in (level.cell_lo, level.cell_hi))
    axis, lower = splits.axis[inner], 2 * np.arange(int(inner.sum()))
    cell_hi[axis, lower] = cell_lo[axis, lower + 1] = splits.position[inner]
    return cell_lo, cell_hi


def _per_node(flags: Bools, starts: Ints) -> Ints:
    """Flags set, node by node."""
    return np.add.reduceat(flags, starts, dtype=np.int64) if len(starts) else np.zeros(0, np.int64)


def _next_level(
    level: Level, node: Ints, count: Ints, cell_lo: F64, cell_hi: F64, order: Ints, piece: Ints, lo: F64, hi: F64
) -> Level:
    """Gather references in their new order; those cut by a split get the bounds of their piece."""
    new_lo, new_hi = (np.take(bound, order, axis=1) for bound in (level.lo, level.hi))
    cut = np.flatnonzero(piece >= 0)
    new_lo[:, cut] = round_down(lo[:, piece[cut]])
    new_hi[:, cut] = round_up(hi[:, piece[cut]])
    return Level(node, count, cell_lo, cell_hi, np.take(level.ref, order), new_lo, new_hi)

