"""Where paths begin: a place in the pixel, a time while the shutter is open, a point of the lens, all uniform."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.reference.path_world import Generator, PathWorld, Wave
from clrt.scene.model import Camera

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]


def eye_rays(world: PathWorld, pixel: IndexArray, rng: Generator) -> Wave:
    """One ray through each pixel (m,), row * width + column."""
    camera, m = world.scene.camera, len(pixel)
    row, column = np.divmod(pixel, camera.width)
    s, t = (column + rng.random(m)) / camera.width, (row + rng.random(m)) / camera.height
    ul, ur, ll, lr = camera.corners
    s, t = s[:, None], t[:, None]
    way = (1 - t) * ((1 - s) * ul + s * ur) + t * ((1 - s) * ll + s * lr)
    origin = np.broadcast_to(np.asarray(camera.eye, np.float64), way.shape)
    time = np.zeros(m)
    lens, shutter = world.scene.lens, world.scene.shutter
    if lens is not None and lens.radius > 0.0:
        view, right, up = _axes(camera)
        focus = way * (lens.focus / (way @ view))[:, None]
        radius, angle = lens.radius * np.sqrt(rng.random((m, 1))), 2.0 * np.pi * rng.random((m, 1))
        from_middle = radius * (np.cos(angle) * right + np.sin(angle) * up)
        origin, way = origin + from_middle, focus - from_middle
    if shutter is not None:
        time = shutter.open + (shutter.close - shutter.open) * rng.random(m)
        origin = origin + time[:, None] * np.array(shutter.eye_motion)
    direction = way / np.linalg.norm(way, axis=1, keepdims=True)
    return Wave(np.asarray(origin), direction, np.full(m, -1, np.int64), np.ones((m, 3)), np.arange(m), time,
                world.first[np.zeros(m, np.int64)], np.zeros(m, np.bool_))  # fmt: skip


def _axes(camera: Camera) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit (3,): the view, perpendicular to both diagonals of the picture; and two vectors that span the plane across it."""
    ul, ur, ll, lr = camera.corners
    view = np.cross(lr - ul, ur - ll)
    view = view / np.linalg.norm(view) * np.sign(view @ camera.corners.sum(axis=0))
    right = np.cross(np.eye(3)[np.abs(view).argmin()], view)
    right = right / np.linalg.norm(right)
    return view, right, np.cross(view, right)
