"""Which medium is around a ray where objects of glass overlap: ranks, the eye's media, coincident walls. See docs/conventions.md."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.reference.crossings import NOISE, Rays, find_crossings
from clrt.reference.geometry import MaterialTable, Primitives

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

#: directions that meet edges by chance alone
PROBES = np.array([[0.3719, -0.6143, 0.6959], [0.7431, 0.5923, 0.3117], [-0.5573, 0.2287, -0.7981]])
STEEPEST = 1e-3  #: cosine below which a slanted hit widens the point no further


def ranks(prims: Primitives, materials: MaterialTable) -> IndexArray:
    """(objects,) of object ids: the higher has the say; -1 for objects that let no light through.

    First by how many boxes of such objects hold the object's own, then by the first material that lets light through, then by the id.
    """
    keys = {}
    glass = materials.refract[prims.material] > 0.0
    boxes = {int(k): _box(prims, np.flatnonzero(prims.object_id == k)) for k in np.unique(prims.object_id[glass])}
    for k, (lo, hi) in boxes.items():
        holders = sum(bool((a <= lo).all() and (hi <= b).all()) for a, b in boxes.values())
        keys[k] = (holders, int(prims.material[glass & (prims.object_id == k)].min()), k)
    result = np.full(int(prims.object_id.max(initial=-1)) + 1, -1, np.int64)
    for rank, k in enumerate(sorted(keys, key=keys.__getitem__)):
        result[k] = rank
    return result


def _box(prims: Primitives, members: IndexArray) -> tuple[FloatArray, FloatArray]:
    if members[0] >= prims.triangle_count:
        k = members[0] - prims.triangle_count
        return prims.centers[k] - prims.radii[k], prims.centers[k] + prims.radii[k]
    return prims.vertices[members].min((0, 1)), prims.vertices[members].max((0, 1))


def absorption(prims: Primitives, materials: MaterialTable) -> FloatArray:
    """(objects + 1, 3) coefficients a scene unit of each object's medium, that of its first material that lets light through; last, 0."""
    result = np.zeros((int(prims.object_id.max(initial=-1)) + 2, 3))
    through = np.flatnonzero(materials.refract[prims.material] > 0.0)
    for k in np.unique(prims.object_id[through]):
        result[k] = materials.absorb[prims.material[through[prims.object_id[through] == k]].min()]
    return result


def transmittance(coefficients: FloatArray, length: FloatArray) -> FloatArray:
    """(m, 3) what a way of `length` (m,) leaves of light, by Beer and Lambert; coefficients (m, 3).

    An endless way leaves all where the coefficient is 0.
    """
    absorbs = coefficients > 0.0
    optical = np.multiply(coefficients, length[:, None], where=absorbs, out=np.zeros_like(coefficients))
    left: FloatArray = np.exp(-optical)
    return left


def around(prims: Primitives, rank: IndexArray, point: FloatArray, tile_bytes: int) -> list[int]:
    """Objects of glass around `point`, by rank: spheres it is inside of, meshes that all probes leave by an odd number of walls."""
    m = 2 * len(PROBES)
    rays = Rays(np.tile(point, (m, 1)), np.concatenate([PROBES, -PROBES]), np.full(m, -1, np.int64), np.zeros(m), np.ones(m))
    found = find_crossings(prims, rays, tile_bytes)
    odd = np.zeros((m, len(rank)), np.int64)
    walls = found.ahead & (found.prim < prims.triangle_count)
    np.add.at(odd, (found.ray[walls], prims.object_id[found.prim[walls]]), 1)
    inside = set(np.flatnonzero((odd % 2 == 1).all(0)).tolist())
    near = np.linalg.norm(prims.centers - point, axis=1) < prims.radii
    inside |= set(prims.object_id[prims.triangle_count :][near].tolist())
    return sorted((k for k in inside if rank[k] >= 0), key=lambda k: int(rank[k]))


def walls(
    prims: Primitives, materials: MaterialTable, rays: Rays, prim: IndexArray, t: FloatArray, tile_bytes: int
) -> list[tuple[IndexArray, IndexArray]]:
    """Triangles of glass of other objects at the very point of each hit (m,), one an object, in rounds of one a ray: (rows, primitives)."""
    found = find_crossings(prims, rays, tile_bytes)
    at, other = found.ray, found.prim
    unit = rays.direction / rays.speed[:, None]
    cosine = np.maximum(np.abs(np.einsum("ki,ki->k", prims.n_geo[np.minimum(other, prims.triangle_count - 1)], unit[at])), STEEPEST)
    noise = NOISE * (prims.largest + np.abs(rays.origin[at]).max(axis=1, initial=0.0))
    here = found.meets & (np.abs(found.t - t[at]) * rays.speed[at] * cosine <= noise)
    here &= (other < prims.triangle_count) & (prims.object_id[other] != prims.object_id[prim[at]])
    here &= (materials.refract[prims.material[other]] > 0.0) & (materials.refract[prims.material[prim[at]]] > 0.0)
    here &= prim[at] < prims.triangle_count
    pairs: dict[tuple[int, int], int] = {}
    for row, wall in zip(at[here].tolist(), other[here].tolist(), strict=True):
        pairs.setdefault((row, int(prims.object_id[wall])), wall)
    rounds: list[dict[int, int]] = []
    for (row, _), wall in sorted(pairs.items()):
        free = next((r for r in rounds if row not in r), None)
        if free is None:
            rounds.append(free := {})
        free[row] = wall
    return [(np.array(list(r), np.int64), np.array(list(r.values()), np.int64)) for r in rounds]
