"""Where the lines of rays meet primitives, or pass them closely: the float64 facts that every visibility decision rests on.

Whether a line meets a triangle is decided by exact arithmetic where float64 cannot (rational.py), so no ray passes between two
triangles that share an edge. What counts as the same point is decided once, here: for rays that start on a surface, their origin is
itself rounded, and a surface within `noise` of it lies at t = 0; so does one within `noise` of a segment's end lie at t = 1.

Closeness is measured in units of the error that a relative rounding error of one would cause: a ray carries `pos_err`, the error
of its origin (a length), and `dir_err`, that of its direction (radians); at distance z it is off by pos_err + z dir_err. For a ray
from the eye they are 0 and 1, and closeness is an angle.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from clrt.reference import rational
from clrt.reference.geometry import Primitives
from clrt.reference.lines import LINE_ERROR, SAFETY, UNDERFLOW, UNIT_ROUNDOFF, Lines, near_pairs

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

BAND = 1e-3  #: closeness up to this is measured; what is farther may go unseen
BAND_CAP = 0.02  #: no wider search than this, in radians, however much a path magnifies errors
ERROR = SAFETY * LINE_ERROR
NOISE = 64.0 * UNIT_ROUNDOFF  #: of a hit point: a few roundings of t, of o + t d, each relative to coordinates and path


@dataclass(frozen=True, eq=False)
class Rays:
    """m rays or segments: points origin + t direction, t > 0, for segments t < 1.

    origin, direction : (m, 3), direction of any length but 0; own : (m,) primitive that the ray starts on, -1 for none
    pos_err : (m,) length; dir_err : (m,) radians, see above
    """

    origin: FloatArray
    direction: FloatArray
    own: IndexArray
    pos_err: FloatArray
    dir_err: FloatArray

    @property
    def speed(self) -> FloatArray:
        """(m,) length of the direction."""
        length: FloatArray = np.linalg.norm(self.direction, axis=1)
        return length


@dataclass(frozen=True, eq=False)
class Crossings:
    """k pairs of a ray and a primitive that its line meets or nearly meets.

    ray, prim : (k,); meets : (k,) the line meets the primitive; t : (k,) where, in lengths of the direction (nan if not)
    ahead : (k,) meets, and t > 0; short : (k,) meets, and t < 1
    start_gap, end_gap : (k,) distance of the primitive's surface from the points t = 0 and t = 1
    boundary : (k, 3) closeness of the line to the primitive's three edges (a sphere: to its outline, thrice); inf behind the origin
    depth : (k, 3) the t where it is closest
    """

    ray: IndexArray
    prim: IndexArray
    meets: BoolArray
    t: FloatArray
    ahead: BoolArray
    short: BoolArray
    start_gap: FloatArray
    end_gap: FloatArray
    boundary: FloatArray
    depth: FloatArray


def find_crossings(prims: Primitives, rays: Rays, tile_bytes: int) -> Crossings:
    """All crossings of the rays, each ray's own triangle left out."""
    parts = [*_triangle_crossings(prims, rays, tile_bytes), *_sphere_crossings(prims, rays, tile_bytes)]
    if not parts:
        parts = [_near_triangles(prims, rays, np.zeros(0, np.int64), np.zeros(0, np.int64))]
    return Crossings(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Crossings)))


def search_band(prims: Primitives, rays: Rays) -> tuple[FloatArray, FloatArray]:
    """(m,) angle within which near misses are looked for, and (m,) the closeness up to which none is overlooked."""
    if not prims.triangle_count:
        return np.full(len(rays.own), BAND), np.full(len(rays.own), np.inf)
    lever = np.ldexp(np.linalg.norm(np.ldexp(rays.origin, -prims.edges.exponent) - prims.edges.center, axis=1)
                     + prims.edges.reach.min(), prims.edges.exponent)  # fmt: skip
    wanted = BAND * (rays.dir_err + np.divide(rays.pos_err, lever, where=rays.pos_err > 0.0, out=np.zeros_like(lever)))
    return np.minimum(wanted, BAND_CAP), np.where(wanted > BAND_CAP, BAND * BAND_CAP / wanted, np.inf)


