"""Effects of materials: mirrors, glass, pictures."""

from __future__ import annotations

import numpy as np

from clrt.features.feature import REAL, Feature, material_caller, used_materials
from clrt.scene.model import Scene


def _fresnel_caller(scene: Scene) -> int | None:
    lines = [m.fresnel_line for m in used_materials(scene) if m.fresnel and m.refract > 0.0]
    return min(lines) if lines and scene.depth > 0 else None


def _absorption_caller(scene: Scene) -> int | None:
    lines = [m.absorb_line for m in used_materials(scene) if m.refract > 0.0 and max(m.absorb) > 0.0]
    return min(lines) if lines and scene.depth > 0 else None


def _texture_caller(scene: Scene) -> int | None:
    return min((scene.textures[m.texture].line for m in used_materials(scene) if m.texture >= 0), default=None)


REFRACTION = Feature(
    "refraction",
    material_caller("refract"),
    "refraction.cl",
    material=(("refract", REAL), ("ior", REAL)),
    parameters=(("media", "global const int *media"),),
    rays=("refracted", "internal"),
    branches=1,
)
FRESNEL = Feature("fresnel", _fresnel_caller, "fresnel.cl", material=(("fresnel", np.int32),), rays=("fresnel",), needs=(REFRACTION,))
ABSORPTION = Feature(
    "absorption",
    _absorption_caller,
    "absorb.cl",
    parameters=(("absorption", "global const real *absorption"),),
    needs=(REFRACTION,),
)
MIRROR = Feature("mirror", material_caller("reflect"), "mirror.cl", material=(("reflect", REAL),), rays=("mirror",))
TEXTURES = Feature(
    "textures",
    _texture_caller,
    "texture_tint.cl",
    material=(("texture", np.int32),),
)
