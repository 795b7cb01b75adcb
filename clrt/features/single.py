"""Rays that go apart, one by one through wide trees: where a scene has so many of them that the trees are worth their making."""

from __future__ import annotations

from clrt.features import rough, sampled, surroundings
from clrt.features.feature import Feature, Joint
from clrt.scene.model import Scene

#: samples of pixels, a triangle, from which on wide trees pay. Measured: a triangle takes 1 us to put into them; the rays of a sample of a
#: pixel save 0.2 to 1.1 us of processor time, which two cores share, over any mesh from 12 triangles on (docs/performance.md)
SAMPLES_A_TRIANGLE = 4
MOST_TRIANGLES = 1 << 22  #: wide trees take about 200 bytes a triangle

#: effects whose rays leave a surface in drawn directions
_DRAWN: tuple[Feature, ...] = (
    sampled.INDIRECT, sampled.AREA_SHADOWS, surroundings.ENVIRONMENT_SHADOWS, rough.GLOSS, rough.METAL_RAY,
)  # fmt: skip


def _many_caller(scene: Scene) -> int | None:
    rays = scene.camera.width * scene.camera.height * scene.samples
    return 0 if SAMPLES_A_TRIANGLE * scene.triangle_count <= rays and 0 < scene.triangle_count <= MOST_TRIANGLES else None


_MANY = Feature("many rays", _many_caller, "single.cl")
_CALLS = Joint((Joint(_DRAWN), _MANY), every=True)
BLOCKS = Feature("blocks", _CALLS, "blocks.cl", early=True, helper=True)
SINGLE = Feature(
    "single rays",
    _CALLS,
    "single.cl",
    early=True,
    parameters=(
        ("wide_nodes", "global const WideNode *wide_nodes"),
        ("wide_blocks", "global const Block *wide_blocks"),
        ("wide_roots", "global const int *wide_roots"),
    ),
    helper=True,
    switch=True,
)
