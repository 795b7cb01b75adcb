"""What surfaces make of light: the lobes of their materials, and the light on them that comes straight from lights of all kinds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.reference.path_hits import beyond_face
from clrt.reference.path_lights import Incoming, arriving, from_areas, from_environment, from_points, from_suns
from clrt.reference.path_microfacet import albedo, diffuse_grazing, grazing, lobe
from clrt.reference.path_world import Generator, PathWorld, Wave
from clrt.reference.shade import Surface, dot
from clrt.reference.terminator import face_between

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

FAR = 1e6  #: lengths away where a light without an end stands
DIELECTRIC = 0.04  #: what a metal-rough surface that is no metal reflects straight on (glTF 2.0, appendix B)


def matte(world: PathWorld, surface: Surface, color: FloatArray, direction: FloatArray) -> FloatArray:
    """f cos (m, 3) of what scatters light all over the place: Phong's lobe, and the diffuse one of metal-rough materials.

    The latter is (1 - F) (1 - metallic) C S N.L / pi, with F of the facet between both directions and S = min(1, (1 - B) / (1 - K)).
    """
    result = phong(world, surface, color, direction)
    rows = np.flatnonzero(world.metal_rough[surface.material] & beyond_face(surface, direction))
    ids, view, n = surface.material[rows], surface.view[rows], facet_normal(surface)[rows]
    shine = _schlick(world, surface, color, rows, direction[rows])
    share = np.minimum(1.0, (1.0 - grazing(dot(n, view), world.alpha[ids])) / (1.0 - diffuse_grazing(dot(n, view))))
    strength = (1.0 - world.metallic[ids]) * share * dot(surface.n_shade[rows], direction[rows]) / np.pi
    result[rows] = (1.0 - shine) * color[rows] * strength[:, None]
    return result


def shiny(world: PathWorld, surface: Surface, color: FloatArray, direction: FloatArray) -> FloatArray:
    """f cos (m, 3) of the metal-rough materials' specular lobe: F times the lobe over its albedo."""
    result = np.zeros_like(color)
    rows = np.flatnonzero(world.metal_rough[surface.material] & (dot(surface.n_geo, direction) > 0.0))
    shine = _schlick(world, surface, color, rows, direction[rows])
    result[rows] = shine * _whole_lobe(world, surface, rows, direction[rows])[:, None]
    return result


def polished(world: PathWorld, surface: Surface, direction: FloatArray) -> FloatArray:
    """f cos (m, 3) of mirrors with gloss: Reflect times the lobe over its albedo. Rough glass is left to the rays that it sends on."""
    value = np.zeros(len(direction))
    mirror = (world.gloss > 0.0) & (world.materials.refract == 0.0)
    rows = np.flatnonzero(mirror[surface.material] & (dot(surface.n_geo, direction) > 0.0))
    value[rows] = world.materials.reflect[surface.material[rows]] * _whole_lobe(world, surface, rows, direction[rows])
    return np.repeat(value[:, None], 3, axis=1)


def facet_normal(surface: Surface) -> FloatArray:
    """(m, 3) what facets are tilted from: N, or n_geo where N faces away from the viewer or mirrors the view to below the surface."""
    facing = dot(surface.n_shade, surface.view)
    mirrored = 2.0 * facing[:, None] * surface.n_shade - surface.view
    return np.where(((facing > 0.0) & (dot(mirrored, surface.n_geo) > 0.0))[:, None], surface.n_shade, surface.n_geo)


def _whole_lobe(world: PathWorld, surface: Surface, rows: IndexArray, direction: FloatArray) -> FloatArray:
    """(k,) the lobe over its albedo, towards directions (k, 3)."""
    n, view, alpha = facet_normal(surface)[rows], surface.view[rows], world.alpha[surface.material[rows]]
    return np.asarray(lobe(view, n, direction, alpha) / albedo(dot(n, view), alpha))


