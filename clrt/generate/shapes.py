"""Meshes from formulae: sphere, height field, fan of needles, soup. Left-handed axes, y up, outward by cross(b - a, c - a)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.errors import LimitError

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]


def uv_sphere(triangles: int, radius: float = 1.0) -> tuple[FloatArray, IndexArray]:
    """A closed sphere of meridians and parallels: vertices (n, 3), faces (m, 3), m within 1% of `triangles` from 2,500 on.

    s meridians and r + 1 parallels, poles included, make 2 s (r - 1) triangles; s is about 2 r. At least 12 triangles.
    """
    _need(triangles, 12, "a sphere")
    rings = max(3, round((1.0 + np.sqrt(1.0 + triangles)) / 2.0))
    sides = max(3, round(triangles / (2 * (rings - 1))))
    polar = np.pi * np.arange(1, rings) / rings
    azimuth = 2.0 * np.pi * np.arange(sides) / sides
    around = np.stack([np.cos(azimuth), np.zeros(sides), np.sin(azimuth)], axis=1)
    belts = np.sin(polar)[:, None, None] * around + np.cos(polar)[:, None, None] * np.array([0.0, 1.0, 0.0])
    vertices = radius * np.concatenate([[[0.0, 1.0, 0.0]], belts.reshape(-1, 3), [[0.0, -1.0, 0.0]]])

    here = 1 + np.arange(sides)
    after = 1 + (np.arange(sides) + 1) % sides
    last = len(vertices) - 1
    belt_start = sides * np.arange(rings - 2)[:, None]
    a, b = (here + belt_start).ravel(), (after + belt_start).ravel()
    top = np.stack([np.zeros(sides, np.int64), after, here], axis=1)
    bottom = np.stack([np.full(sides, last), here + sides * (rings - 2), after + sides * (rings - 2)], axis=1)
    middle = np.concatenate([np.stack([a, b, b + sides], axis=1), np.stack([a, b + sides, a + sides], axis=1)])
    return vertices, np.concatenate([top, middle, bottom])


def grid_mesh(triangles: int, seed: int = 0, size: float = 2.0, height: float = 0.25) -> tuple[FloatArray, IndexArray]:
    """A square height field of hills over x, z in [-size / 2, size / 2], normals up; m within 2% of `triangles` from 2,500 on.

    Heights are sums of sines of random direction, halving in height where the wavelength halves; |y| <= 2 height.
    """
    _need(triangles, 2, "a grid")
    rows = max(1, round(float(np.sqrt(triangles / 2.0))))
    columns = max(1, round(triangles / (2 * rows)))
    z, x = np.meshgrid(np.linspace(-0.5, 0.5, rows + 1) * size, np.linspace(-0.5, 0.5, columns + 1) * size, indexing="ij")
    random = np.random.default_rng(seed)
    y = np.zeros_like(x)
    for octave in range(6):
        angle, phase = random.uniform(0.0, 2.0 * np.pi, 2)
        wave = 2.0 * np.pi * 1.4 * 2**octave / size
        ridge = np.sin(wave * (x * np.cos(angle) + z * np.sin(angle)) + phase)
        y += height * 0.5**octave * ridge * np.cos(0.7 * wave * (z * np.cos(angle) - x * np.sin(angle)))
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    right, below = corner + 1, corner + columns + 1
    faces = np.concatenate([np.stack([corner, below, below + 1], axis=1), np.stack([corner, below + 1, right], axis=1)])
    return vertices, faces


def needle_fan(triangles: int, length: float = 1.0) -> tuple[FloatArray, IndexArray]:
    """A flat disc of needles that share one vertex, the hardest of places for a kd-tree: in the plane z = 0, facing -z.

    vertices (triangles + 1, 3), the center first; faces (triangles, 3). At least 3.
    """
    _need(triangles, 3, "a fan")
    angle = 2.0 * np.pi * np.arange(triangles) / triangles
    rim = length * np.stack([np.cos(angle), np.sin(angle), np.zeros(triangles)], axis=1)
    here = 1 + np.arange(triangles)
    faces = np.stack([np.zeros(triangles, np.int64), 1 + here % triangles, here], axis=1)
    return np.concatenate([np.zeros((1, 3)), rim]), faces


def soup(triangles: int, seed: int = 0) -> tuple[FloatArray, IndexArray]:
    """Random triangles in the cube [-1, 1]^3 that share nothing: vertices (3 m, 3), faces (m, 3).

    Their size falls with the cube root of their number, so that a ray meets a number that grows as slowly.
    """
    _need(triangles, 1, "a soup")
    random = np.random.default_rng(seed)
    size = min(0.9, 1.5 * triangles ** (-1.0 / 3.0))
    centers = random.uniform(-1.0 + size, 1.0 - size, (triangles, 1, 3))
    corners = centers + size * random.uniform(-1.0, 1.0, (triangles, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * triangles, dtype=np.int64).reshape(-1, 3)


def _need(triangles: int, least: int, what: str) -> None:
    if triangles < least:
        raise LimitError(f"{what} of {triangles:,} triangles: give {least:,} or more")
