"""Measured numbers as the study keeps them: a median with an interval that holds it with 95%, a unit, and from how many runs.

    {"median": 0.0123, "low": 0.0121, "high": 0.0126, "unit": "s", "runs": 15}

What is counted or computed, and would be the same again, has low = high and one run.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from clrt.errors import ClrtError
from clrt.timing import FEWEST, Series, interleave, median_interval

FloatArray = NDArray[np.float64]

#: quantiles of Student's t at 97.5%, for 1, 2, ... degrees of freedom (Abramowitz and Stegun 1964, table 26.10)
_STUDENT = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120, 2.110,
            2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042)  # fmt: skip
_RESAMPLES = 2000  #: of a bootstrap: the ends of its interval then wander by some hundredths of their width
_TRIES = 3  #: rounds at the least, where six take too long


class Number(TypedDict):
    """A measured number. `low`, `high`: 95% interval of the median; `runs`: repetitions."""

    median: float
    low: float
    high: float
    unit: str
    runs: int


def number(median: float, low: float, high: float, unit: str, runs: int) -> Number:
    """Raises ClrtError where it is none: a picture with pixels that are not finite has no error."""
    if not all(map(math.isfinite, (median, low, high))):
        raise ClrtError(f"a measurement is no finite number ({median:g} {unit}); does the picture have pixels that are not finite?")
    return {"median": float(median), "low": float(low), "high": float(high), "unit": unit, "runs": int(runs)}


def counted(value: float, unit: str) -> Number:
    """What does not vary."""
    return number(value, value, value, unit, 1)


def measured(values: Sequence[float], unit: str) -> Number:
    """Repeated measurements; two or more. By order statistics from FEWEST on, else by Student's t (see `interval`)."""
    low, high = interval(values)
    return number(statistics.median(values), low, high, unit, len(values))


def interval(values: Sequence[float]) -> tuple[float, float]:
    """Bounds of the median at 95%. Raises ValueError for fewer than two values.

    From FEWEST values on whatever their distribution (`median_interval`). For fewer, which bound nothing without a law, mean -+
    t s / sqrt(n) of their logarithms, or of the values where one is not positive: right where these are about normal.
    """
    if len(values) >= FEWEST:
        return median_interval(values)
    if len(values) < 2:
        raise ValueError("one value has no interval; measure twice or more")
    positive = min(values) > 0.0
    own = np.log(values) if positive else np.asarray(values, np.float64)
    low, high = (own.mean() + side * student(len(values) - 1) * own.std(ddof=1) / math.sqrt(len(values)) for side in (-1.0, 1.0))
    middle = statistics.median(values)
    low, high = (math.exp(low), math.exp(high)) if positive else (float(low), float(high))
    return min(low, middle), max(high, middle)


def student(freedom: int) -> float:
    """The 97.5% quantile of Student's t; beyond the table that of its last entry, a little wide."""
    return _STUDENT[min(freedom, len(_STUDENT)) - 1]


def bootstrapped(values: Sequence[float], unit: str) -> Number:
    """The median over independent seeds with the 95% band of its bootstrap (Efron 1979; percentiles), seeded."""
    own = np.asarray(values, np.float64)
    drawn = np.random.default_rng(len(own)).integers(0, len(own), (_RESAMPLES, len(own)))
    low, high = np.percentile(np.median(own[drawn], axis=1), (2.5, 97.5))
    return number(float(np.median(own)), float(low), float(high), unit, len(own))


def resamples(shape: tuple[int, int], seed: int = 1) -> NDArray[np.int64]:
    """(_RESAMPLES, rows, columns) places to draw from, with replacement within each row."""
    rows, columns = shape
    return np.random.default_rng(seed).integers(0, columns, (_RESAMPLES, rows, columns))


def jackknifed(values: FloatArray, estimate: Callable[[FloatArray], float], unit: str) -> Number:
    """A statistic of symmetric (n, n) products between n seeds, with mean -+ t times its jackknife error (Efron and Stein 1981).

    values : (n, n); estimate : of such an array, or of one with a seed left out. The bounds are those of the expectation.
    """
    n = len(values)
    whole = estimate(values)
    left = np.array([estimate(np.delete(np.delete(values, i, 0), i, 1)) for i in range(n)])
    spread = student(n - 1) * math.sqrt((n - 1) / n * float(((left - left.mean()) ** 2).sum()))
    return number(whole, whole - spread, whole + spread, unit, n)


def proportion(count: int, trials: int, scale: float, unit: str) -> Number:
    """`count` of `trials` as a rate times `scale`, with the interval of Wilson (1927) at 95%."""
    z2, p = 1.96**2, count / trials
    middle, half = p + z2 / (2 * trials), 1.96 * math.sqrt(p * (1 - p) / trials + z2 / (4 * trials**2))
    low, high = ((middle + side * half) / (1 + z2 / trials) for side in (-1.0, 1.0))
    return number(scale * p, scale * max(0.0, low) if count else 0.0, scale * high, unit, trials)


def ratios(series: Series, base: Series) -> Number:
    """Times over those of `base` in the same rounds."""
    return measured([own / other for own, other in zip(series.seconds, base.seconds, strict=True)], "x")


def in_turns(contenders: Mapping[str, Callable[[], object]], rounds: int, budget_s: float) -> dict[str, Series]:
    """A B C A B C ...: `rounds` after a warm-up, or as many, _TRIES at least, as `budget_s` seconds have room for."""
    trial = interleave(contenders, 1, warm_ups=0)
    affordable = int(budget_s / max(1e-9, sum(each.best for each in trial.values())))
    return interleave(contenders, max(_TRIES, min(rounds, affordable)), warm_ups=0)
