"""Error against time over samples doubling, and squared error as bias and variance: both from the same pictures of independent seeds.

Rendered N by N in turns, a seed after the other; each picture has a seed of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.features import Features
from clrt.precision import DEFAULT
from clrt.stats import RunStats
from clrt.study import metrics
from clrt.study.bias import bias_part, gram_of
from clrt.study.numbers import bootstrapped, measured, number, resamples
from clrt.study.reference import RUNG, Reference, reference_of
from clrt.study.subject import FIRST_SEED, Picture, Shot, Subject
from clrt.timing import interleave

FloatArray = NDArray[np.float64]

_ABOVE_FLOOR = 2.0  #: times the floor: points nearer to it say more of the reference than of themselves
SEEDS_APART = 32  #: more than there are levels: what a point's seeds are does not depend on how many others there are
_PILOT = 2  #: samples that are timed before it is decided how many the largest point has


@dataclass(frozen=True, eq=False)
class Points:
    """levels : samples; seconds, rmse, relative, p99, flip : (levels, seeds); gram : per level (seeds, seeds), see bias.py."""

    levels: tuple[int, ...]
    seconds: FloatArray
    rmse: FloatArray
    relative: FloatArray
    p99: FloatArray
    flip: FloatArray | None
    gram: FloatArray


def measure(subject: Subject, key: dict[str, Any]) -> dict[str, Any]:
    """The parts `samples` and `bias`. Raises DeviceError, LimitError, ClrtError, OSError."""
    shot = subject.shot(DEFAULT, samples=2)
    largest = _largest(subject, shot)
    reference = reference_of(subject, subject.plan.reference_factor * largest, key)
    points = _points(subject, shot, reference, tuple(2**i for i in range(1, largest.bit_length())))
    floor = reference.floor()
    part: dict[str, Any] = {"rows": _rows(points), "floor": floor, "pareto": pareto(points), **_slope(points, reference.squared_floor)}
    part["reference"] = {"rung": RUNG, "samples": reference.samples, "batches": len(reference.batches),
                         "times_largest": reference.samples // largest}  # fmt: skip
    if not subject.sampled_effects:
        part["note"] = "nothing in the scene is sampled; the rows are over antialiasing samples"
    features = Features.of(subject.with_samples(2).scene)
    return {"samples": part, "bias": bias_part(points.levels, points.gram, reference.squared_floor, _named_bias(features))}


def _named_bias(features: Features) -> str:
    """What makes the mean another one than the scene's, as a render says it; empty where nothing does that is known."""
    return RunStats(effects=list(features.effects)).bias.removeprefix("biased: ")


def _largest(subject: Subject, shot: Shot) -> int:
    """Samples of the largest point: a power of two whose reference fits into the plan's seconds, as a pilot reckons."""
    plan = subject.plan
    subject.tell("samples: a pilot", 0.0)
    reference = subject.shot(RUNG, samples=2)
    pilot = interleave({"reference": partial(reference.run, _PILOT, FIRST_SEED)}, 2)["reference"].best / _PILOT
    room = plan.reference_s / max(1e-9, pilot * plan.reference_factor)
    return int(min(plan.most_samples, max(plan.least_samples, 2 ** int(np.log2(max(1.0, room))))))


