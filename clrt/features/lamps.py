"""Lights without a size: point lights, spots, suns, and the hard shadows that they throw."""

from __future__ import annotations

import numpy as np

from clrt.features.feature import REAL, Feature
from clrt.features.shapes import can_shadow
from clrt.scene.model import Scene


def _light_caller(scene: Scene) -> int | None:
    return min((light.line for light in scene.lights_with_position), default=None)


def _spot_caller(scene: Scene) -> int | None:
    return min((spot.line for spot in scene.spots), default=None)


def _falloff_caller(scene: Scene) -> int | None:
    return min((light.line for light in scene.lights_with_position if light.falloff), default=None)


def sun_caller(scene: Scene) -> int | None:
    """The first sun; none in fog, through which no light comes from infinitely far away."""
    if scene.fog is not None and scene.fog.density > 0.0:
        return None
    return min((sun.line for sun in scene.suns), default=None)


def _shadow_caller(scene: Scene) -> int | None:
    return _light_caller(scene) if can_shadow(scene) else None


DIRECT_LIGHT = Feature(
    "direct light",
    _light_caller,
    "light_point.cl",
    frame=(("light_count", np.int32, lambda scene: len(scene.lights_with_position)),),
    parameters=(("lights", "global const Light *lights"),),
)
SHADOWS = Feature(
    "shadows",
    _shadow_caller,
    "shadow.cl",
    parameters=(("light_planes", "global const EdgePlanes *light_planes"),),
    rays=("shadow",),
    needs=(DIRECT_LIGHT,),
    switch=True,
)
SPOT = Feature(
    "spot", _spot_caller, "spot.cl", early=True, light=(("axis", REAL, (3,)), ("edge", REAL), ("slope", REAL)), needs=(DIRECT_LIGHT,)
)
FALLOFF = Feature("falloff", _falloff_caller, "falloff.cl", early=True, light=(("falloff", np.int32),), needs=(DIRECT_LIGHT,))
SUN = Feature(
    "sun",
    sun_caller,
    "sun.cl",
    frame=(("sun_count", np.int32, lambda scene: len(scene.suns)),),
    parameters=(("suns", "global const Sun *suns"),),
)
SUN_SHADOWS = Feature(
    "sun shadows",
    lambda scene: sun_caller(scene) if can_shadow(scene) else None,
    "sun_visible.cl",
    parameters=(("sun_planes", "global const ParallelPlanes *sun_planes"),),
    rays=("shadow",),
    needs=(SUN,),
)
