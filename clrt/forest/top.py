"""The large nodes of many trees, a level at a time: their references are cut into chunks, each the work of one work-item.

The device counts, sorts and clips; what is one number a node (which split, where its children go) is worked out here, by the functions
of the NumPy builder. Everything is decided by counts and exact bounds, so that neither threads nor the sizes of chunks change a tree.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.forest.machine import Machine, Store, roomy
from clrt.forest.pool import Jobs, Pool
from clrt.forest.ticker import LARGE
from clrt.kdtree.arrays import LEAF
from clrt.kdtree.binning import LEAST_BINS, MOST_BINS, Cells, Splits, bin_scales, splits_of_counts
from clrt.kdtree.common import F32, Bools, Ints, child_cells, starts_of
from clrt.kdtree.sah import EMPTY_BONUS
from clrt.kdtree.tree import TRAVERSAL_COST

_CHUNK = 4096  #: references of a chunk

Codes = NDArray[np.uint64]


@dataclass
class Nodes(Cells):
    """Nodes of one depth, those of one tree side by side and from left to right.

    tree, code : (m,); the path from the root as bits from the top, 1 for up. tight_lo, tight_hi : (3, m) bounds of the references.
    """

    tree: Ints
    code: Codes
    tight_lo: F32
    tight_hi: F32

    def take(self, which: Ints | Bools) -> Nodes:
        """Those nodes, in that order."""
        return Nodes(
            self.count[which], self.cell_lo[:, which], self.cell_hi[:, which], self.tree[which], self.code[which],
            self.tight_lo[:, which], self.tight_hi[:, which],
        )  # fmt: skip


@dataclass
class Inner:
    """Inner nodes of one depth: their tree, path, split axis and plane."""

    tree: Ints
    code: Codes
    depth: int
    axis: Ints
    position: F32


@dataclass
class Chunks:
    """Runs of references, those of a node one after another. table : (k, 3) int32 start, count, node; first : (m,) of each node."""

    table: NDArray[np.int32]
    first: Ints

    @staticmethod
    def of(starts: Ints, counts: Ints) -> Chunks:
        """Chunks of runs that are not empty."""
        chunks = -(-counts // _CHUNK)
        first, node = starts_of(chunks), np.repeat(np.arange(len(counts)), chunks)
        offset = (np.arange(len(node)) - first[node]) * _CHUNK
        table = np.stack([starts[node] + offset, np.minimum(counts[node] - offset, _CHUNK), node], axis=1)
        return Chunks(table.astype(np.int32), first)

    def least(self, boxes: F32) -> F32:
        """(3, ...) from (k, ..., 3): the least of each node's chunks, flattened but for the axis."""
        return np.ascontiguousarray(np.minimum.reduceat(boxes, self.first).reshape(-1, 3).T)

    def greatest(self, boxes: F32) -> F32:
        """The same for the greatest."""
        return np.ascontiguousarray(np.maximum.reduceat(boxes, self.first).reshape(-1, 3).T)


