"""What stands where: objects at their own place, and placements, seen through a transform: instances, and objects that move.

Numbers of placements: instances in their order, then the objects that are shown themselves and move or have instances.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import FloatArray, MeshObject, Scene

IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]

UNIT_ROUNDOFF = 2.0**-53
_NUMBERS = 1 << 19  #: transformed at a time: few enough to stay in a cache


@dataclass(frozen=True, eq=False)
class Placements:
    """p placements.

    object : (p,) int32 into Scene.objects; medium : (p,) int32, the number that media know it by: objects, spheres, then instances
    world_from_object : (p, 3, 4) float64; motion : (p, 3) float64, of the object, in its own space, a unit of time
    """

    object: IntArray
    medium: IntArray
    world_from_object: FloatArray
    motion: FloatArray

    def __len__(self) -> int:
        return len(self.object)


def moves(item: MeshObject) -> bool:
    """Whether an object is not always in the same place."""
    return any(item.motion)


def _instanced(scene: Scene) -> BoolArray:
    """(objects,) whether each has instances."""
    found = np.zeros(len(scene.objects), np.bool_)
    found[[instance.object for instance in scene.instances]] = True
    return found


def _itself(scene: Scene) -> list[int]:
    """Objects that are placements at their own place, too: those that move, and those with instances, which may be far from all else."""
    instanced = _instanced(scene).tolist()
    return [i for i, item in enumerate(scene.objects) if not item.hidden and (instanced[i] or moves(item))]


def shown(scene: Scene) -> BoolArray:
    """(objects,) whether each is there at its own place, and no placement."""
    there = np.array([not item.hidden for item in scene.objects], np.bool_)
    there[_itself(scene)] = False
    return there


def placement_count(scene: Scene) -> int:
    """How many placements a scene has."""
    return len(scene.instances) + len(_itself(scene))


def placements(scene: Scene) -> Placements:
    """The placements of a scene."""
    itself = _itself(scene)
    first = len(scene.objects) + len(scene.spheres)
    objects = np.array([i.object for i in scene.instances] + itself, np.int32)
    medium = np.array([*range(first, first + len(scene.instances)), *itself], np.int32)
    matrices = np.array([i.world_from_object for i in scene.instances] + [np.eye(3, 4)] * len(itself)).reshape(-1, 3, 4)
    motion = np.array([scene.objects[i].motion for i in objects.tolist()], np.float64).reshape(-1, 3)
    return Placements(objects, medium, matrices, motion)


def seen(scene: Scene, instances: bool = True, motion: bool = True) -> Scene:
    """The scene without hidden objects that have no instance; without instances, or the objects' motion, where these are left out."""
    if not instances and scene.instances:
        scene = replace(scene, instances=())
    if not motion and any(moves(item) for item in scene.objects):
        scene = replace(scene, objects=tuple(replace(item, motion=(0.0, 0.0, 0.0)) for item in scene.objects))
    kept = np.array([not item.hidden for item in scene.objects], np.bool_) | _instanced(scene)
    if kept.all():
        return scene
    number = (np.cumsum(kept) - 1).tolist()
    return replace(
        scene,
        objects=tuple(item for item, there in zip(scene.objects, kept, strict=True) if there),
        instances=tuple(replace(instance, object=number[instance.object]) for instance in scene.instances),
    )


def object_origins(scene: Scene, origin: FloatArray) -> FloatArray:
    """(objects, 3): what objects' coordinates are rounded relative to: `origin`, or the middle of one that is hidden or has instances."""
    apart = _instanced(scene) | np.array([item.hidden for item in scene.objects], np.bool_)
    return np.where(apart[:, None], np.mean(scene.boxes, axis=0), origin)


def swept(scene: Scene, lo: FloatArray, hi: FloatArray, motion: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Boxes (p, 3) grown by where `motion` (p, 3) takes them while the shutter is open."""
    if scene.shutter is None:
        return lo, hi
    ways = np.stack([motion * scene.shutter.open, motion * scene.shutter.close])
    return lo + ways.min(0), hi + ways.max(0)


def placed_boxes(scene: Scene, placed: Placements, *, points: float = np.inf) -> tuple[FloatArray, FloatArray]:
    """Boxes (p, 3) around placements in the world, over all their motion.

    points : where placements times points of their objects are more than this, boxes go around the corners of the objects' boxes instead,
        which takes no time and is up to sqrt(3) times as wide
    Grown by more than the float64 error of a point, a sum of 4 terms: less than 8 u of their absolute values.
    """
    lo, hi = np.empty((len(placed), 3)), np.empty((len(placed), 3))
    linear, shift = placed.world_from_object[:, :, :3], placed.world_from_object[:, :, 3]
    for number in np.unique(placed.object).tolist():
        which, item = np.flatnonzero(placed.object == number), scene.objects[number]
        spread = np.unique(item.vertices.reshape(-1, 3), axis=0) if len(which) * 3.0 * len(item) <= points else _corners(*item.box)
        slack = 16.0 * UNIT_ROUNDOFF * (np.abs(linear[which]) @ np.abs(spread).max(0, initial=0.0) + np.abs(shift[which]))
        at_once = max(1, _NUMBERS // len(spread))
        for start in range(0, len(which), at_once):
            part = which[start : start + at_once]
            ends = linear[part] @ spread.T
            lo[part], hi[part] = ends.min(2) + shift[part], ends.max(2) + shift[part]
        lo[which] -= slack
        hi[which] += slack
    return swept(scene, lo, hi, (linear @ placed.motion[:, :, None])[:, :, 0])


def _corners(lo: FloatArray, hi: FloatArray) -> FloatArray:
    """(8, 3)"""
    return np.array([[(lo, hi)[x][0], (lo, hi)[y][1], (lo, hi)[z][2]] for x in (0, 1) for y in (0, 1) for z in (0, 1)])


def object_from_world(placed: Placements, origin: FloatArray, origins: FloatArray) -> FloatArray:
    """(p, 3, 4): takes points of the world less `origin` (3,) to points of the object less its own origin, `origins` (objects, 3)."""
    inverse = np.linalg.inv(placed.world_from_object[:, :, :3])
    shift = (inverse @ (origin - placed.world_from_object[:, :, 3])[:, :, None])[:, :, 0] - origins[placed.object]
    return np.concatenate([inverse, shift[:, :, None]], axis=2)
