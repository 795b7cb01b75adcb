"""Growth curves: what building, tracing and memory do as triangles, pixels and objects become more; the logarithms fitted to them."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from clrt.errors import ClrtError

#: what a curve runs along -> the part of a point that has its number
AXES = {"triangles": "triangles", "pixels": "rays", "separate": "count", "instances": "count"}
BEND = 100_000  #: triangles up to which the curve is fitted that larger ones are held against


@dataclass(frozen=True)
class Reach:
    """How far the curves go: the largest number of each kind; smallest ones follow. `size` : side of the pictures."""

    triangles: int = 1_000_000
    pixels: int = 4096
    separate: int = 10_000
    instances: int = 100_000
    size: int = 1024
    rounds: int = 7


def points(reach: Reach) -> Iterator[tuple[str, int, int]]:
    """(kind, count, size) of every point: about two a decade of triangles, one a doubling of sides, one a decade of objects."""
    for triangles in _up_to(reach.triangles, 1_000, (1, 3)):
        yield "triangles", triangles, reach.size
    side = min(128, reach.pixels)
    while side <= reach.pixels:
        yield "pixels", 1, side
        side *= 2
    for kind in ("separate", "instances"):
        for count in _up_to(getattr(reach, kind), 1, (1,)):
            yield kind, count, reach.size


def _up_to(largest: int, smallest: int, steps: Sequence[int]) -> Iterator[int]:
    decade = smallest
    while decade <= largest:
        yield from (step * decade for step in steps if step * decade <= largest)
        decade *= 10


def measure_growth(reach: Reach) -> dict[str, Any]:
    """Every point in a process of its own, and the fits."""
    rows = [_point(kind, count, size, reach.rounds) for kind, count, size in points(reach)]
    return {"reach": reach.__dict__, "points": rows, "fits": fits_of(rows)}


def _point(kind: str, count: int, size: int, rounds: int) -> dict[str, Any]:
    command = [sys.executable, "-m", "clrt.bench.growth_point", kind, str(count), str(size), str(rounds)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = done.stderr.strip().splitlines()
        raise ClrtError(f"{kind}, {count}: ended with {done.returncode}: {said[-1] if said else 'it said nothing'}")
    return dict(json.loads(done.stdout))


def curve(rows: Sequence[dict[str, Any]], kind: str) -> tuple[list[int], list[float]]:
    """Numbers, and nanoseconds a ray by the best time: points are taken one after the other, so noise only adds."""
    chosen = [row for row in rows if row["kind"] == kind]
    return [row[AXES[kind]] for row in chosen], [row["trace_s"]["best"] / row["rays"] * 1e9 for row in chosen]


def fits_of(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The fit of every curve with three points or more; of triangles also how far larger numbers lie off the curve of those up to BEND."""
    fits: dict[str, Any] = {}
    for kind in AXES:
        numbers, times = curve(rows, kind)
        if len(numbers) >= 3:
            fits[kind] = logarithm(numbers, times)
    numbers, times = curve(rows, "triangles")
    few = [i for i, number in enumerate(numbers) if number <= 1.1 * BEND]
    if 3 <= len(few) < len(numbers):
        small = logarithm([numbers[i] for i in few], [times[i] for i in few])
        fits["beyond"] = {"fitted_up_to": numbers[few[-1]], "points": [
            {"triangles": n, "foretold": float(small["a"] + small["b"] * np.log2(n)), "measured": t}
            for n, t in zip(numbers[len(few) :], times[len(few) :], strict=True)
        ]}  # fmt: skip
    return fits


def logarithm(numbers: Sequence[float], values: Sequence[float]) -> dict[str, float]:
    """a + b log2(n) by least squares; `residual`: the root of the mean squared distance from it, over the mean of the values."""
    x, y = np.log2(np.asarray(numbers, np.float64)), np.asarray(values, np.float64)
    b, a = np.polyfit(x, y, 1)
    return {"a": float(a), "b": float(b), "residual": float(np.sqrt(np.mean((y - a - b * x) ** 2)) / np.mean(y))}