class Top:
    """Trees over `counts` consecutive triangles each, none over none: their large nodes; everything smaller goes to the pool.

    lo, hi : (trees, 3) float64 bounds of each tree. inner : what was split so far.
    """

    def __init__(self, machine: Machine, vertices: Any, counts: Ints, limits: Ints, pool: Pool) -> None:
        self.machine, self.vertices, self.counts, self.limits, self.pool = machine, vertices, counts, limits, pool
        self.inner: list[Inner] = []
        self.depth = 0
        large = (counts > LARGE) & (limits > 0)
        self._level = Store(machine, int(counts[large].sum()))
        self._next: Store | None = None
        roots = self._roots(large)
        self._wait(roots.take(~large), np.zeros(np.count_nonzero(~large), np.int64), limits[~large])
        self._nodes = roots.take(large)

    def build(self) -> None:
        """Split large nodes until there are none. Raises LimitError."""
        while len(self._nodes.count):
            self._split_level()
            self.pool.ticker.level_done()

    def _roots(self, large: Bools) -> Nodes:
        """All roots; their references go to the level's store and to the pool."""
        machine, counts = self.machine, self.counts
        starts = starts_of(counts)
        chunks = Chunks.of(starts, counts)
        k, node = len(chunks.table), chunks.table[:, 2]
        self.pool.make_room(int(counts[~large].sum()))
        at = self._places(counts, large)[node] + chunks.table[:, 0] - starts[node]
        places = machine.upload(coded_places(at, large[node]))
        boxes, exact = machine.empty(k * 24), machine.empty(k * 48)
        machine.run(
            "build_roots", k, self.vertices, machine.upload(chunks.table), places, *self._level.arguments, *self.pool.store.arguments,
            boxes, exact,
        )  # fmt: skip
        tight, bounds = machine.read(boxes, (k, 6), np.float32), machine.read(exact, (k, 6), np.float64)
        self.lo = np.minimum.reduceat(bounds[:, :3], chunks.first)
        self.hi = np.maximum.reduceat(bounds[:, 3:], chunks.first)
        lo, hi = chunks.least(tight[:, :3]), chunks.greatest(tight[:, 3:])
        trees = np.arange(len(counts))
        return Nodes(counts, lo.astype(np.float64), hi.astype(np.float64), trees, np.zeros(len(counts), np.uint64), lo, hi)

    def _places(self, counts: Ints, large: Bools) -> Ints:
        """Where the references of each node begin: large ones in the level's store, others in the pool, whose room is made."""
        in_level, in_pool = np.where(large, counts, 0), np.where(large, 0, counts)
        return np.where(large, np.cumsum(in_level) - in_level, self.pool.used + np.cumsum(in_pool) - in_pool)

    def _wait(self, nodes: Nodes, depth: Ints, limits: Ints) -> None:
        """Hand nodes to the pool, in the order in which their references come to it."""
        start = self.pool.used + np.cumsum(nodes.count) - nodes.count
        cell = np.concatenate([nodes.cell_lo, nodes.cell_hi]).T.astype(np.float32)
        self.pool.add(Jobs(start, nodes.count, nodes.tree, nodes.code, depth, limits, 4 * self.counts[nodes.tree], cell))

    def _split_level(self) -> None:
        """Split all nodes, sort their references to their children, which become the next nodes or go to the pool."""
        nodes = self._nodes
        work = _Work(self.machine, self.vertices, self._level, nodes.count)
        splits = self._best_splits(nodes, work)
        inner = np.asarray(splits.cost < nodes.count)
        self.inner.append(Inner(nodes.tree[inner], nodes.code[inner], self.depth, splits.axis[inner], splits.position[inner]))
        children = _children(nodes, splits, self.depth)
        children.count = work.sort(nodes, splits, inner).ravel()
        # A node that stays a leaf has all its references below: its lower child stands for it, its upper one is none.
        whole = np.repeat(~inner, 2)
        large = (children.count > LARGE) & (self.limits[children.tree] > self.depth + 1) & ~whole
        self.pool.make_room(int(children.count[~large].sum()))
        self._next = roomy(self.machine, self._next, int(children.count[large].sum()))
        children.tight_lo, children.tight_hi = work.scatter(self._places(children.count, large), large, self._next, self.pool.store)
        small = ~large & ~(whole & (np.arange(len(whole)) % 2 == 1))
        depth = self.depth + 1 - whole
        self._wait(children.take(small), depth[small], np.where(whole, depth, self.limits[children.tree])[small])
        self.depth += 1
        self._level, self._next, self._nodes = self._next, self._level, children.take(large)

    def _best_splits(self, nodes: Nodes, work: _Work) -> Splits:
        """The best split of each node. Nodes of small trees may have fewer bins."""
        bins = np.clip(4 * self.counts[nodes.tree] >> self.depth, LEAST_BINS, MOST_BINS)
        counts = work.count_bins(nodes, bins)
        m = len(bins)
        best = Splits(np.empty(m, np.float32), np.empty(m, np.int64), np.empty(m, np.float32), np.empty(m, bool))
        for value in np.unique(bins):
            some = bins == value
            part, columns = nodes.take(some), counts[some, :, :, : value + 2]
            found = splits_of_counts(
                part, part.tight_lo, part.tight_hi, ((columns[:, a, 0], columns[:, a, 1]) for a in range(3)), TRAVERSAL_COST, EMPTY_BONUS
            )
            for field in fields(Splits):
                getattr(best, field.name)[some] = getattr(found, field.name)
        return best


