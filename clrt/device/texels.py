"""Pictures as the device holds them: the codes of their files, and one table of what each code stands for.

A texel is four codes (red, green, blue, alpha) of 8 or 16 bits, as in the file: a quarter of what linear float32 would take. The
table turns a code into the linear value, rounded once, so nothing is lost against decoding in float64.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device import layout
from clrt.scene.model import Picture, Texture

_WRAPS = {"repeat": 0, "clamp": 1, "mirror": 2}  #: as texture.cl has them


def _places(textures: Sequence[Texture]) -> dict[int, int]:
    """id of each picture -> its first byte, each picture once, in the order of the textures."""
    places: dict[int, int] = {}
    end = 0
    for picture in _pictures(textures):
        places[id(picture)] = end
        end += picture.texels.nbytes
    return places


def _pictures(textures: Sequence[Texture]) -> list[Picture]:
    return list({id(t.picture): t.picture for t in textures}.values())


def _tables(textures: Sequence[Texture]) -> list[tuple[bool, int]]:
    """The kinds of codes that occur: (sRGB-encoded, bytes)."""
    return sorted({(t.srgb, t.picture.texels.itemsize) for t in textures})


def _table(srgb: bool, code_bytes: int) -> NDArray[np.float64]:
    """What each code stands for, 0 to 1; sRGB by IEC 61966-2-1 (1999)."""
    value = np.arange(256**code_bytes) / (256.0**code_bytes - 1.0)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4) if srgb else value


def values(textures: Sequence[Texture], real: type[np.floating]) -> NDArray[Any]:
    """The tables of all kinds of codes, one after the other."""
    return np.concatenate([np.zeros(0), *(_table(*kind) for kind in _tables(textures))]).astype(real)


def codes(textures: Sequence[Texture]) -> NDArray[np.uint8]:
    """The texels of all pictures as bytes, rows from the top; 16 bits in the machine's order, as devices of the same machine read them."""
    rows = (np.ascontiguousarray(picture.texels).reshape(-1).view(np.uint8) for picture in _pictures(textures))
    return np.concatenate([np.zeros(0, np.uint8), *rows])


def records(textures: Sequence[Texture], real: type[np.floating]) -> NDArray[np.void]:
    """One record a texture, see `layout.texture`."""
    kinds, places = _tables(textures), _places(textures)
    starts = np.cumsum([0, *(256**size for _, size in kinds)])
    out = np.zeros(len(textures), layout.texture(real))
    for record, texture in zip(out, textures, strict=True):
        texels = texture.picture.texels
        record["first"] = places[id(texture.picture)]
        record["values"] = starts[kinds.index((texture.srgb, texels.itemsize))]
        record["code_bytes"] = texels.itemsize
        record["height"], record["width"] = texels.shape[:2]
        record["wrap"], record["linear"] = _WRAPS[texture.wrap], texture.linear
    return out
