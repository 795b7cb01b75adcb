"""The view that rays are compared in: a mesh on a wide ground, one point light, 90% of the camera's rays hit; and its files for peers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from clrt.bench.peers import RaySet, shadow_offset
from clrt.bench.scenes import BenchScene
from clrt.device.pack import unit_normals
from clrt.reference.sampled import eye_rays
from clrt.scene.model import Camera, Lens, Material, MeshObject, PointLight, Scene

FloatArray = NDArray[np.float64]

FIELD_DEG = 40.0
_FROM = (0.45, 0.35, -1.0)  #: where the eye stands, seen from the mesh's middle
_DISTANCE = 1.15  #: of the mesh's diagonal, and so are all lengths below
_LIGHT = (0.8, 1.0, -0.3)  #: from the eye: to the right, upwards, along the view
_GROUND = 20.0
_LENS = 0.01  #: radius of the lens whose rays begin at places of their own
_MATT = Material((1.0, 1.0, 1.0), 0.1, 0.9, 0.0, 1.0)
_BLOCK = 4  #: pixels a side of what one packet of Embree holds


def view_scene(mesh: FloatArray, size: int = 512) -> Scene:
    """The scene: `mesh` (n, 3, 3), and a ground of two triangles at its foot as an object of its own; a square picture."""
    lo, hi = mesh.min((0, 1)), mesh.max((0, 1))
    middle, diagonal = (lo + hi) / 2.0, float(np.linalg.norm(hi - lo))
    eye = middle + _DISTANCE * diagonal * np.array(_FROM) / np.linalg.norm(_FROM)
    ahead = (middle - eye) / np.linalg.norm(middle - eye)
    right = np.cross([0.0, 1.0, 0.0], ahead)
    right /= np.linalg.norm(right)
    light = eye + diagonal * (_LIGHT[0] * right + _LIGHT[1] * np.array([0.0, 1.0, 0.0]) + _LIGHT[2] * ahead)
    camera = Camera.from_view(eye, ahead, np.array([0.0, 1.0, 0.0]), FIELD_DEG, size, size)
    x, z = (middle[a] + _GROUND * diagonal * np.array([-1.0, 1.0]) for a in (0, 2))
    corners = np.array([[x[i], lo[1], z[j]] for i, j in ((0, 0), (0, 1), (1, 1), (1, 0))])
    ground = corners[[[0, 1, 2], [0, 2, 3]]]
    objects = (mesh_object(mesh, 0, "mesh"), mesh_object(ground, len(mesh), "ground"))
    return Scene(camera, (PointLight((float(light[0]), float(light[1]), float(light[2]))),), (_MATT,), objects, source="<view>")


def mesh_object(vertices: FloatArray, first_prim: int, name: str) -> MeshObject:
    """Flat triangles of the first material."""
    return MeshObject(vertices, unit_normals(vertices), np.zeros(len(vertices), np.int32), first_prim, name=name)


def view_of(bench: BenchScene, size: int = 512) -> Scene:
    """The view of a scene's largest object."""
    return view_scene(largest_mesh(bench), size)


def largest_mesh(bench: BenchScene) -> FloatArray:
    """(n, 3, 3), scene units."""
    return max((item.vertices for item in bench.scene.objects), key=len)


def with_lens(scene: Scene) -> Scene:
    """The same view through a lens: every ray begins at a place of its own, neighbours have nearly the same direction."""
    mesh = scene.objects[0].vertices
    lo, hi = mesh.min((0, 1)), mesh.max((0, 1))
    diagonal = float(np.linalg.norm(hi - lo))
    lens = Lens(_LENS * diagonal, float(np.linalg.norm((lo + hi) / 2.0 - scene.camera.eye)))
    return Scene(scene.camera, (), scene.materials, scene.objects, source="<view>", lens=lens, samples=1)


def emptied(scene: Scene) -> Scene:
    """The same rays, which meet nothing: of the mesh, one triangle stays, far above the camera and out of its sight."""
    mesh = scene.objects[0].vertices
    height = 100.0 * float(np.linalg.norm(np.ptp(mesh.reshape(-1, 3), axis=0)))
    return replace(scene, objects=(mesh_object(mesh[:1] + np.array([0.0, height, 0.0]), 0, "nothing"),))


def lens_rays(scene: Scene) -> RaySet:
    """The rays of `with_lens(scene)` as the kernels draw them with the seed 0, row by row, unit directions."""
    origins, directions = eye_rays(scene, 0, 0, bits=24)
    return RaySet(*(np.ascontiguousarray(a.reshape(-1, 3), np.float32) for a in (origins, directions)))


def write_scene(scene: Scene, path: Path) -> None:
    """The scene for embree/driver.cpp: float32 eye, image plane, light, offset; then counts and corners of each object."""
    ul, ur, ll, _ = scene.camera.corners
    light = np.asarray(scene.lights[0].position)
    numbers = np.concatenate([scene.camera.eye, ul, ur - ul, ll - ul, light, [shadow_offset(scene)]])
    with path.open("wb") as file:
        file.write(numbers.astype(np.float32).tobytes())
        file.write(np.int32(len(scene.objects)).tobytes())
        for item in scene.objects:
            file.write(np.int32(len(item)).tobytes())
            file.write(item.vertices.astype(np.float32).tobytes())


def write_triangles(scene: Scene, path: Path) -> None:
    """All triangles (n, 3, 3) float32, for peers in Python."""
    np.save(path, np.concatenate([item.vertices for item in scene.objects]).astype(np.float32))


def write_rays(rays: RaySet, path: Path) -> None:
    """Rays (n, 6) float32, or (n, 7) with their lengths, for peers in Python."""
    parts = [rays.origins, rays.directions, *([] if rays.distances is None else [rays.distances[:, None]])]
    np.save(path, np.concatenate(parts, axis=1))


def write_packets(rays: RaySet, size: int, path: Path) -> None:
    """Rays of a square picture for embree/driver.cpp: blocks of 4 x 4 pixels, of each the six numbers, 16 of one kind side by side."""
    numbers = np.concatenate([rays.origins, rays.directions], axis=1)
    blocks = size // _BLOCK
    in_blocks = numbers.reshape(blocks, _BLOCK, blocks, _BLOCK, 6).transpose(0, 2, 4, 1, 3)
    path.write_bytes(np.ascontiguousarray(in_blocks).tobytes())
