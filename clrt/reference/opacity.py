"""Surfaces that light passes straight through, in float64: how much they keep where it meets them, and what is left after all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.reference.crossings import NOISE, Crossings, Rays
from clrt.reference.geometry import Primitives
from clrt.reference.shade import STEEPEST, Surface, dot
from clrt.reference.texture import coordinates, from_jumps, looked_up
from clrt.reference.visibility import blockers, occluded
from clrt.scene.model import Scene, Texture

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

MOST_ON_A_WAY = 1024  #: triangles before a light, beyond which it is hidden


@dataclass(frozen=True, eq=False)
class SceneCover:
    """What the primitives of a scene keep of light that would go straight on.

    factor : (materials,) opacity; seen : (materials,) bool, whether it holds for what is seen
    picture : (materials,) the texture whose alpha multiplies it, -1 for none; cutoff : (materials,)
    """

    scene: Scene
    factor: FloatArray
    seen: BoolArray
    picture: IndexArray
    cutoff: FloatArray

    @classmethod
    def of(cls, scene: Scene) -> SceneCover:
        materials = scene.materials
        return cls(scene, np.array([m.opacity for m in materials]), np.array([m.opacity_of == "all" for m in materials], np.bool_),
                   np.array([m.texture if m.alpha else -1 for m in materials], np.int64),
                   np.array([m.alpha_cutoff for m in materials]))  # fmt: skip

    @property
    def whole(self) -> bool:
        """Whether all materials are opaque."""
        return bool((self.factor == 1.0).all() and (self.picture < 0).all())

    def kept(self, prims: Primitives, prim: IndexArray, point: FloatArray, pos_err: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Opacity of primitives at points (m, 3) on them, (m,), and its margin (m,). pos_err : (m,) the points' error along it."""
        material = prims.material[prim]
        kept, margin = self.factor[material].copy(), np.full(len(prim), np.inf)
        for index in np.unique(self.picture[material][self.picture[material] >= 0]).tolist():
            rows, texture = np.flatnonzero(self.picture[material] == index), self.scene.textures[index]
            uv, rate = coordinates(prims, prim[rows], point[rows])
            alpha, cutoff = looked_up(texture, uv)[:, 3], self.cutoff[material[rows]]
            away = from_jumps(texture, uv, rate, prim[rows] >= prims.triangle_count)
            away = np.where(cutoff > 0.0, np.minimum(away, _from_cutoff(texture, alpha - cutoff, rate)), away)
            kept[rows] *= np.where(cutoff > 0.0, alpha >= cutoff, alpha)
            margin[rows] = np.divide(away, pos_err[rows], where=pos_err[rows] > 0.0, out=np.full(len(rows), np.inf))
        return kept, margin

    def solid(self, prims: Primitives, surface: Surface) -> tuple[FloatArray, FloatArray]:
        """The part of each hit that is seen, (m,); the rest is what lies straight behind. And its margin (m,)."""
        kept, margin = self.kept(prims, surface.prim, surface.point, surface.pos_err)
        seen = self.seen[surface.material]
        return np.where(seen, kept, 1.0), np.where(seen, margin, np.inf)

    def passed(self, prims: Primitives, segments: Rays, tile_bytes: int) -> tuple[FloatArray, FloatArray]:
        """The product of what all surfaces on m open segments let through, (m,), and its margin (m,). A sphere has two."""
        if self.whole:
            blocked, margin = occluded(prims, segments, tile_bytes)
            return np.where(blocked, 0.0, 1.0), margin
        found, blocks, firmness, nearest = blockers(prims, segments, tile_bytes)
        ray, prim, t, firm = _twice_through_spheres(prims, segments, found, blocks, firmness)
        kept, texels = self.kept(prims, prim, segments.origin[ray] + t[:, None] * segments.direction[ray],
                                 _errors(prims, segments, ray, prim, t))  # fmt: skip
        left, margin, opaque = np.ones(len(segments.own)), nearest, np.zeros(len(segments.own))
        np.multiply.at(left, ray, 1.0 - kept)
        left[np.bincount(ray[prim < prims.triangle_count], minlength=len(left)) > MOST_ON_A_WAY] = 0.0
        firm = np.minimum(firm, texels)
        np.minimum.at(margin, ray, firm)
        # One firm opaque blocker is enough, whatever else there is.
        np.maximum.at(opaque, ray[kept == 1.0], firm[kept == 1.0])
        return left, np.maximum(margin, opaque)

    def through_plane(self, prims: Primitives, segments: Rays, rows: IndexArray) -> tuple[FloatArray, FloatArray]:
        """What the triangles on which the segments `rows` (k,) start let through where these meet their planes, (k,), and its margin."""
        prim, origin, direction = segments.own[rows], segments.origin[rows], segments.direction[rows]
        n = prims.n_geo[prim]
        t = dot(prims.vertices[prim, 0] - origin, n) / dot(direction, n)
        kept, margin = self.kept(prims, prim, origin + t[:, None] * direction, _errors(prims, segments, rows, prim, t))
        return 1.0 - kept, margin


