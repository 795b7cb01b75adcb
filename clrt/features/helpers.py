"""Parts that effects share: each is in a program where an effect in need of it is."""

from __future__ import annotations

import numpy as np

from clrt.features import camera, cutouts, lamps, motion, rough, sampled, shapes, surfaces, surroundings, volume
from clrt.features.feature import Feature, Joint

#: effects that draw random numbers
_SAMPLED: tuple[Feature, ...] = (
    camera.SAMPLES, camera.LENS, motion.MOTION, motion.EYE_MOTION, sampled.AREA_LIGHT, sampled.INDIRECT,
    surroundings.ENVIRONMENT_LIGHT, rough.GLOSS, rough.METAL_RAY, volume.FOG,
)  # fmt: skip
#: effects that send rays on from a hit
_BOUNCING: tuple[Feature, ...] = (
    surfaces.MIRROR, surfaces.REFRACTION, cutouts.OPACITY_SEEN, sampled.INDIRECT, rough.GLOSS, rough.METAL_RAY,
)  # fmt: skip
#: effects that draw at the hits of rays, not only at the eye
_DRAWING: tuple[Feature, ...] = (
    sampled.AREA_LIGHT, sampled.INDIRECT, surroundings.ENVIRONMENT_LIGHT, rough.GLOSS, rough.METAL_RAY, volume.FOG,
)  # fmt: skip
#: effects that weigh red, green and blue of a ray apart
_TINTING: tuple[Feature, ...] = (surfaces.ABSORPTION, sampled.INDIRECT, rough.METAL_RAY)
#: effects that add light without the surface's colour
_ADDING: tuple[Feature, ...] = (sampled.AREA_LIGHT,)
#: effects that ask whether a hit sees a light, from the hit
_REACHING: tuple[Feature, ...] = (lamps.SUN_SHADOWS, sampled.AREA_SHADOWS, surroundings.ENVIRONMENT_SHADOWS)
#: effects that draw directions to lights; those whose drawn rays may meet these lights, too
_LIGHT_DRAWING: tuple[Feature, ...] = (sampled.AREA_LIGHT, surroundings.ENVIRONMENT_LIGHT)
_RAY_DRAWING: tuple[Feature, ...] = (sampled.INDIRECT, rough.GLOSS, rough.METAL_RAY)


def _any_of(features: tuple[Feature | Joint, ...]) -> Joint:
    return Joint(features)


def _all_of(*parts: Feature | Joint) -> Joint:
    return Joint(parts, every=True)


SAMPLER = Feature("sampler", _any_of(_SAMPLED), "sampler.cl", helper=True)
SAMPLING = Feature(
    "sampling",
    _any_of(_SAMPLED),
    "sampling.cl",
    frame=(("seed", np.int32, lambda scene: np.uint32(scene.seed).astype(np.int32)),),
    parameters=(("sample_range", "global const int *sample_range"), ("sample_sums", "global double *sample_sums")),
    helper=True,
)
#: rays from the eye do not share their origin
WIDE_EYE = Feature("wide eye", _any_of((camera.LENS, motion.EYE_MOTION)), "wide_eye.cl", helper=True, switch=True)
BOUNCE = Feature(
    "bounce", _any_of(_BOUNCING), "bounce.cl", frame=(("depth", np.int32, lambda scene: scene.depth),), branches=1, helper=True
)
PATH = Feature("path", _any_of(_DRAWING), "path.cl", helper=True)
PATH_BOUNCE = Feature("path bounce", _all_of(PATH, BOUNCE), "path_bounce.cl", helper=True)
THROUGHPUT = Feature("throughput", _any_of(_TINTING), "throughput.cl", helper=True)
FOG_TINT = Feature("fog tint", _all_of(volume.FOG, THROUGHPUT), "fog_tint.cl", helper=True)
FOG_ABSORPTION = Feature("fog absorption", _all_of(volume.FOG, surfaces.ABSORPTION), "fog_absorb.cl", helper=True)
ADDED = Feature("added", _any_of((*_ADDING, _all_of(rough.GLOSS, _any_of(_LIGHT_DRAWING)))), "added.cl", helper=True)
REACH = Feature("reach", _any_of(_REACHING), "reach.cl", helper=True)
SCATTER = Feature("scatter", _any_of(_LIGHT_DRAWING), "scatter.cl", helper=True)
FACETS = Feature(
    "facets", _any_of((rough.GLOSS, rough.METAL_ROUGH)), "ggx.cl", early=True, helper=True,
    parameters=(("facet_albedos", "global const real *facet_albedos"),),
)  # fmt: skip
MIS = Feature("mis", _all_of(_any_of(_LIGHT_DRAWING), _any_of(_RAY_DRAWING)), "mis.cl", helper=True)
#: surfaces that let light samples through, but not rays
LIGHTS_ALONE = Feature("lights alone", _all_of(cutouts.SHADOW_PANES, MIS), "mis_lights.cl", helper=True, switch=True)
#: surfaces that let light samples through farther than rays
PANES = Feature("panes", _all_of(cutouts.OPACITY_SEEN, MIS, sampled.INDIRECT), "mis_panes.cl", helper=True, switch=True)
GLOSS_LIGHT = Feature("gloss light", _all_of(rough.GLOSS_MIRROR, SCATTER), "gloss_light.cl", helper=True)
METAL_LIGHT = Feature("metal light", _all_of(rough.METAL_ROUGH, SCATTER), "metal_rough_light.cl", helper=True)
METAL_MIS = Feature("metal mis", _all_of(METAL_LIGHT, rough.METAL_RAY), "metal_rough_mis.cl", helper=True)
METAL_INDIRECT = Feature(
    "metal indirect", _all_of(rough.METAL_ROUGH, sampled.INDIRECT), "metal_rough_indirect.cl", branches=1, helper=True
)
AREA_MIS = Feature(
    "area light mis", _all_of(sampled.AREA_LIGHT, MIS), "arealight_mis.cl", material=(("emission_drawn", np.int32),), helper=True
)
AREA_SPHERE = Feature("round area light", _all_of(AREA_MIS, shapes.SPHERES), "arealight_sphere.cl", helper=True)
ENVIRONMENT_MIS = Feature("environment mis", _all_of(surroundings.ENVIRONMENT_LIGHT, MIS), "environment_mis.cl", helper=True)
