"""sampler.cl and fresnel.cl on the device: each value against exact or extended arithmetic."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.precision import RUNGS, rung
from clrt.verify import probe

_UNIFORM = """
kernel void probe_uniform(global const uint *word, global real *u) {
    real number[LANES];
    store_lanes(uniform_from_words((word_n)word[get_global_id(0)]), number);
    u[get_global_id(0)] = number[get_global_id(0) % LANES];
}
"""
_FRESNEL = """
kernel void probe_fresnel(global const real *c, global const real *n1, global const real *n2, global real *back, global real *through) {
    const int i = get_global_id(0);
    back[i] = fresnel_dielectric(c[i], n1[i], n2[i]);
    through[i] = fresnel_transmitted(c[i], n1[i], n2[i]);
}
"""


def _uniform(words: np.ndarray, precision: str) -> np.ndarray:
    u = np.zeros(len(words), rung(precision).real)
    probe.run(_UNIFORM, "probe_uniform", len(words), [words, u], device=None, precision=precision, files=("sampler.cl",))
    return u


def _fresnel(cosine: np.ndarray, n1: np.ndarray, n2: np.ndarray, precision: str = "watertight") -> tuple[np.ndarray, np.ndarray]:
    real = rung(precision).real
    given = [np.asarray(a, real) for a in np.broadcast_arrays(cosine, n1, n2)]
    back, through = np.zeros(len(given[0]), real), np.zeros(len(given[0]), real)
    probe.run(_FRESNEL, "probe_fresnel", len(back), [*given, back, through], device=None, precision=precision, files=("fresnel.cl",))
    return back, through


@pytest.mark.parametrize("precision", sorted(RUNGS))
def test_extreme_words_stay_in_the_unit_interval(precision: str) -> None:
    words = np.array([0, 1, 255, 256, 2**31 - 1, 2**31, 2**32 - 129, 2**32 - 128, 2**32 - 2, 2**32 - 1], np.uint64).astype(np.uint32)
    u = _uniform(words, precision)
    bits = 24 if rung(precision).bits == 32 else 32
    expected = [(int(w) >> (32 - bits)) / 2**bits for w in words]
    assert u.tolist() == expected
    assert u.max() < 1.0
    assert np.isfinite(np.log(1 - u)).all()
    assert (words.astype(np.float32) * np.float32(2.0**-32)).max() == 1.0, "the careless product must fail"


def test_words_fill_the_interval_evenly() -> None:
    words = np.random.default_rng(1).integers(0, 2**32, 1 << 16, np.uint64).astype(np.uint32)
    counts = np.histogram(_uniform(words, "watertight"), 64, (0, 1))[0]
    assert np.abs(counts - 1024).max() < 5 * np.sqrt(1024)


def test_fresnel_at_normal_incidence() -> None:
    """((n1 - n2) / (n1 + n2))^2; glass 4%."""
    n = np.array([1.0, 1.33, 1.5, 2.4, 1.0 + 2.0**-23])
    back, through = _fresnel(np.ones(5), np.ones(5), n)
    np.testing.assert_allclose(back, ((n - 1) / (n + 1)) ** 2, rtol=24 * 2.0**-24)
    np.testing.assert_allclose(through, 4 * n / (n + 1) ** 2, rtol=16 * 2.0**-24)


def test_fresnel_of_p_polarised_light_vanishes_at_brewsters_angle() -> None:
    """tan i = n, where F = F_s / 2 = (cos 2i)^2 / 2."""
    n = np.array([1.33, 1.5, 2.4])
    angle = np.arctan(n)
    back, _ = _fresnel(np.cos(angle), np.ones(3), n)
    np.testing.assert_allclose(back, np.cos(2 * angle) ** 2 / 2, rtol=1e-5)


@pytest.mark.parametrize("precision", ["watertight", "double"])
def test_shares_add_up_to_one(precision: str) -> None:
    rng = np.random.default_rng(2)
    cosine, n1, n2 = 10.0 ** rng.uniform(-8, 0, 5000), rng.uniform(1, 2.5, 5000), rng.uniform(1, 2.5, 5000)
    back, through = _fresnel(cosine, n1, n2, precision)
    unit = 2.0 ** (1 - rung(precision).bits + (8 if rung(precision).bits == 32 else 11))
    assert np.abs(back.astype(np.longdouble) + through - 1).max() < 16 * unit


def test_light_takes_the_same_share_both_ways() -> None:
    """Reversibility: F from n1 at angle i is F from n2 at angle t."""
    rng = np.random.default_rng(3)
    n1, n2, cosine = np.ones(2000), rng.uniform(1.01, 2.5, 2000), rng.uniform(0.1, 1, 2000)
    inner = np.sqrt(1 - (1 - cosine**2) / n2**2)
    np.testing.assert_allclose(_fresnel(cosine, n1, n2, "double")[0], _fresnel(inner, n2, n1, "double")[0], rtol=1e-9)


def test_total_reflection_and_equal_indices_are_exact() -> None:
    cosine = np.linspace(0.0, 0.7, 100)
    back, through = _fresnel(cosine, np.full(100, 1.5), np.ones(100))
    assert (back == 1).all()
    assert (through == 0).all()
    back, through = _fresnel(np.linspace(0.0, 1.0, 100), np.full(100, 1.5), np.full(100, 1.5))
    assert (back == 0).all()
    assert (through == 1).all()
