"""Nodes of few references wait in a pool on the device until there are many of them, then everything below them is built."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.forest.machine import Machine, Store, roomy
from clrt.forest.subtrees import SubtreeBuilder, Subtrees, joined
from clrt.forest.ticker import Ticker
from clrt.kdtree.common import F32, Ints

_BATCH = 1 << 19  #: references a launch: some tenths of a second, so that Ctrl-C and progress come between launches


@dataclass
class Jobs:
    """Nodes whose references are in the pool; all arrays have one entry a job.

    start, count : their references. tree, code, depth : where they are: the path from the root as bits from the top, 1 for up.
    limit : no leaf is deeper. bins : at depth 0 of their tree. cell : (jobs, 6), lo and hi.
    """

    start: Ints
    count: Ints
    tree: Ints
    code: NDArray[np.uint64]
    depth: Ints
    limit: Ints
    bins: Ints
    cell: F32

    def take(self, which: Ints) -> Jobs:
        """Those jobs, in that order."""
        return Jobs(*(getattr(self, field.name)[which] for field in fields(self)))

    @staticmethod
    def joined(parts: list[Jobs]) -> Jobs:
        """Parts one after another, as one."""
        return Jobs(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Jobs)))


class Pool:
    """The references of waiting jobs, and what was built."""

    def __init__(self, machine: Machine, vertices: Any, rows: int, ticker: Ticker) -> None:
        self.machine, self.ticker = machine, ticker
        self.store = Store(machine, rows)
        self.used = 0
        self._builder = SubtreeBuilder(machine, vertices)
        self._waiting: list[Jobs] = []
        self._built: list[tuple[Jobs, Subtrees]] = []

    def make_room(self, rows: int) -> None:
        """Room for so many references more, if need be by building what waits. Raises LimitError."""
        if self.used + rows > self.store.rows:
            self.flush()
            self.store = roomy(self.machine, self.store, rows)

    def add(self, jobs: Jobs) -> None:
        """Jobs whose references lie in the pool from `used` on, or will once the device has come to it."""
        if len(jobs.count):
            self._waiting.append(jobs)
        self.used += int(jobs.count.sum())

    def flush(self) -> None:
        """Build all that waits; the pool is empty then. Raises LimitError."""
        if not self._waiting:
            return
        jobs = Jobs.joined(self._waiting)
        self._waiting, self.used = [], 0
        # The largest first: what is left for the end is small, so that no core waits long.
        jobs = jobs.take(np.argsort(-jobs.count, kind="stable"))
        table = np.stack([jobs.start, jobs.count, jobs.depth, jobs.limit, jobs.bins], axis=1).astype(np.int32)
        last_of_batch = np.flatnonzero(np.diff(np.cumsum(jobs.count) // _BATCH))
        for batch in np.split(np.arange(len(table)), last_of_batch + 1):
            self._built.append((jobs.take(batch), self._builder.run(table[batch], jobs.cell[batch], self.store)))
            self.ticker.grew(int(jobs.count[batch].sum()))

    def results(self) -> tuple[Jobs, Subtrees]:
        """All jobs there were, and their subtrees."""
        jobs, subtrees = zip(*self._built, strict=True)
        self._built = []
        return Jobs.joined(list(jobs)), joined(list(subtrees))
