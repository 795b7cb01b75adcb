"""Intervals of an error that was estimated from replicates: against tables, and counted over normal and rare errors."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.adaptive.intervals import Z95, Interval, error_interval, f_quantile
from clrt.adaptive.ledger import Ledger
from clrt.adaptive.moments import moments
from clrt.adaptive.replicates import MAP_REPLICATES, Grid, replicate_seeds


@pytest.mark.parametrize(
    ("first", "second", "high"),  # upper 2.5% points of F, Pearson and Hartley 1972, table 18
    [(5, 30, 3.03), (10, 60, 2.27), (24, 120, 1.76), (60, 60, 1.67), (120, 120, 1.43)],
)
def test_quantiles_of_f_are_those_of_the_table(first: int, second: int, high: float) -> None:
    assert f_quantile(Z95, first, second) == pytest.approx(high, rel=0.02)
    assert f_quantile(-Z95, second, first) == pytest.approx(1.0 / high, rel=0.02)  # F(a, b) and 1 / F(b, a) are the same


def test_standard_error_of_what_is_very_bright_or_very_dark_is_a_number() -> None:
    """Its square has no place in a float32."""
    grid = Grid(16, 8)
    for scale in (1e30, 1e-30):
        values = np.broadcast_to(scale * np.array([1.0, 1.1]).reshape(2, 1, 1, 1, 1), (2, 1, 8, 16, 3))
        ledger = Ledger(grid, 2)
        ledger.put(np.arange(1), 0, moments(values, grid.inside, grid.sides))
        np.testing.assert_allclose(ledger.picture(np.zeros((2, 1), np.int64))[1], 0.05 * scale, rtol=1e-5)


def test_too_few_degrees_of_freedom_have_no_upper_end() -> None:
    assert f_quantile(Z95, 0.1, 0.6) == np.inf
    assert error_interval(1.0, 100.0, 6).high == np.inf
    assert Interval(1.0, 0.0, np.inf).to_json() == {"value": 1.0, "low": 0.0, "high": None}


def test_no_noise_is_no_error() -> None:
    assert error_interval(0.0, 0.0, 6) == Interval(0.0, 0.0, 0.0)


@pytest.mark.parametrize(("rare", "count"), [(False, 2), (True, 2), (False, MAP_REPLICATES), (True, MAP_REPLICATES)])
def test_interval_holds_the_true_error_of_a_picture(rare: bool, count: int) -> None:
    """400 pictures of 32 x 24 pixels of uneven grey noise, normal or of flashes of 1 in 8: the interval's 95% within chance (1 in 1000).

    At the first look the noise is taken for normal; a few flashes are not: there the interval may be wider than it must.
    """
    generator, grid = np.random.default_rng(7), Grid(32, 24)
    strength = np.linspace(0.2, 1.0, 128).reshape(1, 8, 16, 1)
    held = 0
    for _ in range(400):
        shape = (count, grid.count, 8, 16, 1)
        noise = strength * ((generator.random(shape) < 1 / 8) * 8.0 - 1.0 if rare else generator.normal(size=shape))
        values = 1e3 + np.broadcast_to(noise, (*shape[:-1], 3))
        ledger = Ledger(grid, count)
        ledger.put(np.arange(grid.count), 0, moments(values, grid.inside, grid.sides))
        interval = ledger.error(np.zeros((2, grid.count), np.int64)).scaled(float(values.mean()))
        held += interval.low <= np.sqrt((noise.mean(axis=0) ** 2).mean()) <= interval.high
    assert 0.95 - 3.3 * 0.011 <= held / 400 <= (1.0 if rare else 0.95 + 3.3 * 0.011)


def test_moments_are_those_of_numpy_and_leave_out_what_is_no_number() -> None:
    grid = Grid(32, 8)
    values = np.random.default_rng(3).normal(size=(MAP_REPLICATES, 2, 8, 16, 3))
    values[1, 1, 2, 3, 0] = np.nan
    inside = np.ones((2, 8, 16), bool)
    inside[0, :, 9:] = False
    found = moments(values, inside, grid.sides)
    np.testing.assert_allclose(found.mean[0], values[:, 0].mean(0), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(found.error[0, :, :9], values[:, 0, :, :9].std(0, ddof=1) / MAP_REPLICATES**0.5, rtol=1e-5)
    assert (found.error[0, :, 9:] == 0.0).all()
    assert found.bad.sum(0).tolist() == [0, 1]
    y, x = np.indices((8, 16))
    for side in (0, 1):
        own = ((x + y) % 2 == side) & inside[0]
        assert found.noise[side, 0] == pytest.approx(float((values[:, 0].var(0, ddof=1) / MAP_REPLICATES)[own].sum()))
        assert found.total[side, 0] == pytest.approx(float(values[:, 0].mean(0)[own].sum()))
    assert np.isfinite(found.noise).all()


@pytest.mark.parametrize(("count", "grey"), [(2, True), (3, False), (MAP_REPLICATES, True), (MAP_REPLICATES, False)])
def test_squares_are_unbiased_for_normal_noise(count: int, grey: bool) -> None:
    """The sum of squared covariances of three channels with unit variance, alike or independent: 9 or 3 a pixel, over count^2."""
    grid = Grid(160, 160)
    shape = (count, grid.count, 8, 16, 1 if grey else 3)
    values = np.broadcast_to(np.random.default_rng(4).normal(size=shape), (*shape[:-1], 3))
    found = moments(values, grid.inside, grid.sides).square.sum() / 160**2
    assert found == pytest.approx((9.0 if grey else 3.0) / count**2, rel=0.1)


@pytest.mark.parametrize("shape", ["normal", "either", "rare"])
def test_squares_are_known_whatever_the_noise_once_samples_doubled(shape: str) -> None:
    """Independent samples of three colours whose variances are 1, 4 and 0.25: after n of them the mean of two has these over 2 n.

    The larger of two estimates is taken tile by tile: so up to two thirds too much, but not too little.
    """
    grid, generator, n = Grid(320, 320), np.random.default_rng(6), 4
    size = (n, 2, grid.count, 8, 16, 3)
    draws = {"normal": generator.normal(size=size), "either": np.sign(generator.random(size) - 0.5),
             "rare": ((generator.random(size) < 0.1) - 0.1) / 0.3}  # fmt: skip
    samples = draws[shape] * (1.0, 2.0, 0.5)
    before = samples[: n // 2].mean(axis=0).astype(np.float32)
    found = moments(samples.mean(axis=0), grid.inside, grid.sides, before).square.sum() / 320**2
    assert 0.97 <= found / ((1.0 + 16.0 + 0.0625) / (2 * n) ** 2) <= 1.67


def test_seeds_of_replicates_differ_and_are_words() -> None:
    seeds = [word for seed in range(200) for word in replicate_seeds(seed)]
    assert len(set(seeds)) == len(seeds)
    assert 0 <= min(seeds) <= max(seeds) < 1 << 32
