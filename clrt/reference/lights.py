"""What sets suns and spots apart from point lights: where their light comes from, and how much of it goes where (docs/conventions.md)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.reference.geometry import Primitives
from clrt.scene.model import PointLight, Scene, SpotLight, SunLight

FloatArray = NDArray[np.float64]
Light = PointLight | SpotLight | SunLight

FAR = 1e3  #: a sun stands this many times the greatest coordinate away from each hit: beyond every primitive
SHARP = 0.05  #: radians; a rim narrower than this magnifies errors of angles so much that it counts as an edge


def lights_of(scene: Scene) -> tuple[Light, ...]:
    """All lights that are not sampled."""
    return (*scene.lights, *scene.spots, *scene.suns)


def positions(light: Light, prims: Primitives, point: FloatArray) -> FloatArray:
    """(m, 3): where the light stands as seen from the points (m, 3)."""
    if isinstance(light, SunLight):
        reach = max(prims.largest, float((np.abs(prims.centers).max(axis=1, initial=0.0) + prims.radii).max(initial=0.0)))
        return np.asarray(point + FAR * reach * np.array(light.direction))
    return np.broadcast_to(np.array(light.position), point.shape)


def cone(light: Light, to_light: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The part of the light that a spot's cone lets through (m,), and the angle to its edge if that is a hard one (m,), else inf.

    to_light : (m, 3) unit. With h = 1 - cos of the angle to the axis, from 0 at the cone's edge to 1 at its bright part:
    s = (h_outer - h) / (h_outer - h_inner), and s^2 (3 - 2 s) is let through.
    """
    if not isinstance(light, SpotLight) or light.inner >= np.pi:
        return np.ones(len(to_light)), np.full(len(to_light), np.inf)
    angle = 2.0 * np.arcsin(np.minimum(np.linalg.norm(to_light + np.array(light.direction), axis=1) / 2.0, 1.0))
    # cos a - cos b = 2 sin((b + a) / 2) sin((b - a) / 2): no cancellation.
    above = 2.0 * np.sin((light.outer + angle) / 2.0) * np.sin((light.outer - angle) / 2.0)
    rim = 2.0 * np.sin((light.outer + light.inner) / 2.0) * np.sin((light.outer - light.inner) / 2.0)
    s = np.clip(above / rim, 0.0, 1.0) if rim > 0.0 else (above > 0.0).astype(np.float64)
    gap = np.maximum(np.maximum(angle - light.outer, light.inner - angle), 0.0)
    hard = light.outer - light.inner < SHARP
    return s * s * (3.0 - 2.0 * s), gap if hard else np.full(len(gap), np.inf)


def falloff(light: Light, distance: FloatArray) -> FloatArray:
    """(m,): 1 / distance^2 for a light that falls off, else 1; 0 at the light itself, where nothing is lit."""
    if isinstance(light, SunLight) or not light.falloff:
        return np.ones(len(distance))
    return np.divide(1.0, distance * distance, where=distance > 0.0, out=np.zeros(len(distance)))
