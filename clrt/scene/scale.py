"""A scene in other units: all its lengths times a power of two, which rounds nothing.

Tests of rays multiply three lengths in float32, whose range ends near 2^127: a scene that is told in micrometres or in
kilometres is brought to a size near 1 first. The picture is the same, whatever the unit.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from clrt.scene.model import FloatArray, Lens, Material, PointLight, Scene, SpotLight

_ORDINARY = 20  #: scenes between 2^-20 and 2^20 stay as they are: their products stay within 2^-60 and 2^60


def size_exponent(scene: Scene) -> int:
    """e with the size of the scene in [2^(e-1), 2^e): the longest side of its triangles' boxes or the greatest radius."""
    lo, hi = scene.boxes
    sizes = [float((hi / 2.0 - lo / 2.0).max()) * 2.0] if len(lo) else []
    sizes += [float(scene.spheres.radii.max())] if len(scene.spheres) else []
    largest = max(sizes, default=0.0)
    return int(np.frexp(largest)[1]) if 0.0 < largest < np.inf else 0


def at_working_size(scene: Scene) -> Scene:
    """The scene itself, or, where its size would overflow or underflow float32, the same scene at a size near 1."""
    exponent = size_exponent(scene)
    return scene if abs(exponent) <= _ORDINARY else scaled(scene, -exponent)


def scaled(scene: Scene, exponent: int) -> Scene:
    """All lengths of `scene` times 2^exponent, and what is given a length divided by it. Directions, angles, colours and indices stay."""

    def times(values: FloatArray) -> FloatArray:
        return np.asarray(np.ldexp(values, exponent))

    def moved(light: PointLight | SpotLight) -> PointLight | SpotLight:
        x, y, z = times(np.asarray(light.position, np.float64)).tolist()
        red, green, blue = np.ldexp(light.color, 2 * exponent if light.falloff else 0).tolist()
        return replace(light, position=(x, y, z), color=(red, green, blue))

    def thinned(material: Material) -> Material:
        red, green, blue = np.ldexp(material.absorb, -exponent).tolist()
        return replace(material, absorb=(red, green, blue))

    def way(vector: tuple[float, float, float]) -> tuple[float, float, float]:
        x, y, z = times(np.asarray(vector, np.float64)).tolist()
        return x, y, z

    def wider(lens: Lens | None) -> Lens | None:
        return lens and replace(lens, radius=math.ldexp(lens.radius, exponent), focus=math.ldexp(lens.focus, exponent))

    return replace(
        scene,
        lens=wider(scene.lens),
        fog=scene.fog and replace(scene.fog, density=math.ldexp(scene.fog.density, -exponent)),
        shutter=scene.shutter and replace(scene.shutter, eye_motion=way(scene.shutter.eye_motion)),
        materials=tuple(map(thinned, scene.materials)),
        camera=replace(scene.camera, eye=times(scene.camera.eye)),
        objects=tuple(replace(o, vertices=times(o.vertices), motion=way(o.motion)) for o in scene.objects),
        instances=tuple(replace(i, world_from_object=np.column_stack([i.world_from_object[:, :3], times(i.world_from_object[:, 3])]))
                        for i in scene.instances),
        spheres=replace(scene.spheres, centers=times(scene.spheres.centers), radii=times(scene.spheres.radii)),
        lights=tuple(light for light in map(moved, scene.lights) if isinstance(light, PointLight)),
        spots=tuple(light for light in map(moved, scene.spots) if isinstance(light, SpotLight)),
    )
