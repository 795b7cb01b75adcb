"""Intervals of an error that was estimated from replicates: against tables, and counted over normal and rare errors."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.adaptive.intervals import Z95, Interval, error_interval, f_quantile
from clrt.adaptive.moments import moments
from clrt.adaptive.replicates import HALF, REPLICATES, replicate_seeds


@pytest.mark.parametrize(
    ("first", "second", "high"),  # upper 2.5% points of F, Pearson and Hartley 1972, table 18
    [(5, 30, 3.03), (10, 60, 2.27), (24, 120, 1.76), (60, 60, 1.67), (120, 120, 1.43)],
)
def test_quantiles_of_f_are_those_of_the_table(first: int, second: int, high: float) -> None:
    assert f_quantile(Z95, first, second) == pytest.approx(high, rel=0.02)
    assert f_quantile(-Z95, second, first) == pytest.approx(1.0 / high, rel=0.02)  # F(a, b) and 1 / F(b, a) are the same


def test_too_few_degrees_of_freedom_have_no_upper_end() -> None:
    assert f_quantile(Z95, 0.1, 0.6) == np.inf
    assert error_interval(1.0, 100.0, 6).high == np.inf
    assert Interval(1.0, 0.0, np.inf).to_json() == {"value": 1.0, "low": 0.0, "high": None}


def test_no_noise_is_no_error() -> None:
    assert error_interval(0.0, 0.0, 6) == Interval(0.0, 0.0, 0.0)


@pytest.mark.parametrize("rare", [False, True])
def test_interval_holds_the_true_error_of_a_picture(rare: bool) -> None:
    """400 pictures of 16 x 8 pixels of uneven noise, normal or of flashes of 1 in 8: the interval's 95% within chance (1 in 1000)."""
    generator = np.random.default_rng(7)
    strength = np.linspace(0.2, 1.0, 128).reshape(1, 8, 16, 1)
    held = 0
    for _ in range(400):
        shape = (REPLICATES, 1, 8, 16, 3)
        values = strength * ((generator.random(shape) < 1 / 8) * 8.0 - 1.0 if rare else generator.normal(size=shape))
        found = moments(values, np.ones((1, 8, 16), bool))
        both = HALF / (HALF - 1.0) / 4.0 + 0.25  # of ((a + b) / 2)^2 about its estimate: docs/error.md
        interval = error_interval(found.noise.sum() / 4.0 / 384, both * found.product.sum() / 384**2, 2 * HALF - 2)
        held += interval.low <= np.sqrt((found.mean.mean(axis=0).astype(float) ** 2).mean()) <= interval.high
    assert 0.95 - 3.3 * 0.011 <= held / 400 <= 0.95 + 3.3 * 0.011


def test_moments_are_those_of_numpy_and_leave_out_what_is_no_number() -> None:
    values = np.random.default_rng(3).normal(size=(REPLICATES, 2, 8, 16, 3))
    values[1, 1, 2, 3, 0] = np.nan
    inside = np.ones((2, 8, 16), bool)
    inside[0, :, 9:] = False
    found = moments(values, inside)
    half = values[HALF:]
    np.testing.assert_allclose(found.mean[1, 0], half[:, 0].mean(0), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(found.variance[1, 0, :, :9], half[:, 0, :, :9].var(0, ddof=1) / HALF, rtol=1e-5)
    assert (found.variance[:, 0, :, 9:] == 0.0).all()
    assert found.bad.tolist() == [0, 1]
    covariance = [np.einsum("ryxc,ryxd->yxcd", *[h[:, 0] - h[:, 0].mean(0)] * 2)[:, :9] / HALF / (HALF - 1) for h in (values[:HALF], half)]
    assert found.product[0] == pytest.approx((covariance[0] * covariance[1]).sum())
    assert np.isfinite(found.noise).all()


def test_seeds_of_replicates_differ_and_are_words() -> None:
    seeds = [word for seed in range(200) for word in replicate_seeds(seed)]
    assert len(set(seeds)) == len(seeds)
    assert 0 <= min(seeds) <= max(seeds) < 1 << 32
