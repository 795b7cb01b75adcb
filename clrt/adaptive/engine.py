"""Renders to an error or within a time: a pilot over all of the picture, then tiles where a sample brings most."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.adaptive.intervals import Interval
from clrt.adaptive.ledger import Ledger
from clrt.adaptive.moments import flat, moments
from clrt.adaptive.pace import Pace
from clrt.adaptive.predict import Forecast, Outlook, as_told
from clrt.adaptive.replicates import Replicates
from clrt.adaptive.schedule import Walk

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]

PILOT = 0.2  #: of the whole that is spent when the forecast is made
_LOOK_AGAIN = 1.3  #: times the work of the last look ahead, which takes a few milliseconds
MOST_SAMPLES = 1 << 20  #: of a pixel
_CHUNK_S = 0.1  #: launches are to take about this long, so that Ctrl-C and progress come between them
_FIRST_TILES = 32  #: in the first launch, whose speed is not known yet
_READ_TILES = 64  #: looked at in one go: their numbers fit a processor's cache
PILOT_SAMPLES = 2  #: of a pixel in each replicate, before anything is decided
_FINISH_S = 2e-7  #: a pixel, to make a picture of the tiles at the end

Tell = Callable[[float], None]


@dataclass(frozen=True)
class Goal:
    """What to sample for. All may be None but one; of error and deadline the first that is reached ends the render.

    error : relative error of the picture, at 95% confidence; deadline : time.perf_counter() at which the picture is to be there
    samples : of a pixel, the same everywhere
    """

    error: float | None = None
    deadline: float | None = None
    samples: int | None = None


@dataclass(frozen=True)
class Outcome:
    """pixels, standard_error : (h, w, 3) float32; error : of the picture, relative; samples : least, mean and most of a pixel.

    forecast : what was foretold, None where the render was over before; met : the error asked for was reached (or none was asked for)
    """

    pixels: NDArray[np.float32]
    standard_error: NDArray[np.float32]
    error: Interval
    samples: tuple[int, float, int]
    forecast: Forecast | None
    met: bool


class Engine:
    """One render, to be run once."""

    def __init__(
        self, replicates: Replicates, goal: Goal, tell: Tell, foretell: Callable[[Forecast], None], contrast: float | None
    ) -> None:
        """contrast : where only edges are refined, how far neighbouring pixels may differ elsewhere; None: look everywhere."""
        self.replicates, self.goal, self.tell, self.foretell, self.contrast = replicates, goal, tell, foretell, contrast
        self.grid = replicates.grid
        self.start = time.perf_counter()
        self.cost: FloatArray = np.zeros(self.grid.count)  #: seconds of one sample of a tile, all replicates, as the pilot took
        self.ledger = Ledger(self.grid, replicates.count, PILOT_SAMPLES if goal.samples is None else goal.samples // replicates.count)
        #: means of the last look, which `moments` asks of two replicates alone
        self.before = np.zeros((2, *self.grid.inside.shape, 3), np.float32) if replicates.count == 2 else None
        self.forecast: Forecast | None = None
        self.next_look = 0.0  #: seconds spent, when it is worth while to look ahead again
        self.overhead = replicates.overhead()  #: seconds of a launch that traces nothing
        self.pace = Pace(self.overhead)

    @property
    def spent(self) -> float:
        return time.perf_counter() - self.start

    def run(self) -> Outcome:
        """Raises nothing but what launches raise."""
        everywhere = np.arange(self.grid.count)
        rest = everywhere if self.contrast is None else self._edges(everywhere, self.contrast)
        taken = self._pilot(rest)
        if taken < self.replicates.count:
            return self._short(taken)
        self.walk = Walk(self.ledger, MOST_SAMPLES // self.replicates.count)
        met = True
        if self.goal.samples is None:
            met = self.walk.run(self._extend, self._met) or self.goal.error is None
        self.tell(1.0)
        return self._outcome(met)

    def _left(self) -> float:
        """Seconds until the picture must be made of the tiles."""
        if self.goal.deadline is None:
            return np.inf
        return self.goal.deadline - time.perf_counter() - _FINISH_S * int(self.grid.pixels.sum())

    def _edges(self, tiles: IntArray, contrast: float) -> IntArray:
        """One sample through each pixel's centre; tiles without an edge keep it. The others are returned."""
        self.replicates.centre(tiles)
        picture = self.replicates.means(0, 1)
        differs = np.full(picture.shape[:2], picture.shape[:2] == (1, 1))  # a lone pixel has no neighbour to tell what is in it
        for axis in (0, 1):
            close = np.asarray(np.abs(np.diff(picture, axis=axis)) <= contrast * abs(float(picture.mean())))
            apart = ~close.all(-1)
            before, behind = ((slice(None, -1), slice(None)), (slice(1, None), slice(None))) if axis == 0 else (
                (slice(None), slice(None, -1)), (slice(None), slice(1, None)))  # fmt: skip
            differs[before] |= apart
            differs[behind] |= apart
        edge = np.asarray(self.grid.tilewise(differs).any((1, 2)))[tiles]
        still, values = tiles[~edge], self.grid.tilewise(picture)
        for part in _parts(still, _READ_TILES):
            self.ledger.put(part, 0, flat(values[part], self.grid.inside[part], self.grid.sides))
        self.ledger.closed[tiles[~edge]] = True
        return np.asarray(tiles[edge])

    def _pilot(self, tiles: IntArray) -> int:
        """Level 0 of these tiles; how many replicates there was time for."""
        count = self.replicates.count
        for i in range(count):
            if i and tiles.size and i * self._left() < self.spent:
                return i
            self._pilot_replicate(tiles, i)
            self.tell(self._fraction(0.02 * (i + 1) / count))
        for part in _parts(tiles, _READ_TILES):
            self._look(part, 0)
        return count

    def _pilot_replicate(self, tiles: IntArray, i: int) -> None:
        size, at = _FIRST_TILES, 0
        while at < len(tiles):
            part, begin = tiles[at : at + size], time.perf_counter()
            self.replicates.run(part, 0, self.ledger.first, range(i, i + 1))
            seconds = time.perf_counter() - begin
            self.cost[part] += max(seconds - self.overhead, 0.1 * seconds) / len(part) / self.ledger.first
            at += len(part)
            size = max(8, min(8 * size, int(_CHUNK_S / max(seconds / len(part), 1e-9))))

    def _look(self, tiles: IntArray, level: int) -> None:
        """Puts what the sums of these tiles say into the ledger."""
        values = self.replicates.values(tiles, int(self.ledger.samples(level)))
        before = None if self.before is None or level == 0 else self.before[:, tiles]
        self.ledger.put(tiles, level, moments(values, self.grid.inside[tiles], self.grid.sides, before))
        if self.before is not None:
            with np.errstate(invalid="ignore", over="ignore"):  # beside the picture there may be anything
                self.before[:, tiles] = values

    def _extend(self, tiles: IntArray) -> bool:
        """The next level of these tiles; False where there is no time for all."""
        reached = self.ledger.reached[tiles]  # as it is now: tiles that rise to the next level do not go on with those there
        for level in np.unique(reached).tolist():
            same = tiles[reached == level]
            samples = int(self.ledger.samples(level))
            while same.size:
                fixed, factor = self.pace.line()
                work = np.cumsum(self.cost[same]) * samples
                part = same[: max(1, int(np.searchsorted(factor * work, min(_CHUNK_S, self._left() - fixed))))]
                expected = float(work[len(part) - 1])
                if fixed + factor * expected > self._left():
                    return False
                begin = time.perf_counter()
                self._run(part, samples)
                for few in _parts(part, _READ_TILES):
                    self._look(few, level + 1)
                self.pace.learn(expected, time.perf_counter() - begin)
                same = same[len(part) :]
                self.tell(self._fraction())
        return True

    def _run(self, tiles: IntArray, samples: int) -> None:
        """As many samples again as these tiles have, in launches that are not much longer than they are to be."""
        step = max(1, min(samples, int(_CHUNK_S / max(float(self.cost[tiles].sum()), 1e-9))))
        for first in range(samples, 2 * samples, step):
            self.replicates.run(tiles, first, min(first + step, 2 * samples))

    def _met(self, side: int) -> bool:
        if self.forecast is None:
            self._foretell()
        levels = self.walk.levels[side]
        return self.goal.error is not None and self.ledger.side_error(side, levels).high <= self.goal.error

    def _foretell(self) -> None:
        """The forecast, as soon as PILOT of the whole is done."""
        spent = self.spent
        seconds = None if self.goal.deadline is None else spent + max(self._left(), 0.0)
        if spent < self.next_look or (self.goal.error is None and seconds is not None and spent < PILOT * seconds):
            return
        self.next_look = _LOOK_AGAIN * spent
        fixed, factor = self.pace.line()
        outlook = Outlook(self.ledger, self.walk, factor * self.cost, fixed, spent)
        if spent >= PILOT * outlook.seconds(self.goal.error, seconds):
            self.forecast = as_told(outlook.forecast(self.goal.error, seconds), self.goal.error)
            self.foretell(self.forecast)

    def _fraction(self, least: float = 0.02) -> float:
        whole = self.forecast.seconds.value if self.forecast is not None else np.inf
        return float(min(max(self.spent / max(whole, 1e-9), least), 0.99))

    def _outcome(self, met: bool) -> Outcome:
        levels = self.walk.swapped
        pixels, standard_error = self.ledger.picture(levels)
        error = self.ledger.error(levels)
        if self.goal.error is not None:
            met = met and bool(error.value <= self.goal.error)
        samples = self._samples(self.ledger.samples(self.ledger.reached) * self.replicates.count)
        return Outcome(pixels, standard_error, error, samples, self.forecast, met)

    def _samples(self, count: IntArray) -> tuple[int, float, int]:
        """Least, mean and most of a pixel that were traced, also those that only decided; count : (tiles,) in all replicates."""
        if self.contrast is not None:
            count = count + 1
            count[self.ledger.closed] = 1
        return int(count.min()), float((count * self.grid.pixels).sum() / self.grid.pixels.sum()), int(count.max())

    def _short(self, taken: int) -> Outcome:
        """No time for all replicates: the mean of those there are, with what they tell of the error."""
        closed = self.grid.picture(np.broadcast_to(self.ledger.closed[:, None, None, None], (*self.grid.inside.shape, 1)))
        still, _ = self.ledger.picture(np.zeros((2, self.grid.count), np.int64))
        values = np.stack([np.where(closed, still, self.replicates.means(i, self.ledger.first)) for i in range(taken)])
        pixels, samples = values.mean(axis=0), self._samples(np.full(self.grid.count, taken * self.ledger.first))
        if taken == 1:
            unknown = np.broadcast_to(np.where(closed, 0.0, np.inf), pixels.shape).astype(np.float32)
            return Outcome(pixels.astype(np.float32), unknown, Interval(np.inf, 0.0, np.inf), samples, None, self.goal.error is None)
        variance = values.var(axis=0, ddof=1) / taken
        value = float(np.sqrt(variance.mean()) / max(abs(float(pixels.mean())), np.finfo(float).tiny))
        error = np.sqrt(variance).astype(np.float32)
        return Outcome(pixels.astype(np.float32), error, Interval(value, 0.0, np.inf), samples, None, self.goal.error is None)


def _parts(tiles: IntArray, size: int) -> list[IntArray]:
    return [tiles[at : at + size] for at in range(0, len(tiles), size)]
