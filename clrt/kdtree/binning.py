"""The best split of every node of a level by the surface area heuristic, from histograms of its references' bounds.

Cost of a split (MacDonald and Booth, 1990): traversal + (A_lower n_lower + A_upper n_upper) / A, in triangle tests; A are the
surface areas of the cells, n the references that reach into them. Candidates are evenly spaced planes between the bounds of a node's
references (binning: Hurley, Kapustin, Reshetov, Soupikov, 2002; counts from both ends: Shevtsov, Soupikov, Kapustin, 2007) and
these bounds themselves, where one child is empty: such a cut is exact and gets a bonus.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from clrt.kdtree.common import F32, F64, Bools, Ints, Refs, split_positions, starts_of

#: Relative shift that settles a bound on a plane: a triangle that ends on it does not reach beyond, one that starts there not below.
_NUDGE = np.float32(2.0**-20)

#: Bins of a node, at least and at most.
LEAST_BINS, MOST_BINS = 16, 128

#: Narrower extents are not split: the reciprocal of a bin's width would leave float32.
_NARROWEST = 2.0**-112


@dataclass
class Cells:
    """Nodes of one depth. count : (m,) references, at least 1. cell_lo, cell_hi : (3, m), float32 values."""

    count: Ints
    cell_lo: F64
    cell_hi: F64


@dataclass
class Level(Cells):
    """The open nodes of one depth and their references, node by node.

    node : (m,) breadth-first numbers. ref : (r,) triangle numbers; lo, hi : (3, r) bounds of their clipped parts, rounded outward.
    """

    node: Ints
    ref: Refs
    lo: F32
    hi: F32


@dataclass
class Splits:
    """The best split of every node: its cost in triangle tests (inf: none), axis, plane; and whether flat triangles in it go up."""

    cost: F32
    axis: Ints
    position: F32
    flats_up: Bools


def best_splits(level: Level, bins: int, traversal_cost: float, empty_bonus: float) -> Splits:
    """Evaluate all candidates of all nodes of a level. `empty_bonus` is the share of a split's cost forgiven if a child is empty."""
    starts = starts_of(level.count)
    tight_lo = np.minimum.reduceat(level.lo, starts, axis=1)
    tight_hi = np.maximum.reduceat(level.hi, starts, axis=1)
    counts = (_counts(level, axis, tight_lo[axis], tight_hi[axis], bins) for axis in range(3))
    return splits_of_counts(level, tight_lo, tight_hi, counts, traversal_cost, empty_bonus)


def splits_of_counts(
    cells: Cells, tight_lo: F32, tight_hi: F32, counts: Iterable[tuple[Ints, Ints]], traversal_cost: float, empty_bonus: float
) -> Splits:
    """The best splits of nodes, given the bounds (3, m) of their references and, for each axis, how many of these begin and end
    in each bin: (m, bins + 2) each, bin k in column k + 1."""
    m = len(cells.count)
    best = Splits(np.full(m, np.inf, np.float32), np.zeros(m, np.int64), np.zeros(m, np.float32), np.zeros(m, bool))
    for axis, (begins, ends) in enumerate(counts):
        planes = _planes(cells, axis, tight_lo[axis], tight_hi[axis], begins.shape[1] - 2)
        # A running sum up to column k counts the bins below plane k.
        lower = np.cumsum(begins, axis=1)[:, :-1]
        upper = cells.count[:, None] - np.cumsum(ends, axis=1)[:, :-1]
        lower[:, -1], upper[:, -1] = cells.count, 0
        _keep_better(best, cells, axis, planes, lower, upper, traversal_cost, empty_bonus)
    return best


def bin_count(triangles: int, depth: int) -> int:
    """Bins of a node at this depth of a tree over so many triangles: many while nodes are few, at most 4 a triangle in all.

    The whole rule, so that builders that take nodes in any order find the same splits.
    """
    return int(min(max(LEAST_BINS, 4 * triangles >> depth), MOST_BINS))


def bin_scales(lo: F32, hi: F32, bins: int | Ints) -> tuple[F32, F32]:
    """Factors from a distance above `lo` to a number of bins, for where references begin and where they end."""
    extent = hi.astype(np.float64) - lo
    per_bin = np.where(extent > _NARROWEST, bins / np.maximum(extent, _NARROWEST), 0).astype(np.float32)
    return per_bin * (1 + _NUDGE), per_bin * (1 - _NUDGE)


def _planes(level: Cells, axis: int, lo: F32, hi: F32, bins: int) -> F32:
    """Candidate planes, (m, bins + 1): the first and the last are the bounds of the references; NaN where not inside the cell."""
    step = (hi.astype(np.float64) - lo) / bins
    planes = split_positions(lo[:, None] + step[:, None] * np.arange(bins + 1))
    planes[:, 0], planes[:, -1] = split_positions(lo), split_positions(hi)
    inside = (planes > level.cell_lo[axis][:, None]) & (planes < level.cell_hi[axis][:, None])
    planes[~inside] = np.nan
    return planes


def _counts(level: Level, axis: int, lo: F32, hi: F32, bins: int) -> tuple[Ints, Ints]:
    """How many references begin and end in each bin, (m, bins + 2) each."""
    m, width = len(level.node), bins + 2
    first = np.repeat(np.arange(1, m * width + 1, width, dtype=np.int32), level.count)
    base = np.repeat(lo, level.count)
    to_begin, to_end = bin_scales(lo, hi, bins)
    begin = (level.lo[axis] - base) * np.repeat(to_begin, level.count)
    end = (level.hi[axis] - base) * np.repeat(to_end, level.count)
    begins = np.bincount(begin.astype(np.int32) + first, minlength=m * width).reshape(m, width)
    ends = np.bincount(end.astype(np.int32) + first, minlength=m * width).reshape(m, width)
    return begins, ends


def _keep_better(
    best: Splits, level: Cells, axis: int, planes: F32, lower: Ints, upper: Ints, traversal_cost: float, empty_bonus: float
) -> None:
    """Put the cheapest plane of this axis into `best` where it beats what is there."""
    extent = level.cell_hi - level.cell_lo
    extent /= np.maximum(extent.max(axis=0), np.finfo(np.float64).tiny)
    along, one, two = extent[axis], extent[axis - 2], extent[axis - 1]
    total = along * (one + two) + one * two
    with np.errstate(divide="ignore", invalid="ignore"):
        # A child's area is the area of both ends and of the sides, the latter in proportion to its share of the cell.
        ends, sides = one * two / total, along * (one + two) / total
        share = (planes - level.cell_lo[axis][:, None]) / (level.cell_hi - level.cell_lo)[axis][:, None]
    below = (ends[:, None] + sides[:, None] * share).astype(np.float32)
    above = (ends[:, None] + sides[:, None] * (1 - share)).astype(np.float32)
    cost = np.float32(traversal_cost) + below * lower.astype(np.float32) + above * upper.astype(np.float32)
    cost[:, 0] *= 1 - empty_bonus
    cost[:, -1] *= 1 - empty_bonus
    np.nan_to_num(cost, copy=False, nan=np.inf)
    row, k = np.arange(len(cost)), cost.argmin(axis=1)
    chosen = cost[row, k]
    better = chosen < best.cost
    best.cost[better], best.axis[better], best.position[better] = chosen[better], axis, planes[row, k][better]
    # Flat triangles in the plane leave an empty child empty; else they go to the smaller child.
    bins = planes.shape[1] - 1
    up = (k == 0) | ((k < bins) & (above[row, k] < below[row, k]))
    best.flats_up[better] = up[better]
