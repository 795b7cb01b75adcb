"""Effects of what lies around the scene: an environment, seen behind everything and lighting it."""

from __future__ import annotations

import numpy as np

from clrt.features.feature import Feature, used_materials
from clrt.features.shapes import can_shadow
from clrt.scene.model import Environment, Material, Scene
from clrt.scene.skylight import lit_count, row_words


def environment_caller(scene: Scene) -> int | None:
    """The environment, whatever it shows."""
    return None if scene.environment is None else scene.environment.line


def _of(scene: Scene) -> Environment:
    assert scene.environment is not None  # the effect is called for by it
    return scene.environment


def _turn(scene: Scene) -> float:
    """The rotation in turns, 0 to 1."""
    return float(_of(scene).rotation / (2.0 * np.pi) % 1.0)


def _is_lit(material: Material) -> bool:
    """The surface hands on light from all around; polished mirrors, and glass, show it to their own rays alone."""
    phong = max(material.color) > 0.0 and max(material.diffuse, material.specular) > 0.0
    return phong or material.metal_rough or (material.gloss > 0.0 and material.reflect > 0.0)


def light_caller(scene: Scene) -> int | None:
    """An environment that shines on something: one that is only seen needs no samples, and none comes through fog."""
    if scene.fog is not None and scene.fog.density > 0.0:
        return None
    if scene.environment is None or not scene.environment.radiance.any() or not any(map(_is_lit, used_materials(scene))):
        return None
    return scene.environment.line


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
    switch=True,
)
ENVIRONMENT_LIGHT = Feature(
    "environment light",
    light_caller,
    "environment_light.cl",
    frame=(("environment_lit", np.int32, lambda scene: int(lit_count(row_words(_of(scene))))),),
    parameters=(
        ("environment_rows", "global const EnvironmentRow *environment_rows"),
        ("environment_columns", "global const uint *environment_columns"),
    ),
    sampled=True,
    needs=(ENVIRONMENT,),
    switch=True,
)
ENVIRONMENT_SHADOWS = Feature(
    "environment shadows",
    lambda scene: light_caller(scene) if can_shadow(scene) else None,
    "environment_shadow.cl",
    rays=("shadow",),
    needs=(ENVIRONMENT_LIGHT,),
)
