"""Parts of a model as objects of a scene: in the scene's axes, with checked normals and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from clrt.mesh import vertex_normals
from clrt.scene.grammar import LARGEST
from clrt.scene.model import FloatArray, Instance, MeshObject
from clrt.scene.models.gltf_nodes import corner_order, normal_matrix
from clrt.scene.models.model_file import Model, ModelError, Part
from clrt.scene.triangles import face_normals, unit

#: Model files are right-handed, +z towards the viewer; scenes are left-handed, +z into the picture. Mirroring z, a model is seen from its
#: front, and not as its mirror image: a text on it can be read.
SCENE_FROM_FILE = np.diag([1.0, 1.0, -1.0, 1.0])

_SAME = 1e-5  #: a corner's normal that is written with float32 or six digits is this near to the face's own where that is meant


@dataclass(frozen=True)
class Placing:
    """How a part becomes an object. scene_from_file : (4, 4); smooth : "file", "yes" or "no"; material : for triangles that have none;
    materials : number of the scene's materials before the model's own; line : that calls for the model."""

    scene_from_file: FloatArray
    smooth: str = "file"
    material: int = 0
    materials: int = 0
    line: int = 0


def placed(model: Model, at: Placing, first_prim: int = 0, first_object: int = 0) -> tuple[tuple[MeshObject, ...], tuple[Instance, ...]]:
    """All parts of a model as objects, and the copies of those that have some as instances. Raises ModelError.

    first_prim, first_object : numbers of the triangles and of the objects that the scene has already
    """
    objects: list[MeshObject] = []
    instances: list[Instance] = []
    file_from_scene = np.linalg.inv(at.scene_from_file)
    for part in model.parts:
        for copy in part.copies:
            matrix = (at.scene_from_file @ copy @ file_from_scene)[:3]
            instances.append(Instance(first_object + len(objects), matrix, at.line, part.name))
        item = place(part, at, first_prim)
        objects.append(replace(item, hidden=True) if part.copies else item)
        first_prim += len(part.vertices)
    return tuple(objects), tuple(instances)


def place(part: Part, at: Placing, first_prim: int) -> MeshObject:
    """The part as an object. Raises ModelError where its numbers are beyond the range of a scene's."""
    linear, moved = at.scene_from_file[:3, :3], at.scene_from_file[:3, 3]
    order = corner_order(linear)
    vertices = part.vertices[:, order] @ linear.T + moved
    if not np.abs(vertices).max(initial=0.0) <= LARGEST:
        raise ModelError(f"{part.name}: a vertex lies beyond {LARGEST:g}; scale the model in the program that made it")
    normals = face_normals(vertices)
    corners = _corner_normals(part, vertices, at.smooth, order, linear)
    corners = None if corners is None else _checked(corners, normals)
    ids = np.where(part.material_ids >= 0, part.material_ids + at.materials, at.material).astype(np.int32)
    uvs = None if part.uvs is None else part.uvs[:, order]
    return MeshObject(vertices, normals, ids, first_prim, corners, part.name, at.line if corners is not None else 0, uvs)


def _corner_normals(part: Part, vertices: FloatArray, smooth: str, order: list[int], linear: FloatArray) -> FloatArray | None:
    """(n, 3, 3) of the file, or computed from the faces; None for flat ones."""
    if smooth == "no" or (smooth == "file" and part.normals is None):
        return None
    if part.normals is None:
        points = vertices.reshape(-1, 3)
        return vertex_normals(points, np.arange(len(points)).reshape(-1, 3)).reshape(-1, 3, 3)
    return np.asarray(part.normals[:, order] @ normal_matrix(linear).T)


def _checked(given: FloatArray, faces: FloatArray) -> FloatArray | None:
    """Unit normals at the corners; a zero one becomes the face's, on the side of its others. None where all are the faces' own."""
    corners = unit(given)
    behind = np.einsum("ij,ij->i", corners.sum(axis=1), faces) < 0.0
    facing = np.where(behind[:, None], 0.0 - faces, faces)[:, None, :]
    own = (np.abs(corners - facing).max(axis=2) < _SAME) | ~corners.any(axis=2)
    flat = own.all(axis=1)
    corners = np.where((flat[:, None] | ~corners.any(axis=2))[:, :, None], facing, corners)
    corners[flat] = faces[flat][:, None, :]
    return None if flat.all() else corners


def flat_warnings(objects: Sequence[MeshObject]) -> list[str]:
    """Counts triangles without an area, which are never hit."""
    told = []
    for item in objects:
        count = int(np.count_nonzero(~item.normals.any(axis=1)))
        what = "triangles have zero area and are" if count > 1 else "triangle has zero area and is"
        told += [f"{item.name}: {count} {what} never hit"] if count else []
    return told