def _from_cutoff(texture: Texture, above: FloatArray, rate: FloatArray) -> FloatArray:
    """(m,) lengths along the surface that alpha needs at least to pass the cutoff; `above` it by so much now."""
    if not texture.linear:
        return np.full(len(above), np.inf)
    height, width = texture.picture.texels.shape[:2]
    return np.asarray(np.abs(above) / np.maximum(rate @ [float(width), float(height)], 1e-300))


def _errors(prims: Primitives, segments: Rays, ray: IndexArray, prim: IndexArray, t: FloatArray) -> FloatArray:
    """(k,) errors along surfaces of the points t on segments, greater where these are slanted."""
    speed = segments.speed[ray]
    unit = segments.direction[ray] / speed[:, None]
    mesh = prim < prims.triangle_count
    normal = np.empty_like(unit)
    normal[mesh] = prims.n_geo[prim[mesh]]
    sphere = prim[~mesh] - prims.triangle_count
    point = segments.origin[ray[~mesh]] + t[~mesh, None] * segments.direction[ray[~mesh]]
    normal[~mesh] = (point - prims.centers[sphere]) / prims.radii[sphere][:, None]
    spread = segments.pos_err[ray] + t * speed * segments.dir_err[ray]
    errors: FloatArray = spread / np.maximum(np.abs(dot(normal, unit)), STEEPEST)
    return errors


def _twice_through_spheres(
    prims: Primitives, segments: Rays, found: Crossings, blocks: BoolArray, firmness: FloatArray
) -> tuple[IndexArray, IndexArray, FloatArray, FloatArray]:
    """All points where segments meet surfaces, k: ray, prim, t, firmness; crossings have but the first of a sphere met from outside.

    The roots lie alike before and behind the point nearest to the centre.
    """
    first = np.flatnonzero(blocks)
    sphere = first[found.prim[first] >= prims.triangle_count]
    ray, which = found.ray[sphere], found.prim[sphere] - prims.triangle_count
    origin, direction, radius = segments.origin[ray], segments.direction[ray], prims.radii[which]
    to_center = prims.centers[which] - origin
    noise = NOISE * (radius + np.abs(origin).max(axis=1, initial=0.0) + np.abs(prims.centers[which]).max(axis=1, initial=0.0))
    t = 2.0 * dot(to_center, direction) / dot(direction, direction) - found.t[sphere]
    outside = (np.linalg.norm(to_center, axis=1) > radius + noise) & (segments.own[ray] != found.prim[sphere])
    second = outside & (t < 1.0) & (found.end_gap[sphere] > noise)
    every = np.concatenate([first, sphere[second]])
    return found.ray[every], found.prim[every], np.concatenate([found.t[first], t[second]]), firmness[every]
