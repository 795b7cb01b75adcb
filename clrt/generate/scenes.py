"""Scenes around the generated meshes: camera, lights, materials and a mirror floor, of the homework's kind."""

from __future__ import annotations

import numpy as np

from clrt.errors import LimitError
from clrt.generate.rabbit import eyes, rabbit_like
from clrt.generate.shapes import FloatArray, grid_mesh, soup, uv_sphere
from clrt.mesh import vertex_normals
from clrt.scene.write import line, triangle_lines

FLOOR_Y = -0.5
RABBIT_SCALE = 0.84
#: coordinates of the rabbit in a scene are rounded to this many decimals: shorter texts, the same on every machine
_DECIMALS = 6
_LEVEL = "E 0 0 -1\nV 0 0 1\nF 45\nR 1024 1024\nL 5 5 -5\nL -4 3 -3 0.3 0.3 0.36\n\n"
_RAISED = "E 0 0.55 -1\nV 0 -0.5 1\nF 45\nR 1024 768\nL 5 5 -5\nL -4 3 -3 0.3 0.3 0.36\n\n"
_BLUE = "M 0.5 0.5 1 0.1 0.9 0.3 20 0 0 1\n"
_MIRROR_FLOOR = "M 0.8 0.8 0.42 0.1 0.7 0.3 20 0.4 0 1\n"
_DARK_EYE = "M 0.12 0.08 0.06 0.3 0.6 6 80 0.1 0 1\n"
#: r g b Ka Kd Ks exponent Reflect Refract Nr: matt, polished, mirror and glass
_BALLS = (
    "0.85 0.25 0.2 0.1 0.8 0.4 40 0.1 0 1", "0.25 0.5 0.85 0.1 0.8 0.4 40 0.1 0 1", "0.9 0.75 0.3 0.1 0.8 0.2 20 0 0 1",
    "0.35 0.7 0.4 0.1 0.8 0.2 20 0 0 1", "0.9 0.9 0.95 0.05 0.1 0.8 200 0.8 0 1", "0.9 1 0.95 0.02 0.05 0.8 200 0.1 0.85 1.5",
)  # fmt: skip


def rabbit_scene(triangles: int, seed: int, smooth: bool = False) -> str:
    """The rabbit-like animal on a mirror floor, seen by the homework's camera; floor and animal are two objects.

    `smooth` gives each corner a normal.
    """
    vertices, faces = rabbit_like(triangles, seed)
    placed = rabbit_place(vertices)
    normals = np.round(vertex_normals(placed, faces), _DECIMALS) if smooth else None
    text = _LEVEL + _BLUE + triangle_lines(placed, faces, normals) + "O\n" + floor(-1.2, 1.2, -0.2, 2.4)
    centers, radius = eyes(len(faces), seed)
    return text + _DARK_EYE + "".join(line("S", center, radius * RABBIT_SCALE) for center in rabbit_place(centers))


def smooth_rabbit_scene(triangles: int, seed: int) -> str:
    """`rabbit_scene` with a normal at each corner."""
    return rabbit_scene(triangles, seed, smooth=True)


def rabbit_place(points: FloatArray) -> FloatArray:
    """From the rabbit's axes (it looks along +x and sits on y = 0) to its place on the floor, three quarters to the eye."""
    c, s = np.cos(np.radians(38.0)), np.sin(np.radians(38.0))
    scene_from_rabbit = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    placed: FloatArray = np.round(RABBIT_SCALE * points @ scene_from_rabbit.T + np.array([-0.03, FLOOR_Y, 0.85]), _DECIMALS)
    return placed


def sphere_scene(triangles: int, seed: int) -> str:
    """A sphere of triangles on a mirror floor; there is nothing for the seed to decide."""
    vertices, faces = uv_sphere(triangles, 0.5)
    return _LEVEL + _BLUE + triangle_lines(vertices + np.array([0.0, 0.0, 0.9]), faces) + "O\n" + floor(-1.2, 1.2, -0.2, 2.4)


def grid_scene(triangles: int, seed: int) -> str:
    """Hills, as a height field."""
    vertices, faces = grid_mesh(triangles, seed, size=3.0, height=0.18)
    hills = triangle_lines(np.round(vertices + np.array([0.0, -0.5, 1.2]), _DECIMALS), faces)
    return _RAISED + "M 0.55 0.75 0.4 0.12 0.9 0.1 10 0 0 1\n" + hills + "O\n"


def soup_scene(triangles: int, seed: int) -> str:
    """Random triangles that share nothing, over a mirror floor."""
    vertices, faces = soup(triangles, seed)
    placed = np.round(0.45 * vertices + np.array([0.0, 0.0, 0.9]), _DECIMALS)
    return _LEVEL + _BLUE + triangle_lines(placed, faces) + "O\n" + floor(-1.2, 1.2, -0.2, 2.4)


def spheres_scene(count: int, seed: int) -> str:
    """A field of `count` spheres that do not overlap, of six materials, on a mirror floor."""
    if count < 1:
        raise LimitError(f"a field of {count:,} spheres: give 1 or more")
    random = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(count)))
    pitch = 2.8 / side
    places = np.sort(random.permutation(side * side)[:count])
    radii = pitch * random.uniform(0.2, 0.45, count)
    # A sphere stays within its square of the field, so no two overlap
    spare = (pitch / 2.0 - radii)[:, None] * random.uniform(-1.0, 1.0, (count, 2))
    x, z = -1.4 + pitch * (places % side + 0.5) + spare[:, 0], pitch * (places // side + 0.5) + spare[:, 1]
    spheres = np.round(np.stack([x, FLOOR_Y + radii, z, radii], axis=1), _DECIMALS)
    kinds = random.integers(0, len(_BALLS), count)
    parts = ["M " + material + "\n" + "".join(line("S", s) for s in spheres[kinds == kind])
             for kind, material in enumerate(_BALLS) if (kinds == kind).any()]  # fmt: skip
    return _RAISED + floor(-1.6, 1.6, -0.2, 3.0) + "".join(parts)


def floor(left: float, right: float, near: float, far: float) -> str:
    """Two triangles of half mirror at the height FLOOR_Y, facing up, closed as an object of their own."""
    y = FLOOR_Y
    vertices = np.array([[left, y, near], [left, y, far], [right, y, far], [right, y, near]])
    return _MIRROR_FLOOR + triangle_lines(vertices, np.array([[0, 1, 2], [0, 2, 3]])) + "O\n"
