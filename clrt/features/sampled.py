"""Effects whose light is found by sampling: area lights, light from surface to surface."""

from __future__ import annotations

import math

import numpy as np

from clrt.features.feature import REAL, Feature, used_materials
from clrt.features.shapes import can_shadow
from clrt.scene.emitters import emitter_count, emitter_power
from clrt.scene.model import Scene


def area_caller(scene: Scene) -> int | None:
    """The first used material that sends out light by itself."""
    return min((m.emission_line for m in used_materials(scene) if max(m.emission) > 0.0), default=None)


def indirect_caller(scene: Scene) -> int | None:
    """The line `indirect`; also without depth, where nothing scatters: it takes the place of the ambient part."""
    return scene.indirect.line if scene.indirect is not None else None


def _clamp_caller(scene: Scene) -> int | None:
    return indirect_caller(scene) if scene.indirect is not None and scene.indirect.clamp < math.inf else None


AREA_LIGHT = Feature(
    "area light",
    area_caller,
    "arealight.cl",
    material=(("emission", REAL, (3,)),),
    frame=(("emitter_count", np.int32, emitter_count), ("emitter_power", REAL, emitter_power)),
    parameters=(("emitters", "global const Emitter *emitters"),),
    sampled=True,
)
AREA_SHADOWS = Feature(
    "area shadows",
    lambda scene: area_caller(scene) if can_shadow(scene) else None,
    "arealight_shadow.cl",
    rays=("shadow",),
    needs=(AREA_LIGHT,),
)
INDIRECT = Feature("indirect", indirect_caller, "indirect.cl", rays=("indirect",), branches=1, sampled=True, switch=True)
CLAMP = Feature(
    "clamp",
    _clamp_caller,
    "clamp.cl",
    frame=(("radiance_clamp", REAL, lambda scene: scene.indirect.clamp if scene.indirect is not None else math.inf),),
    needs=(INDIRECT,),
)
