"""What a scene's glass needs to know beforehand: which object has the say where several overlap, and which ones the eye is inside of."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import Scene
from clrt.scene.placed import object_from_world, placed_boxes, placements

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]

NONE = -1  #: material and rank of an object that lets no light through
_CHUNK = 1 << 22  #: comparisons of boxes at a time
#: directions along which the eye counts walls: no ratio of small whole numbers, so that edges are not met by design
_PROBES = np.array([[0.5281, 0.6713, 0.5197], [-0.4517, 0.3391, 0.8253], [0.2141, -0.8837, 0.4163]])


def refracting_materials(scene: Scene) -> IntArray:
    """(objects + spheres + instances,): the first material of each object with Refract > 0; NONE where there is none, or it is hidden."""
    lets_through = np.array([m.refract > 0.0 for m in scene.materials], bool)
    used = [np.unique(item.material_ids) for item in scene.objects]
    first = [next((int(i) for i in ids if lets_through[i]), NONE) for ids in used]
    spheres = scene.spheres.material_ids
    through = lets_through[spheres] if len(spheres) else np.zeros(0, bool)
    there = [NONE if item.hidden else i for item, i in zip(scene.objects, first, strict=True)]
    instances = [first[instance.object] for instance in scene.instances]
    return np.concatenate([np.array(there, np.int32), np.where(through, spheres, NONE), np.array(instances, np.int32)]).astype(np.int32)


def _boxes(scene: Scene, which: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    count, first = len(scene.objects), len(scene.objects) + len(scene.spheres)
    mesh = [scene.objects[i].vertices for i in which if i < count]
    ball = which[(which >= count) & (which < first)] - count
    center, radius = scene.spheres.centers[ball], scene.spheres.radii[ball, None]
    placed = [ends[which[which >= first] - first] for ends in placed_boxes(scene, placements(scene))]
    lo = [np.array([v.min((0, 1)) for v in mesh]).reshape(-1, 3), center - radius, placed[0]]
    hi = [np.array([v.max((0, 1)) for v in mesh]).reshape(-1, 3), center + radius, placed[1]]
    return np.concatenate(lo), np.concatenate(hi)


def ranks(scene: Scene) -> IntArray:
    """(objects + spheres + instances,): where several overlap, the one of the highest rank has the say; NONE for those that are not glass.

    One whose box lies inside another's outranks it; of others the one whose material comes later, then the later of objects, instances,
    spheres.
    """
    materials = refracting_materials(scene)
    which = np.flatnonzero(materials != NONE)
    lo, hi = _boxes(scene, which)
    inside = np.zeros(len(which), np.int64)
    rows = max(1, _CHUNK // max(1, len(which)))
    for start in range(0, len(which), rows):
        part = slice(start, start + rows)
        # Boxes that are the same hold each other, and count the same.
        inside[part] = ((lo[None] <= lo[part, None]) & (hi[None] >= hi[part, None])).all(2).sum(1)
    ball = (which >= len(scene.objects)) & (which < len(scene.objects) + len(scene.spheres))
    order = np.lexsort((which, ball, materials[which], inside))
    result = np.full(len(materials), NONE, np.int32)
    result[which[order]] = np.arange(len(which), dtype=np.int32)
    return result


def around_eye(scene: Scene) -> list[int]:
    """Objects that let light through and have the eye inside of them, by rank; a mesh, where all probes cross it an odd number of times."""
    rank, eye, count = ranks(scene), np.asarray(scene.camera.eye, np.float64), len(scene.objects)
    first = count + len(scene.spheres)
    which = np.flatnonzero(rank != NONE)
    if not len(which):
        return []
    lo, hi = _boxes(scene, which)
    near = which[((lo < eye) & (eye < hi)).all(1)]
    spheres, placed = scene.spheres, placements(scene)
    seen = object_from_world(placed, np.zeros(3), np.zeros((count, 3))) @ np.append(eye, 1.0)

    def holds(i: int) -> bool:
        if i < count:
            return _encloses(scene.objects[i].vertices, eye)
        if i >= first:
            return _encloses(scene.objects[scene.instances[i - first].object].vertices, seen[i - first])
        return bool(np.linalg.norm(eye - spheres.centers[i - count]) < spheres.radii[i - count])

    inside = [i for i in near.tolist() if holds(i)]
    return sorted(inside, key=lambda i: int(rank[i]))


def _encloses(vertices: FloatArray, point: FloatArray) -> bool:
    """Whether all probes from `point`, both ways, cross the triangles (n, 3, 3) an odd number of times."""
    corners = vertices - point
    for direction in _PROBES:
        edges = np.stack([np.cross(corners[:, i], corners[:, (i + 1) % 3]) @ direction for i in range(3)])
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        crossed = (edges > 0).all(0) | (edges < 0).all(0)
        ahead = np.einsum("ni,ni->n", corners[:, 0], normal) * (normal @ direction)
        if not all(np.count_nonzero(crossed & side) % 2 for side in (ahead > 0, ahead < 0)):
            return False
    return True
