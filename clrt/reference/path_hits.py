"""Which primitive does a ray meet first, and is a point seen from another: all rays against all primitives, at each ray's own time.

Plain float64 without margins, for means over many rays: a ray within rounding of an edge may go either way.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from clrt.reference.crossings import NOISE, Rays
from clrt.reference.normalmap import tilted
from clrt.reference.path_world import PathWorld, Wave
from clrt.reference.shade import Surface, dot, surfaces
from clrt.reference.texture import tints

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def distances(world: PathWorld, origin: FloatArray, direction: FloatArray, own: IndexArray, time: FloatArray) -> FloatArray:
    """(m, n + k) how far along each ray (unit direction) it first meets each primitive, inf where it does not."""
    noise = NOISE * (world.prims.largest + np.abs(origin).max(axis=1, initial=0.0))
    return np.concatenate([_to_triangles(world, origin, direction, own, time, noise),
                           _to_spheres(world, origin, direction, own)], axis=1)  # fmt: skip


def _to_triangles(
    world: PathWorld, origin: FloatArray, direction: FloatArray, own: IndexArray, time: FloatArray, noise: FloatArray
) -> FloatArray:
    """Where the ray meets the plane, if the barycentric weights there are all in [0, 1]. Its own triangle is not met."""
    n = world.prims.triangle_count
    if n == 0:
        return np.zeros((len(own), 0))
    corner, motion = world.prims.vertices[:, 0], world.motion[:n]

    def along(axes: FloatArray) -> FloatArray:
        """(m, n) of (origin - corner at that time) . axis"""
        offset = np.einsum("ni,ni->n", corner, axes)
        return np.asarray(origin @ axes.T - offset - time[:, None] * np.einsum("ni,ni->n", motion, axes))

    normal, (dual_1, dual_2) = world.prims.n_geo, np.swapaxes(world.duals, 0, 1)
    height, fall = along(normal), direction @ normal.T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -height / fall
        w1 = along(dual_1) + t * (direction @ dual_1.T)
        w2 = along(dual_2) + t * (direction @ dual_2.T)
        met = (t > 0.0) & (w1 >= 0.0) & (w2 >= 0.0) & (w1 + w2 <= 1.0) & (world.area[:n] > 0.0)
    met &= (own < 0)[:, None] | (np.abs(height) > noise[:, None])
    met &= own[:, None] != np.arange(n)
    return np.where(met, t, np.inf)


def _to_spheres(world: PathWorld, origin: FloatArray, direction: FloatArray, own: IndexArray) -> FloatArray:
    """The near root from outside, the far one from inside; a ray that starts on the sphere meets it at its far side if it runs inwards."""
    radius = world.prims.radii
    to_center = world.prims.centers - origin[:, None]
    b = np.einsum("mki,mi->mk", to_center, direction)
    off = to_center - b[:, :, None] * direction[:, None]
    half = np.sqrt(np.maximum(radius**2 - np.einsum("mki,mki->mk", off, off), 0.0))
    on = own[:, None] == world.prims.triangle_count + np.arange(len(radius))
    inside = np.einsum("mki,mki->mk", to_center, to_center) < radius**2
    t = np.where(on, 2.0 * b, np.where(inside, b + half, np.where(half > 0.0, b - half, np.inf)))
    return np.where(t > 0.0, t, np.inf)


def closest(world: PathWorld, wave: Wave) -> tuple[IndexArray, FloatArray]:
    """The first primitive along each ray, -1 for none, and its distance, inf for none."""
    t = distances(world, wave.origin, wave.direction, wave.own, wave.time)
    if t.shape[1] == 0:
        return np.full(len(wave), -1, np.int64), np.full(len(wave), np.inf)
    prim = t.argmin(axis=1)
    nearest = np.take_along_axis(t, prim[:, None], axis=1)[:, 0]
    return np.where(np.isfinite(nearest), prim, -1), nearest


def seen(
    world: PathWorld, origin: FloatArray, direction: FloatArray, distance: FloatArray, own: IndexArray, target: IndexArray, time: FloatArray
) -> FloatArray:
    """(m,) the part of light that comes through to `origin` along the open segment of length `distance` (inf: half-line).

    own, target : primitives that the segment starts and ends on, -1 for none. The target's own far side is asked of the caller.
    """
    t = distances(world, origin, direction, own, time)
    end = distance - NOISE * (world.prims.largest + np.where(np.isfinite(distance), distance, 0.0))
    blocks = t < end[:, None]
    blocks &= target[:, None] != np.arange(t.shape[1])
    if world.cover.whole:
        return np.where(blocks.any(axis=1), 0.0, 1.0)
    ray, prim = np.nonzero(blocks)
    far, again = _far_sides(world, origin, direction, own, ray, prim, t[ray, prim], end)
    ray, prim, t = np.r_[ray, ray[again]], np.r_[prim, prim[again]], np.r_[t[ray, prim], far[again]]
    point = origin[ray] + t[:, None] * direction[ray] - world.motion[prim] * time[ray, None]
    left = np.ones(len(own))
    np.multiply.at(left, ray, 1.0 - world.cover.kept(world.prims, prim, point, np.zeros(len(ray)))[0])
    return left


def _far_sides(
    world: PathWorld, origin: FloatArray, direction: FloatArray, own: IndexArray,
    ray: IndexArray, prim: IndexArray, t: FloatArray, end: FloatArray,
) -> tuple[FloatArray, BoolArray]:  # fmt: skip
    """Of met primitives (k,): where the ray leaves the spheres again that it has entered at t, (k,), and whether there is such a place."""
    count = world.prims.triangle_count
    if not len(world.prims.radii):
        return t, np.zeros(len(t), np.bool_)
    to_center = world.prims.centers[np.maximum(prim - count, 0)] - origin[ray]
    far = 2.0 * dot(to_center, direction[ray]) - t
    return far, (prim >= count) & (own[ray] != prim) & (far > t) & (far < end[ray])


def surfaces_met(world: PathWorld, wave: Wave, prim: IndexArray, t: FloatArray) -> tuple[Surface, FloatArray]:
    """The surfaces where the rays hit, at their times, and their colours with their pictures (m, 3)."""
    shift = world.motion[prim] * wave.time[:, None]
    m = len(prim)
    at_rest = surfaces(world.prims, Rays(wave.origin - shift, wave.direction, wave.own, np.zeros(m), np.ones(m)), prim, t)
    tint, _ = tints(world.scene, world.prims, at_rest)
    at_rest = tilted(world.scene, world.prims, at_rest)
    return replace(at_rest, point=at_rest.point + shift), world.materials.color[at_rest.material] * tint


def solid(world: PathWorld, wave: Wave, surface: Surface) -> FloatArray:
    """(m,) the part of each hit that is seen; the rest is what lies straight behind."""
    if world.cover.whole:
        return np.ones(len(wave))
    shift = world.motion[surface.prim] * wave.time[:, None]
    return world.cover.solid(world.prims, replace(surface, point=surface.point - shift))[0]


def beyond_face(surface: Surface, direction: FloatArray) -> BoolArray:
    """(m,) whether a direction is on the viewer's side of the surface, so that light from there counts (docs/conventions.md)."""
    result: BoolArray = (dot(surface.n_shade, direction) > 0.0) & ((dot(surface.n_geo, direction) > 0.0) | surface.curved)
    return result
