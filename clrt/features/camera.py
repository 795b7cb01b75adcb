"""Effects of how the eye looks: samples of a pixel, a lens."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.features.feature import REAL, Feature
from clrt.scene.model import Camera, Scene


def _samples_caller(scene: Scene) -> int | None:
    return scene.samples_line if scene.samples > 1 else None


def _lens_caller(scene: Scene) -> int | None:
    return scene.lens.line if scene.lens is not None and scene.lens.radius > 0.0 else None


def lens_axes(camera: Camera) -> NDArray[np.float64]:
    """(3, 3) float64 unit vectors: along the picture's rows, up the picture, and the view direction, perpendicular to both diagonals."""
    ul, ur, ll, lr = camera.corners / np.abs(camera.corners).max()
    axis = np.cross(lr - ul, ur - ll)
    axis *= np.copysign(1.0, axis @ (ul + ur + ll + lr)) / np.linalg.norm(axis)
    right = (ur - ul) - ((ur - ul) @ axis) * axis
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(axis, right), axis])


def _lens_frame(scene: Scene) -> NDArray[np.float64]:
    """(3, 3): two radii of the lens at a right angle, and the normal of the sharp plane over its distance; zero without a lens."""
    if scene.lens is None:
        return np.zeros((3, 3))
    return lens_axes(scene.camera) * [[scene.lens.radius], [scene.lens.radius], [1.0 / scene.lens.focus]]


SAMPLES = Feature(
    "samples",
    _samples_caller,
    "antialias.cl",
    frame=(("pixel_spread", REAL, lambda scene: float(scene.samples > 1)),),
    sampled=True,
)
LENS = Feature(
    "lens",
    _lens_caller,
    "lens.cl",
    frame=(
        ("lens_right", REAL, (3,), lambda scene: _lens_frame(scene)[0]),
        ("lens_up", REAL, (3,), lambda scene: _lens_frame(scene)[1]),
        ("lens_axis", REAL, (3,), lambda scene: _lens_frame(scene)[2]),
    ),
    sampled=True,
)
