"""What the replicates of a tile say: the mean of each half, its variance, and sums over the tile that decide where to go on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.adaptive.replicates import HALF, REPLICATES

FloatArray = NDArray[np.float64]
FreeArray = NDArray[np.floating]

_FREEDOM = HALF - 1
#: E[s^4] = sigma^4 (n + 1) / (n - 1) for n normal replicates: what a half's own squared variance is to be multiplied by
_SQUARE = _FREEDOM / (_FREEDOM + 2)


@dataclass(frozen=True)
class Moments:
    """Of some tiles at one number of samples; the first axis is half A, half B.

    mean, variance : (2, n, th, tw, 3) float32, the half's mean and the variance of that mean
    total, noise : (2, n) sums over pixels and channels of the mean and of its variance
    square : (2, n) sums over pixels of the squared covariances of channels of the half's mean, from that half alone
    product : (n,) the same as the product of both halves' covariances, unbiased
    bad : (n,) pixels that are no finite numbers; they are in none of the sums
    """

    mean: NDArray[np.float32]
    variance: NDArray[np.float32]
    total: FloatArray
    noise: FloatArray
    square: FloatArray
    product: FloatArray
    bad: NDArray[np.int64]


def moments(values: FloatArray, inside: NDArray[np.bool_]) -> Moments:
    """values : (REPLICATES, n, th, tw, 3) means of the replicates; inside : (n, th, tw) pixels that are in the picture."""
    with np.errstate(invalid="ignore", over="ignore"):
        finite = np.isfinite(values.sum(axis=0)).all(-1)
        halves = values.reshape(2, HALF, *values.shape[1:])
        mean = halves.mean(axis=1)
        spread = (halves - mean[:, None]) / np.sqrt(HALF * (HALF - 1.0))
    good = (inside & finite)[..., None]
    if not good.all():
        spread = np.where(good, spread, 0.0)
    covariance = [[np.einsum("hrnyx,hrnyx->hnyx", spread[..., c], spread[..., d]) for d in range(c + 1)] for c in range(3)]
    variance = np.stack([covariance[c][c] for c in range(3)], -1)
    square, product = np.zeros((2, values.shape[1])), np.zeros(values.shape[1])
    for c in range(3):
        for d in range(c + 1):
            twice = 1.0 if c == d else 2.0
            square += twice * np.einsum("hnyx,hnyx->hn", covariance[c][d], covariance[c][d])
            product += twice * np.einsum("nyx,nyx->n", covariance[c][d][0], covariance[c][d][1])
    total = np.where(good, mean, 0.0).sum(axis=(2, 3, 4))
    with np.errstate(over="ignore"):
        kept = mean.astype(np.float32), variance.astype(np.float32)
    return Moments(*kept, total, variance.sum(axis=(2, 3, 4)), square * _SQUARE, np.maximum(product, 0.0), (inside & ~finite).sum((1, 2)))


def flat(mean: FloatArray, inside: NDArray[np.bool_]) -> Moments:
    """Tiles of which one sample a pixel, `mean`, is taken for the truth: both halves have it, without variance."""
    return moments(np.broadcast_to(mean, (REPLICATES, *mean.shape)), inside)
