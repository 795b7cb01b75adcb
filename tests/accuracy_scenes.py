"""Small scenes of sampled light with their truths, which share no samples with what is judged, and engines that render them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from reference_scenes import matte, quad, scene, spheres
from sampled_scenes import lamp, objects

from clrt import renderer
from clrt.adaptive.engine import Engine, Goal, Outcome
from clrt.adaptive.replicates import HALVES, Replicates
from clrt.device.context import Device
from clrt.features import Features
from clrt.precision import rung
from clrt.scene.model import Lens, Material, Scene

FloatArray = NDArray[np.float64]

SIZE = (48, 32)
HALF, HEIGHT, RADIANCE = 0.5, 1.5, 6.0  #: of the lamp over the floor


def lamp_over_floor() -> Scene:
    """A square lamp, out of view, over a floor; nothing between. Its light at a point is Lambert's formula."""
    lamp_at = quad((-HALF, HEIGHT, -HALF), (HALF, HEIGHT, -HALF), (HALF, HEIGHT, HALF), (-HALF, HEIGHT, HALF))
    floor = quad((-9, 0, -9), (9, 0, -9), (9, 0, 9), (-9, 0, 9))
    parts = objects((lamp_at, 1), (floor, 0))
    s = scene(parts, [matte(diffuse=0.5, ambient=0.0), lamp(RADIANCE, RADIANCE, RADIANCE)], [], None, eye=(0, 1.0, -2.5),
              view=(0, -0.7, 1), fov=40.0, size=SIZE)  # fmt: skip
    return replace(s, samples_line=1, samples=2)


def soft_shadow(fov: float = 45.0) -> Scene:
    """A ball's shadow from a triangular lamp on a floor that fills the picture."""
    return _ball_and_lamp(fov, (0, 2.2, -4), (0, -0.55, 1))


def shadow_under_sky() -> Scene:
    """The same from farther off: a shadow in a wide view, half of it sky."""
    return replace(_ball_and_lamp(50.0, (0, 1.2, -6), (0, -0.05, 1)), background=(0.2, 0.25, 0.35))


def _ball_and_lamp(fov: float, eye: tuple[float, float, float], view: tuple[float, float, float]) -> Scene:
    lamp_at = np.array([[(-0.5, 3.0, -0.5), (0.5, 3.0, -0.5), (0.0, 3.0, 0.6)]], np.float64)
    floor = quad((-9, 0, -9), (9, 0, -9), (9, 0, 9), (-9, 0, 9))
    parts = objects((lamp_at, 1), (floor, 0))
    s = scene(parts, [Material((0.9, 0.8, 0.6), 0.1, 0.6, 0.0, 1.0), lamp(8.0, 8.0, 8.0), matte(diffuse=0.7)], [],
              spheres((0.0, 0.7, 0.0, 0.4, 2)), eye=eye, view=view, fov=fov, size=SIZE)  # fmt: skip
    return replace(s, samples_line=1, samples=2)


def lens_blur(fov: float = 40.0, radius: float = 0.08) -> Scene:
    """A dark and a bright board, in front of and behind the plane of focus, before a grey one."""
    near, far = quad((-0.8, -0.3, 1.5), (-0.1, -0.3, 1.5), (-0.1, 0.9, 1.5), (-0.8, 0.9, 1.5)), quad(
        (0.2, -0.9, 4.0), (1.6, -0.9, 4.0), (1.6, 0.6, 4.0), (0.2, 0.6, 4.0))  # fmt: skip
    back = quad((-9, -9, 8.0), (9, -9, 8.0), (9, 9, 8.0), (-9, 9, 8.0))
    shades = [Material((c, c, c), 1.0, 0.0, 0.0, 1.0) for c in (0.2, 1.0, 0.5)]
    s = scene(objects((near, 0), (far, 1), (back, 2)), shades, [(0, 0, -5)], None, eye=(0, 0, 0), view=(0, 0, 1), fov=fov, size=SIZE)
    return replace(s, samples_line=1, samples=2, lens=Lens(radius, 2.5, line=1))


