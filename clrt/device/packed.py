"""The arrays that the device holds of a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.features import Features
from clrt.kdtree.tree import KdTree
from clrt.scene.model import Scene

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Packed:
    """What every program reads; the arrays of effects come from `argument`.

    nodes (m, 2) int32; indices (r,) int32 slots; vertices (s, 3, 3) float64 as given; objects, surfaces, materials, frame: structs
    blocks : (b, 2) int32 first slot and count of runs of triangles near each other, BOXES at most
    prim_ids : (s,) int64 primitive id of each slot
    trees : one an object; block : the width of their wide trees
    origins : (objects, 3) float64, what the coordinates of each object are relative to: `origin`, but for hidden ones
    """

    scene: Scene
    origin: FloatArray
    nodes: NDArray[np.int32]
    indices: NDArray[np.int32]
    blocks: NDArray[np.int32]
    vertices: FloatArray
    objects: NDArray[np.void]
    surfaces: NDArray[np.void]
    materials: NDArray[np.void]
    frame: NDArray[np.void]
    prim_ids: NDArray[np.int64]
    origins: FloatArray
    orders: tuple[NDArray[np.int64], ...]
    real: type[np.floating]
    features: Features
    trees: tuple[KdTree, ...]
    block: int = 16

    @property
    def slots(self) -> int:
        return len(self.vertices)

    @property
    def runs(self) -> list[tuple[FloatArray, int, int]]:
        """Origin, first and last slot but one of objects in a row that share their origin."""
        ends = np.cumsum([len(order) for order in self.orders]).tolist()
        found: list[tuple[FloatArray, int, int]] = []
        for origin, end in zip(self.origins, ends, strict=True):
            first = found[-1][2] if found else 0
            if found and (found[-1][0] == origin).all():
                found[-1] = (origin, found[-1][1], end)
            elif end > first:
                found.append((origin, first, end))
        return found
