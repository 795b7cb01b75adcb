"""How far a picture is from the reference: in one number each, over all pixels."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.image.image import encode_srgb

FloatArray = NDArray[np.float64]

RELATIVE_FLOOR = 1e-2  #: what is added to the reference's square, so that black pixels do not decide (Rousselle and others 2011)
NO_FLIP = "FLIP needs its library: pip install flip-evaluator"


def squared_error(picture: NDArray[Any], reference: FloatArray) -> float:
    """The mean of squared differences over pixels and channels, both (h, w, 3) linear."""
    return float(np.mean((picture.astype(np.float64) - reference) ** 2))


def rmse(picture: NDArray[Any], reference: FloatArray) -> float:
    """The root of `squared_error`."""
    return float(np.sqrt(squared_error(picture, reference)))


def relative_mse(picture: NDArray[Any], reference: FloatArray) -> float:
    """The mean of (p - r)^2 / (r^2 + 0.01) over pixels and channels (Rousselle, Knaus and Zwicker 2011, equation 6)."""
    return float(np.mean((picture.astype(np.float64) - reference) ** 2 / (reference**2 + RELATIVE_FLOOR)))


def percentile_99(picture: NDArray[Any], reference: FloatArray) -> float:
    """The difference, of the channel where it is greatest, that 99% of pixels stay below."""
    return float(np.percentile(np.abs(picture.astype(np.float64) - reference).max(axis=-1), 99.0))


def flip(picture: NDArray[Any], reference: FloatArray) -> float | None:
    """Mean FLIP of both as seen on a screen, sRGB clamped to [0, 1] (Andersson and others 2020); None without its library."""
    library = _flip_library()
    if library is None:
        return None
    seen = [encode_srgb(np.clip(np.asarray(x, np.float64), 0.0, 1.0)).astype(np.float32) for x in (reference, picture)]
    return float(library.evaluate(*seen, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True)[1])


@cache
def _flip_library() -> Any:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import flip_evaluator
    except ImportError:
        return None
    return flip_evaluator
