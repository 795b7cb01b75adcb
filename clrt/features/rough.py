"""Effects of rough surfaces: gloss of mirrors and glass."""

from __future__ import annotations

from clrt.features import surfaces
from clrt.features.feature import REAL, Feature, used_materials
from clrt.scene.model import Scene


def _gloss_caller(scene: Scene) -> int | None:
    lines = [m.gloss_line for m in used_materials(scene) if m.gloss > 0.0 and (m.reflect > 0.0 or m.refract > 0.0)]
    return min(lines) if lines and scene.depth > 0 else None


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
