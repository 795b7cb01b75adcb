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

    mean, error : (n, th, tw, 3) float32, of each pixel over replicates, and the standard error of that mean
    total, noise : (2, n) sums over a side's pixels and channels of the mean and of its variance
    square : (2, n) sums over a side's pixels of the squared covariances of channels
    bad : (2, n) pixels that are no finite numbers; they are in none of the sums
    """

    mean: NDArray[np.float32]
    error: NDArray[np.float32]
    total: FloatArray
    noise: FloatArray
    square: FloatArray
    bad: FloatArray


def moments(values: FloatArray, inside: BoolArray, sides: BoolArray, before: NDArray[np.float32] | None = None) -> Moments:
    """What replicates say of tiles.

    values : (replicates, n, th, tw, 3), their means; inside : (n, th, tw) pixels that are in the picture; sides : (2, th, tw)
    before : as values, of the first half of their samples, where there were some
    """
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
    side = sides.reshape(2, -1).astype(np.float64)
    square = side @ _flat(_squares(spread / np.sqrt(count * (count - 1.0)), trace))
    if count == 2 and before is not None:  # either may be too small: one where noise is not normal, one where it narrows to fewer pixels
        square = np.maximum(square, _squares_of_steps(np.where(good[..., None], values - before, 0.0), side @ _flat(trace), side))
    with np.errstate(over="ignore"):
        kept = mean.astype(np.float32), np.sqrt(variance).astype(np.float32)
    total, noise, bad = (side @ _flat(a) for a in (bright, trace, (inside & ~finite).astype(np.float64)))
    return Moments(*kept, total, noise, np.maximum(square, 0.0), bad)


def _flat(pixels: FloatArray) -> FloatArray:
    """(pixels of a tile, n) of (n, th, tw)."""
    return np.asarray(pixels.reshape(len(pixels), -1).T)


def _squares_of_steps(steps: FloatArray, noise: FloatArray, side: FloatArray) -> FloatArray:
    """(2, n): the sum over a side of the trace of the square of the true covariance of a pixel's channels, whatever its distribution.

    steps : (2, n, th, tw, 3), how far each replicate's mean moved as its samples doubled. Both move independently and alike, so the
    square of the product of their steps has the mean tr D^2, D the covariance of a step; that of the mean is taken to be in proportion,
    by the ratio of `noise`, (2, n) sums of its trace, to that of the steps.
    """
    first, second = steps[0], steps[1]
    product = np.einsum("nyxc,nyxc->nyx", first, second) ** 2
    moved = side @ _flat(np.einsum("rnyxc,rnyxc->nyx", steps, steps) / 2.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(moved > 0.0, noise / moved, 0.0)
    return np.asarray(ratio * ratio * (side @ _flat(product)))


def _squares(spread: FloatArray, trace: FloatArray) -> FloatArray:
    """(n, th, tw): the same of each pixel, for normal replicates.

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
