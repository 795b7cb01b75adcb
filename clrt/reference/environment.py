"""What rays bring that meet nothing: the environment, or the background."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import Environment, Scene

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]


def behind(scene: Scene, direction: FloatArray, dir_err: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Radiance (m, 3) from directions (m, 3) of any length, and the margin (m,): the angle to where it changes over dir_err (m,)."""
    if scene.environment is None:
        return np.broadcast_to(np.array(scene.background, np.float64), direction.shape), np.full(len(direction), np.inf)
    return radiance(scene.environment, direction), edge_angle(scene.environment, direction) / dir_err


def radiance(environment: Environment, direction: FloatArray) -> FloatArray:
    """(m, 3) of the texels that directions (m, 3) point to: longitude from +z towards +x, latitude from +y down."""
    row, column, _, _ = _texel(environment, direction)
    return np.asarray(environment.radiance[row, column], np.float64)


def _texel(environment: Environment, direction: FloatArray) -> tuple[IndexArray, IndexArray, FloatArray, FloatArray]:
    """Row and column (m,), and the place within the texel, 0 to 1 down and to the right."""
    height, width = environment.radiance.shape[:2]
    x, y, z = direction.T
    u = np.mod(0.5 + (np.arctan2(x, z) - environment.rotation) / (2.0 * np.pi), 1.0) * width
    v = np.arctan2(np.hypot(x, z), y) / np.pi * height
    row = np.minimum(np.floor(v), height - 1).astype(np.int64)
    column = np.minimum(np.floor(u), width - 1).astype(np.int64)
    return row, column, v - row, u - column


def edge_angle(environment: Environment, direction: FloatArray) -> FloatArray:
    """(m,) radians, at most the angle to another radiance: to the nearest edge of the texel, where not all around it is of its colour."""
    height, width = environment.radiance.shape[:2]
    row, column, down, right = _texel(environment, direction)
    sine = np.hypot(direction[:, 0], direction[:, 2]) / np.linalg.norm(direction, axis=1)
    across = np.minimum(right, 1.0 - right) * (2.0 * np.pi / width) * sine
    along = np.minimum(down, 1.0 - down) * (np.pi / height)
    near = [environment.radiance[np.clip(row + i, 0, height - 1), (column + j) % width] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    alike = np.all([texel == near[4] for texel in near], axis=(0, 2))
    # Across a pole lies any texel of the row.
    plain = (environment.radiance == environment.radiance[:, :1]).all((1, 2))
    alike &= ((row > 0) & (row < height - 1)) | plain[row]
    return np.where(alike, np.inf, np.minimum(across, along))
