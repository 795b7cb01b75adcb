"""kd-trees, one an object: `build_tree(vertices, builder="sah" | "median")`.

    tree.py         the arrays of a tree, their statistics
    validate.py     the proof that a tree is right: structure here, triangles in coverage.py, by overlap.py alone
    sah.py          the default builder: surface area heuristic (binning.py), clipped references (clip.py)
    median.py       the report's splitter
    brute.py        one leaf for all: what the others are measured against
    common.py       what builders share: checked input, rounding, the writer of a tree
"""

from __future__ import annotations

from typing import Protocol

from numpy.typing import ArrayLike

from clrt.errors import LimitError
from clrt.kdtree.arrays import LEAF
from clrt.kdtree.brute import build_brute
from clrt.kdtree.common import DEPTH_CAP, F64, Progress, checked_vertices, default_max_depth
from clrt.kdtree.median import build_median
from clrt.kdtree.sah import build_sah
from clrt.kdtree.tree import KdTree

__all__ = ["BASELINES", "BUILDERS", "DEPTH_CAP", "LEAF", "Builder", "KdTree", "build_tree", "default_max_depth"]


class Builder(Protocol):
    """A builder of trees over checked vertices (n, 3, 3); it calls `progress` with a fraction after each level."""

    def __call__(self, vertices: F64, max_depth: int, progress: Progress | None = None) -> KdTree: ...


#: Builders by name; add one here and it is offered everywhere.
BUILDERS: dict[str, Builder] = {"sah": build_sah, "median": build_median}

#: Also understood by `build_tree`, but offered nowhere: what builders are measured against.
BASELINES: dict[str, Builder] = {"brute": build_brute}


def build_tree(
    vertices: ArrayLike, builder: str = "sah", *, max_depth: int | None = None, progress: Progress | None = None
) -> KdTree:
    """Build the kd-tree of one object.

    vertices : (n, 3, 3) triangle, corner, x y z; computed with in float64, not changed. None are dropped.
    max_depth : 0 to DEPTH_CAP; default 8 + 1.3 log2 n.
    progress : called with a fraction from 0 to 1 after each level; an exception in it ends the build.

    Raises MeshError for vertices that are not finite, LimitError for a depth out of range, ValueError for an unknown builder.
    """
    known = BUILDERS | BASELINES
    if builder not in known:
        raise ValueError(f"no kd-tree builder {builder!r}; choose one of {', '.join(BUILDERS)}")
    corners = checked_vertices(vertices)
    limit = default_max_depth(len(corners)) if max_depth is None else max_depth
    if not 0 <= limit <= DEPTH_CAP:
        raise LimitError(f"kd-tree depth limit {limit} is out of range; choose 0 to {DEPTH_CAP}")
    return known[builder](corners, limit, progress)
