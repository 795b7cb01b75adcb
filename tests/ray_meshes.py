"""Meshes and rays that are hard to decide, for tests of RayCaster: aimed at corners, edges and planes, near and far."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.generate import grid_mesh, needle_fan, rabbit_like, soup, uv_sphere

Array = NDArray[Any]
Random = np.random.Generator


def corners(mesh: tuple[Array, Array]) -> Array:
    vertices, faces = mesh
    return vertices[faces]


def sphere(triangles: int, offset: tuple[float, float, float] = (0, 0, 0), dtype: Any = np.float64, radius: float = 1.0) -> Array:
    """A closed sphere; corners are rounded before faces share them, so that it stays closed."""
    vertices, faces = uv_sphere(triangles, radius)
    return np.asarray((vertices + np.array(offset)).astype(dtype)[faces])


def doubled(tri: Array, seed: int = 0) -> Array:
    """Every triangle three times, once from another corner, in a random order."""
    rng = np.random.default_rng(seed)
    return rng.permutation(np.concatenate([tri, tri[:, [1, 2, 0]], tri]))


def whole(tri: Array) -> Array:
    """On a lattice of 1/16: rays between its points meet edges and corners exactly."""
    return np.round(tri * 16) / 16


MESHES: dict[str, Callable[[], Array]] = {
    "sphere": lambda: sphere(400),
    "sphere, float32": lambda: sphere(400, dtype=np.float32),
    "sphere at 1e6": lambda: sphere(300, (1e6, -2e6, 3e6)),
    "sphere at 1e4, float32": lambda: sphere(300, (1e4, -2e4, 3e4), np.float32),
    "fan of needles": lambda: corners(needle_fan(120)) * [1.0, 1e-3, 1.0] + [0.0, 0.0, 0.3],
    "grid": lambda: corners(grid_mesh(400)),
    "grid on a lattice": lambda: whole(corners(grid_mesh(300))),
    "rabbit": lambda: corners(rabbit_like(1000)),
    "soup": lambda: corners(soup(300)),
    "duplicates": lambda: doubled(whole(corners(grid_mesh(120)))),
    "sizes 1e-8 to 1e8": lambda: np.concatenate([sphere(100, radius=1e-8), corners(soup(50)), sphere(100, radius=1e8)]),
    "scale 1e-30": lambda: sphere(200, radius=1e-30, dtype=np.float32),
}


def points(rng: Random, tri: Array, count: int, kind: str) -> Array:
    """(count, 3) float64 random points of a mesh: its corners, points of edges, of faces."""
    chosen = tri[rng.integers(0, len(tri), count)].astype(np.float64)
    if kind == "corner":
        return np.asarray(chosen[np.arange(count), rng.integers(0, 3, count)])
    weights = rng.dirichlet(np.ones(3), count)
    if kind == "edge":
        weights[np.arange(count), rng.integers(0, 3, count)] = 0.0
        weights /= weights.sum(axis=1, keepdims=True)
    return np.asarray(np.einsum("kc,kca->ka", weights, chosen))


def aimed(rng: Random, tri: Array, count: int, dtype: Any) -> tuple[Array, Array]:
    """Rays from around, within and on a mesh at its corners, edges and faces; in planes of triangles; along axes; of any length."""
    lo, hi = (f(tri.astype(np.float64), axis=(0, 1)) for f in (np.min, np.max))
    size, middle = (hi - lo).max(), (lo + hi) / 2
    part = -(-count // 9)
    around = (middle + rng.uniform(-1.5, 1.5, (2 * part, 3)) * size).astype(dtype)
    within = (middle + rng.uniform(-0.2, 0.2, (4 * part, 3)) * (hi - lo)).astype(dtype)
    on = points(rng, tri, part, "corner").astype(dtype)
    targets = [points(rng, tri, part, kind) for kind in ("corner", "face", "corner", "edge", "face", "edge", "face")]
    origins = np.concatenate([around, within, on])
    directions = np.concatenate(targets) - origins
    chosen = tri[rng.integers(0, len(tri), part)].astype(np.float64)
    a, b = (np.einsum("kc,kca->ka", rng.dirichlet(np.ones(3), part), chosen) for _ in range(2))
    axes = np.eye(3)[rng.integers(0, 3, part)] * rng.choice([-1.0, 1.0], (part, 1))
    origins = np.concatenate([origins, a + 2 * (a - b), points(rng, tri, part, "corner") - 2 * size * axes])
    directions = np.concatenate([directions, b - a, axes])
    lengths = 10.0 ** rng.integers(-10, 11, (len(directions), 1))
    with np.errstate(under="ignore"):
        return origins.astype(dtype), (directions * lengths / np.abs(directions).max(axis=1, keepdims=True)).astype(dtype)
