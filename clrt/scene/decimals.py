"""Many decimal numbers at once, eight characters a machine word.

A number of at most 15 digits is a whole number below 2^53 over a power of ten up to 10^15: both are float64 numbers, so that one division
rounds correctly (Clinger, 1990, "How to read floating point numbers accurately"). The digits of a word are summed by three products
(Lemire, 2018). What has more characters, an exponent, or is no number is left to the caller.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import FloatArray

WINDOW = 16  #: characters that a number may have; as many bytes must lie before the first
_MOST_DIGITS = 15
_CHUNK = 1 << 15  #: numbers at a time, so that their words stay in the cache

_U = np.uint64
_ZEROS, _DOTS, _HIGH, _ONES = (_U(byte * 0x0101010101010101) for byte in (0x30, 0x2E, 0x80, 0x01))
_POWERS = 10.0 ** np.arange(WINDOW + 1)
#: number of characters -> the bits of a word that lie before its last so many
_BEFORE = np.array([0xFFFFFFFFFFFFFFFF >> (8 * n) if n < 8 else 0 for n in range(WINDOW + 1)], _U)

Words = NDArray[np.uint64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]


def read_decimals(text: bytes, starts: Ints, ends: Ints) -> tuple[FloatArray, Bools]:
    """The numbers text[starts[i]:ends[i]], (n,) float64, correctly rounded, and which of them are right.

    Taken are an optional sign and 1 to 15 digits with at most one dot, at most 16 characters in all; others are not right.
    """
    words: Words = np.ndarray((len(text) - 7,), "<u8", text, strides=(1,))
    values, right = np.empty(len(starts)), np.empty(len(starts), np.bool_)
    for first in range(0, len(starts), _CHUNK):
        part = slice(first, first + _CHUNK)
        values[part], right[part] = _read(words, np.frombuffer(text, np.uint8), starts[part], ends[part])
    return values, right


def _read(words: Words, characters: NDArray[np.uint8], starts: Ints, ends: Ints) -> tuple[FloatArray, Bools]:
    length = ends - starts
    sign = characters[starts]
    negative = sign == ord("-")
    digits = length - (negative | (sign == ord("+")))
    whole, decimals, right = _short(words[ends - 8], np.minimum(digits, 8))
    longer = np.flatnonzero(digits > 8)
    if len(longer):
        whole[longer], decimals[longer], right[longer] = _long(words, ends[longer], np.minimum(digits[longer], WINDOW))
    count = digits - (decimals >= 0)
    right &= (length <= WINDOW) & (count >= 1) & (count <= _MOST_DIGITS)
    values = whole.astype(np.float64) / _POWERS[np.maximum(decimals, 0)]
    return np.where(negative, -values, values), right


def _short(late: Words, digits: Ints) -> tuple[Words, Ints, Bools]:
    """Of numbers of at most 8 characters, the last of `late`: the digits as one number, how many follow the dot (-1: none), whether all are
    digits."""
    late = _kept(late, digits)
    dotted, at = _dot(late)
    late = np.where(dotted, (_above(at) & late) | ((_below(at) & late) << _U(8)) | _U(0x30), late)
    return _number(late), np.where(dotted, _bytes_above(at), -1), _all_digits(late)


def _long(words: Words, ends: Ints, digits: Ints) -> tuple[Words, Ints, Bools]:
    """The same of numbers of 9 to 16 characters."""
    early, late, decimals = _without_dot(_kept(words[ends - 16], digits - 8), words[ends - 8])
    return _number(early) * _U(10**8) + _number(late), decimals, _all_digits(early) & _all_digits(late)


def _kept(word: Words, count: Ints) -> Words:
    """Words with zeros, as characters, for all but their last `count` characters; the first character is the lowest byte."""
    before = _BEFORE[count]
    result: Words = (word & ~before) | (_ZEROS & before)
    return result


def _without_dot(early: Words, late: Words) -> tuple[Words, Words, Ints]:
    """The characters without their last word's first dot, zeros in front of them; and how many came after it, -1 for no dot."""
    in_late, at_late = _dot(late)
    in_early, at_early = _dot(early)
    in_early &= ~in_late
    moved = np.where(in_late, (_above(at_late) & late) | ((_below(at_late) & late) << _U(8)) | (early >> _U(56)), late)
    shifted = (early << _U(8)) | _U(0x30)
    closed = (_above(at_early) & early) | ((_below(at_early) & early) << _U(8)) | _U(0x30)
    decimals = np.where(in_late, _bytes_above(at_late), _bytes_above(at_early) + 8)
    return np.where(in_late, shifted, np.where(in_early, closed, early)), moved, np.where(in_late | in_early, decimals, -1)


def _dot(word: Words) -> tuple[Bools, Words]:
    """Whether a word holds a dot, and the lowest bit of the first one's byte."""
    same = word ^ _DOTS
    zero = (same - _ONES) & ~same & _HIGH
    return zero != 0, (zero & (~zero + _U(1))) >> _U(7)


def _below(bit: Words) -> Words:
    result: Words = bit - _U(1)
    return result


def _above(bit: Words) -> Words:
    """The bits of the bytes after the one that starts with `bit`."""
    result: Words = ~((bit << _U(8)) - _U(1))
    return result


def _bytes_above(bit: Words) -> Ints:
    """How many bytes follow the one that starts with `bit`: the product brings that number to the top."""
    result: Ints = (bit * _U(0x0706050403020100) >> _U(56)).astype(np.int64)
    return result


def _all_digits(word: Words) -> Bools:
    """Whether all eight bytes are digits: adding 0x46 or taking away 0x30 sets no high bit."""
    result: Bools = (((word + _U(0x4646464646464646)) | (word - _ZEROS)) & _HIGH) == 0
    return result


def _number(word: Words) -> Words:
    """The number that eight digits stand for: pairs, fours, then all."""
    word = (word & _U(0x0F0F0F0F0F0F0F0F)) * _U(2561) >> _U(8)
    word = (word & _U(0x00FF00FF00FF00FF)) * _U(6553601) >> _U(16)
    result: Words = (word & _U(0x0000FFFF0000FFFF)) * _U(42949672960001) >> _U(32)
    return result
