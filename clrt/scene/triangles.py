"""Geometry of the triangles of a scene: unit normals that survive any scale, and connected components."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import FloatArray

BoolArray = NDArray[np.bool_]

#: A given face normal agrees with the geometry within this angle of it, on either side, in degrees. The normals of
#: real scenes, written with six digits, are within 0.3 degrees; those of wrong ones are anywhere.
AGREEING_ANGLE = 60.0

#: Below this sine of the angle between two edges (scaled to a largest component in [0.5, 1)) the float64 cross product
#: may be off by more than 2^-23 of itself, or wrongly zero: its error is at most 16 * 2^-53, from the roundings of two
#: differences, two products and a sum. Such needles are decided in rational arithmetic.
_NEEDLE = 2.0**-26
_EXPONENT = 1000  #: powers of two up to this one and their reciprocals are float64 numbers, so that multiplying by them is exact


def unit(vectors: FloatArray) -> FloatArray:
    """Vectors (..., 3) float64 scaled to length 1, error at most 4 ulp; zero vectors stay zero. Safe at any scale."""
    return _rows(_unit(columns(vectors)))


def scaled(vectors: FloatArray) -> FloatArray:
    """Each vector (..., 3) times the power of two that brings its largest component into [0.5, 1): no square over- or underflows."""
    return _rows(_scaled(columns(vectors)))


def columns(vectors: FloatArray) -> FloatArray:
    """(3, ...) contiguous components of vectors (..., 3): work on whole ones takes less time than on rows of three."""
    return np.ascontiguousarray(np.moveaxis(vectors, -1, 0))


def _rows(vectors: FloatArray) -> FloatArray:
    """What `columns` is given, of what it gives."""
    return np.ascontiguousarray(np.moveaxis(vectors, 0, -1))


def _unit(vectors: FloatArray) -> FloatArray:
    """As `unit`, of and as columns (3, ...)."""
    inner = _scaled(vectors)
    x, y, z = inner
    length = np.sqrt(x * x + y * y + z * z)
    result: FloatArray = inner / np.where(length > 0.0, length, 1.0)
    return result


def _scaled(vectors: FloatArray) -> FloatArray:
    """As `scaled`, of and as columns (3, ...)."""
    _, exponent = np.frexp(_largest(vectors))
    if np.abs(exponent).max(initial=0) < _EXPONENT:
        return np.asarray(vectors * np.ldexp(1.0, -exponent))
    result: FloatArray = np.ldexp(vectors, -exponent)
    return result


def _largest(vectors: FloatArray) -> FloatArray:
    """The largest component of each of the columns (3, ...), signs aside."""
    x, y, z = np.abs(vectors)
    result: FloatArray = np.maximum(np.maximum(x, y), z)
    return result


def flip_x(vectors: FloatArray) -> FloatArray:
    """A copy of vectors (..., 3) with x negated; as 0 - x, since -x would make -0.0 of 0.0."""
    flipped = np.array(vectors)
    flipped[..., 0] = 0.0 - flipped[..., 0]
    return flipped


def face_normals(vertices: FloatArray) -> FloatArray:
    """Unit normals (n, 3) of triangles (n, 3, 3) along (v1 - v0) x (v2 - v0); exactly zero where the area is exactly zero.

    The relative error is at most 2^-23, in triangles that are no needles a few times 2^-53 over the sine of the angle at v0.
    """
    v0, v1, v2 = columns(vertices.reshape(-1, 9)).reshape(3, 3, -1)
    (ax, ay, az), (bx, by, bz) = _scaled(v1 - v0), _scaled(v2 - v0)
    cross = np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
    for i in np.flatnonzero(_largest(cross) < _NEEDLE).tolist():
        cross[:, i] = _exact_direction(vertices[i])
    return _rows(_unit(cross))


def _exact_direction(triangle: FloatArray) -> FloatArray:
    """The cross product of one triangle (3, 3), computed in rational numbers and then scaled to at most 1."""
    from fractions import Fraction

    v0, v1, v2 = ([Fraction(c) for c in corner] for corner in triangle.tolist())
    a = [p - q for p, q in zip(v1, v0, strict=True)]
    b = [p - q for p, q in zip(v2, v0, strict=True)]
    cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    largest = max(map(abs, cross)) or Fraction(1)
    return np.array([float(c / largest) for c in cross])


def agreeing(given: FloatArray, geometric: FloatArray) -> BoolArray:
    """Which unit normals (n, 3) lie within `AGREEING_ANGLE` of the geometric ones, or of their opposites."""
    cosine = np.einsum("ij,ij->i", given, geometric)
    result: BoolArray = np.abs(cosine) >= np.cos(np.radians(AGREEING_ANGLE))
    return result


def components(vertices: FloatArray) -> NDArray[np.int64]:
    """Number (n,) of the connected component of each triangle (n, 3, 3), numbered in the order of their first triangles.

    Triangles are connected where they share a vertex, that is, three equal coordinates. Union-find over all
    triangles at once: each round hooks every root that has a smaller neighbour below it, then flattens the trees.
    """
    corner = _shared_vertices(vertices.reshape(-1, 3)).reshape(-1, 3)
    parent = np.arange(corner.max(initial=-1) + 1)
    one, other = corner[:, [0, 1]].ravel(), corner[:, [1, 2]].ravel()
    while True:
        low, high = np.minimum(parent[one], parent[other]), np.maximum(parent[one], parent[other])
        apart = low != high
        if not apart.any():
            break
        np.minimum.at(parent, high[apart], low[apart])
        while not np.array_equal(flatter := parent[parent], parent):
            parent = flatter
    _, first, member = np.unique(parent[corner[:, 0]], return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[member.reshape(-1)]


def _shared_vertices(points: FloatArray) -> NDArray[np.int64]:
    """Number (m,) of each point (m, 3) such that equal points, and only those, have equal numbers."""
    order = np.lexsort((points[:, 2], points[:, 1], points[:, 0]))
    ordered = points[order]
    new = np.ones(len(points), np.int64)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    number = np.empty(len(points), np.int64)
    number[order] = np.cumsum(new) - 1
    return number
