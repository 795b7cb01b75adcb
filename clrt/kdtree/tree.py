"""A kd-tree over the triangles of one object: its arrays with their proof and their statistics."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from clrt.kdtree.arrays import LEAF, TreeArrays

TRAVERSAL_COST = 8.0  #: one step down the tree, in triangle tests, as packets of 16 rays have it


class KdTree(TreeArrays):
    """A tree with its proof and its statistics; the arrays are those of TreeArrays."""

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
