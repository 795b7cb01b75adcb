"""Trees of many objects as the arrays of one: what is done to all of them is then done at once, however small each is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.errors import LimitError
from clrt.kdtree.arrays import LEAF
from clrt.kdtree.tree import KdTree

MOST_NODES = 1 << 27  #: of all trees together


@dataclass(frozen=True, eq=False)
class JoinedTrees:
    """The nodes of one tree after those of the other, as TreeArrays has them, but for numbers, which are those of the joined arrays.

    child : (m,) int32, of nodes and of places in `indices`; indices : (r,), of triangles of all objects in a row
    roots : (trees,) int64; triangles : of all objects
    """

    split_axis: NDArray[np.uint8]
    split_pos: NDArray[np.float32]
    child: NDArray[np.int32]
    count: NDArray[np.int32]
    indices: NDArray[np.int32]
    roots: NDArray[np.int64]
    triangles: int


def join(trees: Sequence[KdTree], counts: Sequence[int]) -> JoinedTrees:
    """The trees over `counts` triangles each. Raises LimitError where a child's number has no room."""
    nodes = np.array([len(tree.split_axis) for tree in trees], np.int64)
    if nodes.sum() > MOST_NODES:
        raise LimitError(f"the trees of the scene have more than {MOST_NODES:,} nodes; leave some of its triangles out")
    entries, triangles = np.array([len(tree.indices) for tree in trees], np.int64), np.array(counts, np.int64)
    axis = in_a_row([tree.split_axis for tree in trees], np.uint8)
    child = in_a_row([tree.child for tree in trees], np.int32)
    indices = in_a_row([tree.indices for tree in trees], np.int32)
    if len(trees) > 1:  # of a single tree the numbers stay
        child = child + np.where(axis == LEAF, _shifts(entries, nodes), _shifts(nodes, nodes))
        indices = indices + _shifts(triangles, entries)
    return JoinedTrees(
        split_axis=axis,
        split_pos=in_a_row([tree.split_pos for tree in trees], np.float32),
        child=child,
        count=in_a_row([tree.count for tree in trees], np.int32),
        indices=indices,
        roots=np.cumsum(nodes) - nodes,
        triangles=int(triangles.sum()),
    )


def in_a_row(arrays: Sequence[NDArray[Any]], dtype: type[np.generic], shape: tuple[int, ...] = ()) -> NDArray[Any]:
    """All arrays (n, *shape) as one; a single one as it is, without a copy."""
    if len(arrays) == 1:
        return arrays[0]
    return np.concatenate([np.zeros((0, *shape), dtype), *arrays])


def _shifts(sizes: NDArray[np.int64], repeats: NDArray[np.int64]) -> NDArray[np.int32]:
    """Where each part begins, `repeats` times."""
    return np.repeat((np.cumsum(sizes) - sizes).astype(np.int32), repeats)
