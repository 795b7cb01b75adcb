"""Pictures that are the mean of samples, in float64: antialiasing, lens, motion. The kernels' random numbers (clrt.reference.sampler)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from clrt.reference import sampler
from clrt.reference.tracer import render
from clrt.scene.model import Camera, Lens, Scene

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SampledPicture:
    """The mean of samples. pixels : (h, w, 3); margin : (h, w) the smallest of all samples; rays : by kind, over all samples."""

    pixels: FloatArray
    margin: FloatArray
    rays: dict[str, int]


def eye_rays(scene: Scene, sample: int, seed: int, bits: int = 32) -> tuple[FloatArray, FloatArray]:
    """Origins and directions, (h, w, 3) each, of one sample of every pixel; bits: of each random number, as in `sampler.uniforms`."""
    camera = scene.camera
    i, j = np.arange(camera.width)[None, :], np.arange(camera.height)[:, None]
    pixel = j * 65536 + i
    x, y = np.broadcast_arrays(i + 0.5, j + 0.5)
    if scene.samples > 1:
        x = i + sampler.uniforms(pixel, sample, sampler.PIXEL, seed, bits)
        y = j + sampler.uniforms(pixel, sample, sampler.PIXEL + 1, seed, bits)
    s, t = (x / camera.width)[..., None], (y / camera.height)[..., None]
    ul, ur, ll, lr = camera.corners
    direction = (1 - t) * ((1 - s) * ul + s * ur) + t * ((1 - s) * ll + s * lr)
    origin = np.broadcast_to(np.asarray(camera.eye, np.float64), direction.shape)
    if scene.lens is not None and scene.lens.radius > 0.0:
        u, v = (sampler.uniforms(pixel, sample, sampler.LENS + i, seed, bits) for i in (0, 1))
        origin, direction = _through_lens(scene.lens, camera, direction, disc_points(2.0 * u - 1.0, 2.0 * v - 1.0))
    if scene.shutter is not None:
        origin = origin + sample_times(scene, sample, seed, bits)[..., None] * scene.shutter.eye_motion
    return origin, direction


def sample_times(scene: Scene, sample: int, seed: int, bits: int = 32) -> FloatArray:
    """(h, w): when one sample of every pixel is taken; 0 without a shutter."""
    i, j = np.arange(scene.camera.width)[None, :], np.arange(scene.camera.height)[:, None]
    if scene.shutter is None:
        return np.zeros((len(j), i.shape[1]))
    share = sampler.uniforms(j * 65536 + i, sample, sampler.TIME, seed, bits)
    return np.asarray(scene.shutter.open + (scene.shutter.close - scene.shutter.open) * share)


def at_time(scene: Scene, time: float) -> Scene:
    """The scene as it stands at a time."""
    objects = tuple(replace(o, vertices=o.vertices + time * np.array(o.motion), motion=(0.0, 0.0, 0.0)) for o in scene.objects)
    return replace(scene, objects=objects, shutter=None)


def _through_lens(lens: Lens, camera: Camera, direction: FloatArray, disc: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rays from points of the lens, disc (h, w, 2) to the right and up, to where the pinhole's rays meet the sharp plane."""
    ul, ur, ll, lr = camera.corners
    normal = np.cross(ur - ll, lr - ul)  # of the picture: perpendicular to both diagonals
    distance = direction @ normal
    right = (ur - ul) / np.linalg.norm(ur - ul)
    right = right - normal * (right @ normal) / (normal @ normal)
    up = np.cross(normal, right) * np.sign(distance[0, 0])
    place = sum(disc[..., i, None] * axis * (lens.radius / np.linalg.norm(axis)) for i, axis in enumerate((right, up)))
    sharp = direction * (lens.focus * np.linalg.norm(normal) / np.abs(distance))[..., None]
    return np.asarray(camera.eye + place), np.asarray(sharp - place)


def disc_points(x: FloatArray, y: FloatArray) -> FloatArray:
    """Points (..., 2) of the unit disc for those of the square -1 to 1: squares about the middle become circles (Shirley and Chiu 1997).

    A sector's angle is 45 degrees times the shorter coordinate over the longer.
    """
    along, across = np.where(np.abs(x) > np.abs(y), (x, y), (y, x))
    angle = np.divide(across, along, out=np.zeros_like(along), where=along != 0.0) * np.pi / 4.0
    circle = along * np.array([np.cos(angle), np.sin(angle)])
    return np.stack(np.where(np.abs(x) > np.abs(y), circle, circle[::-1]), axis=-1)


def _still_parts(scene: Scene, sample: int, seed: int, bits: int) -> Iterator[tuple[tuple[slice, slice], Scene]]:
    """Rows and columns of which all rays of a sample see the same scene, and that scene: where objects move, each pixel by itself."""
    if not any(any(o.motion) for o in scene.objects):
        yield (slice(None), slice(None)), scene
        return
    times = sample_times(scene, sample, seed, bits)
    camera = replace(scene.camera, width=1, height=1)
    for row, column in np.ndindex(times.shape):
        still = at_time(replace(scene, camera=camera), float(times[row, column]))
        yield (slice(row, row + 1), slice(column, column + 1)), still


def render_samples(scene: Scene, *, seed: int = 0, first: int = 0, bits: int = 32) -> SampledPicture:
    """Samples first to first + scene.samples of every pixel, and their mean. Raises as `render`."""
    total: FloatArray = np.zeros((scene.camera.height, scene.camera.width, 3))
    margin, rays = np.full((scene.camera.height, scene.camera.width), np.inf), dict[str, int]()
    for sample in range(first, first + scene.samples):
        origins, directions = eye_rays(scene, sample, seed, bits)
        for at, still in _still_parts(scene, sample, seed, bits):
            one = render(still, origins=origins[at], directions=directions[at])
            total[at] += one.pixels
            margin[at] = np.minimum(margin[at], one.margin)
            rays = {kind: rays.get(kind, 0) + n for kind, n in one.rays.items()}
    return SampledPicture(np.asarray(total / scene.samples), margin, rays)
