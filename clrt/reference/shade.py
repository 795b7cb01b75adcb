"""What light leaves a hit towards the viewer by itself: shading normals, Phong's terms, shadows. Formula: docs/conventions.md."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from clrt.reference.crossings import Rays
from clrt.reference.geometry import MaterialTable, Primitives
from clrt.reference.lights import Light, cone, falloff, positions
from clrt.reference.terminator import face_between, lifts

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

NO_CONSEQUENCE = 1e-9  #: a decision that changes a pixel by less than this is none
STEEPEST = 0.01  #: cosine below which a slanted hit magnifies errors no further


@dataclass(frozen=True, eq=False)
class Surface:
    """m hits.

    point : (m, 3); prim : (m,); material : (m,)
    view : (m, 3) unit, towards the viewer; n_geo : (m, 3) unit, on the viewer's side; n_shade : (m, 3) unit, on n_geo's side
    curvature : (m,) 1 / length; dir_err : (m,) of the arriving ray; errors of the hit: across the ray spread_err (m,), along the
        surface pos_err (m,), greater where the ray is slanted
    margin : (m,) how far the choice of sides is from another
    curved : (m,) bool, on a curved triangle; lift : (m, 3) from the point to where shadow rays leave, 0 elsewhere; lift_err : (m,)
        error of point + lift
    """

    point: FloatArray
    prim: IndexArray
    material: IndexArray
    view: FloatArray
    n_geo: FloatArray
    n_shade: FloatArray
    curvature: FloatArray
    spread_err: FloatArray
    pos_err: FloatArray
    dir_err: FloatArray
    margin: FloatArray
    curved: NDArray[np.bool_]
    lift: FloatArray
    lift_err: FloatArray

    @property
    def normal_err(self) -> FloatArray:
        """(m,) error of angles at the surface: of a direction, and of the normal of a curved one."""
        return self.dir_err + self.curvature * self.pos_err


class Cover(Protocol):
    """What primitives in the way of light keep of it, see clrt.reference.opacity."""

    def passed(self, prims: Primitives, segments: Rays, tile_bytes: int) -> tuple[FloatArray, FloatArray]:
        """The part of light that comes along m open segments, (m,), and its margin (m,)."""

    def through_plane(self, prims: Primitives, segments: Rays, rows: IndexArray) -> tuple[FloatArray, FloatArray]:
        """The part that the triangles on which the segments `rows` start let through where their planes are met, and its margin."""


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Row by row: (m, 3), (m, 3) -> (m,)."""
    result: FloatArray = np.einsum("mi,mi->m", a, b)
    return result


def surfaces(prims: Primitives, rays: Rays, prim: IndexArray, t: FloatArray) -> Surface:
    """The surface where each ray hits: prim (m,) >= 0, t (m,) in lengths of the direction."""
    unit = rays.direction / rays.speed[:, None]
    point = rays.origin + t[:, None] * rays.direction
    n_geo, n_shade = np.empty_like(point), np.empty_like(point)
    mesh = prim < prims.triangle_count
    n_geo[mesh] = prims.n_geo[prim[mesh]]
    weights = _weights(prims, prim[mesh], rays.origin[mesh], rays.direction[mesh])
    n_shade[mesh] = _interpolated(prims, prim[mesh], weights)
    sphere = prim[~mesh] - prims.triangle_count
    n_geo[~mesh] = (point[~mesh] - prims.centers[sphere]) / prims.radii[sphere][:, None]
    n_shade[~mesh] = n_geo[~mesh] = n_geo[~mesh] / np.linalg.norm(n_geo[~mesh], axis=1, keepdims=True)
    n_geo = np.where((dot(n_geo, unit) > 0.0)[:, None], -n_geo, n_geo)
    agreement = dot(n_shade, n_geo)
    n_shade = np.where((agreement < 0.0)[:, None], -n_shade, n_shade)
    curvature = prims.curvature[prim]
    spread = rays.pos_err + t * rays.speed * rays.dir_err
    pos_err = spread / np.maximum(-dot(n_geo, unit), STEEPEST)
    margin = np.where(curvature > 0.0, np.abs(agreement) / (1.0 + curvature * pos_err), np.inf)
    curved, lift, lift_err = prims.curved[prim], np.zeros_like(point), pos_err.copy()
    rows, tri = np.flatnonzero(curved), prim[curved]
    turned = np.where(agreement[rows] < 0.0, -1.0, 1.0)[:, None, None] * prims.corner_normals[tri]
    lift[rows], growth = lifts(prims.vertices[tri], turned, weights[curved[mesh]], point[rows], n_geo[rows])
    lift_err[rows] *= growth
    return Surface(point, prim, prims.material[prim], -unit, n_geo, n_shade, curvature, spread, pos_err, rays.dir_err, margin,
                   curved, lift, lift_err)  # fmt: skip


