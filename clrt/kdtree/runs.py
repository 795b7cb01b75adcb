"""The triangles of kd-trees in the order of their leaves, depth first, and in blocks: runs of them that are near each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.kdtree.arrays import LEAF
from clrt.kdtree.joined import JoinedTrees

Ints = NDArray[np.int64]


def leaf_runs(tree: JoinedTrees, size: int) -> tuple[Ints, Ints]:
    """The triangles that leaves name, tree by tree, and how they part into blocks of at most `size`, each of one tree.

    Returns (order, blocks): the triangles in the order of their first naming, depth first; and (b, 2) the first place in `order` of each
    block, and how many it has: those of the topmost nodes that first name at most `size`, or of a part of a leaf that names more.
    """
    levels = _levels(tree)
    places = _first_places(tree, levels, tree.count.astype(np.int64))
    leaf = np.flatnonzero((tree.split_axis == LEAF) & (tree.count > 0))
    leaf = leaf[np.argsort(places[leaf])]
    count, place = tree.count[leaf].astype(np.int64), places[leaf]
    entries = np.repeat(tree.child[leaf] - place, count) + np.arange(int(count.sum()))
    named = tree.indices[entries].astype(np.int64)
    first = np.empty(tree.triangles, np.int64)
    first[named[::-1]] = np.arange(len(named))[::-1]  # of equal indices the last write stays: the first naming
    new = first[named] == np.arange(len(named))
    fresh = np.zeros(len(tree.split_axis), np.int64)
    if len(leaf):
        fresh[leaf] = np.add.reduceat(new.astype(np.int64), place)
    return named[new], _blocks(tree, levels, fresh, size)


def _levels(tree: JoinedTrees) -> list[Ints]:
    """The inner nodes, level by level from the roots."""
    levels: list[Ints] = []
    level: Ints = tree.roots[tree.split_axis[tree.roots] != LEAF]
    while level.size:
        levels.append(level)
        level = (tree.child[level, None].astype(np.int64) + np.arange(2)).ravel()
        level = level[tree.split_axis[level] != LEAF]
    return levels


def _sums(tree: JoinedTrees, levels: list[Ints], count: Ints) -> Ints:
    """Of each node, what the leaves below it have together."""
    total = np.where(tree.split_axis == LEAF, count, 0)
    for level in reversed(levels):
        lower = tree.child[level]
        total[level] = total[lower] + total[lower + 1]
    return total


def _first_places(tree: JoinedTrees, levels: list[Ints], count: Ints) -> Ints:
    """Where what each node has begins, tree by tree, depth first."""
    total, first = _sums(tree, levels, count), np.zeros(len(tree.split_axis), np.int64)
    first[tree.roots] = np.cumsum(total[tree.roots]) - total[tree.roots]
    for level in levels:
        lower = tree.child[level]
        first[lower] = first[level]
        first[lower + 1] = first[level] + total[lower]
    return first


def _blocks(tree: JoinedTrees, levels: list[Ints], count: Ints, size: int) -> Ints:
    total, first = _sums(tree, levels, count), _first_places(tree, levels, count)
    covered = np.zeros(len(total), bool)
    for level in levels:
        lower = tree.child[level]
        covered[lower] = covered[lower + 1] = covered[level] | (total[level] <= size)
    tops = np.flatnonzero(~covered & (total > 0) & ((total <= size) | (tree.split_axis == LEAF)))
    tops = tops[np.argsort(first[tops])]
    parts = -(-total[tops] // size)
    within = np.arange(int(parts.sum())) - np.repeat(np.cumsum(parts) - parts, parts)
    begin = np.repeat(first[tops], parts) + within * size
    return np.stack([begin, np.minimum(np.repeat(first[tops] + total[tops], parts) - begin, size)], axis=1)
