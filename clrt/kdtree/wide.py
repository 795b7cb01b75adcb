"""kd-trees made wide, for single rays: nodes of many children over blocks of triangles, each tested by one vector.

Subtrees of as many triangles as a block has room for become blocks. Of what lies above, each node takes in descendants so that rays are
expected to visit few nodes (Wald, Benthin and Boulos, 2008). The planes of the kd-tree order the children from near to far by octant of the
ray's direction. Boxes are those of whole triangles, so they may overlap; none is missed for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clrt.kdtree.joined import JoinedTrees
from clrt.kdtree.parted import FloatArray, Ints, PartedTree, part


@dataclass(frozen=True, eq=False)
class WideTree:
    """The first nodes are the roots of all trees, one each.

    lo, hi : (nodes, width, 3) float64 boxes of the children; lo > hi where there is none
    child : (nodes, width) another node, or -1 - a block; -1 where there is none: block 0 is empty
    order : (nodes, width, 8) children from near to far, by octant
    blocks : (blocks, width) triangles, -1 where there is none
    depth : levels of nodes
    """

    lo: FloatArray
    hi: FloatArray
    child: Ints
    order: Ints
    blocks: Ints
    depth: int


@dataclass(frozen=True, eq=False)
class _Boxed:
    """A parted tree with the box (m, 3) of each node down to the blocks, and the block of each node that is one, else 0 (m,)."""

    tree: PartedTree
    lo: FloatArray
    hi: FloatArray
    block: Ints


def widen(tree: JoinedTrees, counts: Ints, lo: FloatArray, hi: FloatArray, width: int) -> WideTree:
    """The wide trees over triangles, `counts` of each kd-tree, with the boxes lo, hi (n, 3), in the coordinates of their kd-trees."""
    if not len(lo):
        return _empty(len(counts), width)
    parted, order = part(tree, counts, lo / 2.0 + hi / 2.0, width)
    places = parted.positions()
    tops = _tops(parted, places[:, 0], width)
    boxed = _boxed(parted, tops, lo[order], hi[order])
    nodes, child, depth = _collapsed(boxed, width)
    there = nodes >= 0
    blocks = np.full((len(tops) + 1, width), -1)
    filled = np.arange(width) < parted.count[tops, None]
    blocks[1:][filled] = order  # blocks have the triangles in order, and all of them
    return WideTree(
        lo=np.where(there[..., None], boxed.lo[nodes], np.inf),
        hi=np.where(there[..., None], boxed.hi[nodes], -np.inf),
        child=child,
        order=np.argsort(np.where(there[..., None], places[nodes], len(lo)), axis=1, kind="stable"),
        blocks=blocks,
        depth=depth,
    )


def _empty(trees: int, width: int) -> WideTree:
    none = np.full((trees, width, 3), np.inf)
    return WideTree(none, -none, np.full((trees, width), -1), np.zeros((trees, width, 8), np.int64), np.full((1, width), -1), 1)


def _tops(parted: PartedTree, first: Ints, width: int) -> Ints:
    """The nodes that become blocks, in the order of their triangles: the topmost ones with at most `width`."""
    small = parted.count <= width
    below = np.zeros(len(small), bool)
    for level in parted.levels:
        lower = parted.child[level]
        below[lower] = below[lower + 1] = small[level]
    tops = np.flatnonzero(small & ~below & (parted.count > 0))
    return tops[np.argsort(first[tops])]


def _boxed(parted: PartedTree, tops: Ints, lo: FloatArray, hi: FloatArray) -> _Boxed:
    """lo, hi : (n, 3) boxes of the triangles in order."""
    nodes = len(parted.count)
    starts = np.cumsum(parted.count[tops]) - parted.count[tops]
    box_lo, box_hi, block = np.full((nodes, 3), np.inf), np.full((nodes, 3), -np.inf), np.zeros(nodes, np.int64)
    if len(tops):
        box_lo[tops], box_hi[tops] = np.minimum.reduceat(lo, starts), np.maximum.reduceat(hi, starts)
    block[tops] = np.arange(1, len(tops) + 1)
    for level in reversed(parted.levels):
        level = level[block[level] == 0]
        lower = parted.child[level]
        box_lo[level] = np.minimum(box_lo[lower], box_lo[lower + 1])
        box_hi[level] = np.maximum(box_hi[lower], box_hi[lower + 1])
    return _Boxed(parted, box_lo, box_hi, block)


def _collapsed(boxed: _Boxed, width: int) -> tuple[Ints, Ints, int]:
    """(nodes, width): which node of the tree below each child is, -1 for none; the numbers of children as WideTree has them; the depth."""
    shares = _shares(boxed, width)
    roots, rows, children, depth = boxed.tree.roots, [], [], 0
    done = 0
    while len(roots):
        taken = _descendants(boxed, shares, roots, width)
        done, depth = done + len(roots), depth + 1
        inner = (taken >= 0) & (boxed.block[taken] == 0)
        numbers = np.where(taken >= 0, -1 - boxed.block[taken], -1)
        numbers[inner] = done + np.arange(np.count_nonzero(inner))
        rows.append(taken)
        children.append(numbers)
        roots = taken[inner]
    return np.concatenate(rows), np.concatenate(children), depth


def _shares(boxed: _Boxed, width: int) -> Ints:
    """(m, width + 1): how many of k places the lower child of a node gets where its triangles may take k, 0 where it takes one as a node
    of its own; [:, 0]: how many of `width`, once it is one.

    The expected number of nodes that a random line visits is least (Goldsmith and Salmon, 1987: a node's share of lines is its area's),
    from the blocks up, by dynamic programming (Ylitie, Karras and Laine, 2017).
    """
    tree, size = boxed.tree, np.maximum(boxed.hi - boxed.lo, 0.0)
    area = size[:, 0] * size[:, 1] + size[:, 1] * size[:, 2] + size[:, 2] * size[:, 0]
    area /= np.maximum(area[_roots(tree)], np.finfo(np.float64).tiny)
    visits, shares = np.zeros((len(area), width + 1)), np.zeros((len(area), width + 1), np.int64)
    for level in reversed(tree.levels):
        level = level[(boxed.block[level] == 0) & (tree.count[level] > 0)]
        lower = tree.child[level]
        parted, share = np.full((len(level), width + 1), np.inf), np.zeros((len(level), width + 1), np.int64)
        for places in range(2, width + 1):
            sums = visits[lower, 1:places] + visits[lower + 1, places - 1 : 0 : -1]
            share[:, places] = 1 + sums.argmin(axis=1)
            parted[:, places] = sums[np.arange(len(level)), share[:, places] - 1]
        alone = area[level] + parted[:, width]
        whole = alone[:, None] <= parted
        shares[level], shares[level, 0] = np.where(whole, 0, share), share[:, width]
        visits[level] = np.where(whole, alone[:, None], parted)
        for empty, other in ((lower, lower + 1), (lower + 1, lower)):
            visits[level] = np.where(tree.count[empty, None] == 0, visits[other], visits[level])
    return shares


def _roots(tree: PartedTree) -> Ints:
    """(m,): of each node the root above it."""
    above = np.arange(len(tree.count))
    for level in tree.levels:
        lower = tree.child[level]
        above[lower] = above[lower + 1] = above[level]
    return above


def _contracted(boxed: _Boxed, nodes: Ints) -> Ints:
    """Each node, or the one below it that has all of its triangles."""
    tree, nodes = boxed.tree, nodes.copy()
    while True:
        inner = np.flatnonzero(boxed.block[nodes] == 0)
        lower = tree.child[nodes[inner]]
        alone = (tree.count[lower] == 0) | (tree.count[lower + 1] == 0)
        if not alone.any():
            return nodes
        nodes[inner[alone]] = lower[alone] + (tree.count[lower[alone]] == 0)


def _descendants(boxed: _Boxed, shares: Ints, roots: Ints, width: int) -> Ints:
    """(k, width) of k nodes the descendants that become their children, -1 where there are fewer."""
    taken = np.full((len(roots), width), -1)
    row = np.flatnonzero(boxed.tree.count[roots])  # a tree without triangles has no children
    column, places = np.zeros(len(row), np.int64), np.full(len(row), width)
    nodes = _contracted(boxed, roots[row])
    share = shares[nodes, 0]
    while row.size:
        ends = (share == 0) | (boxed.block[nodes] > 0)
        taken[row[ends], column[ends]] = nodes[ends]
        row, column, places, nodes, share = (values[~ends] for values in (row, column, places, nodes, share))
        lower = boxed.tree.child[nodes]
        row, column = np.concatenate([row, row]), np.concatenate([column, column + share])
        places = np.concatenate([share, places - share])
        nodes = _contracted(boxed, np.concatenate([lower, lower + 1]))
        share = shares[nodes, places]
    return taken
