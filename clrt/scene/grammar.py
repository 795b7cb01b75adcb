"""The letters of a scene text: how many numbers each takes, what they are called, and which values they may have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LARGEST = 1e30  #: greatest magnitude of any number: its square, times any count of terms, is far from overflow in float64
LARGEST_SIDE = 65536  #: pixels
MOST_PIXELS = 2**28


@dataclass(frozen=True)
class Field:
    """One number: its name and the interval that it must lie in; an open end excludes the bound itself.

    within : the interval in words, where the other fields of the line narrow it
    """

    name: str
    low: float = -LARGEST
    high: float = LARGEST
    low_open: bool = False
    high_open: bool = False
    whole: bool = False
    within: str = ""

    def rejects(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """True where a value, (n,) float64 and not NaN, is outside the interval, or not whole where it must be."""
        bad: NDArray[np.bool_] = (values < self.low) | (values > self.high)
        if self.low_open:
            bad |= values == self.low
        if self.high_open:
            bad |= values == self.high
        if self.whole:
            bad |= values != np.floor(values)
        return bad

    def accepted(self) -> str:
        """The interval in words, to follow "must be"."""
        if self.within:
            return self.within
        kind = "a whole number " if self.whole else ""
        if self.low == -LARGEST:
            return f"{kind}between {self.low:g} and {self.high:g}"
        if self.high != LARGEST and not (self.low_open or self.high_open):
            return f"{kind}from {self.low:g} to {self.high:g}"
        low = f"greater than {self.low:g}" if self.low_open else f"at least {self.low:g}"
        high = f"less than {self.high:g}" if self.high_open else f"at most {self.high:g}"
        return f"{kind}{low} and {high}"


def point_fields(what: str) -> tuple[Field, ...]:
    """x, y and z of a point or a vector."""
    return tuple(Field(f"{axis} of {what}") for axis in "xyz")


def color_fields() -> tuple[Field, ...]:
    """Red, green and blue, linear and not negative."""
    return tuple(Field(channel, low=0.0) for channel in ("red", "green", "blue"))


_VERTICES = point_fields("vertex 1") + point_fields("vertex 2") + point_fields("vertex 3")
_SIDES = tuple(Field(name, low=1.0, high=float(LARGEST_SIDE), whole=True) for name in ("width", "height"))
_MATERIAL = (
    *color_fields(), Field("Ka", low=0.0), Field("Kd", low=0.0), Field("Ks", low=0.0),
    Field("exponent", low=0.0), Field("Reflect", low=0.0, high=1.0),
)  # fmt: skip

#: letter -> number of fields -> the fields
LETTERS: dict[str, dict[int, tuple[Field, ...]]] = {
    "E": {3: point_fields("the eye")},
    "V": {3: point_fields("the view direction"), 6: point_fields("the view direction") + point_fields("the up vector")},
    "F": {1: (Field("field of view in degrees", low=0.0, high=180.0, low_open=True, high_open=True),)},
    "R": {2: _SIDES},
    "O": {0: (), 12: tuple(f for name in ("UL", "UR", "LL", "LR") for f in point_fields(f"image corner {name}"))},
    "S": {4: (*point_fields("the centre"), Field("radius", low=0.0, low_open=True))},
    "T": {
        9: _VERTICES,
        12: _VERTICES + point_fields("the face normal"),
        18: _VERTICES + point_fields("normal 1") + point_fields("normal 2") + point_fields("normal 3"),
    },
    "M": {8: _MATERIAL, 10: (*_MATERIAL, Field("Refract", low=0.0, high=1.0), Field("Nr", low=0.0))},
    "L": {3: point_fields("the light"), 6: point_fields("the light") + color_fields()},
}


def counts_taken(letter: str) -> str:
    """`8 or 10 numbers`: the counts of fields that a letter takes, in words."""
    counts = sorted(LETTERS[letter])
    listed = ", ".join(str(c) for c in counts[:-1]) + (" or " if len(counts) > 1 else "") + str(counts[-1])
    return listed + (" number" if counts == [1] else " numbers")
