"""Instances written out: a scene in which every triangle stands where it is seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import Instance, MeshObject, Scene

FloatArray = NDArray[np.float64]


def expanded(scene: Scene) -> Scene:
    """The same scene without instances and hidden objects: the objects that are shown, then the instances, as objects; numbered anew.

    Normals are those of the transformed surface, by the inverse of the transform, at length 1.
    """
    if not scene.instances and not any(item.hidden for item in scene.objects):
        return scene
    objects = [item for item in scene.objects if not item.hidden]
    objects += [_moved(scene.objects[instance.object], instance) for instance in scene.instances]
    first, numbered = 0, []
    for item in objects:
        numbered.append(replace(item, first_prim=first))
        first += len(item)
    return replace(scene, objects=tuple(numbered), instances=())


def _moved(item: MeshObject, instance: Instance) -> MeshObject:
    linear, shift = instance.world_from_object[:, :3], instance.world_from_object[:, 3]
    inverse = np.linalg.inv(linear)
    smooth = None if item.vertex_normals is None else _unit(_times(item.vertex_normals, inverse.T))
    x, y, z = _times(np.array(item.motion, np.float64), linear).tolist()
    vertices, normals = _times(item.vertices, linear) + shift, _unit(_times(item.normals, inverse.T))
    return replace(item, vertices=vertices, normals=normals, vertex_normals=smooth, name=instance.name, hidden=False, motion=(x, y, z))


def _times(vectors: FloatArray, matrix: FloatArray) -> FloatArray:
    """matrix @ each vector (..., 3). Term by term: equal vectors stay equal to the bit, in arrays of any shape."""
    x, y, z = (vectors[..., a, None] for a in range(3))
    return np.asarray(x * matrix[:, 0] + y * matrix[:, 1] + z * matrix[:, 2])


def _unit(vectors: FloatArray) -> FloatArray:
    x, y, z = (vectors[..., a] for a in range(3))
    length = np.sqrt(x * x + y * y + z * z)[..., None]
    return np.asarray(np.divide(vectors, length, where=length > 0.0, out=np.zeros_like(vectors)))