def _points(subject: Subject, shot: Shot, reference: Reference, levels: tuple[int, ...]) -> Points:
    seeds, truth = subject.plan.seeds, reference.mean
    found: dict[str, list[list[float]]] = {name: [[] for _ in levels] for name in ("seconds", "rmse", "relative", "p99", "flip")}
    errors: list[list[Picture]] = [[] for _ in levels]
    shot.run(levels[0], FIRST_SEED)
    for seed in range(seeds):
        subject.tell("samples: the points", seed / seeds)
        pictures: dict[str, Picture] = {}
        turns = {str(n): partial(_keep, pictures, str(n), shot, n, FIRST_SEED + seed * SEEDS_APART + i) for i, n in enumerate(levels)}
        series = interleave(turns, 1, warm_ups=0)
        for i, n in enumerate(levels):
            picture = pictures[str(n)]
            found["seconds"][i] += series[str(n)].seconds
            found["rmse"][i].append(metrics.rmse(picture, truth))
            found["relative"][i].append(metrics.relative_mse(picture, truth))
            found["p99"][i].append(metrics.percentile_99(picture, truth))
            seen = metrics.flip(picture, truth) if seed < subject.plan.flip_seeds else None
            found["flip"][i] += [] if seen is None else [seen]
            errors[i].append((picture - truth).astype(np.float32))
    arrays = {name: np.array(values) for name, values in found.items()}
    return Points(levels, arrays["seconds"], arrays["rmse"], arrays["relative"], arrays["p99"],
                  arrays["flip"] if arrays["flip"].size else None, np.stack([gram_of(each) for each in errors]))  # fmt: skip


def _keep(pictures: dict[str, Picture], name: str, shot: Shot, samples: int, seed: int) -> None:
    pictures[name] = shot.picture(samples, seed)


def _rows(points: Points) -> list[dict[str, Any]]:
    rows = []
    for i, n in enumerate(points.levels):
        row: dict[str, Any] = {
            "samples": n, "seconds": measured(points.seconds[i].tolist(), "s"), "rmse": bootstrapped(points.rmse[i].tolist(), "radiance"),
            "relative_mse": bootstrapped(points.relative[i].tolist(), "1"), "p99": bootstrapped(points.p99[i].tolist(), "radiance"),
            "flip": None if points.flip is None else measured(points.flip[i].tolist(), "1"),
        }  # fmt: skip
        rows.append(row if points.flip is not None else {**row, "note": metrics.NO_FLIP})
    return rows


def pareto(points: Points) -> list[int]:
    """Rows that no other beats in both time and error, by medians."""
    seconds, errors = np.median(points.seconds, axis=1), np.median(points.rmse, axis=1)
    rows = range(len(points.levels))

    def beats(a: int, b: int) -> bool:
        return bool(seconds[a] <= seconds[b] and errors[a] <= errors[b] and (seconds[a] < seconds[b] or errors[a] < errors[b]))

    return [i for i in rows if not any(beats(other, i) for other in rows)]


def _slope(points: Points, squared_floor: float) -> dict[str, Any]:
    """The slope of log error over log samples, the reference's share of the error taken off, with a bootstrap over seeds."""
    squares = points.rmse**2
    used = squares.mean(axis=1) > _ABOVE_FLOOR**2 * squared_floor
    if np.count_nonzero(used) < 3 or not (squares.mean(axis=1)[used] > 0.0).all():
        return {"slope": None, "slope_note": "fewer than three points lie above the reference's own error: no slope"}
    slope, low, high = slope_of(np.array(points.levels)[used], squares[used], squared_floor)
    return {"slope": number(slope, low, high, "log error / log samples", squares.shape[1])}


def slope_of(levels: NDArray[np.int64], squares: FloatArray, squared_floor: float) -> tuple[float, float, float]:
    """The slope of log RMSE over log samples by least squares, and its 95% bootstrap interval over seeds.

    levels : (l,) samples; squares : (l, s) squared errors; squared_floor : the reference's part of each
    """
    x = np.log(levels) - np.log(levels).mean()

    def fit(means: FloatArray) -> FloatArray:
        corrected = np.maximum(means - squared_floor, 1e-3 * means)
        return np.asarray(0.5 * np.log(corrected) @ x / (x @ x))

    drawn = np.take_along_axis(squares[None], resamples((squares.shape[0], squares.shape[1])), axis=2)
    low, high = np.percentile(fit(drawn.mean(axis=2)), (2.5, 97.5))
    return float(fit(squares.mean(axis=1))), float(low), float(high)

