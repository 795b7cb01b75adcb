"""What every builder needs: checked input, a depth limit, float32 rounding outward, and the writer that lays out a tree."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clrt.errors import MeshError
from clrt.kdtree.arrays import LEAF
from clrt.kdtree.tree import KdTree

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
Ints = NDArray[np.int64]
Refs = NDArray[np.int32]
Bools = NDArray[np.bool_]
Progress = Callable[[float], None]

#: The deepest tree ever built: path codes fit 64 bits, and the kernels' stack is compiled for the depth.
DEPTH_CAP = 60

#: Greatest coordinate: the difference of two of them is still a float32, in which split planes are kept.
COORDINATE_LIMIT = 2.0**126

_SMALLEST_NORMAL = np.float32(2.0**-126)


def default_max_depth(triangles: int) -> int:
    """Depth limit for so many triangles: 8 + 1.3 log2 n (Wald and Havran, 2006; PBRT), at most DEPTH_CAP."""
    return min(DEPTH_CAP, int(8 + 1.3 * math.log2(max(triangles, 1))))


def checked_vertices(vertices: ArrayLike) -> F64:
    """Return the corners as a contiguous (n, 3, 3) float64 array.

    Raises MeshError for another shape, and for the first triangle with a corner that is not finite or beyond COORDINATE_LIMIT.
    """
    try:
        corners = np.ascontiguousarray(vertices, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise MeshError(f"triangles must be an array of numbers of shape (n, 3, 3): {error}") from None
    if corners.size == 0 and corners.ndim in (1, 3):
        return corners.reshape(0, 3, 3)
    if corners.ndim != 3 or corners.shape[1:] != (3, 3):
        raise MeshError(f"triangles must have shape (n, 3, 3): triangle, corner, x y z; found {corners.shape}")
    # NaN is the greatest and the least of all.
    if not (corners.max() <= COORDINATE_LIMIT and corners.min() >= -COORDINATE_LIMIT):
        bad = ~(np.abs(corners) <= COORDINATE_LIMIT).all(axis=(1, 2))
        first = int(np.argmax(bad))
        raise MeshError(
            f"triangle {first} of {len(corners)} has a corner that is not a finite number within +-2^126 (8.5e37): "
            f"{corners[first].tolist()}; remove it or mend its file ({int(bad.sum())} such triangles)"
        )
    return corners


def corner_bounds(triangles: F64) -> tuple[F64, F64]:
    """Bounds lo, hi : (3, n) of triangles (n, 3, 3)."""
    a, b, c = (np.ascontiguousarray(triangles[:, corner].T) for corner in range(3))
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def round_down(values: F64) -> F32:
    """Greatest float32 that is not above each value."""
    rounded = values.astype(np.float32)
    above = rounded > values
    rounded[above] = np.nextafter(rounded[above], np.float32(-np.inf))
    return rounded


def round_up(values: F64) -> F32:
    """Least float32 that is not below each value."""
    rounded = values.astype(np.float32)
    below = rounded < values
    rounded[below] = np.nextafter(rounded[below], np.float32(np.inf))
    return rounded


def split_positions(positions: NDArray[np.floating]) -> F32:
    """Round split planes to float32; subnormal ones become 0, since devices may flush them and would then sort rays otherwise."""
    rounded = positions.astype(np.float32)
    rounded[np.abs(rounded) < _SMALLEST_NORMAL] = 0
    return rounded


def starts_of(counts: Ints) -> Ints:
    """First position of each of consecutive runs of the given lengths."""
    starts = np.zeros_like(counts)
    np.cumsum(counts[:-1], out=starts[1:])
    return starts


def spread_runs(starts: Ints, counts: Ints) -> Ints:
    """Positions start, start + 1, ... of every run, one run after another."""
    return np.repeat(starts - starts_of(counts), counts) + np.arange(int(counts.sum()))


def child_cells(cell_lo: F64, cell_hi: F64, axis: Ints, plane: F32) -> tuple[F64, F64]:
    """Cells (3, k) cut at their planes: the cells of the children, (3, 2 k), lower and upper side by side."""
    lo, hi = np.repeat(cell_lo, 2, axis=1), np.repeat(cell_hi, 2, axis=1)
    lower = 2 * np.arange(len(axis))
    hi[axis, lower] = lo[axis, lower + 1] = plane
    return lo, hi


class TreeWriter:
    """Collects splits and leaves by breadth-first node number, in any order, and lays them out as a KdTree."""

    def __init__(self) -> None:
        self._splits: list[tuple[Ints, NDArray[np.uint8], F32]] = []
        self._leaves: list[tuple[Ints, Ints, Refs]] = []

    def splits(self, nodes: Ints, axes: NDArray[np.integer], positions: F32) -> None:
        """Add inner nodes, numbers ascending; their children get the next numbers, pair by pair."""
        self._splits.append((nodes, axes.astype(np.uint8), positions))

    def leaves(self, nodes: Ints, counts: Ints, refs: Refs) -> None:
        """Add leaves; `refs` holds their triangles one leaf after another."""
        self._leaves.append((nodes, counts, refs))

    def empty_root(self) -> None:
        """Add a lone leaf without triangles: the tree of an empty object."""
        nothing = np.zeros(1, np.int64)
        self.leaves(nothing, nothing, np.zeros(0, np.int32))

    def tree(self, vertices: F64, builder: str) -> KdTree:
        """Lay out the tree. Entries of `indices` follow the leaves in depth-first order: near in space, near in memory."""
        nodes, counts, refs = (np.concatenate(part) for part in zip(*self._leaves, strict=True))
        total = 2 * len(nodes) - 1
        axis = np.full(total, LEAF, np.uint8)
        position = np.zeros(total, np.float32)
        child = np.zeros(total, np.int32)
        count = np.zeros(total, np.int32)
        if self._splits:
            inner, axes, positions = (np.concatenate(part) for part in zip(*self._splits, strict=True))
            axis[inner], position[inner] = axes, positions
            child[inner] = 1 + 2 * np.arange(len(inner))
        codes, depth = _depth_first_codes(axis, child)
        order = np.argsort(codes[nodes], kind="stable")
        in_order = counts[order]
        child[nodes[order]] = starts_of(in_order)
        count[nodes] = counts
        indices = refs[spread_runs(starts_of(counts)[order], in_order)]
        lo, hi = np.zeros(3), np.zeros(3)
        if len(vertices):
            corners_lo, corners_hi = corner_bounds(vertices)
            lo, hi = corners_lo.min(axis=1), corners_hi.max(axis=1)
        return KdTree(lo, hi, axis, position, child, count, indices.astype(np.int32), depth, builder)


def _depth_first_codes(axis: NDArray[np.uint8], child: NDArray[np.int32]) -> tuple[NDArray[np.uint64], int]:
    """The path to each node as bits from the top (0 lower, 1 upper child), and the depth of the tree."""
    codes = np.zeros(len(axis), np.uint64)
    inner = np.flatnonzero(axis[:1] != LEAF)
    depth = 0
    while inner.size:
        depth += 1
        lower = child[inner]
        codes[lower] = codes[inner]
        codes[lower + 1] = codes[inner] | np.uint64(1 << (63 - depth))
        level = np.stack([lower, lower + 1], axis=1).ravel()
        inner = level[axis[level] != LEAF]
    return codes, depth
