"""What the rest of a render will take and reach, from what its tiles have shown so far."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from clrt.adaptive.intervals import Interval
from clrt.adaptive.ledger import Ledger
from clrt.adaptive.schedule import Walk, threshold

FloatArray = NDArray[np.float64]

_SLOPES = (0.7, 3.0)  #: a variance falls about as n^-1 (less is a matter of chance) and at most as n^-3 (Owen 1997: smooth integrands)
_USUAL = 2.2  #: where nothing is known yet
#: Slopes begin steep, while more and more of a pixel's parts get a sample each, and fall towards those of random samples, as far as the
#: light depends on pairs of dimensions that are stratified apart: slope - LAST by the factor FADE a level, in the mean of seven scenes.
_LAST, _FADE = 1.1, 0.65
_PACE = 0.1  #: relative: how well the time of a sample is known
_SLOPE = 0.12  #: of a slope's change from the pilot to the end, measured over the scenes of docs/error.md
_MOST_STEPS = 400


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

    def _slopes(self) -> tuple[FloatArray, float]:
        """(2, tiles): the power of n with which the variance falls, halfway between the tile's own and that of all; its doubt."""
        ledger, reached = self.ledger, self.ledger.reached
        own = np.full(ledger.grid.count, np.nan)
        pooled = _USUAL
        apart = []
        for level in range(1, len(ledger.noise)):
            tiles = np.flatnonzero(reached >= level)
            before, after = ledger.noise[level - 1][:, tiles], ledger.noise[level][:, tiles]
            sums = before.sum(1), after.sum(1)
            if tiles.size == 0 or min(sums[0].min(), sums[1].min()) <= 0.0:
                continue
            apart = np.log2(sums[0] / sums[1]).tolist()
            pooled = float(np.log2(sums[0].sum() / sums[1].sum()))
            with np.errstate(divide="ignore", invalid="ignore"):
                slope = np.log2(before.sum(0) / after.sum(0))
            own[tiles] = np.where(np.isfinite(slope), slope, np.nan)
        mixed = np.where(np.isnan(own), pooled, 0.5 * (own + pooled))
        doubt = _SLOPE + (abs(apart[0] - apart[1]) / 2.0 if apart else 0.3)
        return np.broadcast_to(np.clip(mixed, *_SLOPES), (2, len(mixed))), doubt

    def _run(self, slopes: FloatArray, pace: float, error: float | None, seconds: float | None) -> tuple[float, float]:
        """The walk with variances that fall as assumed: seconds and relative error at its end."""
        ledger, walk = self.ledger, self.walk
        slopes = np.clip(slopes, *_SLOPES)
        noise, levels = ledger.at(ledger.noise, walk.levels).copy(), walk.levels.copy()
        numbers = float(ledger.numbers().sum())
        scale = numbers * max(abs(float(ledger.at(ledger.total, walk.levels).sum())) / numbers, np.finfo(float).tiny) ** 2
        now = ledger.side_error(0, walk.levels[0])
        margin = now.high / now.value if now.value > 0.0 and now.high < np.inf else 1.0
        there, time = ledger.reached.copy(), self.spent
        size = np.maximum(ledger.pixels, 1) * 3.0
        most = np.where(ledger.closed, 0, walk.most)
        best = (time, float(np.sqrt(noise.sum() / scale)))
        for step in range(walk.step + 1, walk.step + 1 + _MOST_STEPS):
            if error is not None and best[1] * margin <= error:
                break
            while (up := (noise / (size * ledger.samples(levels)) > threshold(step)) & (2 * ledger.samples(levels) <= most)).any():
                levels += up
                ahead = levels - walk.levels
                noise = np.where(up, noise * 2.0 ** -(_LAST + (slopes - _LAST) * _FADE**ahead), noise)
            higher = np.maximum(there, levels.max(0))
            rising = [int(ledger.samples(level)) for level in range(int(higher.max())) if ((there <= level) & (higher > level)).any()]
            time += pace * (float(np.sum(self.cost * (ledger.samples(higher) - ledger.samples(there)))) + self.overhead * len(rising))
            there = higher
            reached = float(np.sqrt(noise.sum() / scale))
            if seconds is not None and time > seconds:
                share = (seconds - best[0]) / max(time - best[0], 1e-12)
                return max(seconds, self.spent), best[1] + (reached - best[1]) * min(max(share, 0.0), 1.0)
            best = (time, reached)
        return best


def as_told(forecast: Forecast, error: float | None) -> Forecast:
    """With the error that a render stops at, where it stops at one."""
    if error is None or forecast.error.value > error:
        return forecast
    return replace(forecast, error=Interval(forecast.error.value, forecast.error.low, min(forecast.error.high, error)))
