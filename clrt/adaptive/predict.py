"""What the rest of a render will take and reach, from what its tiles have shown so far."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from clrt.adaptive.intervals import Interval
from clrt.adaptive.ledger import Ledger
from clrt.adaptive.schedule import Walk, threshold

FloatArray = NDArray[np.float64]

#: A tile's variance is taken to be a sum of two powers of n: of what varies smoothly over its samples (Owen 1997: at most n^-3), and of
#: edges and of pairs of dimensions that are stratified apart (random samples: n^-1). Chosen for the scenes of docs/error.md.
_STEEP, _FLAT = 2.4, 1.0
_USUAL = 1.5  #: the power of n where nothing is known yet
_ALL = 0.4  #: weight of what all tiles showed beside what is usual
_OWN = 0.4  #: weight of a tile's own power beside that of all
_PACE = 0.1  #: relative: how well the time of a sample is known
_SLOPE = 0.12  #: of a slope's change from the pilot to the end, measured over the scenes of docs/error.md
_MOST_STEPS = 400
_BLACK = float(np.finfo(float).tiny)  #: mean of a picture without light, so that an error can be divided by it


@dataclass(frozen=True)
class Forecast:
    """seconds : of sampling, from its start to its end; error : that is reached, relative."""

    seconds: Interval
    error: Interval


@dataclass(frozen=True)
class Outlook:
    """The state from which a render goes on. cost : (tiles,) seconds of one sample of all replicates, and `overhead` those of a
    launch, whatever it traces; spent : seconds so far.
    """

    ledger: Ledger
    walk: Walk
    cost: FloatArray
    overhead: float
    spent: float

    def forecast(self, error: float | None, seconds: float | None) -> Forecast:
        """For a target error, for a target time (both counted from the start), or for what comes first of both."""
        slopes, doubt = self._slopes()
        runs = [self._run(slopes + shift * doubt, pace, error, seconds)
                for shift, pace in ((0.0, 1.0), (1.0, 1.0 - _PACE), (-1.0, 1.0 + _PACE))]  # fmt: skip
        (time, reached), (quick, better), (slow, worse) = runs
        now = self.ledger.side_error(0, self.walk.levels[0])
        spread = (now.high / now.value, now.low / now.value) if now.value > 0.0 and now.high < np.inf else (1.0, 1.0)
        return Forecast(Interval(time, min(quick, time), max(slow, time)),
                        Interval(reached, min(better, reached) * spread[1], max(worse, reached) * spread[0]))  # fmt: skip

    def seconds(self, error: float | None, seconds: float | None) -> float:
        """Those of the forecast, without its interval."""
        return self._run(self._slopes()[0], 1.0, error, seconds)[0]

    def _slopes(self) -> tuple[FloatArray, float]:
        """(tiles,): the power of n with which the variance fell last, between the tile's own and that of all; its doubt."""
        ledger, reached = self.ledger, self.ledger.reached
        mixed = np.full(ledger.grid.count, _USUAL)
        apart: list[float] = []
        for level in range(1, len(ledger.noise)):
            tiles = np.flatnonzero(reached >= level)
            before, after = ledger.noise[level - 1][:, tiles], ledger.noise[level][:, tiles]
            sums = before.sum(1), after.sum(1)
            if tiles.size == 0 or min(sums[0].min(), sums[1].min()) <= 0.0:
                continue
            pooled = _ALL * float(np.log2(sums[0].sum() / sums[1].sum())) + (1.0 - _ALL) * _USUAL
            apart = np.log2(sums[0] / sums[1]).tolist()
            with np.errstate(divide="ignore", invalid="ignore"):
                own = np.log2(before.sum(0) / after.sum(0))
            mixed[tiles] = np.where(np.isfinite(own), _OWN * own + (1.0 - _OWN) * pooled, pooled)
            if level == 1:
                mixed[reached < 1] = pooled
        doubt = _SLOPE + (abs(apart[0] - apart[1]) / 2.0 if apart else 0.3)
        return mixed, doubt

    def _run(self, slopes: FloatArray, pace: float, error: float | None, seconds: float | None) -> tuple[float, float]:
        """The walk with variances that fall as assumed: seconds and relative error at its end."""
        ledger, walk = self.ledger, self.walk
        steep = _steep_share(slopes)
        noise, levels = ledger.at(ledger.noise, walk.levels).copy(), walk.levels.copy()
        start = noise.copy()
        numbers = float(ledger.numbers().sum())
        mean = max(abs(float(ledger.at(ledger.total, walk.levels).sum())) / numbers, _BLACK)
        now = ledger.side_error(0, walk.levels[0])
        margin = now.high / now.value if now.value > 0.0 and now.high < np.inf else 1.0
        there, time = ledger.reached.copy(), self.spent
        size = np.maximum(ledger.pixels, 1) * 3.0
        most = np.where(ledger.closed, 0, walk.most)
        best = (time, float(np.sqrt(noise.sum() / numbers)) / mean)
        for step in range(walk.step + 1, walk.step + 1 + _MOST_STEPS):
            if error is not None and best[1] * margin <= error:
                break
            while (up := (noise / (size * ledger.samples(levels)) > threshold(step)) & (2 * ledger.samples(levels) <= most)).any():
                levels += up
                noise = start * _fallen(steep, levels - walk.levels)
            higher = np.maximum(there, levels.max(0))
            rising = [int(ledger.samples(level)) for level in range(int(higher.max())) if ((there <= level) & (higher > level)).any()]
            time += pace * (float(np.sum(self.cost * (ledger.samples(higher) - ledger.samples(there)))) + self.overhead * len(rising))
            there = higher
            reached = float(np.sqrt(noise.sum() / numbers)) / mean
            if seconds is not None and time > seconds:
                share = (seconds - best[0]) / max(time - best[0], 1e-12)
                return max(seconds, self.spent), best[1] + (reached - best[1]) * min(max(share, 0.0), 1.0)
            best = (time, reached)
        return best


def _steep_share(slopes: FloatArray) -> FloatArray:
    """The steep part of variances that fell with these powers in their last doubling."""
    return np.asarray(np.clip((2.0**slopes - 2.0**_FLAT) / (2.0**_STEEP - 2.0**_FLAT), 0.0, 1.0))


def _fallen(steep: FloatArray, doublings: NDArray[np.int64]) -> FloatArray:
    """What is left of variances with these steep parts after so many doublings."""
    return np.asarray(steep * 2.0 ** (-_STEEP * doublings) + (1.0 - steep) * 2.0 ** (-_FLAT * doublings))


def as_told(forecast: Forecast, error: float | None) -> Forecast:
    """With the error that a render stops at, where it stops at one."""
    if error is None or forecast.error.value > error:
        return forecast
    return replace(forecast, error=Interval(forecast.error.value, forecast.error.low, min(forecast.error.high, error)))
