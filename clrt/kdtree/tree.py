"""A kd-tree over the triangles of one object: plain arrays, their proof, their statistics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

LEAF = 3  #: the split_axis of a leaf

TRAVERSAL_COST = 8.0  #: one step down the tree, in triangle tests, as packets of 16 rays have it


@dataclass(frozen=True, eq=False)
class KdTree:
    """Nodes in breadth-first order; node 0 is the root; the two children of a node lie side by side.

    lo, hi : (3,) float64, closed bounds of all triangles
    split_axis : (m,) uint8; 0, 1, 2 for x, y, z; LEAF for a leaf
    split_pos : (m,) float32; the plane of an inner node (rounded to float32 *before* triangles were sorted by it); 0 in a leaf
    child : (m,) int32; inner node: index of its lower child, the upper one is child + 1; leaf: its first entry in `indices`
    count : (m,) int32; leaf: number of its entries in `indices`; inner node: 0
    indices : (r,) int32 triangle numbers, local to the object, leaf by leaf
    depth : edges from the root to the deepest leaf (a lone leaf: 0)
    builder : "sah" or "median"
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

    @property
    def node_count(self) -> int:
        """Inner nodes and leaves."""
        return len(self.split_axis)

    @property
    def leaf_count(self) -> int:
        """Leaves, empty ones too."""
        return int(np.count_nonzero(self.split_axis == LEAF))

    @property
    def empty_leaf_count(self) -> int:
        """Leaves without triangles."""
        return int(np.count_nonzero((self.split_axis == LEAF) & (self.count == 0)))

    @property
    def reference_count(self) -> int:
        """Entries of all leaves; a triangle in several leaves counts as often."""
        return len(self.indices)

    @property
    def mean_leaf_size(self) -> float:
        """Triangles in a leaf that has any; 0 without triangles."""
        return self.reference_count / max(self.leaf_count - self.empty_leaf_count, 1)

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

    def sah_cost(self, traversal_cost: float = TRAVERSAL_COST) -> float:
        """Expected cost of a random line through the bounds, in triangle tests: steps * traversal_cost + tests.

        A line that meets a box meets a box within it with the ratio of their areas (Goldsmith and Salmon, 1987). 0 if the bounds
        have no area.
        """
        lo, hi = self.cells()
        x, y, z = ((hi - lo) / max(float((self.hi - self.lo).max()), np.finfo(np.float64).tiny)).T
        area = x * y + y * z + z * x
        per_visit = np.where(self.split_axis == LEAF, self.count, traversal_cost)
        return float(area @ per_visit / area[0]) if area[0] > 0 else 0.0

    def stats(self) -> dict[str, int | float | str]:
        """Figures for a report, JSON types."""
        return {
            "builder": self.builder,
            "nodes": self.node_count,
            "leaves": self.leaf_count,
            "empty_leaves": self.empty_leaf_count,
            "references": self.reference_count,
            "depth": self.depth,
            "mean_leaf_size": self.mean_leaf_size,
            "greatest_leaf_size": int(self.count.max(initial=0)),
            "sah_cost": self.sah_cost(),
            "bytes": sum(a.nbytes for a in (self.split_axis, self.split_pos, self.child, self.count, self.indices)),
        }

    def validate(self, vertices: ArrayLike, *, max_depth: int | None = None) -> int:
        """Prove the tree right for triangles (n, 3, 3), or raise ValueError; see validate.py for what is proved.

        Returns the number of stray references: entries whose triangle is surely away from its leaf. They cost time, never a hit.
        """
        from clrt.kdtree.validate import validate

        return validate(self, np.asarray(vertices, np.float64), max_depth)
