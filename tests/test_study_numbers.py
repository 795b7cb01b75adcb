"""The statistics of `clrt study`: intervals, slopes, bias and variance, errors, all against closed forms or simulation."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.errors import ClrtError
from clrt.study import metrics
from clrt.study.bias import bias_part, decomposition
from clrt.study.measure_depth import depths_of
from clrt.study.measure_samples import Points, pareto, slope_of
from clrt.study.numbers import bootstrapped, in_turns, interval, measured, number, proportion
from clrt.study.oracle import is_closed
from clrt.study.reference import Reference
from clrt.verify.rays import closed_sphere, cube


@pytest.mark.parametrize("count", [2, 3, 5, 6, 10])
def test_interval_holds_the_median_of_logarithmic_noise_in_95_of_100(count: int) -> None:
    rng = np.random.default_rng(count)
    held = [low <= 1.0 <= high for low, high in (interval(np.exp(0.2 * rng.normal(size=count)).tolist()) for _ in range(1500))]
    assert np.mean(held) > 0.935


def test_interval_of_one_value_is_refused() -> None:
    with pytest.raises(ValueError, match="measure twice"):
        interval([1.0])


def test_interval_holds_its_own_median() -> None:
    found = measured([1.0, 1.0, 9.0], "s")
    assert found["low"] <= found["median"] <= found["high"]
    assert (found["median"], found["runs"], found["unit"]) == (1.0, 3, "s")


def test_a_measurement_that_is_no_number_is_refused() -> None:
    with pytest.raises(ClrtError, match="not finite"):
        number(float("nan"), 0.0, 1.0, "radiance", 3)


def test_bootstrap_band_is_that_of_the_median() -> None:
    """The median of n normal numbers has the standard error 1.2533 s / sqrt(n): half the band is about 1.96 of these."""
    found = bootstrapped(np.random.default_rng(1).normal(10.0, 1.0, 400).tolist(), "1")
    assert found["low"] < 10.0 < found["high"]
    assert (found["high"] - found["low"]) / 2.0 == pytest.approx(1.96 * 1.2533 / 20.0, rel=0.3)


def test_proportion_of_none_and_of_half() -> None:
    """Wilson's bounds: for 0 of n z^2 / (n + z^2); for n/2 of n 1/2 -+ z / (2 sqrt(n + z^2))."""
    none, half = proportion(0, 1000, 1.0, "1"), proportion(50, 100, 1.0, "1")
    assert (none["median"], none["low"]) == (0.0, 0.0)
    assert none["high"] == pytest.approx(1.96**2 / (1000 + 1.96**2))
    assert half["high"] - half["median"] == pytest.approx(1.96 / (2.0 * np.sqrt(100 + 1.96**2)))


def test_turns_are_as_many_as_there_is_time_for_and_interleaved() -> None:
    order: list[str] = []
    series = in_turns({"a": lambda: order.append("a"), "b": lambda: order.append("b")}, 4, 60.0)
    assert order == ["a", "b"] * 5
    assert len(series["a"].seconds) == 4
    assert len(in_turns({"a": lambda: None}, 9, 0.0)["a"].seconds) == 3


def test_slope_interval_holds_the_slope_of_made_up_errors() -> None:
    rng, levels, floor = np.random.default_rng(3), np.array([2, 4, 8, 16, 32]), 1e-4
    held = []
    for _ in range(60):
        squares = levels[:, None] ** -1.4 * rng.chisquare(40, (5, 12)) / 40.0 + floor
        slope, low, high = slope_of(levels, squares, floor)
        assert low <= slope <= high
        held.append(low <= -0.7 <= high)
    assert np.mean(held) > 0.8


def _gram(bias: float, spread: float, seeds: int, pixels: int, floor: float = 0.0, seed: int = 0) -> np.ndarray:
    """<e_s, e_t> of seeds whose errors are `bias`, noise of their own, and the reference's, which they share."""
    rng = np.random.default_rng(seed)
    errors = bias + spread * rng.normal(size=(seeds, pixels)) - floor * rng.normal(size=pixels)
    return np.asarray(errors @ errors.T / pixels)


