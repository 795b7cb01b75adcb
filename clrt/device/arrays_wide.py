"""The wide trees of a picture's objects, for rays that are traced one by one (single.cl)."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from clrt.device import layout
from clrt.device.blocks import WideArrays, wide_arrays
from clrt.device.packed import Packed

_MADE: WeakKeyDictionary[Packed, WideArrays] = WeakKeyDictionary()  #: several arrays ask for the same trees


def wide_trees(packed: Packed) -> WideArrays:
    if packed not in _MADE:
        _MADE[packed] = wide_arrays(packed, packed.trees, packed.block)
    return _MADE[packed]


def nodes(packed: Packed) -> NDArray[np.void]:
    return wide_trees(packed).nodes


def roots(packed: Packed) -> NDArray[np.int32]:
    """(objects,): of each the node that its tree begins at."""
    return wide_trees(packed).roots


def blocks(packed: Packed) -> NDArray[Any]:
    """Room for the blocks, which a kernel fills from the records of triangles."""
    return np.zeros(len(wide_trees(packed).slots), layout.block(packed.real, packed.block))
