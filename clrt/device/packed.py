"""The arrays that the device holds of a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.features import Features
from clrt.scene.model import Scene

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Packed:
    """What every program reads; the arrays of effects come from `argument`.

    nodes (m, 2) int32; indices (r,) int32 slots; vertices (s, 3, 3) float64 as given; objects, surfaces, materials, frame: structs
    prim_ids : (s,) int64 primitive id of each slot
    """

    scene: Scene
    origin: FloatArray
    nodes: NDArray[np.int32]
    indices: NDArray[np.int32]
    vertices: FloatArray
    objects: NDArray[np.void]
    surfaces: NDArray[np.void]
    materials: NDArray[np.void]
    frame: NDArray[np.void]
    prim_ids: NDArray[np.int64]
    orders: tuple[NDArray[np.int64], ...]
    real: type[np.floating]
    features: Features

    @property
    def slots(self) -> int:
        return len(self.vertices)
