"""The exact oracle: which triangle does a ray hit first, in rational arithmetic on the numbers as given.

Triangles are closed sets (edges and vertices count); a ray in a triangle's plane misses it; a triangle of exactly zero area is never
hit; t lies in the open interval (t_min, t_max); equal t goes to the lowest primitive id. A ray that is zero, NaN or infinite misses.

All triangles are looked at. A float64 sieve (lines.py) and the interval of t below drop what is surely missed or surely farther; what
is left is decided by integers (rational.py), so that no answer ever rests on a rounded number.

Interval of t = N / D with N = A . (e1 x e2), D = d . (e1 x e2), u = 2^-53: e1, e2, A have one rounding a component, the cross product
gamma(4) sqrt(2), the dot product gamma(3), A one more: |N - N_exact| <= 10 u sqrt(2) |e1||e2||A| < 16 u |e1||e2||A|, the same for D
with |d|. The edge functions, from A, B, C with one rounding each, likewise: |w - w_exact| < 16 u |d||A||B|.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clrt.errors import MeshError
from clrt.reference import rational
from clrt.reference.lines import LINE_ERROR, SAFETY, UNDERFLOW, EdgeTable, Lines, near_pairs

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

ERROR = SAFETY * LINE_ERROR
PAIRS_AT_ONCE = 1 << 18  #: pairs classified together


@dataclass(frozen=True, eq=False)
class _Query:
    """Triangles and the usable rays among those given; `ray_ids` are their places in the caller's arrays."""

    vertices: FloatArray
    origins: FloatArray
    directions: FloatArray
    t_min: FloatArray
    t_max: FloatArray
    ray_ids: IndexArray
    ray_count: int


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Pairs that may be hits. sure : (k,) the hit, range included, is certain; t_low, t_high : (k,) bounds of t."""

    ray: IndexArray
    tri: IndexArray
    sure: BoolArray
    t_low: FloatArray
    t_high: FloatArray

    def __getitem__(self, keep: BoolArray) -> _Pairs:
        return _Pairs(self.ray[keep], self.tri[keep], self.sure[keep], self.t_low[keep], self.t_high[keep])


def first_hit(
    vertices: ArrayLike, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
) -> tuple[IndexArray, FloatArray]:
    """The nearest triangle along each ray, exactly.

    vertices : (n, 3, 3), origins, directions : (m, 3), float32 or float64, any length of direction; t_min, t_max : scalars or (m,)
    Returns prim_id (m,) int64, -1 for a miss, and t (m,) float64, the exact t correctly rounded, inf for a miss.
    Raises MeshError where vertices are not finite, ValueError where shapes do not fit.
    """
    query = _query(vertices, origins, directions, t_min, t_max)
    # Of equal triangles the first is the lowest id, and only it can win.
    distinct = np.sort(np.unique(query.vertices.reshape(-1, 9), axis=0, return_index=True)[1]).astype(np.int64)
    prim_id = np.full(query.ray_count, -1, np.int64)
    t_hit = np.full(query.ray_count, np.inf)
    pairs = _join(list(_classified(query, distinct)))
    # Whatever begins behind the end of a certain hit is not the nearest.
    limit = np.full(len(query.ray_ids), np.inf)
    np.minimum.at(limit, pairs.ray[pairs.sure], pairs.t_high[pairs.sure])
    pairs = pairs[pairs.t_low <= limit[pairs.ray]]
    hit, t, numerator, denominator = _decide(query, pairs)
    ray, tri = pairs.ray[hit], pairs.tri[hit]
    best = rational.nearest(ray, tri, t[hit], numerator[hit], denominator[hit])
    prim_id[query.ray_ids[ray[best]]] = tri[best]
    t_hit[query.ray_ids[ray[best]]] = t[hit][best]
    return prim_id, t_hit


def any_hit(
    vertices: ArrayLike, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
) -> BoolArray:
    """Does the ray hit any triangle in (t_min, t_max)? (m,) bool. Arguments and errors as for `first_hit`."""
    query = _query(vertices, origins, directions, t_min, t_max)
    pairs = _join(list(_classified(query, np.arange(len(query.vertices)))))
    found = np.zeros(len(query.ray_ids), np.bool_)
    found[pairs.ray[pairs.sure]] = True
    pairs = pairs[~found[pairs.ray]]
    found[pairs.ray[_decide(query, pairs)[0]]] = True
    blocked = np.zeros(query.ray_count, np.bool_)
    blocked[query.ray_ids] = found
    return blocked


def count_hits(
    vertices: ArrayLike, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
) -> IndexArray:
    """How many triangles the ray hits in (t_min, t_max), (m,) int64. Arguments and errors as for `first_hit`."""
    query = _query(vertices, origins, directions, t_min, t_max)
    counts = np.zeros(query.ray_count, np.int64)
    for pairs in _classified(query, np.arange(len(query.vertices))):
        unsure = pairs[~pairs.sure]
        hits = np.concatenate([pairs.ray[pairs.sure], unsure.ray[_decide(query, unsure)[0]]])
        np.add.at(counts, query.ray_ids[hits], 1)
    return counts


def _query(vertices: ArrayLike, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike) -> _Query:
    v, o, d = (np.asarray(x) for x in (vertices, origins, directions))
    for name, x, shape in (("vertices", v, (3, 3)), ("origins", o, (3,)), ("directions", d, (3,))):
        if x.dtype not in (np.float32, np.float64) or x.shape[1:] != shape:
            raise ValueError(f"{name} must be float32 or float64 of shape (any, {', '.join(map(str, shape))}), not {x.dtype} {x.shape}")
    if len(o) != len(d):
        raise ValueError(f"{len(o)} origins, but {len(d)} directions; give one of each a ray")
    bad = np.flatnonzero(~np.isfinite(v).all(axis=(1, 2)))
    if len(bad):
        raise MeshError(f"triangle {bad[0]} has a vertex that is NaN or infinite ({len(bad)} such triangles); remove them")
    low, high = (np.broadcast_to(np.asarray(t, np.float64), len(o)) for t in (t_min, t_max))
    ids = np.flatnonzero(np.isfinite(o).all(axis=1) & np.isfinite(d).all(axis=1) & (d != 0).any(axis=1) & (low < high))
    return _Query(v.astype(np.float64), o[ids].astype(np.float64), d[ids].astype(np.float64), low[ids], high[ids], ids, len(o))


def _classified(query: _Query, triangles: IndexArray) -> Iterator[_Pairs]:
    """All pairs with the given triangles that are not surely misses."""
    v = query.vertices[triangles]
    largest = max((float(np.abs(x).max(initial=0.0)) for x in (v, query.origins)), default=0.0)
    table = EdgeTable.build(v, largest)
    lines = Lines.build(table, query.origins, query.directions)
    for ray, tri in near_pairs(table, lines):
        for start in range(0, len(ray), PAIRS_AT_ONCE):
            part = slice(start, start + PAIRS_AT_ONCE)
            yield _classify(query, table.exponent, lines, ray[part], triangles[tri[part]])


def _classify(query: _Query, exponent: int, lines: Lines, ray: IndexArray, tri: IndexArray) -> _Pairs:
    """Sharper bounds for single pairs: certain hits, certain misses (dropped), and an interval of t."""
    v = np.ldexp(query.vertices[tri], -exponent)
    d = lines.direction[ray]
    to = v - np.ldexp(query.origins[ray], -exponent)[:, None]
    w = np.einsum("ki,kci->kc", d, np.cross(to[:, [1, 2, 0]], to[:, [2, 0, 1]]))
    reach = np.linalg.norm(to, axis=2)
    speed = np.linalg.norm(d, axis=1)
    w_error = ERROR * speed[:, None] * reach[:, [1, 2, 0]] * reach[:, [2, 0, 1]] + UNDERFLOW
    positive, negative = w > w_error, w < -w_error
    sure = positive.all(axis=1) | negative.all(axis=1)
    missed = positive.any(axis=1) & negative.any(axis=1)
    t_low, t_high = _t_bounds(v, to[:, 0], d, reach[:, 0], speed)
    t_low, t_high = _unscaled(t_low, t_high, exponent - lines.direction_exponent[ray])
    t_min, t_max = query.t_min[ray], query.t_max[ray]
    pairs = _Pairs(ray, tri, sure & (t_low > t_min) & (t_high < t_max), t_low, t_high)
    return pairs[~(missed | (t_high < t_min) | (t_low > t_max))]


def _t_bounds(
    v: FloatArray, to: FloatArray, d: FloatArray, reach: FloatArray, speed: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(k,) each: t of the crossing with the plane lies between them; -inf, inf where D may be zero."""
    e1, e2 = v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]
    normal = np.cross(e1, e2)
    size = np.linalg.norm(e1, axis=1) * np.linalg.norm(e2, axis=1)
    top, bottom = np.einsum("ki,ki->k", to, normal), np.einsum("ki,ki->k", d, normal)
    top_error, bottom_error = ERROR * size * reach + UNDERFLOW, ERROR * size * speed + UNDERFLOW
    known = np.abs(bottom) > 2.0 * bottom_error
    with np.errstate(over="ignore"):
        t = np.divide(top, bottom, where=known, out=np.zeros_like(top))
        width = np.divide(top_error + np.abs(t) * bottom_error, np.abs(bottom) - bottom_error, where=known, out=np.full_like(top, np.inf))
    width = width + 4.0 * SAFETY * np.finfo(np.float64).eps * np.abs(t)
    return t - width, t + width


