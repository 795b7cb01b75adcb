"""Pictures of radiance from files: Radiance HDR and OpenEXR through OpenImageIO, others as linear numbers through Pillow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from clrt.scene.grammar import LARGEST, LARGEST_SIDE
from clrt.scene.model import FloatArray
from clrt.scene.picture import PictureError, Use, read_picture

MOST_TEXELS = 1 << 25  #: of one picture: 8192 x 4096, 768 MiB in float64
#: how a file begins -> what it is
_MAGIC = {b"#?": "Radiance HDR", b"\x76\x2f\x31\x01": "OpenEXR"}
_ENDINGS = {".hdr": "Radiance HDR", ".exr": "OpenEXR"}
_UPRIGHT = 1  #: of the orientations of TIFF, which OpenImageIO tells


def read_radiance(path: Path, name: str) -> FloatArray:
    """(h, w, 3) float64 linear red, green, blue, >= 0; row 0 at the top. Codes of 8 or 16 bits are decoded as sRGB, 0 to 1.

    Raises PictureError for a file that is none of the formats, cut off, too large, and for radiance that is negative or not finite.
    """
    with path.open("rb") as file:
        start = file.read(4)
    kind = next((kind for magic, kind in _MAGIC.items() if start.startswith(magic)), None)
    if kind is None and path.suffix.lower() in _ENDINGS:
        raise PictureError(f"{name} is no {_ENDINGS[path.suffix.lower()]} picture, as its ending says; save it again")
    values = _decoded(path, name) if kind is None else _through_library(path, name, kind)
    _check(values, name)
    return values


def _check_size(width: int, height: int, name: str) -> None:
    if width * height > MOST_TEXELS or max(width, height) > LARGEST_SIDE:
        most = f"{MOST_TEXELS} in all and {LARGEST_SIDE} a side"
        raise PictureError(f"{name} has {width} x {height} pixels; an environment has at most {most}")


def _decoded(path: Path, name: str) -> FloatArray:
    """A picture of codes as linear numbers, by IEC 61966-2-1 (1999)."""
    deep = "as .hdr or .exr"
    texels = read_picture(path, name, Use("an environment", MOST_TEXELS, ".hdr, .exr or PNG", deep, deep)).texels[..., :3]
    _check_size(texels.shape[1], texels.shape[0], name)
    code = texels / float(np.iinfo(texels.dtype).max)
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def _through_library(path: Path, name: str, kind: str) -> FloatArray:
    try:
        import OpenImageIO as oiio
    except ImportError as error:
        raise PictureError(f"{name} is a picture in {kind}, which needs OpenImageIO; install it: pip install 'clrt[hdr]'") from error

    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise PictureError(f"{name} is damaged or cut off ({_first_line(oiio.geterror())}); save it again")
    try:
        spec = source.spec()
        channels = _channels(spec, name)
        texels = source.read_image(0, 0, 0, spec.nchannels, "float")
        if texels is None or source.has_error:
            raise PictureError(f"{name} is damaged or cut off ({_first_line(source.geterror())}); save it again")
    finally:
        source.close()
    # Programs that brighten a Radiance picture say by how much.
    exposure = float(spec.getattribute("hdr:exposure") or 1.0)
    return np.asarray(texels[..., channels].astype(np.float64) / exposure)


def _first_line(message: str) -> str:
    return message.strip().partition("\n")[0] or "nothing more is known"


def _channels(spec: Any, name: str) -> list[int]:
    """Places of red, green and blue among the channels; grey is all three. Raises PictureError, before any texel is read."""
    _check_size(spec.width, spec.height, name)
    if (spec.x, spec.y, spec.width, spec.height) != (spec.full_x, spec.full_y, spec.full_width, spec.full_height):
        raise PictureError(f"{name} holds {spec.width} x {spec.height} of {spec.full_width} x {spec.full_height} pixels; save it whole")
    if spec.get_int_attribute("Orientation", _UPRIGHT) != _UPRIGHT:
        raise PictureError(f"{name} is stored turned or mirrored; save it with rows from the top and columns from the left")
    found = list(spec.channelnames)
    for wanted in (("R", "G", "B"), ("Y", "Y", "Y")):
        if set(wanted) <= set(found) and not {"RY", "BY"} & set(found):
            return [found.index(channel) for channel in wanted]
    raise PictureError(f"{name} has the channels {', '.join(found)}; save it with R, G and B, or with Y alone")


def _check(values: FloatArray, name: str) -> None:
    """Light is a finite number, and not negative; of what is neither, the first place is told."""
    bad = np.asarray(((values < 0.0) | ~(values <= LARGEST)).any(axis=-1))
    if not bad.any():
        return
    row, column = np.argwhere(bad)[0].tolist()
    count = int(np.count_nonzero(bad))
    noun = "1 pixel" if count == 1 else f"{count} pixels"
    found = ", ".join(f"{value:g}" for value in values[row, column])
    raise PictureError(
        f"{name} has {noun} with radiance that is negative, not a number or above {LARGEST:g}, "
        f"the first in column {column + 1}, row {row + 1} ({found}); repair the picture"
    )
