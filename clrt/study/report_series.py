"""Columns of numbers for the plots: medians with intervals, as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.study.report_numbers import Number

Rows = list[Mapping[str, Any]]


@dataclass(frozen=True)
class Series:
    """medians, lows, highs : (n,) float64, NaN where a row has no such number; `unit` is that of the first that has one."""

    medians: NDArray[np.float64]
    lows: NDArray[np.float64]
    highs: NDArray[np.float64]
    numbers: list[Number | None]
    unit: str

    @classmethod
    def of(cls, rows: Rows, key: str) -> Series:
        numbers = [Number.of(row.get(key)) for row in rows]
        columns = np.array([(n.median, n.low, n.high) if n else (np.nan,) * 3 for n in numbers], np.float64).reshape(-1, 3)
        return cls(columns[:, 0], columns[:, 1], columns[:, 2], numbers, next((n.unit for n in numbers if n), ""))

    @property
    def known(self) -> NDArray[np.bool_]:
        return np.isfinite(self.medians)

    @property
    def positive(self) -> NDArray[np.bool_]:
        """What logarithmic axes can show."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.known & (self.medians > 0.0), np.bool_)

    @property
    def axis(self) -> tuple[float, str]:
        """What medians and intervals are divided by to be drawn, and the unit that the axis then has, empty where it has none."""
        known = [n for n in self.numbers if n]
        factor, unit = max(known, key=lambda n: abs(n.median)).factor if known else (1.0, "")
        return factor, "" if unit in ("", "1", "x") else unit.replace("^2", "²")

    def whiskers(self, where: NDArray[np.bool_], scale: float = 1.0) -> NDArray[np.float64]:
        """(2, k): how far the interval goes below and above the median, as matplotlib's errorbar wants it; never negative."""
        middle = self.medians[where]
        return np.maximum(np.stack([middle - self.lows[where], self.highs[where] - middle]) * scale, 0.0)


def rows_of(content: Mapping[str, Any]) -> Rows:
    return [row for row in content.get("rows") or [] if isinstance(row, Mapping)]
