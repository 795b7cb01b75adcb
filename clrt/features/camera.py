"""Effects of how the eye looks: samples of a pixel."""

from __future__ import annotations

from clrt.features.feature import REAL, Feature
from clrt.scene.model import Scene


def _samples_caller(scene: Scene) -> int | None:
    return scene.samples_line if scene.samples > 1 else None


SAMPLES = Feature(
    "samples",
    _samples_caller,
    "antialias.cl",
    frame=(("pixel_spread", REAL, lambda scene: float(scene.samples > 1)),),
    sampled=True,
)
