"""Fog: what is between the surfaces."""

from __future__ import annotations

from clrt.features import cutouts, lamps, sampled
from clrt.features.feature import REAL, Feature, Joint
from clrt.scene.model import Fog, Scene


def fog_caller(scene: Scene) -> int | None:
    """The line `fog`, where there is any."""
    return scene.fog.line if scene.fog is not None and scene.fog.density > 0.0 else None


def _of(scene: Scene) -> Fog:
    return scene.fog if scene.fog is not None else Fog(0.0)


FOG = Feature(
    "fog",
    fog_caller,
    "fog.cl",
    frame=(
        ("fog_density", REAL, lambda scene: _of(scene).density),
        ("fog_albedo", REAL, (3,), lambda scene: _of(scene).albedo),
        ("fog_asymmetry", REAL, lambda scene: _of(scene).asymmetry),
    ),
    sampled=True,
    switch=True,
)
FOG_POINT = Feature("fog point", Joint((FOG, lamps.DIRECT_LIGHT), every=True), "fog_point.cl", helper=True)
FOG_AREA = Feature("fog area", Joint((FOG, sampled.AREA_LIGHT), every=True), "fog_area.cl", helper=True)
FOG_OPACITY = Feature("fog opacity", Joint((FOG, cutouts.OPACITY_SHADOWS), every=True), "fog_opacity.cl", helper=True)
