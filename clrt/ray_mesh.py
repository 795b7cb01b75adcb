"""What a RayCaster takes for a mesh: checked triangles, as a Scene; and the same at unit size for the device."""

from __future__ import annotations

import os
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device.pack import unit_normals
from clrt.errors import MeshError
from clrt.mesh import check_mesh
from clrt.ray_arrays import numbers
from clrt.scene.model import Camera, Material, MeshObject, Scene, Spheres

FloatArray = NDArray[np.float64]

_FORMS = (
    "a Scene, (vertices, faces), an object with .vertices and .faces, a list of such pairs or objects, or triangles of shape (m, 3, 3)"
)
_FLAT_SINE = 2.0**-26  #: of the angle at a corner: below it, a float64 normal has less than float32's digits left
_SMALLEST_EXPONENT = -1000


def scene_of(mesh: Any) -> Scene:
    """The triangles of whatever is a mesh, one object a part; camera and material are never looked at.

    Triangles of exactly zero area are counted in the scene's warnings. Raises MeshError, naming the part and the face.
    """
    if isinstance(mesh, Scene):
        if mesh.instances or any(item.hidden for item in mesh.objects):
            raise MeshError("rays are cast at triangles where they are written; this scene has instances or hidden objects, write them out")
        for item in mesh.objects:
            _check_finite(item.vertices, item.name, "triangle")
        return mesh
    objects: list[MeshObject] = []
    flat: list[str] = []
    first = 0
    for name, part in _parts(mesh):
        corners = _corners(part, name)
        normals = surface_normals(corners)
        objects.append(MeshObject(corners, normals, np.zeros(len(corners), np.int32), first, name=name))
        first += len(corners)
        flat += [f"{name}, face {face}" for face in np.flatnonzero(~normals.any(axis=1))]
    told = "1 triangle has zero area and is" if len(flat) == 1 else f"{len(flat)} triangles have zero area and are"
    warnings = (f"{told} never hit (the first: {flat[0]})",) if flat else ()
    camera = Camera.from_view(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]), 45.0, 1, 1)
    return Scene(camera, (), (Material((1.0, 1.0, 1.0), 0.0, 0.0, 0.0, 1.0),), tuple(objects), source="<mesh>", warnings=warnings)


def at_unit_size(scene: Scene) -> tuple[Scene, float]:
    """The scene's triangles alone times a power of two that brings their longest side into [0.5, 1), and that power.

    Nothing is rounded, so results do not depend on the unit that a mesh is in. Objects without triangles are left out.
    Raises MeshError where sizes within the mesh span more than float64's range.
    """
    objects = [item for item in scene.objects if len(item)]
    corners = [item.vertices.reshape(-1, 3) for item in objects]
    size = 0.0
    if corners:
        lo, hi = np.min([c.min(axis=0) for c in corners], axis=0), np.max([c.max(axis=0) for c in corners], axis=0)
        size = float((hi / 2.0 - lo / 2.0).max())
    exponent = max(int(np.frexp(size)[1]) + 1, _SMALLEST_EXPONENT) if size > 0.0 else 0
    for item in objects:
        scaled = np.ldexp(item.vertices, -exponent)
        if (np.ldexp(scaled, exponent) != item.vertices).any():
            raise MeshError(f"{item.name}: some coordinates are more than 2^1000 times smaller than the mesh; set them to zero")
    objects = [replace(item, vertices=np.ldexp(item.vertices, -exponent)) for item in objects]
    return replace(scene, objects=tuple(objects), spheres=Spheres(), lights=()), float(np.ldexp(1.0, -exponent))


def surface_normals(vertices: FloatArray) -> FloatArray:
    """(n, 3) unit normals (v1 - v0) x (v2 - v0), each component within 2^-22 at any shape and size; zero for exactly zero area.

    float64 while the angle at v0 is wide enough, rational arithmetic for the triangles left.
    """
    size = np.abs(vertices).max(axis=(1, 2), initial=0.0)
    scaled = np.ldexp(vertices, -np.frexp(size)[1][:, None, None])
    e1, e2 = scaled[:, 1] - scaled[:, 0], scaled[:, 2] - scaled[:, 0]
    area = np.linalg.norm(np.cross(e1, e2), axis=1)
    unsure = area <= _FLAT_SINE * np.linalg.norm(e1, axis=1) * np.linalg.norm(e2, axis=1)
    normals = unit_normals(scaled)
    equal = [(vertices[:, i] == vertices[:, (i + 1) % 3]).all(axis=1) for i in range(3)]
    double = np.any(equal, axis=0)
    normals[double] = 0.0
    for i in np.flatnonzero(unsure & ~double):
        normals[i] = _rational_normal(vertices[i])
    return normals