def test_squared_error_is_squared_bias_and_variance() -> None:
    found = decomposition(_gram(0.03, 0.1, 12, 20_000, floor=0.02), 0.02**2)
    for name, value in (("bias_squared", 0.03**2), ("variance", 0.01), ("squared_error", 0.03**2 + 0.01)):
        assert found[name]["low"] < found[name]["high"]
        assert found[name]["median"] == pytest.approx(value, rel=0.06)
    total = found["bias_squared"]["median"] + found["variance"]["median"]
    assert found["squared_error"]["median"] == pytest.approx(total, rel=1e-12)


def test_squared_bias_of_unbiased_pictures_is_zero_within_its_interval() -> None:
    found = [decomposition(_gram(0.0, 0.1, 10, 300, seed=seed), 0.0)["bias_squared"] for seed in range(200)]
    assert np.mean([each["low"] <= 0.0 <= each["high"] for each in found]) > 0.9


@pytest.mark.parametrize(("bias", "start"), [(0.05, "biased: indirect clamp"), (0.0, "unbiased")])
def test_a_curve_that_flattens_is_named_biased(bias: float, start: str) -> None:
    levels = (2, 4, 8, 16, 32)
    gram = np.stack([_gram(bias, 0.2 / np.sqrt(n), 10, 5000, seed=n) for n in levels])
    assert bias_part(levels, gram, 1e-6, "indirect clamp")["verdict"].startswith(start)


def test_a_bias_that_falls_with_the_samples_is_none_that_stays() -> None:
    levels = (2, 4, 8, 16, 32)
    gram = np.stack([_gram(0.5 / n, 0.05 / np.sqrt(n), 10, 5000, seed=n) for n in levels])
    assert bias_part(levels, gram, 1e-8, "")["verdict"] == "unbiased"


def test_reference_knows_its_own_error() -> None:
    """Sixteen batches of noise 0.1: the mean is off by 0.1 / 4."""
    reference = Reference(1.0 + 0.1 * np.random.default_rng(5).normal(size=(16, 30, 40, 3)), 256)
    floor = reference.floor()
    assert floor["low"] <= floor["median"] <= floor["high"]
    assert floor["median"] == pytest.approx(0.025, rel=0.05)
    assert reference.squared_floor == pytest.approx(0.025**2, rel=0.05)


def test_errors_of_a_picture_by_hand() -> None:
    reference = np.full((10, 10, 3), 0.5)
    picture = reference.astype(np.float32)
    picture[0, 0] = (0.5, 0.9, 0.5)
    assert metrics.rmse(picture, reference) == pytest.approx(np.sqrt(0.16 / 300.0), rel=1e-6)
    assert metrics.relative_mse(picture, reference) == pytest.approx(0.16 / 0.26 / 300.0, rel=1e-6)
    assert metrics.percentile_99(picture, reference) == pytest.approx(0.004, rel=1e-5)  # a hundredth of the way from the 99th to the 100th


def test_flip_of_equal_pictures_is_zero_and_of_black_and_white_near_one() -> None:
    pytest.importorskip("flip_evaluator")
    white, black = np.ones((32, 32, 3)), np.zeros((32, 32, 3))
    assert metrics.flip(white.astype(np.float32), white) == 0.0
    found = metrics.flip(black.astype(np.float32), white)
    assert found is not None
    assert found > 0.9


def test_pareto_rows_are_those_that_no_other_beats() -> None:
    seconds, errors = np.array([[1.0], [2.0], [3.0], [4.0]]), np.array([[4.0], [2.0], [2.5], [1.0]])
    assert pareto(Points((2, 4, 8, 16), seconds, errors, errors, errors, None, np.zeros((4, 1, 1)))) == [0, 1, 3]


@pytest.mark.parametrize(("deepest", "most", "expected"), [(5, 8, [0, 1, 2, 4, 5]), (64, 4, [0, 1, 2, 64]), (1, 3, [0, 1]), (0, 3, [0])])
def test_depths_double_up_to_the_scenes_own(deepest: int, most: int, expected: list[int]) -> None:
    assert depths_of(deepest, most) == expected


def test_meshes_without_a_hole_are_closed() -> None:
    assert is_closed(cube())
    assert not is_closed(cube()[1:])
    assert is_closed(closed_sphere(200).astype(np.float64))
