"""What surfaces make of light: the lobes of their materials, and the light on them that comes straight from lights of all kinds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.reference.path_hits import beyond_face
from clrt.reference.path_lights import Incoming, arriving, from_areas, from_environment, from_points, from_suns
from clrt.reference.path_microfacet import albedo, lobe
from clrt.reference.path_world import Generator, PathWorld, Wave
from clrt.reference.shade import Surface, dot

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

DIELECTRIC = 0.04  #: what a metal-rough surface that is no metal reflects straight on (glTF 2.0, appendix B)


def matte(world: PathWorld, surface: Surface, color: FloatArray, direction: FloatArray) -> FloatArray:
    """f cos (m, 3) of what scatters light all over the place: Phong's lobe, and the diffuse one of metal-rough materials.

    The latter is (1 - F) (1 - metallic) C / pi, with F of the facet between both directions.
    """
    result = phong(world, surface, color, direction)
    rows = np.flatnonzero(world.metal_rough[surface.material] & beyond_face(surface, direction))
    ids = surface.material[rows]
    shine, _ = _reflectance(world, surface, color, rows, direction[rows])
    share = (1.0 - world.metallic[ids]) * dot(surface.n_shade[rows], direction[rows]) / np.pi
    result[rows] = (1.0 - shine) * color[rows] * share[:, None]
    return result


def shiny(world: PathWorld, surface: Surface, color: FloatArray, direction: FloatArray) -> FloatArray:
    """f cos (m, 3) of the metal-rough materials' specular lobe: F D V (1 + F0 (1 / E - 1)), E the lobe's albedo with F = 1."""
    result = np.zeros_like(color)
    rows = np.flatnonzero(world.metal_rough[surface.material] & beyond_face(surface, direction))
    n, view, alpha = surface.n_shade[rows], surface.view[rows], world.alpha[surface.material[rows]]
    shine, straight = _reflectance(world, surface, color, rows, direction[rows])
    value, _ = lobe(view, n, direction[rows], alpha)
    lost = 1.0 / albedo(dot(n, view), alpha) - 1.0
    result[rows] = shine * (1.0 + straight * lost[:, None]) * value[:, None]
    return result


def _reflectance(
    world: PathWorld, surface: Surface, color: FloatArray, rows: IndexArray, direction: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Schlick's F (k, 3) of the facets that mirror the directions (k, 3) to the viewer, and F0 (k, 3)."""
    metallic = world.metallic[surface.material[rows]][:, None]
    straight = DIELECTRIC * (1.0 - metallic) + color[rows] * metallic
    half = surface.view[rows] + direction
    half = half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-300)
    cosine = np.clip(dot(surface.view[rows], half), 0.0, 1.0)
    return straight + (1.0 - straight) * (1.0 - cosine[:, None]) ** 5, straight


def polished(world: PathWorld, surface: Surface, direction: FloatArray) -> FloatArray:
    """f cos (m, 3) of `gloss`: Reflect times the lobe over its albedo, so that all that a polished mirror would hand on is handed on."""
    materials, ids = world.materials, surface.material
    value = np.zeros(len(ids))
    rows = np.flatnonzero((world.gloss[ids] > 0.0) & beyond_face(surface, direction))
    n, view, alpha = surface.n_shade[rows], surface.view[rows], world.alpha[ids[rows]]
    value[rows] = materials.reflect[ids[rows]] * lobe(view, n, direction[rows], alpha)[0] / albedo(dot(n, view), alpha)
    return np.repeat(value[:, None], 3, axis=1)


def phong(world: PathWorld, surface: Surface, color: FloatArray, direction: FloatArray) -> FloatArray:
    """C (Kd N.L + Ks max(R.V, 0)^exponent) / pi where light from the direction counts, else 0."""
    materials, ids = world.materials, surface.material
    n_l = dot(surface.n_shade, direction)
    r_v = 2.0 * n_l * dot(surface.n_shade, surface.view) - dot(direction, surface.view)
    shine = np.where(r_v > 0.0, np.power(np.maximum(r_v, 0.0), materials.exponent[ids]), 0.0)
    counts = beyond_face(surface, direction) & ~world.metal_rough[ids]
    strength = np.where(counts, materials.diffuse[ids] * n_l + materials.specular[ids] * shine, 0.0)
    return np.asarray(color * (strength / np.pi)[:, None])


def direct(world: PathWorld, wave: Wave, surface: Surface, color: FloatArray, rng: Generator) -> FloatArray:
    """(m, 3) what the surface shows of the light that comes straight from lights of all kinds; one sample of those with a size."""
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
        total += _lit(world, wave, surface, by_all + polished(world, surface, light.direction), light)
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
    result = np.zeros_like(reflected)
    result[rows] = reflected[rows] * arriving(world, towards, origin, surface.prim[rows], wave.time[rows])
    return result
