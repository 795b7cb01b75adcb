"""The arrays that the device holds of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

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
    prim_ids : (s,) int64 primitive id of each slot; order : (s,) int64 its triangle, of all objects' in a row
    slot_counts : (objects,) int64 how many slots each has
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
    order: NDArray[np.int64]
    slot_counts: NDArray[np.int64]
    real: type[np.floating]
    features: Features
    trees: tuple[KdTree, ...]
    block: int = 16

    @property
    def slots(self) -> int:
        return len(self.vertices)

    @cached_property
    def orders(self) -> tuple[NDArray[np.int64], ...]:
        """Of each object its triangles in the order of slots."""
        ends = np.cumsum(self.slot_counts)
        firsts = np.cumsum([0, *map(len, self.scene.objects)])
        return tuple(self.order[end - n : end] - first for end, n, first in zip(ends, self.slot_counts, firsts[:-1], strict=True))
