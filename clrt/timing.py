"""Times of contenders that take turns, so that what else the machine does falls on all of them alike."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any


class Told(float):
    """Seconds that a contender in a process of its own tells: taken in place of the clock's, which would count the asking, too."""


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
    before: int = 0,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, Series]:
    """Run A B C A B C ...: `warm_ups` rounds that are not kept, then `rounds` that are; a contender may return `Told` seconds.

    before : runs of a contender in its turn that are not timed: after them it finds its own data in the caches, not what the others left

    Raises ValueError for no rounds.
    """
    if rounds < 1:
        raise ValueError(f"{rounds} rounds measure nothing; give 1 or more")
    taken: dict[str, list[float]] = {name: [] for name in contenders}
    for turn in range(warm_ups + rounds):
        for name, run in contenders.items():
            for _ in range(before):
                run()
            start = clock()
            told = run()
            seconds = float(told) if isinstance(told, Told) else clock() - start
            if turn >= warm_ups:
                taken[name].append(seconds)
    return {name: Series(tuple(seconds)) for name, seconds in taken.items()}


FEWEST = 6  #: values that bound their median at all, at 95%


def median_interval(values: Sequence[float], level: float = 0.95) -> tuple[float, float]:
    """An interval that holds the median of what `values` were drawn from with a probability of `level` or more.

    Between the k-th least and the k-th greatest value, where the median is unless fewer than k of n values fall on one side of it, by a
    binomial law whatever the distribution (David and Nagaraja 2003, 7.1). Raises ValueError for too few values, as are 5 at 95%.
    """
    ordered, count = sorted(values), len(values)
    tail, k = 0.0, 0
    while 2.0 * (tail := tail + math.comb(count, k) / 2.0**count) <= 1.0 - level and k < count // 2:
        k += 1
    if k == 0:
        raise ValueError(f"{count} values do not bound their median at a level of {level:g}; take {FEWEST} or more")
    return ordered[k - 1], ordered[count - k]


@dataclass(frozen=True)
class Ratio:
    """The median of ratios, and low <= median <= high; `sure`: the interval holds the true median with 95%, else it is the range."""

    median: float
    low: float
    high: float
    sure: bool

    @property
    def inverse(self) -> Ratio:
        return Ratio(1.0 / self.median, 1.0 / self.high, 1.0 / self.low, self.sure)

    def times(self, factor: float) -> Ratio:
        """All of it times a positive factor."""
        return Ratio(self.median * factor, self.low * factor, self.high * factor, self.sure)

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


def paired(a: Sequence[float], b: Sequence[float]) -> Ratio:
    """a over b, round by round: what slowed a whole round falls on both. Raises ValueError for none, or unequally many."""
    ratios = [x / y for x, y in zip(a, b, strict=True)]
    if not ratios:
        raise ValueError("no rounds to compare; give 1 or more")
    sure = len(ratios) >= FEWEST
    low, high = median_interval(ratios) if sure else (min(ratios), max(ratios))
    return Ratio(statistics.median(ratios), low, high, sure)
