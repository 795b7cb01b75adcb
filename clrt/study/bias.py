"""Squared error over seeds as the square of the bias and the variance, without bias themselves.

With e_s the error of seed s against the reference, and <,> the mean over the picture of a product: <e_s, e_t> of two different seeds is the
squared bias in expectation, plus the reference's own squared error, which all seeds share; <e_s, e_s> has the variance on top.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.study.numbers import Number, jackknifed

FloatArray = NDArray[np.float64]

_UNIT = "radiance^2"
_FLAT = 0.5  #: of the squared bias a few doublings before that a curve which flattens has kept
_SEEN_FROM = 0.1  #: of the squared error at the largest point, below which a bias is no reason for a curve to flatten


def bias_part(levels: Sequence[int], gram: FloatArray, squared_floor: float, named: str) -> dict[str, Any]:
    """The part `bias`. gram : (levels, seeds, seeds) of <e_s, e_t>; named : what is known to bias, for the verdict, or empty."""
    rows = [{"samples": n, **decomposition(each, squared_floor)} for n, each in zip(levels, gram, strict=True)]
    return {"rows": rows, "verdict": verdict(rows, squared_floor, named)}


def gram_of(errors: Sequence[NDArray[np.float32]]) -> FloatArray:
    """(seeds, seeds): means over the picture of products of two seeds' errors, in float64."""
    flat = np.stack([each.ravel() for each in errors]).astype(np.float64)
    return np.asarray(flat @ flat.T / flat.shape[1])


def decomposition(gram: FloatArray, squared_floor: float) -> dict[str, Number]:
    """squared_error, bias_squared, variance of one number of samples, the reference's own error taken off."""
    def same(values: FloatArray) -> float:
        return float(np.trace(values)) / len(values)

    def other(values: FloatArray) -> float:
        return float(values.sum() - np.trace(values)) / (len(values) * (len(values) - 1))

    return {
        "squared_error": jackknifed(gram, lambda g: same(g) - squared_floor, _UNIT),
        "bias_squared": jackknifed(gram, lambda g: other(g) - squared_floor, _UNIT),
        "variance": jackknifed(gram, lambda g: same(g) - other(g), _UNIT),
    }


def verdict(rows: list[dict[str, Any]], squared_floor: float, named: str) -> str:
    """"unbiased", or "biased: ...": the squared bias lies above the reference's own error, is a good part of the error, and stays."""
    last, before = rows[-1], rows[max(0, len(rows) - 3)]
    seen = last["bias_squared"]["low"] > squared_floor and last["bias_squared"]["median"] > _SEEN_FROM * last["squared_error"]["median"]
    stays = last["bias_squared"]["median"] >= _FLAT * before["bias_squared"]["median"]
    if not (seen and stays):
        return "unbiased"
    reason = named or "the error stays, whatever the number of samples"
    return f"biased: {reason} (root of the squared bias {last['bias_squared']['median'] ** 0.5:.3g} at {last['samples']} samples)"