def rare_flashes() -> Scene:
    """A small, very bright lamp behind a board with a narrow gap: most samples bring nothing, a few bring a lot."""
    lamp_at = quad((-0.6, 3.0, -0.6), (0.6, 3.0, -0.6), (0.6, 3.0, 0.6), (-0.6, 3.0, 0.6))
    floor = quad((-9, 0, -9), (9, 0, -9), (9, 0, 9), (-9, 0, 9))
    left, right = quad((-9, 2.0, -9), (-0.02, 2.0, -9), (-0.02, 2.0, 9), (-9, 2.0, 9)), quad(
        (0.02, 2.0, -9), (9, 2.0, -9), (9, 2.0, 9), (0.02, 2.0, 9))  # fmt: skip
    parts = objects((lamp_at, 1), (floor, 0), (left, 0), (right, 0))
    s = scene(parts, [matte(diffuse=0.6, ambient=0.02), lamp(60.0, 60.0, 60.0)], [], None, eye=(0, 1.2, -3.0), view=(0, -0.5, 1), fov=40.0,
              size=(24, 16))  # fmt: skip
    return replace(s, samples_line=1, samples=2)


SCENES: dict[str, Callable[[], Scene]] = {"lamp over a floor": lamp_over_floor, "soft shadow": soft_shadow, "lens blur": lens_blur}


def lambert_truth(fine: int = 4) -> FloatArray:
    """(h, w, 3): the floor under the lamp by Lambert's (1760) formula for a polygon, at fine x fine midpoints of each pixel, in float64."""
    s = lamp_over_floor()
    width, height = SIZE
    x, y = np.meshgrid((np.arange(width * fine) + 0.5) / (width * fine), (np.arange(height * fine) + 0.5) / (height * fine))
    ul, ur, ll, lr = (np.asarray(c) for c in s.camera.corners)
    u, v = x[..., None], y[..., None]
    direction = (1 - v) * ((1 - u) * ul + u * ur) + v * ((1 - u) * ll + u * lr)
    eye = np.asarray(s.camera.eye, np.float64)
    point = eye - direction * (eye[1] / direction[..., 1])[..., None]
    corners = np.array([(-HALF, HEIGHT, -HALF), (HALF, HEIGHT, -HALF), (HALF, HEIGHT, HALF), (-HALF, HEIGHT, HALF)])
    to = corners - point[..., None, :]
    to /= np.linalg.norm(to, axis=-1, keepdims=True)
    total = np.zeros(point.shape[:-1])
    for i in range(4):
        a, b = to[..., i, :], to[..., (i + 1) % 4, :]
        axis = np.cross(a, b)
        angle = np.arctan2(np.linalg.norm(axis, axis=-1), (a * b).sum(-1))
        total += angle * axis[..., 1] / np.linalg.norm(axis, axis=-1)
    light = 0.5 * RADIANCE * np.abs(total) / (2.0 * np.pi)
    return np.repeat(light.reshape(height, fine, width, fine).mean((1, 3))[..., None], 3, -1)


class Renders:
    """One program of a scene, rendered again and again with other seeds."""

    def __init__(self, scene: Scene, device: Device) -> None:
        self.scene, self.features = scene, Features.of(scene)
        prepared = renderer.build_trees(scene, "sah", lambda phase, part: None)
        self.tracer = renderer.open_tracer(prepared, self.features, rung("watertight"), device, lambda phase, part: None)[1]

    def run(self, seed: int, goal: Goal) -> Outcome:
        return self.engine(seed, goal).run()

    def engine(self, seed: int, goal: Goal, count: int = HALVES) -> Engine:
        return Engine(Replicates(self.tracer, count, seed), goal, lambda part: None, lambda told: None, None)

    def truth(self, samples: int, seed: int = 10**9) -> tuple[FloatArray, float]:
        """(h, w, 3) by uniform samples of seeds that nothing else has, and the root mean square of its own error."""
        runs = [self.run(seed + i, Goal(samples=samples)) for i in range(4)]
        pictures = np.stack([run.pixels.astype(np.float64) for run in runs])
        return pictures.mean(axis=0), float(np.sqrt(pictures.var(axis=0, ddof=1).mean() / len(runs)))
