"""kd-trees as trees over triangles, none of them twice: each goes to the leaf of its middle, and large leaves are parted further."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.kdtree.arrays import LEAF
from clrt.kdtree.joined import JoinedTrees

FloatArray = NDArray[np.float64]
Ints = NDArray[np.int64]

_OCTANTS = 8


@dataclass(frozen=True, eq=False)
class PartedTree:
    """Nodes with two children or none, (m,) each, of one tree or several.

    axis : along which the children lie; child : the lower one, the upper one follows; count : triangles; a leaf has axis LEAF
    roots : (trees,); levels : inner nodes, parents before children
    """

    axis: Ints
    child: Ints
    count: Ints
    roots: Ints
    levels: list[Ints]

    def positions(self, octants: int = _OCTANTS) -> Ints:
        """(m, octants): the place of each node's first triangle where children come from near to far for directions of an octant.

        Bit a of the octant's number is set where the component a of directions is negative.
        """
        negative = (np.arange(octants) >> np.arange(3)[:, None]) & 1
        first = np.zeros((len(self.count), octants), np.int64)
        first[self.roots] = (np.cumsum(self.count[self.roots]) - self.count[self.roots])[:, None]
        for level in self.levels:
            lower, turned = self.child[level], negative[self.axis[level]]
            first[lower] = first[level] + turned * self.count[lower + 1, None]
            first[lower + 1] = first[level] + (1 - turned) * self.count[lower, None]
        return first


def part(tree: JoinedTrees, counts: Ints, points: FloatArray, size: int) -> tuple[PartedTree, Ints]:
    """The trees of `points` (n, 3), middles of triangles, `counts` of each tree, with at most `size` in a leaf; and their order (n,)."""
    axis, child = tree.split_axis.astype(np.int64), tree.child.astype(np.int64)
    levels: list[Ints] = []
    level: Ints = tree.roots[axis[tree.roots] != LEAF]
    while level.size:
        levels.append(level)
        level = (child[level, None] + np.arange(2)).ravel()
        level = level[axis[level] != LEAF]
    leaf = _leaf_of(tree, np.repeat(tree.roots, counts), points)
    count = np.bincount(leaf, minlength=len(axis))
    for level in reversed(levels):
        count[level] = count[child[level]] + count[child[level] + 1]
    whole = PartedTree(axis, child, count, tree.roots, levels)
    widest = _widest(points, leaf, len(axis))
    order = np.lexsort((points[np.arange(len(points)), widest[leaf]], whole.positions(1)[leaf, 0]))
    return _parted(whole, widest, size), order


def _leaf_of(tree: JoinedTrees, leaf: Ints, points: FloatArray) -> Ints:
    """(n,) from the roots on."""
    moving = np.flatnonzero(tree.split_axis[leaf] != LEAF)
    while moving.size:
        node = leaf[moving]
        leaf[moving] = tree.child[node] + (points[moving, tree.split_axis[node]] > tree.split_pos[node])
        moving = moving[tree.split_axis[leaf[moving]] != LEAF]
    return leaf


def _widest(points: FloatArray, leaf: Ints, nodes: int) -> Ints:
    """(nodes,) the axis along which the points of each leaf reach furthest."""
    order = np.argsort(leaf, kind="stable")
    names, starts = np.unique(leaf[order], return_index=True)
    low, high = (bound.reduceat(points[order], starts, axis=0) for bound in (np.minimum, np.maximum))
    widest = np.zeros(nodes, np.int64)
    widest[names] = (high - low).argmax(axis=1)
    return widest


def _parted(tree: PartedTree, widest: Ints, size: int) -> PartedTree:
    """Leaves of more than `size` triangles in two, again and again; the lower part is a multiple of `size`."""
    axis, child, count, levels = tree.axis.copy(), tree.child.copy(), tree.count, list(tree.levels)
    large = np.flatnonzero((axis == LEAF) & (count > size))
    along = widest[large]
    while large.size:
        levels.append(large)
        lower = -(-count[large] // (2 * size)) * size
        parts = np.stack([lower, count[large] - lower], axis=1).ravel()
        axis[large], child[large] = along, len(axis) + 2 * np.arange(len(large))
        large, along = len(axis) + np.flatnonzero(parts > size), along.repeat(2)[parts > size]
        axis = np.concatenate([axis, np.full(len(parts), LEAF)])
        child, count = np.concatenate([child, np.zeros_like(parts)]), np.concatenate([count, parts])
    return PartedTree(axis, child, count, tree.roots, levels)
