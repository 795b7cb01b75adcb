"""What shines: the primitives whose material sends out light, with how much of it each sends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import FloatArray, MeshObject, Scene

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  #: of linear red, green, blue (ITU-R BT.709)


@dataclass(frozen=True, eq=False)
class Emitters:
    """k emitters, triangles first.

    vertices : (k, 3, 3) float64, of a sphere its centre three times; radius : (k,) 0 for triangles
    radiance : (k, 3); part : (k,) of it that is sent out, the surface's opacity; area : (k,); triangles of zero area are left out
    """

    vertices: FloatArray
    radius: FloatArray
    radiance: FloatArray
    part: FloatArray
    area: FloatArray

    @property
    def luminance(self) -> FloatArray:
        """(k,) of the radiance."""
        return np.asarray(self.radiance @ LUMINANCE)

    @property
    def power(self) -> FloatArray:
        """(k,) area times luminance: in proportion to what each is drawn."""
        return self.area * self.luminance


def _shining(scene: Scene) -> NDArray[np.bool_]:
    """(materials,): light that a picture shapes is found by rays that meet it alone."""
    return np.array([m.emission_drawn for m in scene.materials], np.bool_)


def _standing(scene: Scene) -> Iterator[tuple[MeshObject, FloatArray]]:
    """Objects that are shown, and instances with their transforms (3, 4); (0, 4) for those that stand where they are written."""
    yield from ((item, np.zeros((0, 4))) for item in scene.objects if not item.hidden)
    yield from ((scene.objects[instance.object], instance.world_from_object) for instance in scene.instances)


_FOUND: WeakKeyDictionary[Scene, Emitters] = WeakKeyDictionary()  #: the frame asks twice, the packer once


def emitters_of(scene: Scene) -> Emitters:
    """The emitters of a scene, those of instances where they stand; gathered once a scene."""
    if scene not in _FOUND:
        _FOUND[scene] = _gathered(scene)
    return _FOUND[scene]


def _gathered(scene: Scene) -> Emitters:
    shining, radiance = _shining(scene), np.array([m.emission for m in scene.materials]).reshape(-1, 3)
    corners, ids = [np.zeros((0, 3, 3))], [np.zeros(0, np.int64)]
    for item, matrix in _standing(scene):
        chosen = shining[item.material_ids]
        corners.append(item.vertices[chosen] @ matrix[:, :3].T + matrix[:, 3] if len(matrix) else item.vertices[chosen])
        ids.append(item.material_ids[chosen].astype(np.int64))
    vertices, material = np.concatenate(corners), np.concatenate(ids)
    area = np.linalg.norm(np.cross(vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0]), axis=1) / 2.0
    flat = area > 0.0
    vertices, material, area = vertices[flat], material[flat], area[flat]
    balls = np.flatnonzero(shining[scene.spheres.material_ids])
    radius = scene.spheres.radii[balls]
    of = np.concatenate([material, scene.spheres.material_ids[balls].astype(np.int64)])
    part = np.array([m.opacity if m.opacity_seen else 1.0 for m in scene.materials])
    return Emitters(
        np.concatenate([vertices, np.repeat(scene.spheres.centers[balls][:, None], 3, axis=1)]),
        np.concatenate([np.zeros(len(vertices)), radius]),
        radiance[of],
        part[of],
        np.concatenate([area, 4.0 * np.pi * radius**2]),
    )


def emitter_count(scene: Scene) -> int:
    """How many emitters the scene has."""
    return len(emitters_of(scene).area)


def emitter_power(scene: Scene) -> float:
    """The sum of their powers, 1 where there is none."""
    return float(emitters_of(scene).power.sum()) or 1.0
