"""Effects of rough surfaces: gloss of mirrors and glass, metal-rough materials."""

from __future__ import annotations

import numpy as np

from clrt.features import cutouts, surfaces
from clrt.features.feature import REAL, Feature, Joint, used_materials
from clrt.scene.model import Scene


def _gloss_caller(scene: Scene) -> int | None:
    lines = [m.gloss_line for m in used_materials(scene) if m.gloss > 0.0 and (m.reflect > 0.0 or m.refract > 0.0)]
    return min(lines) if lines and scene.depth > 0 else None


def _metal_caller(scene: Scene) -> int | None:
    return min((m.metal_rough_line for m in used_materials(scene) if m.metal_rough), default=None)


def _metal_map_caller(scene: Scene) -> int | None:
    return min((m.metal_rough_line for m in used_materials(scene) if m.metal_rough and m.metal_rough_map >= 0), default=None)


GLOSS = Feature("gloss", _gloss_caller, "gloss.cl", material=(("gloss", REAL),), rays=("gloss",), sampled=True)
GLOSS_MIRROR = Feature("gloss mirror", _gloss_caller, "gloss_mirror.cl", needs=(GLOSS, surfaces.MIRROR), helper=True)
GLOSS_GLASS = Feature(
    "gloss glass",
    _gloss_caller,
    "gloss_refraction.cl",
    parameters=(("glass_albedos", "global const real *glass_albedos"),),
    needs=(GLOSS, surfaces.REFRACTION),
    helper=True,
)
GLOSS_FRESNEL = Feature("gloss fresnel", _gloss_caller, "gloss_fresnel.cl", needs=(GLOSS_GLASS, surfaces.FRESNEL), helper=True)
METAL_ROUGH = Feature(
    "metal rough",
    _metal_caller,
    "metal_rough.cl",
    early=True,
    material=(("metal_rough", np.int32), ("metallic", REAL), ("roughness", REAL)),
    parameters=(("diffuse_shares", "global const real *diffuse_shares"),),
)
METAL_OPACITY = Feature(
    "metal opacity", Joint((METAL_ROUGH, cutouts.OPACITY_SHADOWS), every=True), "metal_opacity.cl", early=True, helper=True
)
METAL_MAP = Feature(
    "metal map",
    _metal_map_caller,
    "metal_rough_map.cl",
    material=(("metal_rough_map", np.int32),),
    needs=(METAL_ROUGH, cutouts.PICTURES),
    helper=True,
)
METAL_RAY = Feature(
    "metal shine",
    lambda scene: _metal_caller(scene) if scene.depth > 0 else None,
    "metal_rough_ray.cl",
    rays=("gloss",),
    branches=1,
    sampled=True,
    needs=(METAL_ROUGH,),
    helper=True,
)
