"""The environment as kernels read it: the radiance of its texels, and the tables that directions are drawn by."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device import layout
from clrt.device.packed import Packed
from clrt.scene.model import Environment
from clrt.scene.skylight import WORDS, beginnings, cosines, lit_count, luminance, row_words, texel_words


def cells(packed: Packed) -> NDArray[Any]:
    """(h, w, 3) linear radiance, row 0 at the top."""
    return _environment(packed).radiance.astype(packed.real)


def rows(packed: Packed) -> NDArray[np.void]:
    """One record a row of the picture, see `layout.environment_row`."""
    environment = _environment(packed)
    height, width = environment.radiance.shape[:2]
    edges, words = cosines(height), row_words(environment)
    records = np.zeros(height, layout.environment_row(packed.real))
    records["top"], records["bottom"] = edges[:-1], edges[1:]
    solid_angle = 2.0 * np.pi * (edges[:-1] - edges[1:]) / width
    records["density"] = words / WORDS / WORDS / solid_angle
    records["begin"] = beginnings(words).view(np.int32)
    records["lit"] = lit_count(luminance(environment))
    return records


def columns(packed: Packed) -> NDArray[np.uint32]:
    """(h, w): the word at which each texel of a row begins."""
    return beginnings(texel_words(_environment(packed)))


def _environment(packed: Packed) -> Environment:
    assert packed.scene.environment is not None  # the effect is called for by it
    return packed.scene.environment
