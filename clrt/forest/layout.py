"""From what the device built to trees as the traversal reads them: nodes breadth first, entries in the order of the leaves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from clrt.forest.pool import Jobs
from clrt.forest.subtrees import Subtrees, Words
from clrt.forest.top import Inner
from clrt.kdtree.arrays import LEAF
from clrt.kdtree.common import F64, Ints, spread_runs, starts_of
from clrt.kdtree.tree import KdTree


def trees_of(jobs: Jobs, subtrees: Subtrees, inner: Sequence[Inner], counts: Ints, lo: F64, hi: F64) -> list[KdTree]:
    """The trees over `counts` consecutive triangles each; lo, hi : (trees, 3)."""
    words, of_tree, entries = _preorder(jobs, subtrees, inner)
    depth, axis = words[:, 0] >> 2, (words[:, 0] & 3).astype(np.uint8)
    leaf = axis == LEAF
    size = np.where(leaf, words[:, 1], 0)
    node_counts = np.bincount(of_tree, minlength=len(counts))
    entry_counts = np.bincount(of_tree, size, minlength=len(counts)).astype(np.int64)
    first_entry = np.cumsum(size, dtype=np.int64) - size - starts_of(entry_counts)[of_tree]
    order = _breadth_first(of_tree, depth)
    leaf = leaf[order]
    # The k-th inner node of a tree has children 1 + 2 k and 2 + 2 k.
    rank = np.cumsum(~leaf) - ~leaf
    child = np.where(leaf, first_entry[order], 1 + 2 * (rank - rank[starts_of(node_counts)][of_tree])).astype(np.int32)
    position = np.where(leaf, 0, words[order, 1]).astype(np.int32).view(np.float32)
    axis, size = axis[order], size[order].astype(np.int32)
    deepest = np.maximum.reduceat(depth, starts_of(node_counts)).tolist()
    indices = entries - np.repeat(starts_of(counts), entry_counts).astype(np.int32)
    ends, entry_ends = np.cumsum(node_counts).tolist(), np.cumsum(entry_counts).tolist()
    trees, first, first_index = [], 0, 0
    for t, (end, index_end) in enumerate(zip(ends, entry_ends, strict=True)):
        nodes = axis[first:end], position[first:end], child[first:end], size[first:end]
        trees.append(KdTree(lo[t], hi[t], *nodes, indices[first_index:index_end], deepest[t], "sah", "device"))
        first, first_index = end, index_end
    return trees


def _preorder(jobs: Jobs, subtrees: Subtrees, inner: Sequence[Inner]) -> tuple[Words, Ints, Words]:
    """All nodes (n, 2) tree by tree in preorder, their trees (n,), and the entries of the leaves in that order."""
    tree = np.concatenate([*(part.tree for part in inner), jobs.tree])
    code = np.concatenate([*(part.code for part in inner), jobs.code])
    depth = np.concatenate([*(np.full(len(part.tree), part.depth) for part in inner), jobs.depth])
    # Of nodes with one path, the upper end comes first: a node before its lower child.
    order = np.lexsort((depth, code, tree))
    split = [np.stack([part.depth << 2 | part.axis, part.position.view(np.int32)], axis=1).astype(np.int32) for part in inner]
    inner_count = len(tree) - len(jobs.tree)
    start = np.concatenate([len(subtrees.nodes) + np.arange(inner_count), subtrees.node_start])[order]
    length = np.concatenate([np.ones(inner_count, np.int64), subtrees.node_count])[order]
    nodes = np.concatenate([subtrees.nodes, *split])[spread_runs(start, length)]
    job = order[order >= inner_count] - inner_count
    entries = subtrees.entries[spread_runs(subtrees.entry_start[job], subtrees.entry_count[job])]
    return nodes, np.repeat(tree[order], length), entries


def _breadth_first(of_tree: Ints, depth: NDArray[np.int32]) -> Ints:
    """The order by tree and depth, in which nodes of one depth stay from left to right."""
    key = of_tree * 64 + depth
    # NumPy sorts keys of 16 bits by radix.
    return np.argsort(key.astype(np.uint16) if key.max() < 1 << 16 else key, kind="stable")
