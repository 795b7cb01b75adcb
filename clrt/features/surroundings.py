"""Effects of what lies around the scene: an environment, seen behind everything and lighting it."""

from __future__ import annotations

import numpy as np

from clrt.features.feature import Feature
from clrt.scene.model import Environment, Scene


def environment_caller(scene: Scene) -> int | None:
    """The environment, whatever it shows."""
    return None if scene.environment is None else scene.environment.line


def _of(scene: Scene) -> Environment:
    assert scene.environment is not None  # the effect is called for by it
    return scene.environment


def _turn(scene: Scene) -> float:
    """The rotation in turns, 0 to 1."""
    return float(_of(scene).rotation / (2.0 * np.pi) % 1.0)


ENVIRONMENT = Feature(
    "environment",
    environment_caller,
    "environment.cl",
    frame=(
        ("environment_turn", np.float64, _turn),
        ("environment_width", np.int32, lambda scene: _of(scene).radiance.shape[1]),
        ("environment_height", np.int32, lambda scene: _of(scene).radiance.shape[0]),
    ),
    parameters=(("environment_cells", "global const real *environment_cells"),),
)
