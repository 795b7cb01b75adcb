"""Fog in the reference of sampled light: what it leaves of a ray, and the light that it scatters into one, once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.reference import media
from clrt.reference.path_lights import Incoming, arriving, from_areas, from_points
from clrt.reference.path_world import Generator, PathWorld, Wave

FloatArray = NDArray[np.float64]


def fogged(world: PathWorld, wave: Wave, t: FloatArray, rng: Generator) -> tuple[FloatArray, FloatArray]:
    """The light (m, 3) that reaches the start of each ray by one scattering in the fog in front of its hit at t (m,), inf for none;
    and the part (m,) that is left of what comes from the hit.

    With a distance s of density sigma exp(-sigma s), the integral of sigma exp(-sigma s) (light scattered at s) over s < t is the mean
    of (light scattered at s) where s < t, else 0.
    """
    fog = world.scene.fog
    assert fog is not None
    s = rng.exponential(1.0 / fog.density, len(wave))
    rows = np.flatnonzero(s < t)
    part = wave.take(rows)
    point = part.origin + s[rows, None] * part.direction
    nowhere = np.full(len(rows), -1, np.int64)
    lights: list[Incoming] = list(from_points(world, point))
    if len(world.emitters):
        lights.append(from_areas(world, point, nowhere, part.time, rng))
    airlight = np.zeros((len(wave), 3))
    for light in lights:
        scatters = phase(fog.asymmetry, np.einsum("mi,mi->m", light.direction, part.direction))
        airlight[rows] += scatters[:, None] * arriving(world, light, point, nowhere, part.time)
    airlight[rows] *= media.transmittance(world.absorption[part.stack.top], s[rows])
    return airlight * np.array(fog.albedo), np.exp(-fog.density * t)


def phase(asymmetry: float, cosine: FloatArray) -> FloatArray:
    """Henyey and Greenstein (1941), 1 / sr: cosine of the angle by which light is turned, (m,); more than uniform ahead for g > 0."""
    g = asymmetry
    return np.asarray((1.0 - g * g) / (4.0 * np.pi * np.power(1.0 + g * g - 2.0 * g * cosine, 1.5)))
