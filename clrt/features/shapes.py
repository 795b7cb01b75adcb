"""Effects of what there is to hit: spheres, smooth triangles."""

from __future__ import annotations

import numpy as np

from clrt.features.feature import Feature
from clrt.scene.model import Scene


def _smooth_caller(scene: Scene) -> int | None:
    return min((o.line for o in scene.objects if o.vertex_normals is not None), default=None)


def can_shadow(scene: Scene) -> bool:
    """Something can stand in a light's way: a lone flat triangle cannot shadow itself, a curved one and a sphere can."""
    return scene.triangle_count > 1 or len(scene.instances) > 0 or len(scene.spheres) > 0 or _smooth_caller(scene) is not None


SPHERES = Feature(
    "spheres",
    lambda scene: scene.spheres.line if len(scene.spheres) else None,
    "sphere.cl",
    early=True,
    frame=(("sphere_count", np.int32, lambda scene: len(scene.spheres)),),
    parameters=(("spheres", "global const Sphere *spheres"),),
)
SMOOTH = Feature("smooth", _smooth_caller, "smooth.cl", early=True, parameters=(("corner_normals", "global const real *corner_normals"),))
