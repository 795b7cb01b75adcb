"""What surfaces make of light: the lobes of their materials, direct light on them, and the ray that a lobe sends on for indirect light."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from clrt.reference.path_hits import beyond_face
from clrt.reference.path_lights import Incoming, arriving, from_areas, from_environment, from_points, from_suns, uniform_sphere
from clrt.reference.path_world import Generator, PathWorld, Wave, surface_rows
from clrt.reference.shade import Surface, dot

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

#: (surface, color (m, 3), direction (m, 3)) -> f cos (m, 3) of light from there
Lobe = Callable[[Surface, FloatArray, FloatArray], FloatArray]


def phong(world: PathWorld, surface: Surface, color: FloatArray, direction: FloatArray) -> FloatArray:
    """C (Kd N.L + Ks max(R.V, 0)^exponent) / pi where light from the direction counts, else 0."""
    materials, ids = world.materials, surface.material
    n_l = dot(surface.n_shade, direction)
    r_v = 2.0 * n_l * dot(surface.n_shade, surface.view) - dot(direction, surface.view)
    shine = np.where(r_v > 0.0, np.power(np.maximum(r_v, 0.0), materials.exponent[ids]), 0.0)
    strength = np.where(beyond_face(surface, direction), materials.diffuse[ids] * n_l + materials.specular[ids] * shine, 0.0)
    return np.asarray(color * (strength / np.pi)[:, None])


def direct(world: PathWorld, wave: Wave, surface: Surface, color: FloatArray, rng: Generator) -> FloatArray:
    """(m, 3) what the surface shows of the light that comes straight from lights of all kinds; one sample of those with a size."""
    m = len(wave)
    total = np.zeros((m, 3))
    for light in (*from_points(world, surface.point), *from_suns(world, m)):
        total += _lit(world, wave, surface, color, light)
    if len(world.emitters):
        total += _lit(world, wave, surface, color, from_areas(world, surface.point, surface.prim, wave.time, rng))
    if world.scene.environment is not None:
        total += _lit(world, wave, surface, color, from_environment(world.scene.environment, m, rng))
    return total


def _lit(world: PathWorld, wave: Wave, surface: Surface, color: FloatArray, light: Incoming) -> FloatArray:
    """f cos times the light that arrives; shadow rays leave from the lifted point of a curved triangle."""
    reflected = phong(world, surface, color, light.direction) * light.power
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


def scattered(world: PathWorld, wave: Wave, surface: Surface, color: FloatArray, rng: Generator) -> Wave:
    """The rays that bring light from other surfaces to the Phong lobe: f cos over the density with which their directions are drawn.

    Directions are above the surface: by the cosine for what is matte, else every second uniform, which keeps the highlight's part bounded.
    """
    ids = surface.material
    rows = np.flatnonzero((world.materials.diffuse[ids] > 0.0) | (world.materials.specular[ids] > 0.0))
    part, ray = surface_rows(surface, rows), wave.take(rows)
    shiny = world.materials.specular[part.material] > 0.0
    uniform = uniform_sphere(len(rows), rng)
    flip = dot(uniform, part.n_shade) < 0.0
    even = np.where(flip[:, None], -uniform, uniform)
    # A point uniform on the unit sphere that touches the surface lies in a direction whose density is cos / pi.
    cosine = uniform + part.n_shade
    cosine /= np.maximum(np.linalg.norm(cosine, axis=1, keepdims=True), 1e-300)
    direction = np.where((shiny & (rng.random(len(rows)) < 0.5))[:, None], even, cosine)
    n_l = np.maximum(dot(direction, part.n_shade), 0.0)
    density = np.where(shiny, 0.5 * n_l + 0.25, n_l) / np.pi
    reflected = phong(world, part, color[rows], direction)
    weight = np.divide(reflected, density[:, None], where=density[:, None] > 0.0, out=np.zeros_like(reflected))
    return Wave(part.point + part.lift, direction, part.prim, ray.tint * weight, ray.path, ray.time, ray.stack,
                np.ones(len(rows), np.bool_))  # fmt: skip
