"""The picture that a render returns: linear numbers, and how they become bytes."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from os import PathLike, fspath
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clrt.errors import ClrtError
from clrt.files import atomic_write, check_writable
from clrt.image import exr, png, ppm
from clrt.stats import RunStats

_WRITERS: dict[str, Callable[[BinaryIO, NDArray[np.uint8], bool, str], None]] = {".png": png.write, ".ppm": ppm.write}
_LINEAR = ".exr"  #: holds numbers as they are

_BLOCK_ROWS = 64  #: rows encoded at a time, so that float64 work arrays stay in the cache


class Image:
    """A picture.

    pixels : (height, width, 3) float32, linear red, green, blue, not clamped; row 0 at the top
    stats : the figures of the run that made it, or None
    standard_error : (height, width, 3) float32, of each number of `pixels`, or None where it is not known
    """

    def __init__(self, pixels: ArrayLike, stats: RunStats | None = None, standard_error: NDArray[np.float32] | None = None) -> None:
        """Raises ValueError where `pixels` is not (height, width, 3) with at least one pixel."""
        self.standard_error = standard_error
        self.pixels: NDArray[np.float32] = np.asarray(pixels, dtype=np.float32)
        self.stats = stats
        if self.pixels.ndim != 3 or self.pixels.shape[2] != 3 or self.pixels.size == 0:
            raise ValueError(f"pixels must have the shape (height, width, 3), not {self.pixels.shape}")

    @property
    def width(self) -> int:
        return int(self.pixels.shape[1])

    @property
    def height(self) -> int:
        return int(self.pixels.shape[0])

    def __repr__(self) -> str:
        return f"<clrt.Image {self.width}x{self.height}>"

    def to_uint8(self, srgb: bool = False) -> NDArray[np.uint8]:
        """(height, width, 3) uint8: clamped to [0, 1], optionally sRGB-encoded, 255 x rounded half up.

        The products are formed in float64, where they are exact, so that each byte is the correctly rounded one. What is
        not a number becomes 0, with a RuntimeWarning that counts the pixels.
        """
        out = np.empty(self.pixels.shape, np.uint8)
        bad = 0
        for row in range(0, self.height, _BLOCK_ROWS):
            block = self.pixels[row : row + _BLOCK_ROWS].astype(np.float64)
            nan = np.isnan(block)
            if nan.any():
                bad += int(nan.any(axis=-1).sum())
                block[nan] = 0.0
            np.clip(block, 0.0, 1.0, out=block)
            if srgb:
                block = encode_srgb(block)
            block *= 255.0
            block += 0.5
            out[row : row + _BLOCK_ROWS] = block  # cut off: downwards, since nothing is negative
        if bad:
            noun = "pixel is" if bad == 1 else "pixels are"
            warnings.warn(f"{bad} {noun} not a number and shown as black", RuntimeWarning, stacklevel=2)
        return out

    def save(self, path: str | PathLike[str], *, srgb: bool = False) -> None:
        """Write a .png or .ppm, whole or not at all; `srgb` encodes, else the linear values are written. An .exr holds them unclamped.

        A biased picture says so in the file, in a comment.

        Raises ClrtError for any other ending, for an .exr with `srgb` or without its library, OSError with the path in it where it cannot
        be written.
        """
        suffix = check_format(path, srgb)
        check_writable(path)
        pixels = None if suffix == _LINEAR else self.to_uint8(srgb)
        label = self.stats.bias if self.stats is not None else ""
        with atomic_write(path) as file:
            if pixels is None:
                exr.write(file, self.pixels, label)
            else:
                _WRITERS[suffix](file, pixels, srgb, label)

    def _repr_png_(self) -> bytes:
        """What a notebook shows."""
        return png.encode(self.to_uint8())


def check_format(path: str | PathLike[str], srgb: bool = False) -> str:
    """The ending of `path` in lower case. Raises ClrtError where it is none that can be written, or is not encoded as `srgb` asks."""
    suffix = Path(path).suffix.lower()
    if suffix == _LINEAR:
        exr.check()
        if srgb:
            raise ClrtError(f"{fspath(path)}: an .exr holds linear values, never sRGB; leave out --srgb, or write a .png")
    elif suffix not in _WRITERS:
        found = f"the ending {suffix}" if suffix else "no ending"
        raise ClrtError(f"{fspath(path)}: a picture ends in .png, .ppm or .exr, this has {found}")
    return suffix


def encode_srgb(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """The transfer function of IEC 61966-2-1 (1999) on values in [0, 1]."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
