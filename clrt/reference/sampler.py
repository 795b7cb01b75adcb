"""The random numbers of sampled effects: Owen-scrambled Sobol points as a pure function of pixel, sample, dimension and seed.

Sobol points by direction numbers (Joe and Kuo 2008), scrambled by hashing (Burley 2020, "Practical hash-based Owen scrambling", after
Laine and Karras 2011). Each pair of dimensions (2i, 2i + 1) is the (0, 2)-sequence of Sobol's first two, shuffled and scrambled by itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

WordArray = NDArray[np.uint32]

PIXEL, LENS, TIME = 0, 2, 4  #: first dimension of each use
_GOLDEN = 0x9E3779B9
_SHUFFLE = 0xA511E9B3
_FACTORS = (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6)
_MASK = 0xFFFFFFFF
#: of Joe and Kuo's table, dimension 1: (all m are 1); dimension 2: the polynomial x + 1 with m_1 = 1
_FIRST_NUMBERS = ((), (1,))


def direction_numbers(dimension: int) -> list[int]:
    """32 direction numbers of Sobol's dimension 0 or 1, as words: m_k 2^(32 - k)."""
    m = [1] * 32
    for k in range(1, 32 if _FIRST_NUMBERS[dimension] else 1):
        m[k] = (2 * m[k - 1]) ^ m[k - 1]
    return [number << (31 - k) for k, number in enumerate(m)]


def sobol(index: ArrayLike, dimension: int) -> WordArray:
    """Points `index` of Sobol's sequence, dimension 0 or 1, times 2^32."""
    i = np.asarray(index, np.uint64)
    result = np.zeros_like(i)
    for k, number in enumerate(direction_numbers(dimension)):
        result ^= np.where((i >> np.uint64(k)) & np.uint64(1), np.uint64(number), np.uint64(0))
    return result.astype(np.uint32)


def words(pixel: ArrayLike, sample: ArrayLike, dimension: int, seed: int) -> WordArray:
    """32 random bits for each pixel and sample, which broadcast; pixel: row * 65536 + column."""
    pair, component = divmod(dimension, 2)
    key = _hashed((_hashed((seed + _GOLDEN) & _MASK) ^ _wide(pixel)) & _MASK)
    key = _hashed((key + ((pair + 1) * _GOLDEN & _MASK)) & _MASK)
    index = _scrambled(_wide(sample), _hashed(key ^ _SHUFFLE))
    return _scrambled(_wide(sobol(index, component)), _hashed((key + component + 1) & _MASK)).astype(np.uint32)


def uniforms(pixel: ArrayLike, sample: ArrayLike, dimension: int, seed: int, bits: int = 32) -> NDArray[np.float64]:
    """Numbers of [0, 1) with the upper `bits` bits of each word: kernels in float32 take 24, those in float64 all 32."""
    return np.asarray((words(pixel, sample, dimension, seed) >> np.uint32(32 - bits)) / 2.0**bits)


def _wide(values: ArrayLike) -> NDArray[np.int64]:
    return np.asarray(values).astype(np.int64) & _MASK


def _times(a: NDArray[np.int64], factor: int) -> NDArray[np.int64]:
    """a * factor mod 2^32, in halves that fit int64."""
    return (a * (factor & 0xFFFF) + ((a * (factor >> 16) & 0xFFFF) << 16)) & _MASK


def _hashed(x: ArrayLike) -> NDArray[np.int64]:
    """Wellons 2018, "lowbias32"."""
    h = _wide(x)
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B)):
        h = _times(h ^ (h >> shift), factor)
    return h ^ (h >> 16)


def _reversed(x: NDArray[np.int64]) -> NDArray[np.int64]:
    """The 32 bits in the other order."""
    octets = np.ascontiguousarray(np.asarray(x, ">u4")).view(np.uint8).reshape(*x.shape, 4)
    bits = np.unpackbits(octets, axis=-1)[..., ::-1]
    return np.packbits(bits, axis=-1).view(">u4")[..., 0].astype(np.int64)


def _scrambled(x: NDArray[np.int64], key: NDArray[np.int64]) -> NDArray[np.int64]:
    """Owen's scrambling in base 2: each bit is flipped or not, by a hash of the bits above it."""
    h = (_reversed(x) + key) & _MASK
    for factor in _FACTORS:
        h = h ^ _times(h, factor)
    return _reversed(h)
