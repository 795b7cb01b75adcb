"""The reference picture of sampled light: a float64 path tracer that is as plain as can be, and says how sure its means are.

All rays against all primitives, NumPy's own random numbers, every surface lit by one uniform sample of the lights and of the
environment; rays drawn from a lobe bring all other light. No sampling by importance of lights, no multiple importance
sampling, no roulette: every ray goes on to the scene's depth. It follows docs/conventions.md, "Sampled light".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.errors import LimitError
from clrt.reference import media
from clrt.reference.environment import radiance
from clrt.reference.path_bounce import next_rays, straight_on
from clrt.reference.path_eye import eye_rays
from clrt.reference.path_fog import fogged
from clrt.reference.path_hits import closest, solid, surfaces_met
from clrt.reference.path_surfaces import direct
from clrt.reference.path_world import Generator, PathWorld, Wave
from clrt.scene.model import Scene

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

RAYS_AT_ONCE = 1 << 14  #: of the eye: few enough that the arrays of rays times primitives stay in caches


@dataclass(frozen=True, eq=False)
class PathPicture:
    """mean : (h, w, 3) of the samples of each pixel; variance_of_mean : (h, w, 3), the unbiased estimate of it; samples : a pixel."""

    mean: FloatArray
    variance_of_mean: FloatArray
    samples: int


def render_paths(scene: Scene, samples: int, seed: int) -> PathPicture:
    """The mean of `samples` paths a pixel, each through a place uniform in the pixel, at a uniform time.

    Needs two samples at least, for the variance; raises LimitError for fewer, SceneError as PathWorld.of.
    """
    if samples < 2:
        raise LimitError(f"{samples} samples have no variance; take 2 or more")
    world, rng = PathWorld.of(scene), np.random.default_rng(seed)
    height, width = scene.camera.height, scene.camera.width
    pixels = height * width
    mean, squares, count = np.zeros((pixels, 3)), np.zeros((pixels, 3)), 0
    at_once = max(1, min(samples, RAYS_AT_ONCE // pixels))
    while count < samples:
        batch = min(at_once, samples - count)
        values = np.concatenate([_values(world, part, rng) for part in np.array_split(np.tile(np.arange(pixels), batch),
                                 -(-pixels * batch // RAYS_AT_ONCE))]).reshape(batch, pixels, 3)  # fmt: skip
        mean, squares = _merged(mean, squares, count, values)
        count += batch
    shape = (height, width, 3)
    return PathPicture(mean.reshape(shape), (squares / (count - 1) / count).reshape(shape), count)


def _merged(mean: FloatArray, squares: FloatArray, count: int, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean and sum of squared deviations with more values (k, ...) added (Chan, Golub, LeVeque 1983; Welford's for one)."""
    k = len(values)
    own = values.mean(axis=0)
    gap = own - mean
    squares = squares + ((values - own) ** 2).sum(axis=0) + gap**2 * (count * k / (count + k))
    return mean + gap * (k / (count + k)), squares


def _values(world: PathWorld, pixel: IndexArray, rng: Generator) -> FloatArray:
    """(m, 3) radiance along one path through each of the pixels (m,)."""
    total = np.zeros((len(pixel), 3))
    wave = eye_rays(world, pixel, rng)
    for depth in range(world.scene.depth + 1):
        wave = _step(world, wave, total, depth < world.scene.depth, rng)
        if not len(wave):
            break
    return total


def _step(world: PathWorld, wave: Wave, total: FloatArray, goes_on: bool, rng: Generator) -> Wave:
    """Add what the rays of one depth meet to their paths' totals; return the rays of the next."""
    prim, t = closest(world, wave)
    tint = wave.tint * media.transmittance(world.absorption[wave.stack.top], t)
    if world.scene.fog is not None and world.scene.fog.density > 0.0:
        airlight, left = fogged(world, wave, t, rng)
        _add(total, wave, wave.tint * airlight)
        tint = tint * left[:, None]
    wave = wave.tinted(tint)
    missed, hit = np.flatnonzero(prim < 0), np.flatnonzero(prim >= 0)
    beyond = wave.take(missed)
    _add(total, beyond, beyond.tint * _sky(world, beyond))
    wave, prim, t = wave.take(hit), prim[hit], t[hit]
    surface, color = surfaces_met(world, wave, prim, t)
    whole = wave
    part = solid(world, wave, surface)
    wave = wave.tinted(wave.tint * part[:, None])
    shown = np.where(wave.drawn[:, None], 0.0, world.emission[prim]) + direct(world, wave, surface, color, goes_on, rng)
    if world.scene.indirect is None:
        shown += color * world.materials.ambient[surface.material][:, None]
    _add(total, wave, wave.tint * shown)
    if not goes_on:
        return wave.take(np.zeros(0, np.int64))
    passed = straight_on(whole, surface, 1.0 - part)
    return Wave.join([passed, next_rays(world, wave, surface, color, t, rng)])


def _add(total: FloatArray, wave: Wave, value: FloatArray) -> None:
    """Several rays of a wave may be of one path."""
    for channel in range(3):
        total[:, channel] += np.bincount(wave.path, value[:, channel], len(total))


def _sky(world: PathWorld, wave: Wave) -> FloatArray:
    """(m, 3) what rays meet that hit nothing: the environment, where no light sample has stood for it; else the background."""
    if world.scene.environment is None:
        return np.broadcast_to(np.array(world.scene.background, np.float64), (len(wave), 3))
    return np.where(wave.drawn[:, None], 0.0, radiance(world.scene.environment, wave.direction))
