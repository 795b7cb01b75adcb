"""The tests of noisy pictures, tested: tables of the distributions, false alarms counted over seeded trials, biases that are found."""

from __future__ import annotations

import math

import numpy as np
import pytest
from ztest import chi_square, chi_square_p, compare, student_p

SHAPE = (12, 12, 3)
#: the pixels' own means and deviations, from dark to bright
MEAN = np.linspace(0.05, 2.0, 144).reshape(12, 12, 1) * np.array([1.0, 0.7, 0.3])


def noisy(rng: np.random.Generator, values: np.ndarray, samples: int, skewed: bool) -> np.ndarray:
    """The mean of `samples` numbers of this mean, deviation 1/2 of it (normal) or all of it (exponential)."""
    if skewed:
        return values * rng.gamma(samples, 1.0 / samples, values.shape)
    return values * (1.0 + 0.5 / math.sqrt(samples) * rng.standard_normal(values.shape))


def trial(rng: np.random.Generator, skewed: bool, factor: np.ndarray | float = 1.0, level: float = 0.01, batches: int = 12) -> bool:
    """Whether pictures are accepted of which the batches' mean is `factor` times the other's."""
    few = np.stack([noisy(rng, MEAN * factor, 64, skewed) for _ in range(batches)])
    deviation = MEAN * (1.0 if skewed else 0.5)
    return compare(few, noisy(rng, MEAN, 1000, skewed), deviation**2 / 1000, level).accepted


@pytest.mark.parametrize(
    ("t", "freedom", "p"),
    [(1.0, 1, 0.5), (12.7062047, 1, 0.05), (4.30265273, 2, 0.05), (3.18244631, 3, 0.05), (2.22813885, 10, 0.05), (3.24983554, 9, 0.01),
     (4.78091259, 9, 0.001), (1.98397152, 100, 0.05), (0.0, 7, 1.0)],
)  # fmt: skip
def test_student_p_matches_tables(t: float, freedom: int, p: float) -> None:
    assert student_p(np.array([t]), np.array([freedom]))[0] == pytest.approx(p, rel=2e-4)
    assert student_p(np.array([-t]), np.array([freedom]))[0] == student_p(np.array([t]), np.array([freedom]))[0]


@pytest.mark.parametrize(
    ("x", "freedom", "p"),
    [(3.84145882, 1, 0.05), (5.99146455, 2, 0.05), (7.81472790, 3, 0.05), (18.3070381, 10, 0.05), (23.2092512, 10, 0.01),
     (24.7249703, 11, 0.01), (124.342113, 100, 0.05), (123.225221, 99, 0.05), (0.0, 4, 1.0)],
)  # fmt: skip
def test_chi_square_p_matches_tables(x: float, freedom: int, p: float) -> None:
    assert chi_square_p(x, freedom) == pytest.approx(p, rel=1e-5)


def test_chi_square_takes_its_own_density_and_refuses_another() -> None:
    rng = np.random.default_rng(5)
    p = np.linspace(0.0, 1.0, 64) ** 3
    p /= p.sum()
    values = [chi_square_p(*chi_square(rng.multinomial(4000, p), 4000 * p)) for _ in range(200)]
    assert 0.0 < np.mean(np.array(values) < 0.05) < 0.1  # 0.05 +- 3 deviations
    other = 0.9 * p + 0.1 / 64
    assert chi_square_p(*chi_square(rng.multinomial(4000, other), 4000 * p)) < 1e-6


@pytest.mark.parametrize("skewed", [pytest.param(False, marks=pytest.mark.slow), True])
def test_equal_pictures_are_refused_as_often_as_stated(skewed: bool) -> None:
    """At level 10%: of 200 trials at most 20 + 3 deviations; and not far fewer, or it would be blind."""
    rng = np.random.default_rng(11 + skewed)
    refused = sum(not trial(rng, skewed, level=0.1) for _ in range(200))
    assert 4 <= refused <= 20 + 3 * math.sqrt(200 * 0.1 * 0.9)


def test_equal_pictures_pass_at_the_usual_level() -> None:
    rng = np.random.default_rng(3)
    assert sum(not trial(rng, True) for _ in range(100)) <= 4


def test_bias_of_two_percent_in_a_region_is_found() -> None:
    """A fifth of the picture is too bright by 2%, a quarter to a half of a pixel's own deviation: seen by blocks and as a whole."""
    rng = np.random.default_rng(7)
    factor = np.ones(SHAPE)
    factor[8:, 2:10] = 1.02
    assert sum(trial(rng, False, factor, batches=24) for _ in range(20)) <= 1


def test_bias_of_one_in_a_hundred_everywhere_is_found() -> None:
    rng = np.random.default_rng(8)
    assert sum(trial(rng, False, 1.01, batches=24) for _ in range(20)) <= 1


def test_single_wrong_pixel_is_found_and_named() -> None:
    rng = np.random.default_rng(9)
    few = np.stack([noisy(rng, MEAN, 64, False) for _ in range(12)])
    few[:, 5, 7, 1] *= 1.3
    verdict = compare(few, MEAN, np.zeros(SHAPE))
    assert not verdict.accepted
    assert "row 5, column 7, channel 1" in verdict.worst


def test_numbers_without_noise_are_compared_by_their_rounding() -> None:
    still = np.broadcast_to(MEAN, (4, *SHAPE))
    assert compare(still * (1.0 + 1e-6), MEAN, np.zeros(SHAPE)).accepted
    assert not compare(still * (1.0 + 1e-4), MEAN, np.zeros(SHAPE)).accepted
    assert compare(np.zeros((4, *SHAPE)), np.zeros(SHAPE), np.zeros(SHAPE)).accepted