def _weights(prims: Primitives, tri: IndexArray, origin: FloatArray, direction: FloatArray) -> FloatArray:
    """(m, 3) barycentric weights, in proportion to the volumes d . (B x C), d . (C x A), d . (A x B)."""
    to = prims.vertices[tri] - origin[:, None]
    weights = np.einsum("mi,mci->mc", direction, np.cross(to[:, [1, 2, 0]], to[:, [2, 0, 1]]))
    total = weights.sum(axis=1, keepdims=True)
    result: FloatArray = np.divide(weights, total, where=total != 0.0, out=np.full_like(weights, 1.0 / 3.0))
    return result


def _interpolated(prims: Primitives, tri: IndexArray, weights: FloatArray) -> FloatArray:
    """Unit normals: the sums of the corners' by `weights` (m, 3)."""
    normals = prims.corner_normals[tri]
    # A face's own normal stays as it is given: interpolation would round it.
    flat = prims.curvature[tri] == 0.0
    mixed = np.where(flat[:, None], normals[:, 0], np.einsum("mc,mci->mi", weights, normals))
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    result: FloatArray = np.divide(mixed, length, where=length > 0.0, out=prims.n_geo[tri].copy())
    return result


def local_color(
    prims: Primitives, materials: MaterialTable, lights: tuple[Light, ...], surface: Surface, weight: FloatArray, tile_bytes: int,
    cover: Cover,
) -> tuple[FloatArray, FloatArray, int]:
    """C (Ka + sum over lights of visible Lrgb (Kd N.L + Ks (R.V)^exponent)).

    weight : (m,) of the ray in its pixel; it only scales what counts as a decision
    cover : what primitives in the way of light keep of it
    Returns color (m, 3), margin (m,) and the number of shadow rays traced.
    """
    ids = surface.material
    total = np.repeat(materials.ambient[ids][:, None], 3, axis=1)
    margin = surface.margin.copy()
    shadow_rays = 0
    for light in lights:
        power = materials.color[ids] * np.array(light.color)
        position = positions(light, prims, surface.point)
        shine, lit, close = _light_term(materials, surface, light, position, np.abs(power).max(axis=1, initial=0.0) * weight)
        margin = np.minimum(margin, close)
        traced = np.flatnonzero(lit & (shine != 0.0) & (power != 0.0).any(axis=1) & (weight != 0.0))
        shadow_rays += len(traced)
        left, closeness = _let_through(prims, surface, traced, position[traced], tile_bytes, cover)
        counts = np.abs(shine * power.max(axis=1, initial=0.0) * weight)[traced] > NO_CONSEQUENCE
        margin[traced] = np.where(counts, np.minimum(margin[traced], closeness), margin[traced])
        total[traced] += (left * shine[traced])[:, None] * np.array(light.color)
    return materials.color[ids] * total, margin, shadow_rays


