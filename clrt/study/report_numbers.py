"""Measured numbers of a study as text: the digits that the interval supports, and units that a person reads."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

NONE = "-"  #: stands where nothing was measured
_MOST_DIGITS, _FEWEST_DIGITS = 4, 2  #: significant digits of a median that has an interval
_PLAIN_DIGITS = 3  #: of a number that has none
_SKEWED = 10.0  #: times the median: an interval that reaches farther has ends with digits of their own
_SMALLEST_PLAIN = 1e-3  #: below it a number is written with a power of ten
SCALED = ("s", "B", "bytes", "rays/s", "1/s", "share", "x", "%")  #: units that stand behind every number
TIMES = "\N{MULTIPLICATION SIGN}"
_TIMES = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))
_RATES = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
_BYTES = ((2.0**30, "GiB"), (2.0**20, "MiB"), (2.0**10, "KiB"))
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Number:
    """A median with its 95% interval over `runs` repetitions; a counted number has an interval of no width."""

    median: float
    low: float
    high: float
    unit: str = ""
    runs: int = 1

    @classmethod
    def of(cls, value: object) -> Number | None:
        """From the JSON; a bare number counts as exact. None where there is no finite number."""
        if isinstance(value, Mapping):
            return cls._of_object(value)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            return None
        return cls(float(value), float(value), float(value))

    @classmethod
    def _of_object(cls, value: Mapping[str, Any]) -> Number | None:
        median = _finite(value.get("median"))
        if median is None:
            return None
        low, high = _finite(value.get("low")), _finite(value.get("high"))
        unit, runs = str(value.get("unit") or ""), int(value.get("runs") or 1)
        return cls(median, median if low is None else low, median if high is None else high, unit, runs)

    @property
    def has_interval(self) -> bool:
        return self.high > self.low

    def __str__(self) -> str:
        """As `1.16x (1.13 to 1.19)`; the interval is in the unit of the median."""
        factor, suffix = _scale(self)
        median, low, high = (value / factor for value in (self.median, self.low, self.high))
        if self.has_interval and max(abs(low), abs(high)) > _SKEWED * abs(median) > 0.0:
            return f"{_rounded(median)}{suffix} ({_rounded(low)} to {_rounded(high)})"
        places = _places(median, low, high)
        text = _fixed(median, places) + suffix
        return f"{text} ({_fixed(low, places)} to {_fixed(high, places)})" if self.has_interval else text

    def short(self) -> str:
        """The median alone, with as many digits, for labels in plots."""
        return str(self).partition(" (")[0]

    def without_unit(self) -> Number:
        """Where the unit stands elsewhere; one that chooses the size of the number, as s to ms, stays."""
        return self if self.unit in SCALED else replace(self, unit="")

    @property
    def factor(self) -> tuple[float, str]:
        """What an axis up to this number is divided by, and the unit that it then has."""
        factor, suffix = _scale(self)
        return factor, suffix.strip()


def _finite(value: object) -> float | None:
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value) else None


def _scale(number: Number) -> tuple[float, str]:
    """What to divide by, and what then stands behind the number."""
    size, unit = abs(number.median), number.unit
    if number.low <= 0.0 <= number.high:  # next to nothing: what is known of it is the width of the interval
        size = max(size, (number.high - number.low) / 2.0)
    if unit == "s":
        return _step(size, _TIMES, _TIMES[0] if size == 0.0 else _TIMES[-1])
    if unit in ("B", "bytes"):
        return _step(size, _BYTES, (1.0, "B"))
    if unit in ("rays/s", "1/s"):
        factor, prefix = _step(size, _RATES, (1.0, ""))
        return factor, f"{prefix or ' '}{unit.removeprefix('1')}" if unit == "1/s" else f"{prefix} {unit}"
    if unit == "share":
        return 0.01, "%"
    power = math.floor(math.log10(size)) if 0.0 < size < _SMALLEST_PLAIN else 0
    tail = f"{TIMES}10{str(power).translate(_SUPERSCRIPTS)}" if power else ""
    return 10.0**power, tail + (unit if unit in ("x", "%") else f" {unit}" if unit not in ("", "1", "count", "ratio") else "")


def _step(size: float, steps: tuple[tuple[float, str], ...], least: tuple[float, str]) -> tuple[float, str]:
    factor, name = next((step for step in steps if size >= step[0]), least)
    return factor, f" {name}" if name else ""


def _places(median: float, low: float, high: float) -> int:
    """Digits after the point: to the first digit of the half width of the interval, within the bounds above."""
    half = (high - low) / 2.0
    size = abs(median) or half
    lead = math.floor(math.log10(size)) if size > 0.0 else None
    if half <= 0.0:
        whole = math.isclose(median, round(median), rel_tol=1e-12)
        return 0 if whole or lead is None else max(_PLAIN_DIGITS - 1 - lead, 0)
    places = -math.floor(math.log10(half))
    if lead is not None:
        places = min(max(places, _FEWEST_DIGITS - 1 - lead), _MOST_DIGITS - 1 - lead)
    return max(places, 0)


def _rounded(value: float) -> str:
    """With few significant digits of its own: ends of an interval far from the median share no digits with it."""
    lead = math.floor(math.log10(abs(value))) if value else 0
    return _fixed(round(value, _FEWEST_DIGITS - 1 - lead), max(_FEWEST_DIGITS - 1 - lead, 0)) if value else "0"


def _fixed(value: float, places: int) -> str:
    text = f"{value:,.{places}f}"
    return text.lstrip("-") if not text.strip("-0.,") else text