def _rational_normal(corners: FloatArray) -> FloatArray:
    a, b, c = ([Fraction(float(x)) for x in corner] for corner in corners)
    e1, e2 = [q - p for p, q in zip(a, b, strict=True)], [q - p for p, q in zip(a, c, strict=True)]
    n = [e1[i - 2] * e2[i - 1] - e1[i - 1] * e2[i - 2] for i in range(3)]
    largest = max(abs(x) for x in n)
    if largest == 0:
        return np.zeros(3)
    unit = np.array([float(x / largest) for x in n])
    return np.asarray(unit / np.linalg.norm(unit))


def _parts(mesh: Any) -> list[tuple[str, Any]]:
    """(name, part) of every mesh in `mesh`."""
    if isinstance(mesh, (str, os.PathLike)):
        raise MeshError(f"{mesh}: a path is not a mesh; read it first: clrt.load for a scene text, clrt.mesh.load_mesh for a mesh file")
    if hasattr(mesh, "geometry") and hasattr(mesh, "dump"):
        raise MeshError("a trimesh.Scene has transforms of its own; give scene.to_mesh(), or a list of meshes")
    if isinstance(mesh, (list, tuple)) and len(mesh) and all(_is_one(part) for part in mesh):
        return [(f"mesh {number} of {len(mesh)}", part) for number, part in enumerate(mesh, 1)]
    if isinstance(mesh, list) and len(mesh) == 2 and _is_pair_of_tables(mesh):
        raise MeshError("a list of two arrays is ambiguous; give vertices and faces as a tuple: (vertices, faces)")
    return [("mesh", mesh)]


def _faces_of(part: Any) -> Any:
    """The faces of an object with vertices: trimesh calls them faces, Open3D triangles."""
    return getattr(part, "faces", None) if hasattr(part, "faces") else getattr(part, "triangles", None)


def _is_one(part: Any) -> bool:
    """Whether this is a mesh by itself: an object of a mesh library, or a pair of vertices and faces."""
    return _is_object(part) or (isinstance(part, tuple) and len(part) == 2 and not any(_is_object(p) or _holds_tables(p) for p in part))


def _holds_tables(part: Any) -> bool:
    """Whether this is a pair that begins with a table, and not a table of two rows."""
    try:
        return isinstance(part, tuple) and len(part) == 2 and np.ndim(part[0]) == 2
    except ValueError:  # ragged
        return False


def _is_object(part: Any) -> bool:
    return hasattr(part, "vertices") and _faces_of(part) is not None


def _is_pair_of_tables(tables: list[Any]) -> bool:
    """Whether these look like vertices and faces: unlike two triangles, of unequal length or type."""
    try:
        points, index = (np.asarray(table) for table in tables)
    except (ValueError, TypeError):
        return False
    return points.ndim == index.ndim == 2 and (points.shape != index.shape or (points.dtype.kind == "f" and index.dtype.kind in "iu"))


def _corners(part: Any, name: str) -> FloatArray:
    """(m, 3, 3) float64 of one mesh. Raises MeshError."""
    if _is_object(part):
        return _indexed(part.vertices, _faces_of(part), name)
    if _is_one(part):
        return _indexed(part[0], part[1], name)
    triangles = numbers(part, f"{name}: expected {_FORMS}; as triangles", MeshError)
    if triangles.shape == (0,):
        triangles = triangles.reshape(0, 3, 3)
    if triangles.ndim != 3 or triangles.shape[1:] != (3, 3):
        raise MeshError(f"{name}: expected {_FORMS}; found {type(part).__name__} of shape {triangles.shape}")
    _check_finite(triangles, name, "triangle")
    return np.array(triangles, np.float64)


def _indexed(vertices: Any, faces: Any, name: str) -> FloatArray:
    points, index = numbers(vertices, f"{name}: vertices", MeshError), numbers(faces, f"{name}: faces", MeshError)
    if index.size == 0 and index.shape[1:] in ((), (3,)) and points.shape[1:] in ((), (3,)):
        return np.zeros((0, 3, 3))
    in_range = index.dtype.kind in "iu" and index.ndim == 2 and points.ndim == 2 and index.min() >= 0 and index.max() < len(points)
    if in_range:
        _check_finite(points[index], name, "face")
    checked, checked_index = check_mesh(points, index, name)
    return checked[checked_index]


def _check_finite(corners: NDArray[Any], name: str, what: str) -> None:
    bad = np.flatnonzero(~np.isfinite(corners).all(axis=tuple(range(1, corners.ndim))))
    if len(bad):
        more = f" (and {len(bad) - 1} more)" if len(bad) > 1 else ""
        raise MeshError(f"{name}: {what} {bad[0]}{more} is not finite: {corners[bad[0]].tolist()}; remove or mend it")