def _unscaled(t_low: FloatArray, t_high: FloatArray, exponent: IndexArray) -> tuple[FloatArray, FloatArray]:
    """Bounds times 2^exponent, stepped outward once: scaling rounds where it meets the denormals."""
    with np.errstate(over="ignore", under="ignore"):
        return np.nextafter(np.ldexp(t_low, exponent), -np.inf), np.nextafter(np.ldexp(t_high, exponent), np.inf)


def _decide(query: _Query, pairs: _Pairs) -> tuple[BoolArray, FloatArray, rational.BigArray, rational.BigArray]:
    """hit (k,) exactly, t (k,) correctly rounded, and its numerator and denominator."""
    ray = pairs.ray
    hit, numerator, denominator = rational.evaluate(query.vertices[pairs.tri], query.origins[ray], query.directions[ray])
    t = np.full(len(ray), np.inf)
    t[hit] = rational.rounded(numerator[hit], denominator[hit])
    hit[hit] = rational.inside_range(t[hit], numerator[hit], denominator[hit], query.t_min[ray[hit]], query.t_max[ray[hit]])
    return hit, t, numerator, denominator


def _join(parts: list[_Pairs]) -> _Pairs:
    none = _Pairs(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.bool_), np.zeros(0), np.zeros(0))
    parts = [none, *parts]
    return _Pairs(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("ray", "tri", "sure", "t_low", "t_high")))
