"""Times of contenders that take turns, so that what else the machine does falls on all of them alike."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Series:
    """The times of one contender, seconds of wall time, in the order of the rounds; the warm-up is not among them."""

    seconds: tuple[float, ...]

    @property
    def best(self) -> float:
        """The least: what the machine can do when nothing comes between."""
        return min(self.seconds)

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)

    def to_json(self) -> dict[str, Any]:
        """best, median, and every time, in seconds."""
        return {"best": self.best, "median": self.median, "all": list(self.seconds)}


def interleave(
    contenders: Mapping[str, Callable[[], object]],
    rounds: int,
    *,
    warm_ups: int = 1,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, Series]:
    """Run A B C A B C ...: `warm_ups` rounds that are not kept, then `rounds` that are. Raises ValueError for no rounds."""
    if rounds < 1:
        raise ValueError(f"{rounds} rounds measure nothing; give 1 or more")
    taken: dict[str, list[float]] = {name: [] for name in contenders}
    for turn in range(warm_ups + rounds):
        for name, run in contenders.items():
            start = clock()
            run()
            seconds = clock() - start
            if turn >= warm_ups:
                taken[name].append(seconds)
    return {name: Series(tuple(seconds)) for name, seconds in taken.items()}
