"""Error against time over how many reflections, refractions and bounces of light are followed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from clrt.features import Features
from clrt.precision import DEFAULT
from clrt.study import metrics
from clrt.study.bias import decomposition, gram_of
from clrt.study.numbers import Number, counted, in_turns, measured, number
from clrt.study.reference import Reference
from clrt.study.subject import FIRST_SEED, Picture, Shot, Subject


def measure(subject: Subject, reference: Reference) -> dict[str, Any]:
    """The part `depth`. Raises DeviceError, LimitError."""
    scene = subject.scene
    if not any(f.name == "bounce" for f in Features.of(scene).active):
        return {"rows": [], "note": "nothing in the scene sends rays on from where they hit"}
    shots: dict[int, Shot] = {}
    depths = depths_of(scene.depth, subject.plan.depths)
    for i, depth in enumerate(depths):
        subject.tell("depth: programs", 0.5 * i / len(depths))
        shallow = replace(scene, depth=depth)
        shots[depth] = Shot(replace(subject.prepared, scene=shallow), Features.of(shallow), DEFAULT, subject.device)
    subject.tell("depth: timing", 0.5)
    series = in_turns({str(d): shot.run for d, shot in shots.items()}, subject.plan.rounds, subject.plan.part_s)
    sampled = bool(subject.sampled_effects) or scene.samples > 1
    errors = _sampled_errors(subject, shots, reference) if sampled else _plain_errors(shots)
    rows = [{"depth": d, "seconds": measured(series[str(d)].seconds, "s"), "error": errors[d]} for d in depths]
    whole = f"RMSE against the picture of depth {depths[-1]}"
    return {"rows": rows, "against": "root of the squared bias against the reference, noise left out" if sampled else whole}


def depths_of(deepest: int, most: int) -> list[int]:
    """0, 1, 2, 4, 8, ... and the scene's own depth last; `most` of them, the lowest and the last."""
    found = sorted({0, 1, *(2**i for i in range(1, deepest.bit_length())), deepest})
    found = [d for d in found if d <= deepest]
    return found if len(found) <= most else [*found[: most - 1], deepest]


def _plain_errors(shots: dict[int, Shot]) -> dict[int, Any]:
    pictures = {depth: shot.picture() for depth, shot in shots.items()}
    whole = pictures[max(pictures)].astype(np.float64)
    return {depth: counted(metrics.rmse(picture, whole), "radiance") for depth, picture in pictures.items()}


def _sampled_errors(subject: Subject, shots: dict[int, Shot], reference: Reference) -> dict[int, Any]:
    """What each depth leaves out, without the noise of its few samples: the root of the squared bias over independent seeds."""
    truth, seeds = reference.mean, subject.plan.seeds
    errors: dict[int, list[Picture]] = {depth: [] for depth in shots}
    for seed in range(seeds):
        subject.tell("depth: errors", 0.6 + 0.4 * seed / seeds)
        for depth, shot in shots.items():
            errors[depth].append((shot.picture(subject.samples, FIRST_SEED + seed) - truth).astype(np.float32))
    floor = reference.squared_floor
    return {depth: _root(decomposition(gram_of(each), floor)["bias_squared"]) for depth, each in errors.items()}


def _root(square: Number) -> Number:
    """The root of a squared number, 0 where its estimate comes out below zero."""
    low, median, high = (max(0.0, square[key]) ** 0.5 for key in ("low", "median", "high"))
    return number(median, low, high, "radiance", square["runs"])
