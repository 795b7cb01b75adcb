"""Triangles that are easy, hard or degenerate for a kd-tree, and an exact clip to judge by."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]


def soup(n: int = 400, size: float = 0.3, seed: int = 1) -> F64:
    """Random triangles of random orientation in the unit cube."""
    rng = np.random.default_rng(seed)
    return rng.random((n, 1, 3)) + size * rng.normal(size=(n, 3, 3))


def sphere(bands: int = 24) -> F64:
    """A closed sphere of 2 * bands * (bands - 1) triangles around (0.3, -0.2, 0.1), zero-area triangles at the poles left out."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, bands + 1), np.linspace(0, 2 * np.pi, bands + 1), indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1) + np.array([0.3, -0.2, 0.1])
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    lower, upper = np.stack([a, b, c], axis=2)[:-1], np.stack([a, c, d], axis=2)[1:]
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3)])


def lattice(cells: int = 4, step: float = 1.0) -> F64:
    """Unit squares, two triangles each, in all planes x, y, z = k * step: flat in whatever plane splits there."""
    faces = []
    k = np.arange(cells + 1)
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        plane, row, column = (grid.ravel() for grid in np.meshgrid(k, k[:-1], k[:-1], indexing="ij"))
        corners = np.zeros((len(plane), 4, 3))
        corners[:, :, axis] = plane[:, None]
        corners[:, :, b] = row[:, None] + [0, 1, 1, 0]
        corners[:, :, c] = column[:, None] + [0, 0, 1, 1]
        faces += [corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]
    return np.array(np.concatenate(faces) * step, np.float64)


def needles(n: int = 300, ratio: float = 1e6, seed: int = 2) -> F64:
    """Axis-aligned slivers, length to width 1e6 to 1, flat in one axis."""
    rng = np.random.default_rng(seed)
    corners = np.repeat(rng.random((n, 1, 3)), 3, axis=1)
    along, row = rng.integers(0, 3, n), np.arange(n)
    corners[row, 1, along] += 1.0
    corners[row, 2, (along + 1) % 3] += 1.0 / ratio
    return corners


def flat_sheet(n: int = 500, height: float = 0.3, seed: int = 3) -> F64:
    """Overlapping triangles all in one plane whose height is no float32."""
    corners = soup(n, 0.1, seed)
    corners[:, :, 2] = height
    return corners


def collinear(n: int = 100, seed: int = 4) -> F64:
    """Triangles of exactly zero area along one line."""
    t: F64 = np.random.default_rng(seed).integers(0, 64, (n, 3, 1)).astype(np.float64)
    corners: F64 = t * np.array([1.0, 2.0, -0.5]) + 0.25
    return corners


def mixed_scales(seed: int = 5) -> F64:
    """Triangles of sizes 1e-30 to 1e30 around one point."""
    scales: F64 = 10.0 ** np.arange(-30.0, 31)
    return np.random.default_rng(seed).normal(size=(len(scales), 3, 3)) * scales[:, None, None]


def neighbours(n: int = 200, seed: int = 6) -> F64:
    """Corners on three neighbouring float32 numbers each way: every split rounds onto a corner or a bound."""
    steps: F64 = np.random.default_rng(seed).integers(0, 3, (n, 3, 3)).astype(np.float64)
    return 1.0 + steps * 2.0**-23


def heavy_floor(top: bool) -> F64:
    """A high room, most of whose triangles lie in its floor or its ceiling: the median is a bound of the whole."""
    room = soup(100, 0.02, 9) * np.array([1.0, 1, 8])
    return np.concatenate([room, flat_sheet(300, 9.0 if top else -1.0)])


def large_and_small(seed: int = 7) -> F64:
    """Twelve triangles that span everything, among many small ones."""
    return np.concatenate([soup(12, 3.0, seed), soup(500, 0.02, seed)])


MESHES: dict[str, Callable[[], F64]] = {
    "none": lambda: np.zeros((0, 3, 3)),
    "one": lambda: soup(1),
    "two": lambda: soup(2),
    "soup": soup,
    "dense soup": lambda: soup(200, 1.0),
    "sphere": sphere,
    "sphere at 1e6": lambda: sphere() + np.array([1e6, -1e6, 1e6]),
    "sphere of 1e-30": lambda: sphere() * 1e-30,
    "sphere of 1e30": lambda: sphere() * 1e30,
    "sphere of 1e-200": lambda: sphere(8) * 1e-200,
    "lattice": lattice,
    "lattice of thirds": lambda: lattice(3, 1 / 3),
    "needles": needles,
    "flat sheet": flat_sheet,
    "heavy floor": lambda: heavy_floor(False),
    "heavy ceiling": lambda: heavy_floor(True),
    "identical": lambda: np.repeat(soup(1), 10_000, axis=0),
    "identical, flat": lambda: np.repeat(flat_sheet(1), 1000, axis=0),
    "collinear": collinear,
    "collinear among others": lambda: np.concatenate([collinear(), soup(100)]),
    "points": lambda: np.repeat(np.random.default_rng(8).random((100, 1, 3)), 3, axis=1),
    "one point": lambda: np.ones((50, 3, 3)),
    "mixed scales": mixed_scales,
    "neighbours": neighbours,
    "large and small": large_and_small,
}


def exact_bounds(triangle: F64, lo: F64, hi: F64) -> tuple[list[Fraction], list[Fraction]] | None:
    """Bounds of the part of a triangle in a box, exactly; None if they do not meet."""
    polygon = [[Fraction(float(x)) for x in corner] for corner in triangle]
    for axis in range(3):
        for bound, sign in ((lo, 1), (hi, -1)):
            plane = Fraction(float(bound[axis]))
            kept = []
            for here, there in zip(polygon, polygon[1:] + polygon[:1], strict=True):
                a, b = sign * (here[axis] - plane), sign * (there[axis] - plane)
                if a >= 0:
                    kept.append(here)
                if a * b < 0:
                    kept.append([x + (y - x) * (a / (a - b)) for x, y in zip(here, there, strict=True)])
            polygon = kept
            if not polygon:
                return None
    return [min(c) for c in zip(*polygon, strict=True)], [max(c) for c in zip(*polygon, strict=True)]


def read_objects(path: Path) -> list[F64]:
    """Triangles of each object of a scene text that is known to be well formed."""
    objects: list[F64] = []
    corners: list[list[str]] = []
    for line in path.read_text().splitlines():
        if line.startswith("T"):
            corners.append(line.split()[1:10])
        elif line.startswith("O"):
            objects.append(np.array(corners, np.float64).reshape(-1, 3, 3))
            corners = []
    return objects
