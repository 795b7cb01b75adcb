"""The proof that no triangle is missing from a leaf that it reaches.

Independent of the builders: triangles are followed from the root with the separating-axis test of overlap.py, never by clipping.

What "reaches" means. Let delta = 2^-40 * (the triangle's greatest |coordinate|), or the least number there is: far above the rounding of
float64, far below that of float32. A triangle that reaches farther than delta beyond a split, within the part of the cell where it was
followed to, must be found on that side. If it reaches farther than delta to neither side, as when it lies flat in the plane, it must be
found on at least one of the two, whole. A triangle that only touches a side within delta may be there or not: a ray that hits it there
passes within rounding of the plane, where traversal visits both sides. So the proof is an and-or tree over pairs of triangle and node,
with the entries of leaves as its facts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.kdtree.arrays import LEAF, TreeArrays
from clrt.kdtree.overlap import F64, Bools, triangles_meet_boxes

Ints = NDArray[np.int64]

#: delta relative to a triangle's greatest |coordinate|
DELTA = 2.0**-40

#: An entry is stray if its triangle is farther from the leaf's cell than this, relative to its greatest |coordinate|: two float32 steps.
STRAY = 2.0**-22


def entry_keys(tree: TreeArrays, triangles: int) -> Ints:
    """leaf * triangles + triangle of every entry of `indices`."""
    leaves = np.flatnonzero(tree.split_axis == LEAF)
    leaves = leaves[np.lexsort((tree.count[leaves], tree.child[leaves]))]
    return np.asarray(np.repeat(leaves, tree.count[leaves]) * max(triangles, 1) + tree.indices)


@dataclass
class _Pairs:
    """Triangles followed to the nodes of one depth.

    triangle, node, parent (k,): parent is the pair of the depth above that this one comes from. lo, hi (k, 3): the part of the
    triangle's bounds that was followed to the node. either (k,): one of the two children is enough.
    """

    triangle: Ints
    node: Ints
    parent: Ints
    lo: F64
    hi: F64
    either: Bools


def check_coverage(tree: TreeArrays, vertices: F64) -> None:
    """Every triangle is in every leaf that it reaches."""
    n = len(vertices)
    delta = np.maximum(DELTA * np.abs(vertices).max(axis=(1, 2), initial=0), np.finfo(np.float64).tiny)  # 0 for a point at the origin
    first = np.arange(n)
    depths = [_Pairs(first, np.zeros(n, np.int64), first, vertices.min(axis=1), vertices.max(axis=1), np.zeros(n, bool))] if n else []
    for _ in range(tree.depth if n else 0):
        depths.append(_follow(tree, vertices, delta, depths[-1]))
    entries = np.sort(entry_keys(tree, n))
    # From the leaves up: a pair is proved by its leaf's entry, or by its children.
    proved: list[Bools] = []
    for pairs in reversed(depths):
        holds = _has_entry(entries, pairs.node * n + pairs.triangle)
        inner = tree.split_axis[pairs.node] != LEAF
        if proved:
            below, size = depths[len(depths) - len(proved)], len(pairs.node)
            some, missing = (np.bincount(below.parent[which], minlength=size) for which in (proved[-1], ~proved[-1]))
            holds[inner] = np.where(pairs.either, some > 0, missing == 0)[inner]
        proved.append(holds)
    if proved and not proved[-1].all():
        raise ValueError(_missing_entry(tree, depths, proved[::-1]))


def _has_entry(entries: Ints, keys: Ints) -> Bools:
    """Which keys are among the sorted entries."""
    place = np.minimum(np.searchsorted(entries, keys), max(len(entries) - 1, 0))
    return np.asarray(entries[place] == keys) if len(entries) else np.zeros(len(keys), bool)


def _follow(tree: TreeArrays, vertices: F64, delta: F64, pairs: _Pairs) -> _Pairs:
    """The pairs one level down; marks in `pairs` those that reach beyond the split to neither side."""
    inner = np.flatnonzero(tree.split_axis[pairs.node] != LEAF)
    triangle, node = pairs.triangle[inner], pairs.node[inner]
    axis, plane = tree.split_axis[node].astype(np.int64), tree.split_pos[node].astype(np.float64)
    margin = delta[triangle]
    whole_lo, whole_hi = pairs.lo[inner], pairs.hi[inner]
    lower_hi, upper_lo = whole_hi.copy(), whole_lo.copy()
    row = np.arange(len(inner))
    lower_hi[row, axis] = np.minimum(whole_hi[row, axis], plane - margin)
    upper_lo[row, axis] = np.maximum(whole_lo[row, axis], plane + margin)
    lower = _reaches(vertices, triangle, margin, whole_lo, lower_hi, lower_hi[row, axis] < whole_hi[row, axis])
    upper = _reaches(vertices, triangle, margin, upper_lo, whole_hi, upper_lo[row, axis] > whole_lo[row, axis])
    # Where one of both is enough, the pair goes on uncut: all of it lies within delta of the plane.
    either = ~(lower | upper)
    pairs.either[inner[either]] = True
    lower_hi[either], upper_lo[either] = whole_hi[either], whole_lo[either]
    below, above = np.flatnonzero(lower | either), np.flatnonzero(upper | either)
    both = np.concatenate([below, above])
    child = tree.child[node].astype(np.int64)
    return _Pairs(
        triangle=triangle[both],
        node=np.concatenate([child[below], child[above] + 1]),
        parent=inner[both],
        lo=np.concatenate([whole_lo[below], upper_lo[above]]),
        hi=np.concatenate([lower_hi[below], whole_hi[above]]),
        either=np.zeros(len(both), bool),
    )


def _reaches(vertices: F64, triangle: Ints, margin: F64, lo: F64, hi: F64, cut: Bools) -> Bools:
    """Whether triangles reach into their boxes; tested where the box was cut, known where it was not."""
    reaches: Bools = np.all(lo <= hi, axis=1)
    test = np.flatnonzero(cut & reaches)
    reaches[test] = triangles_meet_boxes(vertices[triangle[test]], lo[test], hi[test], margin[test] / 4)
    return reaches


def _missing_entry(tree: TreeArrays, depths: list[_Pairs], proved: list[Bools]) -> str:
    """Follow the first unproved triangle down to a leaf that lacks it."""
    pair = int(np.flatnonzero(~proved[0])[0])
    for level, pairs in enumerate(depths):
        node, triangle = int(pairs.node[pair]), int(pairs.triangle[pair])
        if tree.split_axis[node] == LEAF:
            break
        pair = int(np.flatnonzero((depths[level + 1].parent == pair) & ~proved[level + 1])[0])
    lo, hi = (bound[node].tolist() for bound in tree.cells())
    return f"kd-tree: triangle {triangle} reaches into leaf {node}, {lo} to {hi}, and is not among its {tree.count[node]} triangles"


def stray_references(tree: TreeArrays, vertices: F64) -> int:
    """Entries whose triangle is surely away from its leaf."""
    if not tree.indices.size:
        return 0
    leaf, triangle = np.divmod(entry_keys(tree, len(vertices)), len(vertices))
    cell_lo, cell_hi = tree.cells()
    corners = vertices[triangle]
    margin = STRAY * np.abs(corners).max(axis=(1, 2))
    lo = np.maximum(cell_lo[leaf] - margin[:, None], corners.min(axis=1))
    hi = np.minimum(cell_hi[leaf] + margin[:, None], corners.max(axis=1))
    return int(np.count_nonzero(~triangles_meet_boxes(corners, lo, hi, margin / 4)))
