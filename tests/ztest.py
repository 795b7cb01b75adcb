"""Are two noisy pictures pictures of the same thing? Tests with a stated rate of false alarms, in NumPy alone.

A device's picture comes as batches: means over independent seeds. The reference's comes as a mean and its variance. They are compared by
Welch's t pixel by pixel, by blocks of pixels and as a whole, two-sided. Each of the three scales gets a third of the level
(Bonferroni); within a scale it is shared out over pixels and channels by Sidak's rule, so that a picture without fault is refused with
the probability `level` at most (measured in tests/test_ztest.py). Student's t asks for means that are about normal: enough samples.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import erfc, exp, lgamma, log, sqrt

import numpy as np
from numpy.typing import NDArray

import clrt
from clrt.scene.model import Scene

FloatArray = NDArray[np.float64]

LEVEL = 0.01
ROUNDING = 4e-6  #: relative, of kernels' numbers
BLOCK = 4  #: pixels along the side of a block
MOST_FREEDOM = 400  #: degrees of freedom from which on Student's t is taken as that of this many: tails a little wide


@dataclass(frozen=True)
class Verdict:
    """accepted : no scale has a number whose p is below its share of the level; worst : the finding nearest to a refusal, in words."""

    accepted: bool
    worst: str


def device_batches(scene: Scene, samples: int, seeds: range, precision: str = "watertight") -> FloatArray:
    """(k, h, w, 3) float64: the scene rendered once a seed, each the mean of `samples`."""
    sampled = replace(scene, samples=samples)
    return np.stack([np.asarray(clrt.render(sampled, seed=seed, precision=precision).pixels, np.float64) for seed in seeds])


def compare(
    batches: FloatArray, mean: FloatArray, variance_of_mean: FloatArray, level: float = LEVEL, rounding: float = ROUNDING,
    pixels: bool = True,
) -> Verdict:  # fmt: skip
    """Welch's t-test of the batches' mean against `mean`, at all scales.

    batches : (k, h, w, 3), k >= 2, independent; mean, variance_of_mean : (h, w, 3) of independent pixels
    rounding : of the batches' numbers, relative; it counts as a standard deviation, so that equal numbers without variance are equal
    pixels : look at single pixels, too; their means are not normal where much of what they get comes in few of their samples
    """
    findings: list[tuple[float, str]] = []
    height, width = mean.shape[:2]
    scales = (("pixel", 1, 1), ("block", BLOCK, BLOCK), ("picture", height, width))
    for name, rows, columns in scales[0 if pixels else 1 :]:
        few, one = _blocks(batches, rows, columns), _blocks(mean[None], rows, columns)[0]
        spread = _blocks(variance_of_mean[None], rows, columns)[0] / _sizes(height, width, rows, columns)
        p, t = welch(few, one, spread, rounding)
        place = np.unravel_index(p.argmin(), p.shape)
        share = 1.0 - (1.0 - level / 3.0) ** (1.0 / p.size)
        text = (f"{name} (row {place[0] * rows}, column {place[1] * columns}, channel {place[2]}): {few.mean(axis=0)[place]:.6g} "
                f"against {one[place]:.6g}, t = {t[place]:.2f}, p = {p[place]:.1e} of {share:.1e}")  # fmt: skip
        findings.append((float(p[place] / share), text))
    least, text = min(findings)
    return Verdict(least >= 1.0, text)


def assert_same(
    batches: FloatArray, mean: FloatArray, variance_of_mean: FloatArray, rounding: float = ROUNDING, pixels: bool = True
) -> None:
    """Fail, and say where, if the two pictures differ by more than chance and `rounding`. See `compare`."""
    verdict = compare(batches, mean, variance_of_mean, rounding=rounding, pixels=pixels)
    assert verdict.accepted, verdict.worst


def welch(batches: FloatArray, mean: FloatArray, variance_of_mean: FloatArray, rounding: float) -> tuple[FloatArray, FloatArray]:
    """Two-sided p and t, number by number: batches (k, ...) against a mean and its variance, the latter taken as known.

    Degrees of freedom by Welch and Satterthwaite: (k - 1) (total variance / the batches' part)^2.
    """
    k = len(batches)
    own = batches.mean(axis=0)
    variance = batches.var(axis=0, ddof=1) / k
    scale = np.maximum(np.abs(own), np.abs(mean))
    total = variance + variance_of_mean + (rounding * scale) ** 2 + np.finfo(np.float64).tiny
    t = (own - mean) / np.sqrt(total)
    share = np.maximum(variance / total, 1e-6)
    freedom = np.minimum((k - 1) / share**2, MOST_FREEDOM).astype(np.int64)
    return student_p(t, freedom), t


def student_p(t: FloatArray, freedom: NDArray[np.int64]) -> FloatArray:
    """P(|T| >= |t|) of Student's t, whole degrees of freedom: the finite sums of Abramowitz and Stegun 26.7.3 and 26.7.4.

    With a = atan(|t| / sqrt(n)), s = sin a, c2 = cos^2 a. Right to about 1e-14 absolute, which is far below any share of a level here.
    """
    t, freedom = np.broadcast_arrays(np.abs(np.asarray(t, np.float64)), freedom)
    p = np.empty(t.shape)
    for n in np.unique(freedom).tolist():
        rows = freedom == n
        angle = np.arctan(t[rows] / np.sqrt(n))
        s, c2 = np.sin(angle), np.cos(angle) ** 2
        odd = n % 2
        term = (np.cos(angle) if odd else np.ones_like(s)) * (n > 1)
        total = term.copy()
        for j in range(1 + odd, n - 2, 2):
            term = term * c2 * (j / (j + 1.0))
            total += term
        inside = 2.0 / np.pi * (angle + s * total) if odd else s * total
        p[rows] = np.maximum(1.0 - inside, 0.0)
    return p


def chi_square_p(statistic: float, freedom: int) -> float:
    """P(X >= statistic) of chi-square, whole degrees of freedom: Abramowitz and Stegun 26.4.4 and 26.4.5."""
    if statistic <= 0.0:
        return 1.0
    half = statistic / 2.0
    first = 0.5 * (freedom % 2)
    terms = (exp(-half + (first + j) * log(half) - lgamma(first + j + 1.0)) for j in range(freedom // 2 + freedom % 2)
             if first + j <= freedom / 2.0 - 1.0)  # fmt: skip
    return min(1.0, (erfc(sqrt(half)) if freedom % 2 else 0.0) + sum(terms))


def chi_square(counts: NDArray[np.int64], expected: FloatArray, least: float = 5.0) -> tuple[float, int]:
    """Pearson's statistic and its degrees of freedom; cells of an expectation below `least` are put together, rarest first.

    The expectations' sum is that of the counts: the density is normalised, or no fit is possible.
    """
    order = np.argsort(expected, axis=None)
    n, e = counts.ravel()[order].astype(np.float64), expected.ravel()[order]
    cut = int(np.searchsorted(e, least))
    # The rare cells become one, and that one grows until it is not rare.
    while 0 < cut < len(e) and e[:cut].sum() < least:
        cut += 1
    if cut:
        n, e = np.r_[n[:cut].sum(), n[cut:]], np.r_[e[:cut].sum(), e[cut:]]
    keep = e > 0.0
    if (n[~keep] > 0.0).any():
        return np.inf, max(int(keep.sum()) - 1, 1)
    return float(((n[keep] - e[keep]) ** 2 / e[keep]).sum()), max(int(keep.sum()) - 1, 1)


def _blocks(values: FloatArray, rows: int, columns: int) -> FloatArray:
    """(k, h, w, c) -> means over blocks of rows x columns; those at the far edges are smaller."""
    sums = np.add.reduceat(np.add.reduceat(values, np.arange(0, values.shape[1], rows), axis=1),
                           np.arange(0, values.shape[2], columns), axis=2)  # fmt: skip
    return np.asarray(sums / _sizes(values.shape[1], values.shape[2], rows, columns))


def _sizes(height: int, width: int, rows: int, columns: int) -> FloatArray:
    """(block rows, block columns, 1) pixels of each block."""
    down, across = (np.diff(np.r_[np.arange(0, whole, part), whole]) for whole, part in ((height, rows), (width, columns)))
    return np.asarray(down[:, None, None] * across[None, :, None], np.float64)
