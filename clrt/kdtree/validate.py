"""The proof that a kd-tree is right: its structure and its cells here, that no triangle is missing in coverage.py."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.kdtree.arrays import LEAF, TreeArrays
from clrt.kdtree.coverage import check_coverage, entry_keys, stray_references
from clrt.kdtree.overlap import F64, Bools

Ints = NDArray[np.int64]


def validate(tree: TreeArrays, vertices: F64, max_depth: int | None = None) -> int:
    """Raise ValueError with the first fault found; return the number of stray references."""
    _check_arrays(tree, vertices)
    _check_structure(tree, max_depth)
    _check_leaves(tree, len(vertices))
    _check_planes(tree)
    check_coverage(tree, vertices)
    return stray_references(tree, vertices)


def _require(holds: Bools | bool, message: str) -> None:
    """Raise ValueError unless `holds` everywhere; `{0}` in the message becomes the first index where it does not."""
    failing = np.flatnonzero(~np.atleast_1d(holds))
    if failing.size:
        raise ValueError("kd-tree: " + message.format(int(failing[0])))


def _check_arrays(tree: TreeArrays, vertices: F64) -> None:
    """Shapes, dtypes, and bounds that hold all triangles."""
    m = len(tree.split_axis)
    _require(m > 0, "no root node")
    dtypes = {"split_axis": np.uint8, "split_pos": np.float32, "child": np.int32, "count": np.int32, "indices": np.int32}
    for name, dtype in dtypes.items():
        array = getattr(tree, name)
        fits = array.ndim == 1 and array.dtype == dtype
        _require(fits, f"{name} is {array.dtype} of {array.ndim} dimensions, not a list of {dtype.__name__}")
        _require(name == "indices" or len(array) == m, f"{name} has {len(array)} entries for {m} nodes")
    _require(vertices.ndim == 3 and vertices.shape[1:] == (3, 3), f"vertices have shape {vertices.shape}, not (n, 3, 3)")
    _require(bool(np.isfinite([tree.lo, tree.hi]).all()), "bounds are not finite")
    within: Bools = np.all((vertices >= tree.lo) & (vertices <= tree.hi), axis=(1, 2))
    _require(within, "triangle {0} is not within the bounds of the tree")


def _check_structure(tree: TreeArrays, max_depth: int | None) -> None:
    """Children in breadth-first pairs, each node reached once, and the depth as stated."""
    _require(tree.split_axis <= LEAF, "node {0} has a split axis above 3")
    inner = np.flatnonzero(tree.split_axis != LEAF)
    m = len(tree.split_axis)
    _require(m == 1 + 2 * len(inner), f"{len(inner)} inner nodes call for {1 + 2 * len(inner)} nodes, there are {m}")
    child = np.where(tree.split_axis != LEAF, tree.child, m)
    expected = np.full(m, m)
    expected[inner] = 1 + 2 * np.arange(len(inner))
    _require(child == expected, "the children of node {0} are not the next pair in breadth-first order")
    _require(child > np.arange(m), "node {0} has a child that does not come after it")
    _require((tree.split_axis == LEAF) | (tree.count == 0), "inner node {0} has a triangle count")
    depth = len(_levels(tree)) - 1
    _require(tree.depth == depth, f"depth is given as {tree.depth}, its deepest leaf is at {depth}")
    _require(max_depth is None or depth <= max_depth, f"depth {depth} is beyond the limit {max_depth}")


def _levels(tree: TreeArrays) -> list[Ints]:
    """Node numbers of each depth."""
    levels = [np.zeros(1, np.int64)]
    while True:
        inner = levels[-1][tree.split_axis[levels[-1]] != LEAF]
        if not inner.size:
            return levels
        levels.append((tree.child[inner].astype(np.int64)[:, None] + np.arange(2)).ravel())


def _check_leaves(tree: TreeArrays, triangles: int) -> None:
    """Leaf ranges partition `indices`; entries are triangles, each at most once a leaf."""
    leaves = np.flatnonzero(tree.split_axis == LEAF)
    first, count = tree.child[leaves].astype(np.int64), tree.count[leaves].astype(np.int64)
    size = len(tree.indices)
    bad = (count < 0) | (first < 0) | (first + count > size)
    _require(not bad.any(), f"the range of leaf {leaves[bad.argmax()]} leaves the {size} indices")
    order = np.lexsort((count, first))
    ends = first[order] + count[order]
    tiles = np.array_equal(first[order], np.concatenate([[0], ends[:-1]])) and ends[-1] == size
    _require(tiles, f"the ranges of the leaves overlap or leave gaps in the {size} indices")
    _require((tree.indices >= 0) & (tree.indices < triangles), f"indices[{{0}}] is not one of the {triangles} triangles")
    keys = np.sort(entry_keys(tree, triangles))
    twice = np.flatnonzero(keys[1:] == keys[:-1])
    if twice.size:
        leaf, triangle = divmod(int(keys[twice[0]]), triangles)
        _require(False, f"leaf {leaf} has triangle {triangle} twice")


def _check_planes(tree: TreeArrays) -> None:
    """Each split lies strictly inside the cell of its node."""
    lo, hi = tree.cells()
    node, axis = np.arange(len(lo)), np.where(tree.split_axis == LEAF, 0, tree.split_axis)
    inside = (tree.split_pos > lo[node, axis]) & (tree.split_pos < hi[node, axis])
    _require((tree.split_axis == LEAF) | inside, "the split of node {0} is not strictly inside its cell")
