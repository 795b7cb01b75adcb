"""The arrays of placed.cl and object_tree.cl: objects that are seen through a transform, and the tree over the boxes of all there is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.device import layout
from clrt.device.packed import FloatArray, Packed
from clrt.device.rounding import rounded_down, rounded_up
from clrt.kdtree.boxtree import NOTHING, build_box_tree
from clrt.scene import placed

BOX_POINTS = 2e8  #: instances times corners of triangles up to which boxes are tight: about a second
_FIRST_LEAF = -2
#: what rays may be off where they meet the box of a placement, in roundings of the longest way: 2 + 3 of origin and box, 2 + 3 of
#: direction and length in object space (placed.cl), and as much again
_PLACED_SLACK = 20.0


def placements(packed: Packed) -> NDArray[np.void]:
    """One record a placement."""
    found = placed.placements(packed.scene)
    records = np.zeros(len(found), layout.placement(packed.real))
    if not len(found):
        return records
    matrices = placed.object_from_world(found, packed.origin, packed.origins)
    records["object_from_world"] = matrices.reshape(-1, 12)
    records["stretch"] = np.linalg.svd(matrices[:, :, :3], compute_uv=False).max(1)
    records["motion"], records["object"], records["medium"] = found.motion, found.object, found.medium
    return records


def object_origins(packed: Packed) -> FloatArray:
    """(objects, 3): what the coordinates of each object are relative to."""
    return packed.origins


def object_tree(packed: Packed) -> NDArray[np.void]:
    """The nodes of the tree, as object_tree.cl has them."""
    places, lo, hi = _boxes(packed)
    tree = build_box_tree(lo, hi)
    records = np.zeros(len(tree.child), layout.object_record(packed.real))
    records["lo"], records["hi"] = rounded_down(tree.lo, packed.real), rounded_up(tree.hi, packed.real)
    records["extent"] = rounded_up(np.maximum(np.abs(tree.lo), np.abs(tree.hi)).sum(1), packed.real)
    leaf = tree.child <= _FIRST_LEAF
    records["root"] = tree.child
    records["root"][leaf] = _FIRST_LEAF - places[_FIRST_LEAF - tree.child[leaf]] if len(places) else NOTHING
    return records


def _boxes(packed: Packed) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Places and boxes, relative to the local origin: objects at their own place, placements, spheres."""
    scene = packed.scene
    there = np.flatnonzero(placed.shown(scene) & np.array([len(item) > 0 for item in scene.objects], np.bool_))
    found, spheres = placed.placements(scene), scene.spheres
    lo, hi = placed.placed_boxes(scene, found, points=BOX_POINTS)
    radii, centers = spheres.radii[:, None], spheres.centers - packed.origin
    first = len(scene.objects)
    places = np.concatenate([there, first + np.arange(len(found)), first + len(found) + np.arange(len(spheres))])
    lows = np.concatenate([packed.objects["lo"][there].astype(np.float64), lo - packed.origin, centers - radii])
    highs = np.concatenate([packed.objects["hi"][there].astype(np.float64), hi - packed.origin, centers + radii])
    slack = _PLACED_SLACK * np.finfo(packed.real).eps / 2.0 * _longest_way(packed, lows, highs)
    shifted = slice(len(there), len(there) + len(found))
    lows[shifted] -= slack
    highs[shifted] += slack
    return places, lows, highs


def _longest_way(packed: Packed, lo: FloatArray, hi: FloatArray) -> float:
    """Bounds |x| + |y| + |z| of all points, and of where rays start: eye, lights, surfaces."""
    scene = packed.scene
    starts = [scene.camera.eye, *(np.asarray(light.position) for light in scene.lights_with_position)]
    reach = max(float(np.abs(start - packed.origin).sum()) for start in starts)
    shutter = scene.shutter
    moves = 0.0
    if shutter is not None:
        moves = float(np.abs(np.multiply(shutter.eye_motion, [[shutter.open], [shutter.close]])).sum(1).max())
    lens = 0.0 if scene.lens is None else 3.0 * scene.lens.radius
    return max(reach + moves + lens, float(np.maximum(np.abs(lo), np.abs(hi)).sum(1).max(initial=0.0)))