def _triangle_crossings(prims: Primitives, rays: Rays, tile_bytes: int) -> Iterator[Crossings]:
    if not prims.triangle_count or not len(rays.own):
        return
    lines = Lines.build(prims.edges, rays.origin, rays.direction)
    for ray, tri in near_pairs(prims.edges, lines, search_band(prims, rays)[0], tile_bytes):
        other = tri != rays.own[ray]
        yield _near_triangles(prims, rays, ray[other], tri[other])


def _near_triangles(prims: Primitives, rays: Rays, ray: IndexArray, tri: IndexArray) -> Crossings:
    v, o, d = prims.vertices[tri], rays.origin[ray], rays.direction[ray]
    to = v - o[:, None]
    reach, speed = np.linalg.norm(to, axis=2), np.linalg.norm(d, axis=1)
    w = np.einsum("ki,kci->kc", d, np.cross(to[:, [1, 2, 0]], to[:, [2, 0, 1]]))
    w_error = ERROR * speed[:, None] * reach[:, [1, 2, 0]] * reach[:, [2, 0, 1]] + UNDERFLOW
    positive, negative = w > w_error, w < -w_error
    e1, e2 = v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]
    normal = np.cross(e1, e2)
    size, area = np.linalg.norm(e1, axis=1) * np.linalg.norm(e2, axis=1), np.linalg.norm(normal, axis=1)
    top, bottom = np.einsum("ki,ki->k", to[:, 0], normal), np.einsum("ki,ki->k", d, normal)
    known = (np.abs(bottom) > ERROR * size * speed + UNDERFLOW) & ((np.abs(top) > ERROR * size * reach[:, 0]) | (rays.own[ray] >= 0))
    meets = (positive.all(axis=1) | negative.all(axis=1)) & known
    t = np.divide(top, bottom, where=meets, out=np.full_like(top, np.nan))
    # What float64 cannot decide, integers do.
    unsure = np.flatnonzero(~meets & ~(positive.any(axis=1) & negative.any(axis=1)))
    meets[unsure], numerator, denominator = rational.evaluate(v[unsure], o[unsure], d[unsure])
    t[unsure] = np.where(meets[unsure], rational.rounded(numerator, denominator), np.nan)
    # Gaps are distances from the plane; a needle's plane is known less well.
    flat = area > 0.0
    start_gap = np.divide(np.abs(top), area, where=flat, out=np.zeros_like(top))
    end_gap = np.divide(np.abs(top - bottom), area, where=flat, out=np.zeros_like(top))
    noise = NOISE * (prims.largest + np.abs(o).max(axis=1, initial=0.0)) * np.divide(size, area, where=flat, out=np.ones_like(size))
    ahead = meets & (t > 0.0) & ((rays.own[ray] < 0) | (start_gap > noise))
    short = meets & (t < 1.0) & (end_gap > noise)
    boundary, depth = _edge_closeness(to, d / speed[:, None], rays.pos_err[ray], rays.dir_err[ray])
    return Crossings(ray, tri, meets, t, ahead, short, start_gap, end_gap, boundary, depth / speed[:, None])


