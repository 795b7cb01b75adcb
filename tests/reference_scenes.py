"""Small scenes for the tests of the references, built without the scene reader."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clrt.scene.model import Camera, Material, MeshObject, PointLight, Scene, Spheres

FloatArray = NDArray[np.float64]

BLACK = Material((1.0, 1.0, 1.0), 0.0, 0.0, 0.0, 1.0)


def matte(ambient: float = 0.0, diffuse: float = 1.0) -> Material:
    return Material((1.0, 1.0, 1.0), ambient, diffuse, 0.0, 1.0)


def glass(ior: float, refract: float = 1.0, reflect: float = 0.0) -> Material:
    return Material((1.0, 1.0, 1.0), 0.0, 0.0, 0.0, 1.0, reflect, refract, ior)


def mirror(reflect: float = 1.0, ambient: float = 0.0) -> Material:
    return Material((1.0, 1.0, 1.0), ambient, 0.0, 0.0, 1.0, reflect)


def mesh(vertices: ArrayLike, first: int = 0, material: int = 0, corner_normals: FloatArray | None = None) -> MeshObject:
    v = np.asarray(vertices, np.float64)
    n = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    length = np.linalg.norm(n, axis=1, keepdims=True)
    n = np.divide(n, length, where=length > 0.0, out=np.zeros_like(n))
    return MeshObject(v, n, np.full(len(v), material, np.int32), first, corner_normals)


def quad(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike) -> FloatArray:
    """Corners in order around the quad -> (2, 3, 3)."""
    return np.array([[a, b, c], [a, c, d]], np.float64)


def plane_z(z: float, half: float = 100.0) -> FloatArray:
    """A quad at height z that holds |x|, |y| <= half; the edge between its triangles passes the centre at a distance."""
    return quad((-half, -half, z), (half, -half, z), (half, 1.5 * half, z), (-half, half, z))


def plane_y(y: float, half: float = 100.0) -> FloatArray:
    return plane_z(y, half)[:, :, [0, 2, 1]]


def box(low: ArrayLike, high: ArrayLike) -> FloatArray:
    """(12, 3, 3), faces of either orientation."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    p = np.array([[x, y, z] for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)], np.float64)
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    return np.concatenate([quad(*p[list(f)]) for f in faces])


def prism_mesh() -> MeshObject:
    """A right-angled prism: the leg z = 0 is met straight along +z, the slanted face behind it at 45 degrees."""
    p = np.array([[x, y, z] for x in (-1.0, 1.0) for y, z in ((-1, 0), (1, 0), (-1, 2))])
    return mesh(np.array([*p[[[0, 1, 2], [3, 5, 4]]], *quad(*p[[0, 1, 4, 3]]), *quad(*p[[0, 2, 5, 3]]), *quad(*p[[1, 2, 5, 4]])]))


def globe(rings: int = 8, radius: float = 1.0, center: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """A closed sphere of triangles, poles along y; neighbours share their vertices to the bit."""
    theta, phi = np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, 2 * rings + 1)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    grid = np.stack([np.sin(t) * np.cos(p), np.cos(t), np.sin(t) * np.sin(p)], axis=-1)
    grid[:, -1], grid[0], grid[-1] = grid[:, 0], (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)
    grid = grid * radius + np.asarray(center)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    lower = np.stack([a, b, c], axis=2)[:-1].reshape(-1, 3, 3)  # without the zero-area ones at the poles
    upper = np.stack([a, c, d], axis=2)[1:].reshape(-1, 3, 3)
    return np.concatenate([lower, upper])


def shifted(vertices: FloatArray, x: float, y: float, z: float) -> FloatArray:
    return vertices + np.array([x, y, z])


def spheres(*items: tuple[float, float, float, float, int]) -> Spheres:
    """Each: x, y, z, radius, material."""
    table = np.array(items, np.float64).reshape(-1, 5)
    return Spheres(table[:, :3].copy(), table[:, 3].copy(), table[:, 4].astype(np.int32))


def scene(
    objects: list[MeshObject],
    materials: list[Material],
    lights: list[ArrayLike | PointLight] | None = None,
    balls: Spheres | None = None,
    *,
    eye: ArrayLike = (0.0, 0.0, -5.0),
    view: ArrayLike = (0.0, 0.0, 1.0),
    fov: float = 40.0,
    size: tuple[int, int] = (1, 1),
    background: tuple[float, float, float] = (0.0, 0.0, 0.0),
    depth: int = 5,
) -> Scene:
    camera = Camera.from_view(np.array(eye, np.float64), np.array(view, np.float64), np.array([0.0, 1.0, 0.0]), fov, *size)
    points = tuple(x if isinstance(x, PointLight) else PointLight(tuple(map(float, x))) for x in lights or [])
    return Scene(camera, points, tuple(materials), tuple(objects), balls or Spheres(), background, depth)
