"""Pictures that are the mean of samples, in float64: antialiasing. The same random numbers as the kernels' (clrt.reference.sampler)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.reference import sampler
from clrt.reference.tracer import render
from clrt.scene.model import Scene

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
    return origin, direction


def render_samples(scene: Scene, *, seed: int = 0, first: int = 0, bits: int = 32) -> SampledPicture:
    """Samples first to first + scene.samples of every pixel, and their mean. Raises as `render`."""
    total: FloatArray = np.zeros((scene.camera.height, scene.camera.width, 3))
    margin, rays = np.full((scene.camera.height, scene.camera.width), np.inf), dict[str, int]()
    for sample in range(first, first + scene.samples):
        origins, directions = eye_rays(scene, sample, seed, bits)
        one = render(scene, origins=origins, directions=directions)
        total = total + one.pixels
        margin = np.minimum(margin, one.margin)
        rays = {kind: rays.get(kind, 0) + n for kind, n in one.rays.items()}
    return SampledPicture(np.asarray(total / scene.samples), margin, rays)