def _schlick(world: PathWorld, surface: Surface, color: FloatArray, rows: IndexArray, direction: FloatArray) -> FloatArray:
    """F (k, 3) of the facets that mirror the directions (k, 3) to the viewer (Schlick 1994)."""
    metallic = world.metallic[surface.material[rows]][:, None]
    straight = DIELECTRIC * (1.0 - metallic) + color[rows] * metallic
    half = surface.view[rows] + direction
    half = half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-300)
    cosine = np.clip(dot(surface.view[rows], half), 0.0, 1.0)
    return np.asarray(straight + (1.0 - straight) * (1.0 - cosine[:, None]) ** 5)


def phong(world: PathWorld, surface: Surface, color: FloatArray, direction: FloatArray) -> FloatArray:
    """C (Kd N.L + Ks max(R.V, 0)^exponent) / pi where light from the direction counts, else 0."""
    materials, ids = world.materials, surface.material
    n_l = dot(surface.n_shade, direction)
    r_v = 2.0 * n_l * dot(surface.n_shade, surface.view) - dot(direction, surface.view)
    shine = np.where(r_v > 0.0, np.power(np.maximum(r_v, 0.0), materials.exponent[ids]), 0.0)
    counts = beyond_face(surface, direction) & ~world.metal_rough[ids]
    strength = np.where(counts, materials.diffuse[ids] * n_l + materials.specular[ids] * shine, 0.0)
    return np.asarray(color * (strength / np.pi)[:, None])


def direct(world: PathWorld, wave: Wave, surface: Surface, color: FloatArray, goes_on: bool, rng: Generator) -> FloatArray:
    """(m, 3) what the surface shows of the light that comes straight from lights of all kinds; one sample of those with a size.

    goes_on : whether mirrored rays are followed from here; where they are not, gloss shows no lights, either
    """
    m = len(wave)
    total = np.zeros((m, 3))
    for light in (*from_points(world, surface.point), *from_suns(world, m)):
        by_point = matte(world, surface, color, light.direction) + shiny(world, surface, color, light.direction)
        total += _lit(world, wave, surface, by_point, light)
    wide: list[Incoming] = []
    if len(world.emitters):
        wide.append(from_areas(world, surface.point, surface.prim, wave.time, rng))
    if world.scene.environment is not None:
        wide.append(from_environment(world.scene.environment, m, rng))
    for light in wide:
        by_all = matte(world, surface, color, light.direction) + shiny(world, surface, color, light.direction)
        if goes_on:
            by_all += polished(world, surface, light.direction)
        total += _lit(world, wave, surface, by_all, light)
    return total


def _lit(world: PathWorld, wave: Wave, surface: Surface, f_cos: FloatArray, light: Incoming) -> FloatArray:
    """f cos (m, 3) times the light that arrives; shadow rays leave from the lifted point of a curved triangle."""
    reflected = f_cos * light.power
    rows = np.flatnonzero(reflected.any(axis=1))
    part = light.take(rows)
    origin = surface.point[rows] + surface.lift[rows]
    # The direction is that from the hit; the ray from the lifted point ends in the same point of the light.
    near = np.isfinite(part.distance)
    end = surface.point[rows] + np.where(near, part.distance, 0.0)[:, None] * part.direction
    way = np.where(near[:, None], end - origin, part.direction)
    length = np.linalg.norm(way, axis=1)
    towards = Incoming(way / length[:, None], np.where(near, length, np.inf), np.ones((len(rows), 3)), part.target)
    arrived = arriving(world, towards, origin, surface.prim[rows], wave.time[rows])
    arrived[_behind_own_face(world, surface, rows, wave.time[rows], np.where(near[:, None], end, origin + FAR * way))] = 0.0
    result = np.zeros_like(reflected)
    result[rows] = reflected[rows] * arrived
    return result


def _behind_own_face(world: PathWorld, surface: Surface, rows: IndexArray, time: FloatArray, light: FloatArray) -> IndexArray:
    """Places in `rows` whose curved triangle stands between the lifted point and the light at (k, 3) behind its plane."""
    at = np.flatnonzero(surface.curved[rows])
    hits = rows[at]
    corners = world.prims.vertices[surface.prim[hits]] + (world.motion[surface.prim[hits]] * time[at, None])[:, None]
    hidden, _ = face_between(corners, surface.n_geo[hits], surface.point[hits], surface.lift[hits], light[at], np.ones(len(at)))
    return at[hidden]
