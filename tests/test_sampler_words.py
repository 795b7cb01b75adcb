"""The sampler's words: Sobol's points as published, what Owen's scrambling keeps of them, and the same bits in kernels and reference."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.precision import rung
from clrt.reference import sampler
from clrt.verify import probe

_KERNELS = """
kernel void probe_sobol(global const uint *index, global const uint *dimension, global uint *word) {
    const int i = get_global_id(0);
    uint lane[LANES];
    store_words(sampler_reverse(sampler_sobol((word_n)index[i], dimension[i])), lane);
    word[i] = lane[i % LANES];
}
kernel void probe_word(global const uint *pixel, global const uint *sample, global const uint *dimension, global const uint *seed,
                       global uint *word, global real *u) {
    const int i = get_global_id(0);
    uint lane[LANES];
    for (int k = 0; k < LANES; k++) lane[k] = pixel[i] + k - i % LANES;
    word_n first, second;
    sampler_words(load_words(lane), sample[i], dimension[i] & ~1u, seed[i], &first, &second);
    const word_n words = dimension[i] % 2 ? second : first;
    store_words(words, lane);
    word[i] = lane[i % LANES];
    real number[LANES];
    store_lanes(uniform_from_words(words), number);
    u[i] = number[i % LANES];
}
"""
#: points 0 to 7 of the first two dimensions, in eighths (Sobol 1967; Joe and Kuo 2008), in the order of the index's bits
PUBLISHED = ((0, 4, 2, 6, 1, 5, 3, 7), (0, 4, 6, 2, 5, 1, 3, 7))
EDGES = (0, 1, 2, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF)


def _words(pixel: np.ndarray, sample: np.ndarray, dimension: np.ndarray, seed: np.ndarray, precision: str) -> tuple[np.ndarray, np.ndarray]:
    given = [np.ascontiguousarray(a, np.uint32) for a in (pixel, sample, dimension, seed)]
    word, u = np.zeros(len(given[0]), np.uint32), np.zeros(len(given[0]), rung(precision).real)
    probe.run(_KERNELS, "probe_word", len(word), [*given, word, u], device=None, precision=precision, files=("sampler.cl",))
    return word, u


@pytest.mark.parametrize("dimension", [0, 1])
def test_unscrambled_points_are_the_published_ones(dimension: int) -> None:
    index, axis = np.arange(8, dtype=np.uint32), np.full(8, dimension, np.uint32)
    word = np.zeros(8, np.uint32)
    probe.run(_KERNELS, "probe_sobol", 8, [index, axis, word], device=None, precision="watertight", files=("sampler.cl",))
    for found in (word, sampler.sobol(index, dimension)):
        assert (found / 2.0**29).tolist() == list(PUBLISHED[dimension])


def test_unscrambled_points_are_the_same_in_kernel_and_reference() -> None:
    index = np.concatenate([np.array(EDGES), np.random.default_rng(4).integers(0, 2**32, 2000)]).astype(np.uint32)
    for dimension in (0, 1):
        word = np.zeros(len(index), np.uint32)
        given = [index, np.full(len(index), dimension, np.uint32), word]
        probe.run(_KERNELS, "probe_sobol", len(index), given, device=None, precision="watertight", files=("sampler.cl",))
        assert (word == sampler.sobol(index, dimension)).all()


@pytest.mark.parametrize(("precision", "bits"), [("watertight", 24), ("double", 32)])
def test_words_are_the_same_in_kernel_and_reference(precision: str, bits: int) -> None:
    rng = np.random.default_rng(5)
    edges = np.array(np.meshgrid(EDGES, EDGES, EDGES)).reshape(3, -1)
    pixel, sample, seed = np.concatenate([edges, rng.integers(0, 2**32, (3, 3000))], axis=1)
    dimension = rng.integers(0, 64, len(pixel))
    word, u = _words(pixel, sample, dimension, seed, precision)
    for d in range(64):
        for value in np.unique(seed[dimension == d])[:20]:
            at = (dimension == d) & (seed == value)
            assert (word[at] == sampler.words(pixel[at], sample[at], d, int(value))).all()
            assert (u[at] == sampler.uniforms(pixel[at], sample[at], d, int(value), bits)).all()
    assert 0.0 <= u.min() <= u.max() < 1.0


def test_one_sample_has_the_words_that_it_has_among_others() -> None:
    pixel = np.arange(12).reshape(3, 4)
    many = sampler.words(pixel, np.arange(5)[:, None, None], 1, 9)
    for sample in range(5):
        assert (sampler.words(pixel, sample, 1, 9) == many[sample]).all()


@pytest.mark.parametrize("first", [0, 256])
@pytest.mark.parametrize("power", [0, 1, 4, 8])
def test_every_elementary_interval_holds_one_sample(power: int, first: int) -> None:
    """Of 2^k samples from a multiple of 2^k on, in every pair of dimensions, for every split of k into two: a (0, k, 2)-net."""
    sample = np.arange(first, first + (1 << power))
    for pixel, seed, pair in ((0, 0, 0), (0x00070003, 1, 1), (0xFFFFFFFF, 2**32 - 1, 9)):
        x, y = (sampler.words(pixel, sample, 2 * pair + c, seed).astype(np.uint64) for c in (0, 1))
        for bits in range(power + 1):
            cell = (x >> np.uint64(32 - bits) << np.uint64(power - bits)) | (y >> np.uint64(32 - power + bits))
            assert sorted(cell.tolist()) == list(range(1 << power)), (pixel, seed, pair, bits)


def _chi_square(counts: np.ndarray) -> float:
    """Standard deviations by which chi-square is off its mean (Wilson and Hilferty 1931)."""
    freedom = counts.size - 1
    value = ((counts - counts.mean()) ** 2 / counts.mean()).sum()
    return float(((value / freedom) ** (1 / 3) - (1 - 2 / (9 * freedom))) / np.sqrt(2 / (9 * freedom)))


def test_first_samples_of_neighbouring_pixels_are_spread_evenly() -> None:
    pixel = (np.arange(128)[:, None] * 65536 + np.arange(128)).ravel()
    for dimension in (0, 1, 2, 3, 7):
        u = sampler.uniforms(pixel, 0, dimension, 3)
        assert abs(_chi_square(np.histogram(u, 64, (0, 1))[0])) < 4


@pytest.mark.parametrize(("one", "other"), [(0, 1), (0, 2), (1, 2), (1, 3), (2, 3)])
def test_dimensions_are_independent_over_pixels(one: int, other: int) -> None:
    pixel = (np.arange(128)[:, None] * 65536 + np.arange(128)).ravel()
    x, y = (sampler.uniforms(pixel, 5, d, 0) for d in (one, other))
    assert abs(_chi_square(np.histogram2d(x, y, 16, ((0, 1), (0, 1)))[0])) < 4


def test_pixels_and_seeds_are_independent() -> None:
    pixel = np.arange(16384)
    u = sampler.uniforms(pixel, 0, 0, 0)
    for other in (sampler.uniforms(pixel + 1, 0, 0, 0), sampler.uniforms(pixel, 0, 0, 1), sampler.uniforms(pixel + 65536, 0, 0, 0)):
        assert abs(np.corrcoef(u, other)[0, 1]) < 4 / np.sqrt(len(u))


def test_scrambled_points_beat_random_ones() -> None:
    """The area of a quarter disc by 256 samples: random points miss by 2.6% of it (standard deviation), a scrambled net by far less."""
    pixel, sample = np.arange(500)[:, None], np.arange(256)
    x, y = (sampler.uniforms(pixel, sample, d, 0) for d in (0, 1))
    area = (x**2 + y**2 < 1).mean(axis=1)
    assert abs(area.mean() - np.pi / 4) < 4 * area.std() / np.sqrt(500)
    assert area.std() < 0.3 * np.sqrt(np.pi / 4 * (1 - np.pi / 4) / 256)
