"""A mesh file as a scene text of one object, in front of the homework's camera.

Mesh files are right-handed: x to the right, y up, +z towards the viewer. Scenes are left-handed: +z into the picture.
So (x, y, z) of the file becomes (x, y, -z): the model is seen from its front, not mirrored. The change of hand
turns every triangle's winding; the last two corners are swapped to keep cross(b - a, c - a) outward.
"""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from clrt.errors import MeshError, SceneError
from clrt.mesh import load_mesh, vertex_normals
from clrt.scene.write import triangle_lines, write_text

HOMEWORK_CAMERA = "E 0 0 -1\nV 0 0 1\nF 45\nR 1024 1024\nL 5 5 -5\n"
HOMEWORK_MATERIAL = "M 0.5 0.5 1.0 0.1 0.9 0.3 20.0 0.0 0.0 1.6\n"

#: half the width of the view at distance 1 from the eye: F 45
_HALF_VIEW = float(np.tan(np.radians(22.5)))
#: how much of the view the mesh spans, at its widest
_FILL = 0.8
#: distance of the eye from the middle of the mesh, scene units; the eye stands at z = -1
_DISTANCE = 2.0


def convert(mesh_path: str | os.PathLike[str], scene_path: str | os.PathLike[str], smooth: bool = False) -> str:
    """Write `scene_path` from the mesh and return a one-line summary.

    `smooth` gives each corner a normal (`T` with 18 numbers), the mean of the faces around its vertex. An existing
    scene is replaced whole. Raises MeshError for the mesh, SceneError for a scene path that cannot be written.
    """
    if os.path.exists(mesh_path) and os.path.exists(scene_path) and os.path.samefile(mesh_path, scene_path):
        raise SceneError(f"{scene_path}: is the mesh itself; name another file for the scene")
    vertices, faces = load_mesh(mesh_path)
    vertices, faces = to_scene_axes(vertices, faces)
    try:
        vertices = fit_to_view(vertices, faces)
    except MeshError as error:
        raise MeshError(f"{mesh_path}: {error}") from None
    normals = vertex_normals(vertices, faces) if smooth else None
    head = f"# {os.path.basename(mesh_path)}: {len(faces)} triangles\n".encode("ascii", "replace").decode()
    write_text(scene_path, head + HOMEWORK_CAMERA + "\n" + HOMEWORK_MATERIAL + triangle_lines(vertices, faces, normals) + "O\n")
    return f"{scene_path}: {len(faces):,} triangles of {mesh_path}{', smooth' if smooth else ''}"


def to_scene_axes(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """From a mesh file's right-handed axes to the scene's left-handed ones; see the head of this file."""
    return vertices * np.array([1.0, 1.0, -1.0]), faces[:, [0, 2, 1]]


def fit_to_view(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Move and scale the vertices in use so that the mesh spans 80% of the homework's square view.

    With the middle of the box at distance D, a vertex (x, y, z) scaled by s is seen at s |x| / (D + s z) of the
    view plane at distance 1; setting that to fill * half-view and solving for s gives s = k D / (|x| - k z), and the
    smallest s over all vertices fits them all. A mesh that is long in z is kept at half the distance from the eye.

    Raises MeshError where all vertices coincide.
    """
    used = np.unique(faces)
    lo, hi = vertices[used].min(axis=0), vertices[used].max(axis=0)
    size = float((hi - lo).max())
    if not 0.0 < size < np.inf:
        raise MeshError("the mesh has no extent, or one beyond the range of numbers; scale it in the program that made it")
    # Scaling by the size first keeps every product below within range
    unit = (vertices - (lo / 2.0 + hi / 2.0)) / size
    k = _FILL * _HALF_VIEW
    reach = np.maximum(np.abs(unit[used, :2]).max(axis=1) - k * unit[used, 2], -2.0 * unit[used, 2] * k)
    scale = k * _DISTANCE / float(reach.max())
    fitted: NDArray[np.float64] = unit * scale + np.array([0.0, 0.0, _DISTANCE - 1.0])
    return fitted
