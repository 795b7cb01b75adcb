"""Triangles (n, 3, 3) and rays (m, 3) of the hard cases: what is aimed where. float32 unless said otherwise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clrt.generate import uv_sphere

Triangles = NDArray[np.floating]
Array = NDArray[np.floating]
Random = np.random.Generator


class Rays(NamedTuple):
    """origins, directions : (m, 3), of one dtype."""

    origins: Array
    directions: Array

    @property
    def size(self) -> int:
        return len(self.origins)

    def take(self, rows: slice | NDArray[np.integer] | NDArray[np.bool_]) -> Rays:
        """Some of the rays, as NumPy would index them."""
        return Rays(self.origins[rows], self.directions[rows])


def rays_of(origins: ArrayLike, directions: ArrayLike, dtype: type[np.floating] = np.float32) -> Rays:
    """Rays of one dtype; one origin or one direction serves all."""
    o, d = np.broadcast_arrays(np.asarray(origins), np.asarray(directions))
    return Rays(np.ascontiguousarray(o, dtype), np.ascontiguousarray(d, dtype))


def joined(*parts: Rays) -> Rays:
    return Rays(np.concatenate([p.origins for p in parts]), np.concatenate([p.directions for p in parts]))


def closed_sphere(
    triangles: int, offset: ArrayLike = (0.0, 0.0, 0.0), radius: float = 1.0, dtype: type[np.floating] = np.float32
) -> Triangles:
    """A closed sphere around `offset`. Corners are rounded before they are shared, so that it stays closed in any dtype.

    float32 at a far offset merges corners: triangles collapse to segments between their neighbours, which leaves no hole either.
    """
    vertices, faces = uv_sphere(triangles, radius)
    return np.asarray((vertices + np.asarray(offset)).astype(dtype)[faces])


def inside(rng: Random, count: int, tri: Triangles, share: float = 0.3) -> Array:
    """(count, 3) points of the triangles' dtype in the middle `share` of their bounding box."""
    lo, hi = tri.min(axis=(0, 1)).astype(np.float64), tri.max(axis=(0, 1)).astype(np.float64)
    return np.asarray(((lo + hi) / 2 + rng.uniform(-share, share, (count, 3)) * (hi - lo) / 2).astype(tri.dtype))


def directions(rng: Random, count: int) -> Array:
    """(count, 3) float64 unit directions, even over the sphere."""
    d = rng.normal(size=(count, 3))
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


def toward(origins: Array, targets: Array, dtype: type[np.floating] = np.float32) -> Rays:
    """Rays from origins to targets; t = 1 is there. float64 holds the difference of most float32 numbers exactly."""
    return rays_of(origins.astype(dtype), targets.astype(np.float64) - origins.astype(np.float64), dtype)


def at_vertices(rng: Random, origins: Array, tri: Triangles, dtype: type[np.floating] = np.float32) -> Rays:
    """A ray from each origin to a random corner."""
    corners = tri.reshape(-1, 3)
    return toward(origins, corners[rng.integers(0, len(corners), len(origins))], dtype)


def on_edges(rng: Random, count: int, tri: Triangles) -> Array:
    """(count, 3) float64 points of random edges."""
    which, corner, s = rng.integers(0, len(tri), count), rng.integers(0, 3, count), rng.random((count, 1))
    a, b = tri[which, corner].astype(np.float64), tri[which, (corner + 1) % 3].astype(np.float64)
    return np.asarray(a + (b - a) * s)


def at_edges(rng: Random, origins: Array, tri: Triangles, dtype: type[np.floating] = np.float32) -> Rays:
    """A ray from each origin to a random point of an edge."""
    return toward(origins, on_edges(rng, len(origins), tri), dtype)


def on_faces(rng: Random, count: int, tri: Triangles, which: NDArray[np.integer] | None = None) -> Array:
    """(count, 3) float64 points of triangles, random ones unless `which` (count,) names them."""
    chosen = tri[rng.integers(0, len(tri), count) if which is None else which].astype(np.float64)
    weights = rng.dirichlet(np.ones(3), count)
    return np.asarray(np.einsum("kc,kca->ka", weights, chosen))


def hard_aims(rng: Random, count: int, tri: Triangles, share: float = 0.3) -> Rays:
    """From inside a closed mesh, thirds each: at corners, at edges, anywhere. float32."""
    origins = inside(rng, count, tri, share)
    vertex, edge, free = np.array_split(origins, 3)
    return joined(at_vertices(rng, vertex, tri), at_edges(rng, edge, tri), rays_of(free, directions(rng, len(free))))


def lattice(cells: int, relief: NDArray[np.floating] | None = None) -> Triangles:
    """A square sheet z = relief over whole x, y in [-cells / 2, cells / 2]; two triangles a square, diagonals alternating.

    relief : (cells + 1, cells + 1) heights, 0 where not given. `cells` even: then its middle is the origin, so that nothing is shifted.
    """
    z = np.zeros((cells + 1, cells + 1)) if relief is None else relief
    y, x = np.mgrid[-cells // 2 : cells // 2 + 1, -cells // 2 : cells // 2 + 1]
    p = np.stack([x, y, z], axis=-1)
    a, b, c, d = p[:-1, :-1], p[:-1, 1:], p[1:, 1:], p[1:, :-1]
    odd = ((x + y)[:-1, :-1] % 2 == 1)[..., None, None]
    first = np.where(odd, np.stack([a, b, d], axis=-2), np.stack([a, b, c], axis=-2))
    second = np.where(odd, np.stack([b, c, d], axis=-2), np.stack([a, c, d], axis=-2))
    return np.stack([first, second], axis=2).reshape(-1, 3, 3).astype(np.float32)


def quad(center: ArrayLike, side: ArrayLike, up: ArrayLike) -> Triangles:
    """Two triangles: the parallelogram center +- side +- up, float64."""
    c, s, u = (np.asarray(x, np.float64) for x in (center, side, up))
    corners = [c - s - u, c + s - u, c + s + u, c - s + u]
    return np.array([[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]])


def whole_frame(rng: Random) -> tuple[Array, Array, Array]:
    """Two whole vectors that span a tilted plane, and its whole normal: points a s + b u are exact in any format."""
    while True:
        s, u = rng.integers(-6, 7, 3), rng.integers(-6, 7, 3)
        n = np.cross(s, u)
        if np.count_nonzero(n) == 3:
            return s.astype(np.float64), u.astype(np.float64), n.astype(np.float64)


def cube(half: float = 1.0) -> Triangles:
    """The closed cube [-half, half]^3, 12 triangles, float64."""
    axes = np.eye(3) * half
    faces = [quad(sign * axes[a], axes[(a + 1) % 3], sign * axes[(a + 2) % 3]) for a in range(3) for sign in (-1.0, 1.0)]
    return np.concatenate(faces)
