"""The rays that a hit sends on: mirrored and refracted ones, those drawn from rough lobes, and scattered ones for indirect light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from clrt.reference import media
from clrt.reference.bounce import Bounces, MediumStack, Walls, bounces
from clrt.reference.crossings import Rays
from clrt.reference.lines import TILE_BYTES
from clrt.reference.path_glass import through_rough_glass
from clrt.reference.path_lights import uniform_sphere
from clrt.reference.path_microfacet import drawn_facets
from clrt.reference.path_surfaces import facet_normal, matte, polished, shiny
from clrt.reference.path_world import Generator, PathWorld, Wave, surface_rows
from clrt.reference.shade import Surface, dot

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def next_rays(world: PathWorld, wave: Wave, surface: Surface, color: FloatArray, t: FloatArray, rng: Generator) -> Wave:
    """All rays that the hits send on, each with the weight of what it stands for."""
    ids = surface.material
    b = _bounces(world, wave, surface, t)
    smooth = (world.gloss[ids] == 0.0) & ~world.metal_rough[ids]
    waves = [_sent(wave, surface, b.reflected, b.reflect_weight * smooth, wave.stack),
             _sent(wave, surface, b.refracted, b.refract_weight * smooth, b.behind)]  # fmt: skip
    waves.append(_mirrored_by_facets(world, wave, surface, color, rng))
    waves.extend(through_rough_glass(world, wave, surface, b, rng))
    if world.scene.indirect is not None:
        waves.append(_scattered(world, wave, surface, color, rng))
    return Wave.join(waves)


def straight_on(wave: Wave, surface: Surface, part: FloatArray) -> Wave:
    """The rays that see what lies behind surfaces of which they pass the `part` (m,): as if nothing had been there."""
    return replace(wave, origin=surface.point, own=surface.prim, tint=wave.tint * part[:, None])


def _bounces(world: PathWorld, wave: Wave, surface: Surface, t: FloatArray) -> Bounces:
    walls: Walls = ()
    if world.walls_may_coincide:
        still = Rays(wave.origin, wave.direction, wave.own, np.zeros(len(wave)), np.ones(len(wave)))
        walls = media.walls(world.prims, world.materials, still, surface.prim, t, TILE_BYTES)
    return bounces(world.prims, world.materials, surface, wave.stack, world.rank, walls)


def _sent(wave: Wave, surface: Surface, direction: FloatArray, weight: FloatArray, stack: MediumStack) -> Wave:
    return Wave(surface.point, direction, surface.prim, wave.tint * weight[:, None], wave.path, wave.time, stack,
                np.zeros(len(wave), np.bool_))  # fmt: skip


def _drawn(ray: Wave, surface: Surface, direction: FloatArray, f_cos: FloatArray, density: FloatArray) -> Wave:
    """Rays of drawn directions: f cos over their density; those below the surface are lost."""
    counts = (density > 0.0) & (dot(direction, surface.n_geo) > 0.0)
    weight = np.divide(f_cos, density[:, None], where=counts[:, None], out=np.zeros_like(f_cos))
    return Wave(surface.point, direction, surface.prim, ray.tint * weight, ray.path, ray.time, ray.stack, np.ones(len(ray), np.bool_))


def _mirrored_by_facets(world: PathWorld, wave: Wave, surface: Surface, color: FloatArray, rng: Generator) -> Wave:
    """Rays for the lobes of gloss and of metal-rough materials: a facet is drawn by D cos, its density by directions is D cos / (4 v.h)."""
    ids = surface.material
    mirror = (world.gloss[ids] > 0.0) & (world.materials.reflect[ids] > 0.0) & (world.materials.refract[ids] == 0.0)
    rows = np.flatnonzero(world.metal_rough[ids] | mirror)
    part, ray = surface_rows(surface, rows), wave.take(rows)
    facet, density = drawn_facets(facet_normal(part), world.alpha[part.material], rng)
    v_h = dot(part.view, facet)
    direction = 2.0 * v_h[:, None] * facet - part.view
    density = np.where(v_h > 0.0, density / (4.0 * np.where(v_h > 0.0, v_h, 1.0)), 0.0)
    f_cos = shiny(world, part, color[rows], direction) + polished(world, part, direction)
    return _drawn(ray, part, direction, f_cos, density)


def _scattered(world: PathWorld, wave: Wave, surface: Surface, color: FloatArray, rng: Generator) -> Wave:
    """Rays for the Phong lobe and the diffuse one of metal-rough materials.

    Directions are above the surface: by the cosine for what is matte, else every second uniform, which keeps the highlight's part bounded.
    """
    rows = np.flatnonzero(world.scatters[surface.material])
    part, ray = surface_rows(surface, rows), wave.take(rows)
    mixed = world.materials.specular[part.material] > 0.0
    uniform = uniform_sphere(len(rows), rng)
    even = np.where((dot(uniform, part.n_shade) < 0.0)[:, None], -uniform, uniform)
    # A point uniform on the unit sphere that touches the surface lies in a direction whose density is cos / pi.
    cosine = uniform + part.n_shade
    cosine /= np.maximum(np.linalg.norm(cosine, axis=1, keepdims=True), 1e-300)
    direction = np.where((mixed & (rng.random(len(rows)) < 0.5))[:, None], even, cosine)
    n_l = np.maximum(dot(direction, part.n_shade), 0.0)
    density = np.where(mixed, 0.5 * n_l + 0.25, n_l) / np.pi
    return _drawn(ray, part, direction, matte(world, part, color[rows], direction), density)
