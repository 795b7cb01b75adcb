"""What the replicates of a tile say: each pixel's mean, its variance, and sums over the tile's two sides that decide where to go on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class Moments:
    """Of some tiles at one number of samples.

    mean, variance : (n, th, tw, 3) float32, of each pixel over replicates, and the variance of that mean
    total, noise : (2, n) sums over a side's pixels and channels of the mean and of its variance
    square : (2, n) sums over a side's pixels of the squared covariances of channels
    bad : (2, n) pixels that are no finite numbers; they are in none of the sums
    """

    mean: NDArray[np.float32]
    variance: NDArray[np.float32]
    total: FloatArray
    noise: FloatArray
    square: FloatArray
    bad: FloatArray


def moments(values: FloatArray, inside: BoolArray, sides: BoolArray) -> Moments:
    """values : (replicates, n, th, tw, 3), their means; inside : (n, th, tw) pixels that are in the picture; sides : (2, th, tw)."""
    with np.errstate(invalid="ignore", over="ignore"):
        mean = values.mean(axis=0)
        spread = values - mean
    bright = mean.sum(-1)
    finite = np.isfinite(bright)
    good = inside & finite
    if not good.all():
        bright = np.where(good, bright, 0.0)
        spread[:, ~good] = 0.0
    count = len(values)
    variance = np.einsum("rnyxc,rnyxc->nyxc", spread, spread) / (count * (count - 1.0))
    trace = variance.sum(-1)
    square = _squares(spread / np.sqrt(count * (count - 1.0)), trace)
    with np.errstate(over="ignore"):
        kept = mean.astype(np.float32), variance.astype(np.float32)
    side = sides.reshape(2, -1).astype(np.float64)
    total, noise, squares, bad = (side @ a.reshape(len(a), -1).T for a in (bright, trace, square, (inside & ~finite).astype(np.float64)))
    return Moments(*kept, total, noise, np.maximum(squares, 0.0), bad)


def _squares(spread: FloatArray, trace: FloatArray) -> FloatArray:
    """(n, th, tw): the trace of the square of the true covariance of a pixel's channels, for normal replicates.

    With W the estimate from n degrees of freedom (Wishart 1928), tr W^2 has the mean (1 + 1/n) tr S^2 + (tr S)^2 / n and (tr W)^2 has
    (tr S)^2 + 2/n tr S^2. One degree cannot tell the two apart; then channels are taken to be noisy together, as they mostly are, which
    is at most 5/3 too much.
    """
    freedom = len(spread) - 1
    if freedom == 1:
        return np.asarray(trace * trace / 3.0)
    cross = np.einsum("rnyxc,rnyxd->nyxcd", spread, spread)
    own = np.einsum("nyxcd,nyxcd->nyx", cross, cross)
    return np.asarray((own - trace * trace / freedom) / (1.0 + 1.0 / freedom - 2.0 / freedom**2))


def flat(mean: FloatArray, inside: BoolArray, sides: BoolArray) -> Moments:
    """Tiles of which one sample a pixel, `mean`, is taken for the truth: without variance."""
    return moments(np.stack([mean, mean]), inside, sides)