def _edge_closeness(
    to: FloatArray, unit: FloatArray, pos_err: FloatArray, dir_err: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(k, 3) closeness of the ray to the three edges, and the distance along it where they are closest.

    to : (k, 3, 3) corners from the ray's origin; unit : (k, 3). Each edge is cut to what lies ahead. The closeness along an edge,
    off / (pos_err + z dir_err), is least between the point least off and the point at the least angle; the better of the two is
    taken, which is right to a small factor.
    """
    z = np.einsum("kci,ki->kc", to, unit)
    off = to - z[:, :, None] * unit[:, None]
    ahead = 1e-9 * (np.abs(z).max(axis=1, initial=0.0)[:, None] + UNDERFLOW)
    (za, pa), (zb, pb) = (z, off), (z[:, [1, 2, 0]], off[:, [1, 2, 0]])
    behind = np.maximum(za, zb) <= ahead
    run = np.where(za == zb, 1.0, zb - za)
    cut_a = np.where((za < ahead) & ~behind, (ahead - za) / run, 0.0)
    cut_b = np.where((zb < ahead) & ~behind, (ahead - za) / run, 1.0)
    points = [(za + cut * (zb - za), pa + cut[:, :, None] * (pb - pa)) for cut in (cut_a, cut_b)]
    (za, pa), (zb, pb) = ((np.where(behind, 1.0, zk), pk) for zk, pk in points)
    least_off = _foot(pa, pb)
    at_angle = _foot(pa / za[:, :, None], pb / zb[:, :, None])
    least_angle = at_angle * za / ((1.0 - at_angle) * zb + at_angle * za)  # from the picture plane back to the edge
    best, where = np.full(z.shape, np.inf), np.full(z.shape, np.inf)
    for s in (least_off, least_angle):
        depth = za + s * (zb - za)
        distance = np.linalg.norm(pa + s[:, :, None] * (pb - pa), axis=2)
        value = np.where(behind, np.inf, distance / (pos_err[:, None] + depth * dir_err[:, None]))
        best, where = np.where(value < best, value, best), np.where(value < best, depth, where)
    return best, where


def _foot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Parameter in [0, 1] of the point of the segment a b nearest to zero; (..., 3) -> (...)."""
    e = b - a
    square = np.einsum("...i,...i->...", e, e)
    s: FloatArray = np.divide(-np.einsum("...i,...i->...", a, e), square, where=square > 0.0, out=np.zeros_like(square))
    return np.clip(s, 0.0, 1.0)


def _sphere_crossings(prims: Primitives, rays: Rays, tile_bytes: int) -> Iterator[Crossings]:
    m, k = len(rays.own), len(prims.radii)
    if not m or not k:
        return
    rows = max(1, tile_bytes // (200 * k))
    for start in range(0, m, rows):
        ray = np.repeat(np.arange(start, min(start + rows, m)), k)
        crossings = _near_spheres(prims, rays, ray, np.tile(np.arange(k), len(ray) // k))
        keep = crossings.meets | (crossings.boundary[:, 0] <= BAND)
        yield Crossings(*(getattr(crossings, f.name)[keep] for f in fields(Crossings)))


def _near_spheres(prims: Primitives, rays: Rays, ray: IndexArray, sphere: IndexArray) -> Crossings:
    """The surface is met at the first root ahead: from outside the near one, from inside or from the surface inward the far one.

    With b the distance along the ray to the point nearest to the centre, q that point's distance from the centre (taken from the
    vector, so that nothing cancels): roots b -+ sqrt((r - q)(r + q)); the near one as (|oc|^2 - r^2) / (b + sqrt(...)).
    """
    radius, o, d = prims.radii[sphere], rays.origin[ray], rays.direction[ray]
    speed = np.linalg.norm(d, axis=1)
    unit = d / speed[:, None]
    oc = prims.centers[sphere] - o
    b = np.einsum("ki,ki->k", oc, unit)
    q, distance = np.linalg.norm(oc - b[:, None] * unit, axis=1), np.linalg.norm(oc, axis=1)
    end = np.linalg.norm(oc - d, axis=1)
    noise = NOISE * (radius + np.abs(o).max(axis=1, initial=0.0) + np.abs(prims.centers[sphere]).max(axis=1, initial=0.0))
    on = (rays.own[ray] == prims.triangle_count + sphere) | ((rays.own[ray] >= 0) & (np.abs(distance - radius) <= noise))
    inside = ~on & (distance <= radius)
    half = np.sqrt(np.maximum((radius - q) * (radius + q), 0.0))
    power = (distance - radius) * (distance + radius)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.where(b >= 0.0, b + half, -power / (half - b))
        near = power / (b + half)
    z = np.where(on, 2.0 * b, np.where(inside, far, near))
    meets = inside | ((b > 0.0) & (on | (q <= radius)))
    ahead = meets & (z > 0.0)
    # A segment that ends on the surface meets it there, at t = 1, unless it has met the near side before.
    end_gap = np.abs(end - radius)
    ends_here = (end_gap <= noise) & (inside | on | (np.einsum("ki,ki->k", oc - d, unit) >= 0.0))
    outline = np.abs(q - radius) / (rays.pos_err[ray] + np.maximum(b, UNDERFLOW) * rays.dir_err[ray])
    outline = np.where(inside | on | (b <= 0.0), np.inf, outline)
    start_gap = np.where(rays.own[ray] == prims.triangle_count + sphere, np.inf, np.abs(distance - radius))
    t = np.where(meets, z, np.nan) / speed
    return Crossings(ray, prims.triangle_count + sphere, meets, t, ahead, meets & (t < 1.0) & ~ends_here, start_gap, end_gap,
                     np.repeat(outline[:, None], 3, axis=1), np.repeat((b / speed)[:, None], 3, axis=1))  # fmt: skip
