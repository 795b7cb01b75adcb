"""Pictures from files: which paths a scene may name, and texels through Pillow, without loss."""

from __future__ import annotations

import struct
import warnings
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import Picture

#: formats that are read; others of Pillow start programs (EPS) or are no pictures of texels
FORMATS = ("PNG", "JPEG", "BMP", "PPM", "TGA", "TIFF", "GIF", "WEBP")
MOST_TEXELS = 1 << 26  #: of one picture: 256 MiB at 8 bits a channel
_BYTE_MODES = ("1", "L", "LA", "P", "PA", "RGB", "RGBA", "CMYK")  #: of Pillow, at most 8 bits a channel
_GREY_16 = ("I;16", "I;16L", "I;16B", "I;16N")


class PictureError(Exception):
    """What is wrong with a path or the picture there, to follow the place in the scene text."""


@dataclass(frozen=True)
class Folders:
    """Where the files that a scene names may be: its own folder, which paths are relative to, and others that are permitted."""

    own: Path
    allowed: Sequence[Path] = ()

    def find(self, name: str) -> Path:
        """The file of that name, symbolic links followed. Raises PictureError for one outside, or that is not there."""
        path = (self.own / name).resolve()
        if not any(path.is_relative_to(folder.resolve()) for folder in (self.own, *self.allowed)):
            raise PictureError(f"{name} leads out of the scene's folder; permit its folder with --allow-path, or move the file")
        if path.is_dir():
            raise PictureError(f"{name} is a folder; name a file in it")
        if not path.is_file():
            raise PictureError(f"there is no file {name}{_nearby(path)}")
        return path


@dataclass(frozen=True)
class Use:
    """What a picture is for, as messages tell it.

    what : what it is called; most : texels that it may have
    formats : to save it in, where it is in none that is read
    fewer_bits, plain : how else to save it, where it has too many bits, or pixels of an odd kind
    """

    what: str = "a picture"
    most: int = MOST_TEXELS
    formats: str = "PNG or JPEG"
    fewer_bits: str = "with 8, or in greyscale with 16"
    plain: str = "as PNG with 8 bits a channel"


def _nearby(path: Path) -> str:
    if not path.parent.is_dir():
        return ""
    import difflib  # for faults alone

    near = difflib.get_close_matches(path.name, [entry.name for entry in path.parent.iterdir()], n=1)
    return f'; did you mean "{near[0]}"?' if near else ""


def read_picture(path: Path | IO[bytes], name: str, use: Use = Use()) -> Picture:
    """The picture of a file, or of its bytes. Raises PictureError for no picture, one cut off, without a size, of more than one frame."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(path, formats=FORMATS) as image:
                _check(image, name, use)
                image.load()
                texels = _texels(image)
    except UnidentifiedImageError:
        raise PictureError(f"{name} is no picture that can be read, or has no pixels; save it as {use.formats}") from None
    except Image.DecompressionBombError:
        raise PictureError(f"{name} is too large; {use.what} has at most {use.most} pixels") from None
    except (OSError, SyntaxError, ValueError, TypeError, EOFError, IndexError, struct.error, zlib.error) as problem:
        raise PictureError(f"{name} is damaged or cut off ({problem}); save it again") from None
    return Picture(texels, name)


def _check(image: Any, name: str, use: Use) -> None:
    """Refuses, before the texels are read, what would not be read without loss or fit in memory."""
    width, height = image.size
    frames = getattr(image, "n_frames", 1)
    if width < 1 or height < 1:
        raise PictureError(f"{name} has {width} x {height} pixels; {use.what} has at least one")
    if width * height > use.most:
        raise PictureError(f"{name} has {width} x {height} pixels; {use.what} has at most {use.most}")
    if frames > 1:
        raise PictureError(f"{name} is animated: it has {frames} frames; save the one that is meant as a picture of its own")
    deep = any("16" in str(part) for tile in image.tile for part in np.atleast_1d(np.array(tile[3], object)))
    if deep and image.mode not in (*_GREY_16, "I"):
        raise PictureError(f"{name} has colours of 16 bits a channel; save it {use.fewer_bits}")
    if image.mode not in (*_BYTE_MODES, *_GREY_16) and not (image.mode == "I" and deep):
        raise PictureError(f"{name} has pixels of the kind {image.mode}; save it {use.plain}")


def _texels(image: Any) -> NDArray[np.uint8] | NDArray[np.uint16]:
    if image.mode in _BYTE_MODES:
        return np.ascontiguousarray(np.asarray(image.convert("RGBA"), np.uint8))
    grey = np.asarray(image).astype(np.uint16)
    opaque = np.full_like(grey, 65535)
    return np.ascontiguousarray(np.stack([grey, grey, grey, opaque], axis=-1))