class _Work:
    """The launches of one level: nodes whose references lie one after another in a store."""

    def __init__(self, machine: Machine, vertices: Any, store: Store, counts: Ints) -> None:
        self.machine, self.store, self.vertices = machine, store, vertices
        self.chunks = Chunks.of(starts_of(counts), counts)
        self.size, self.references = len(self.chunks.table), int(counts.sum())
        self._table = machine.upload(self.chunks.table)
        self._sorted: tuple[Any, ...] = ()
        self._went = np.zeros((0, 2), np.int64)

    def count_bins(self, nodes: Nodes, bins: Ints) -> Ints:
        """(m, axes, 2, bins + 2): how many references begin and end in each bin, bin k in column k + 1."""
        machine = self.machine
        scales = np.stack([nodes.tight_lo, *bin_scales(nodes.tight_lo, nodes.tight_hi, bins)]).transpose(2, 1, 0)
        counts = machine.empty(self.size * 24 * (MOST_BINS + 2))
        machine.run("build_bins", self.size, self._table, self.store.bounds, self.store.rows, machine.upload(scales), counts)
        of_chunks = machine.read(counts, (self.size, 3, 2, MOST_BINS + 2), np.int32)
        return np.asarray(np.add.reduceat(of_chunks, self.chunks.first, dtype=np.int64))

    def sort(self, nodes: Nodes, splits: Splits, inner: Bools) -> Ints:
        """(m, 2): how many references of each node go to its children."""
        machine = self.machine
        words = np.stack([np.where(inner, splits.axis, LEAF), splits.flats_up], axis=1).astype(np.int32)
        cells = np.concatenate([nodes.cell_lo, nodes.cell_hi, splits.position[None]]).T.astype(np.float32)
        self._sorted = (
            self.vertices, self._table, *self.store.arguments, machine.upload(words), machine.upload(cells), machine.empty(self.references)
        )  # fmt: skip
        sizes = machine.empty(self.size * 8)
        machine.run("build_sides", self.size, *self._sorted, sizes)
        self._went = machine.read(sizes, (self.size, 2), np.int32).astype(np.int64)
        return np.asarray(np.add.reduceat(self._went, self.chunks.first))

    def scatter(self, places: Ints, large: Bools, level: Store, pool: Store) -> tuple[F32, F32]:
        """Move the references to their children's places (2 m); the bounds of these, lo and hi : (3, 2 m)."""
        machine, node = self.machine, self.chunks.table[:, 2]
        before = np.cumsum(self._went, axis=0) - self._went
        at = places.reshape(-1, 2)[node] + before - before[self.chunks.first][node]
        boxes = machine.empty(self.size * 48)
        machine.run(
            "build_scatter", self.size, *self._sorted, machine.upload(coded_places(at, large.reshape(-1, 2)[node])),
            *level.arguments, *pool.arguments, boxes,
        )  # fmt: skip
        found = machine.read(boxes, (self.size, 2, 6), np.float32)
        return self.chunks.least(found[..., :3]), self.chunks.greatest(found[..., 3:])


def coded_places(at: Ints, large: Bools) -> NDArray[np.int32]:
    """As the kernels take them: places in the level's store as they are, those in the pool negative."""
    return np.where(large, at, ~at).astype(np.int32)


def _children(nodes: Nodes, splits: Splits, depth: int) -> Nodes:
    """The children of nodes at `depth`, pair by pair, without counts and bounds."""
    cell_lo, cell_hi = child_cells(nodes.cell_lo, nodes.cell_hi, splits.axis, splits.position)
    code = np.repeat(nodes.code, 2)
    code[1::2] |= np.uint64(1 << (62 - depth))
    nothing = np.zeros((3, 0), np.float32)
    return Nodes(np.zeros(0, np.int64), cell_lo, cell_hi, np.repeat(nodes.tree, 2), code, nothing, nothing)
