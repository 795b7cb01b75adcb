"""With which chances directions to an environment are drawn, as whole numbers of words.

Directions are drawn by words of 32 bits. Each row, and each texel of its row, gets a whole number of the 2^32 words, at least one where it
shines and none where it does not, so that the chances that kernels compute are those by which they draw, without rounding.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import Environment, FloatArray

WORDS = 1 << 32
_LUMINANCE = (0.2126, 0.7152, 0.0722)  #: of linear red, green, blue (ITU-R BT.709)


def cosines(height: int) -> FloatArray:
    """(h + 1,) of the angles from +y of the rows' edges. By a sine, which is exact in the middle and keeps its digits around it."""
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    edges[0], edges[-1] = 1.0, -1.0
    return np.asarray(edges)


def luminance(environment: Environment) -> FloatArray:
    """(h, w) of each texel."""
    red, green, blue = np.moveaxis(environment.radiance, -1, 0)
    return np.asarray(_LUMINANCE[0] * red + _LUMINANCE[1] * green + _LUMINANCE[2] * blue)


def row_words(environment: Environment) -> NDArray[np.int64]:
    """(h,) words of each row, in proportion to its luminance times solid angle."""
    edges = cosines(len(environment.radiance))
    return np.asarray(_whole((luminance(environment).sum(axis=1) * (edges[:-1] - edges[1:]))[None])[0])


def texel_words(environment: Environment) -> NDArray[np.int64]:
    """(h, w) words of each texel of a row, in proportion to its luminance; a row that does not shine has none."""
    return _whole(luminance(environment))


def lit_count(weights: NDArray[np.int64] | FloatArray) -> NDArray[np.int64]:
    """(...) of weights (..., n): how many there are from the first to the last that is drawn at all."""
    drawn = weights > 0
    return np.where(drawn.any(axis=-1), drawn.shape[-1] - drawn[..., ::-1].argmax(axis=-1), 0)


def beginnings(words: NDArray[np.int64]) -> NDArray[np.uint32]:
    """(..., n) the word at which each begins; what stands behind the last that is drawn is never looked at."""
    return np.asarray(np.minimum(np.cumsum(words, axis=-1) - words, WORDS - 1), np.uint32)


def _whole(weights: FloatArray) -> NDArray[np.int64]:
    """Whole numbers (m, n) whose rows add up to 2^32, in proportion to `weights` (m, n): none for 0, else at least one. n <= 2^16."""
    most = weights.max(axis=1, keepdims=True)
    weights = np.divide(weights, most, where=most > 0.0, out=np.zeros_like(weights))  # by the greatest first: no sum over- or underflows
    total = weights.sum(axis=1, keepdims=True)
    words = np.asarray(weights * (WORDS / np.maximum(total, 1.0)), np.int64)
    words += (weights > 0.0) & (words == 0)
    # What rounding left over, at most one a weight, goes to the greatest, which has at least 2^16 - 1.
    left = np.where(total[:, 0] > 0.0, WORDS - words.sum(axis=1), 0)
    words[np.arange(len(words)), weights.argmax(axis=1)] += left
    return words
