"""The plain arrays of a kd-tree, and the boxes of its nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LEAF = 3  #: the split_axis of a leaf


@dataclass(frozen=True, eq=False)
class TreeArrays:
    """Nodes in breadth-first order; node 0 is the root; the two children of a node lie side by side.

    lo, hi : (3,) float64, closed bounds of all triangles
    split_axis : (m,) uint8; 0, 1, 2 for x, y, z; LEAF for a leaf
    split_pos : (m,) float32; the plane of an inner node (rounded to float32 *before* triangles were sorted by it); 0 in a leaf
    child : (m,) int32; inner node: index of its lower child, the upper one is child + 1; leaf: its first entry in `indices`
    count : (m,) int32; leaf: number of its entries in `indices`; inner node: 0
    indices : (r,) int32 triangle numbers, local to the object, leaf by leaf
    depth : edges from the root to the deepest leaf (a lone leaf: 0)
    builder : "sah" or "median"
    built_on : "numpy", or "device" for its kernels
    """

    lo: NDArray[np.float64]
    hi: NDArray[np.float64]
    split_axis: NDArray[np.uint8]
    split_pos: NDArray[np.float32]
    child: NDArray[np.int32]
    count: NDArray[np.int32]
    indices: NDArray[np.int32]
    depth: int
    builder: str
    built_on: str = "numpy"

    @property
    def node_count(self) -> int:
        """Inner nodes and leaves."""
        return len(self.split_axis)

    def cells(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The box of every node: lo, hi : (m, 3) float64."""
        lo, hi = np.tile(self.lo, (self.node_count, 1)), np.tile(self.hi, (self.node_count, 1))
        level = np.flatnonzero(self.split_axis[:1] != LEAF)
        while level.size:
            axis, plane, lower = self.split_axis[level], self.split_pos[level], self.child[level]
            for bound in (lo, hi):
                bound[lower] = bound[lower + 1] = bound[level]
            hi[lower, axis] = lo[lower + 1, axis] = plane
            children = np.stack([lower, lower + 1], axis=1).ravel()
            level = children[self.split_axis[children] != LEAF]
        return lo, hi
