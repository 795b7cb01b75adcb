"""No tree at all: one leaf that holds every triangle, so that each ray in the object's box is tested against all of them.

It gives brute force the very kernels of the other trees, to measure what those save and to check that they lose nothing.
"""

from __future__ import annotations

import numpy as np

from clrt.kdtree.common import F64, Progress, TreeWriter
from clrt.kdtree.tree import KdTree


def build_brute(vertices: F64, max_depth: int, progress: Progress | None = None) -> KdTree:
    """A lone leaf with the triangles (n, 3, 3) in their order; `max_depth` bounds nothing here."""
    writer = TreeWriter()
    if len(vertices):
        writer.leaves(np.zeros(1, np.int64), np.array([len(vertices)]), np.arange(len(vertices), dtype=np.int32))
    else:
        writer.empty_root()
    if progress is not None:
        progress(1.0)
    return writer.tree(vertices, "brute")
