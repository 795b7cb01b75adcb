"""Parts that effects share: each is in a program where an effect in need of it is."""

from __future__ import annotations

import numpy as np

from clrt.features import camera, surfaces
from clrt.features.feature import Caller, Feature, first_line

#: effects that draw random numbers
_SAMPLED: tuple[Feature, ...] = (camera.SAMPLES,)
#: effects that send rays on from a hit
_BOUNCING: tuple[Feature, ...] = (surfaces.MIRROR, surfaces.REFRACTION)


def _any_of(features: tuple[Feature, ...]) -> Caller:
    return first_line(*(f.called_by for f in features))


SAMPLER = Feature("sampler", _any_of(_SAMPLED), "sampler.cl", helper=True)
SAMPLING = Feature(
    "sampling",
    _any_of(_SAMPLED),
    "sampling.cl",
    frame=(("seed", np.int32, lambda scene: np.uint32(scene.seed).astype(np.int32)),),
    parameters=(("sample_range", "global const int *sample_range"), ("sample_sums", "global double *sample_sums")),
    helper=True,
)
GLOBE = Feature("globe", surfaces.globe_caller, "globe.cl", helper=True)
BOUNCE = Feature(
    "bounce", _any_of(_BOUNCING), "bounce.cl", frame=(("depth", np.int32, lambda scene: scene.depth),), branches=1, helper=True
)
