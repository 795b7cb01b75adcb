"""Many noisy pictures of one scene as one: mean, variance, and the pixels whose samples were not numbers to add up."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.errors import ClrtError

FloatArray = NDArray[np.float64]

LIMIT = 1e18  #: of a sample's magnitude: its square is still a float32


class Film:
    """The running mean and variance of samples, pixel by pixel and channel by channel, in float64.

    Means are updated by their differences (Welford 1962; Chan, Golub and LeVeque 1983 for whole pictures and other films), so that the
    sum neither stalls nor cancels: after n additions the mean's relative error is below n 2^-53 for samples of one sign, 1e-8 for 2^26.

    A sample that is NaN, infinite or beyond `limit` in any channel is left out of its pixel, and counted there: one bad sample spoils
    neither the pixel nor the picture, and does not go unseen. Leaving out a legitimate sample would bias the mean, so `limit` is far above
    any radiance that a picture shows.
    """

    def __init__(self, width: int, height: int, channels: int = 3, *, limit: float = LIMIT) -> None:
        """Raises ClrtError for a size below 1 or a limit that is not a positive number."""
        if min(width, height, channels) < 1 or not 0.0 < limit < np.inf:
            raise ClrtError(f"a film of {width} x {height} x {channels} with limit {limit:g} is out of range; all must be positive")
        self.limit = float(limit)
        self.mean: FloatArray = np.zeros((height, width, channels))  #: (h, w, c); 0 where no sample counts
        self.count = np.zeros((height, width), np.int64)  #: (h, w) samples that count
        self.rejected = np.zeros((height, width), np.int64)  #: (h, w) samples left out
        self._square: FloatArray = np.zeros((height, width, channels))  # sum of squared differences from the mean

    @property
    def flagged(self) -> NDArray[np.bool_]:
        """(h, w): pixels that had a sample left out."""
        return self.rejected > 0

    @property
    def variance(self) -> FloatArray:
        """(h, w, c) of a single sample, unbiased; infinite where fewer than two samples count."""
        return self._per(self.count - 1)

    @property
    def variance_of_mean(self) -> FloatArray:
        """(h, w, c): the variance over the count; its root is the standard error of `mean`. Infinite where fewer than two count."""
        return np.asarray(self.variance / np.maximum(self.count, 1)[..., None])

    def _per(self, divisor: NDArray[np.int64]) -> FloatArray:
        out = np.full_like(self._square, np.inf)
        return np.divide(self._square, divisor[..., None], out=out, where=divisor[..., None] > 0)

    def add(self, pictures: NDArray[Any]) -> None:
        """One picture (h, w, c), or several (n, h, w, c), of any float type. Raises ClrtError for another shape."""
        samples = np.asarray(pictures, np.float64)
        samples = samples[None] if samples.ndim == self.mean.ndim else samples
        if samples.shape[1:] != self.mean.shape:
            raise ClrtError(f"a picture of the shape {np.shape(pictures)} does not fit a film of {self.mean.shape}")
        with np.errstate(invalid="ignore"):
            good = np.asarray((np.abs(samples) <= self.limit).all(axis=-1))
        if good.all():
            count, kept = np.full_like(self.count, len(samples)), samples
        else:
            count, kept = np.asarray(np.count_nonzero(good, axis=0), np.int64), np.where(good[..., None], samples, 0.0)
        mean = kept.sum(axis=0) / np.maximum(count, 1)[..., None]
        spread = kept - mean
        if kept is not samples:
            spread *= good[..., None]
        self._combine(mean, np.einsum("n...,n...->...", spread, spread), count)
        self.rejected += len(samples) - count

    def merge(self, other: Film) -> None:
        """All samples of another film of the same size. Raises ClrtError for another size."""
        if other.mean.shape != self.mean.shape:
            raise ClrtError(f"a film of {other.mean.shape} does not fit one of {self.mean.shape}")
        self._combine(other.mean, other._square, other.count)
        self.rejected += other.rejected

    def _combine(self, mean: FloatArray, square: FloatArray, count: NDArray[np.int64]) -> None:
        total = self.count + count
        share = np.divide(count, total, out=np.zeros(total.shape), where=total > 0)[..., None]
        shift = mean - self.mean
        self._square += square + shift**2 * (self.count[..., None] * share)
        self.mean += shift * share
        self.count = total
