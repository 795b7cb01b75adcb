"""The launches that build whole subtrees, and run again where memory was too small."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.forest.machine import Machine, Store
from clrt.kdtree.common import F32, Ints

_ROOM = 6  #: memory of a work-item, as a multiple of the references of its largest job: about twice what meshes need
_SPARE = 1024  #: references, nodes and entries more than that
_WORDS = 10  #: of memory a reference: seven rows of the stack, two words of a node, one entry
_DONE_WORDS = 4  #: of a job's report: first node, nodes, first entry, entries
_TOO_SMALL = -1  #: in place of a number of nodes: the work-item's memory was too small; -2: the output was

Words = NDArray[np.int32]


@dataclass
class Subtrees:
    """What became of jobs: the run of each in the nodes and in the leaves' entries of all.

    node_start, node_count, entry_start, entry_count : (jobs,)
    nodes : (n, 2), preorder: depth << 2 | axis, 3 for a leaf; bits of the plane, or number of triangles
    entries : triangle numbers, leaf by leaf
    """

    node_start: Ints
    node_count: Ints
    entry_start: Ints
    entry_count: Ints
    nodes: Words
    entries: Words


def joined(parts: list[Subtrees]) -> Subtrees:
    """Parts one after another, as one."""
    nodes = np.cumsum([0, *(len(part.nodes) for part in parts)])
    entries = np.cumsum([0, *(len(part.entries) for part in parts)])
    return Subtrees(
        np.concatenate([part.node_start + start for part, start in zip(parts, nodes, strict=False)]),
        np.concatenate([part.node_count for part in parts]),
        np.concatenate([part.entry_start + start for part, start in zip(parts, entries, strict=False)]),
        np.concatenate([part.entry_count for part in parts]),
        np.concatenate([part.nodes for part in parts]),
        np.concatenate([part.entries for part in parts]),
    )


class SubtreeBuilder:
    """Runs jobs on the device; keeps its buffers from one batch to the next."""

    def __init__(self, machine: Machine, vertices: Any) -> None:
        self.machine, self.vertices = machine, vertices
        self._buffers: dict[str, tuple[int, Any]] = {}

    def run(self, table: Words, cells: F32, pool: Store) -> Subtrees:
        """Build below each job, however much memory that takes.

        table : (jobs, 5) start and number of references in the pool, depth, depth limit, bins at depth 0; cells : (jobs, 6).
        Raises LimitError where the device has too little memory.
        """
        counts = table[:, 1].astype(np.int64)
        at_once = table[:, 2] == table[:, 3]  # becomes a leaf, which needs no more room than its references
        size = int(max(_ROOM * counts[~at_once].max(initial=0), counts.max())) + _SPARE
        room = np.array([1, 3]) * int(counts.sum()) + _SPARE + 4 * len(table)
        done = np.zeros((len(table), _DONE_WORDS), np.int64)
        all_nodes: list[Words] = []
        all_entries: list[Words] = []
        pending, node_total, entry_total = np.arange(len(table)), 0, 0
        while pending.size:
            report, taken, nodes, entries = self._launch(table[pending], cells[pending], pool, size, room)
            done[pending] = report
            done[pending, 0] += node_total
            done[pending, 2] += entry_total
            all_nodes.append(nodes)
            all_entries.append(entries)
            node_total, entry_total = node_total + len(nodes), entry_total + len(entries)
            if (report[:, 1] == _TOO_SMALL).any():
                size *= 2
            room = np.maximum(room, taken)
            pending = pending[report[:, 1] < 0]
        return Subtrees(done[:, 0], done[:, 1], done[:, 2], done[:, 3], np.concatenate(all_nodes), np.concatenate(all_entries))

    def _launch(self, table: Words, cells: F32, pool: Store, size: int, room: Ints) -> tuple[Ints, Ints, Words, Words]:
        """One launch: each job's report, how many nodes and entries room was wanted for, and both."""
        machine = self.machine
        workers = min(machine.workers, len(table))
        memory = self._buffer("memory", workers * size * _WORDS * 4)
        nodes, entries = self._buffer("nodes", int(room[0]) * 8), self._buffer("entries", int(room[1]) * 4)
        taken, done = machine.upload(np.zeros(3, np.int32)), machine.empty(len(table) * _DONE_WORDS * 4)
        machine.run(
            "build_subtrees", workers, self.vertices, machine.upload(table), machine.upload(cells), len(table), *pool.arguments,
            memory, size, taken, nodes, int(room[0]), entries, int(room[1]), done,
        )  # fmt: skip
        wanted = machine.read(taken, 3, np.int32)[1:].astype(np.int64)
        there = np.minimum(wanted, room)
        report = machine.read(done, (len(table), _DONE_WORDS), np.int32).astype(np.int64)
        return report, wanted, machine.read(nodes, (int(there[0]), 2), np.int32), machine.read(entries, int(there[1]), np.int32)

    def _buffer(self, name: str, size: int) -> Any:
        """A buffer of at least `size` bytes, the one of the last batch if it is large enough."""
        kept = self._buffers.pop(name, (0, None))
        if kept[0] < size:
            kept = (size, self.machine.empty(size))
        self._buffers[name] = kept
        return kept[1]
