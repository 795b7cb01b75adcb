"""The environment as kernels read it: the radiance of its texels, and the tables that directions are drawn by."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device.packed import Packed


def cells(packed: Packed) -> NDArray[Any]:
    """(h, w, 3) linear radiance, row 0 at the top."""
    assert packed.scene.environment is not None  # the effect is called for by it
    return packed.scene.environment.radiance.astype(packed.real)
