"""Films: means, variances and counts against NumPy's over all samples at once; bad samples stay where they are."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.errors import ClrtError
from clrt.film import Film


def _samples(n: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(3.0, 1.0, (n, 5, 7, 3)).astype(np.float32)


def _film(*stacks: np.ndarray) -> Film:
    film = Film(7, 5)
    for stack in stacks:
        film.add(stack)
    return film


def _same(film: Film, samples: np.ndarray) -> None:
    wide = samples.astype(np.float64)
    np.testing.assert_allclose(film.mean, wide.mean(0), rtol=1e-13)
    np.testing.assert_allclose(film.variance, wide.var(0, ddof=1), rtol=1e-11)
    np.testing.assert_allclose(film.variance_of_mean, wide.var(0, ddof=1) / len(wide), rtol=1e-11)
    assert (film.count == len(samples)).all()
    assert not film.flagged.any()


def test_pictures_one_by_one_and_at_once_agree_with_numpy() -> None:
    samples = _samples(50, 1)
    _same(_film(*samples), samples)
    _same(_film(samples), samples)
    _same(_film(samples[:3], samples[3], samples[4:]), samples)


def test_merge_equals_all_samples_in_one_film() -> None:
    samples = _samples(40, 2)
    film = _film(samples[:13])
    film.merge(_film(*samples[13:]))
    _same(film, samples)
    empty = Film(7, 5)
    empty.merge(film)
    _same(empty, samples)


def test_variance_keeps_its_digits_far_from_zero() -> None:
    """The difference of sums of squares would lose them: 1e7 squared is 1e14, the variance 1/12."""
    samples = 1e7 + np.random.default_rng(3).uniform(size=(1000, 1, 1, 1))
    film = Film(1, 1, 1)
    film.add(samples)
    np.testing.assert_allclose(film.variance, samples.var(0, ddof=1), rtol=1e-9)


def test_variance_of_fewer_than_two_samples_is_infinite() -> None:
    film = _film(_samples(1, 4)[0])
    assert np.isinf(film.variance).all()
    assert np.isinf(Film(2, 2).variance_of_mean).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e30])
def test_bad_sample_is_counted_and_left_out(bad: float) -> None:
    samples = _samples(20, 5)
    good = samples.astype(np.float64)
    samples[7, 2, 3, 1] = bad
    film = _film(*samples)
    assert np.argwhere(film.flagged).tolist() == [[2, 3]]
    assert (film.count[2, 3], film.rejected[2, 3]) == (19, 1)
    np.testing.assert_allclose(film.mean[2, 3], np.delete(good[:, 2, 3], 7, axis=0).mean(0), rtol=1e-13)
    np.testing.assert_allclose(film.variance[2, 3], np.delete(good[:, 2, 3], 7, axis=0).var(0, ddof=1), rtol=1e-11)
    others = ~film.flagged
    np.testing.assert_allclose(film.mean[others], good.mean(0)[others], rtol=1e-13)
    at_once = _film(samples)
    np.testing.assert_allclose(at_once.mean, film.mean, rtol=1e-12)
    np.testing.assert_array_equal(at_once.rejected, film.rejected)


def test_pixel_of_bad_samples_alone_stays_black() -> None:
    film = Film(1, 1)
    film.add(np.full((3, 1, 1, 3), np.nan))
    assert film.mean.tolist() == [[[0.0, 0.0, 0.0]]]
    assert (film.count[0, 0], film.rejected[0, 0]) == (0, 3)
    assert np.isinf(film.variance).all()


def test_limit_is_the_callers() -> None:
    film = Film(1, 1, 1, limit=10.0)
    film.add(np.array([1.0, 11.0, 3.0]).reshape(3, 1, 1, 1))
    assert film.mean[0, 0, 0] == 2.0
    assert film.rejected[0, 0] == 1


def test_misfits_are_refused_and_change_nothing() -> None:
    film = _film(_samples(2, 6))
    before = film.mean.copy()
    with pytest.raises(ClrtError, match=r"\(7, 5, 3\)"):
        film.add(np.zeros((7, 5, 3)))
    with pytest.raises(ClrtError, match="does not fit"):
        film.merge(Film(5, 7))
    with pytest.raises(ClrtError, match="out of range"):
        Film(0, 4)
    with pytest.raises(ClrtError, match="out of range"):
        Film(4, 4, limit=float("nan"))
    np.testing.assert_array_equal(film.mean, before)