def _let_through(
    prims: Primitives, surface: Surface, rows: IndexArray, position: FloatArray, tile_bytes: int, cover: Cover
) -> tuple[FloatArray, FloatArray]:
    """The part of the light at `position` (k, 3) that comes to the hits `rows`, (k,), and the margin (k,).

    Segments run from the lifted hits to the light. The far end is exact: the direction adds no error but its own rounding.
    """
    origin = surface.point[rows] + surface.lift[rows]
    left, margin = np.ones(len(rows)), np.zeros(len(rows))
    apart = np.flatnonzero((origin != position).any(axis=1))
    rows, origin, position = rows[apart], origin[apart], position[apart]
    segments = Rays(origin, position - origin, surface.prim[rows], surface.lift_err[rows], np.ones(len(rows)))
    by_others, others = cover.passed(prims, segments, tile_bytes)
    by_face, face = np.ones(len(rows)), np.full(len(rows), np.inf)
    at, tri = np.flatnonzero(surface.curved[rows]), surface.prim[rows[surface.curved[rows]]]
    curved = rows[at]
    between, face[at] = face_between(
        prims.vertices[tri], surface.n_geo[curved], surface.point[curved], surface.lift[curved], position[at], surface.lift_err[curved]
    )
    by_face[at[between]], texels = cover.through_plane(prims, segments, at[between])
    face[at[between]] = np.minimum(face[at[between]], texels)
    left[apart] = by_others * by_face
    # The firmer of two that block decides; where neither does, the one that is nearer to it.
    firmer = np.maximum(np.where(by_others == 0.0, others, 0.0), np.where(by_face == 0.0, face, 0.0))
    margin[apart] = np.where(left[apart] == 0.0, firmer, np.minimum(others, face))
    return left, margin


def _light_term(
    materials: MaterialTable, surface: Surface, light: Light, position: FloatArray, scale: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:
    """What the surface makes of a light at `position` (m, 3), as far as its cone lets it through.

    Returns Kd max(N.L, 0) + Ks max(R.V, 0)^exponent, times the cone's part (m,); whether the light is on the viewer's side (m,);
    closeness to the other side, or to a hard edge of the cone (m,).
    """
    ids = surface.material
    to_light = position - surface.point
    distance = np.linalg.norm(to_light, axis=1)
    unit = np.divide(to_light, distance[:, None], where=distance[:, None] > 0.0, out=np.zeros_like(to_light))
    n_l, g_l = dot(surface.n_shade, unit), dot(surface.n_geo, unit)
    r_v = 2.0 * n_l * dot(surface.n_shade, surface.view) - dot(unit, surface.view)
    gloss = np.where(r_v > 0.0, np.power(np.maximum(r_v, 0.0), materials.exponent[ids]), 0.0) * materials.specular[ids]
    shine = materials.diffuse[ids] * np.maximum(n_l, 0.0) + gloss
    above = (g_l > 0.0) | surface.curved
    lit = (n_l > 0.0) & above
    passed, gap = cone(light, unit)
    weakened = falloff(light, distance)
    shine, gloss = shine * weakened, gloss * weakened
    # At N.L = 0 only the specular term jumps; at n_geo.L = 0, unless curved, also the diffuse one, as far as the two normals differ.
    at_geo = gloss + materials.diffuse[ids] * np.maximum(n_l - g_l, 0.0) * weakened
    moved = np.divide(surface.pos_err, distance, where=distance > 0.0, out=np.full_like(distance, np.inf))
    by_shade, by_geo = np.abs(n_l) / (1.0 + moved + surface.curvature * surface.pos_err), np.abs(g_l) / (1.0 + moved)
    by_cone = np.where(lit & (np.abs(shine) * scale > NO_CONSEQUENCE), gap / (1.0 + moved), np.inf)
    scale = scale * passed
    jump_shade = np.abs(gloss) * scale > NO_CONSEQUENCE
    jump_geo = (np.abs(at_geo) * scale > NO_CONSEQUENCE) & ~surface.curved
    leave = np.minimum(np.where(jump_shade, by_shade, np.inf), np.where(jump_geo, by_geo, np.inf))
    enter = np.maximum(np.where(n_l > 0.0, 0.0, by_shade), np.where(above, 0.0, by_geo))
    sides = np.where(lit, leave, np.where(np.where(surface.curved, jump_shade, jump_geo), enter, np.inf))
    return shine * passed, lit, np.minimum(sides, by_cone)
