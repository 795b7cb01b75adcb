"""Objects that are seen through a transform, and the tree over the boxes of all there is."""

from __future__ import annotations

import numpy as np

from clrt.features.feature import Feature, Joint
from clrt.features.motion import MOTION
from clrt.features.shapes import SMOOTH
from clrt.scene.model import Scene
from clrt.scene.placed import placement_count, shown

MANY = 16  #: objects and spheres from which on a tree over their boxes is faster than to ask each (docs/kdtree.md has the measurement)


def _instance_caller(scene: Scene) -> int | None:
    return min((instance.line for instance in scene.instances), default=None)


def _many_caller(scene: Scene) -> int | None:
    return 0 if int(shown(scene).sum()) + len(scene.spheres) >= MANY else None


INSTANCES = Feature("instances", _instance_caller, "instance.cl", early=True)
#: effects by which objects are seen through a transform
PLACED = Feature(
    "placed",
    Joint((INSTANCES, MOTION)),
    "placed.cl",
    early=True,
    parameters=(("placements", "global const Placement *placements"), ("object_origins", "global const double *object_origins")),
    helper=True,
)
PLACED_SMOOTH = Feature("placed smooth", Joint((PLACED, SMOOTH), every=True), "placed_smooth.cl", early=True, helper=True)
PLACED_BACK = Feature("placed back", PLACED.called_by, "placed_back.cl", early=True, helper=True)
_MANY = Feature("many objects", _many_caller, "object_tree.cl")
OBJECT_TREE = Feature(
    "object tree",
    Joint((PLACED, _MANY)),
    "object_tree.cl",
    early=True,
    frame=(("tree_solids", np.int32, lambda scene: len(scene.objects) + placement_count(scene)),),
    parameters=(("object_tree", "global const Object *object_tree"),),
    replaces="scene.cl",
    helper=True,
)
