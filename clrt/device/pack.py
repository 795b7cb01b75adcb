"""Scene and trees to the arrays that the device holds: plain NumPy of the dtypes in layout.py.

Coordinates are taken relative to a local origin in float64 before they are rounded, so that a scene far from zero loses
nothing; the numbers as given go along in float64 for the tests that need them. Triangles lie in the order in which the
trees' leaves first name them ("slots"), which keeps a leaf's triangles near each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from clrt.device import layout
from clrt.device.packed import FloatArray, Packed
from clrt.device.program import frame_dtype, material_dtype
from clrt.device.rounding import rounded_down, rounded_up
from clrt.features import Features
from clrt.kdtree.arrays import LEAF
from clrt.kdtree.joined import JoinedTrees, in_a_row, join
from clrt.kdtree.runs import leaf_runs
from clrt.kdtree.tree import KdTree
from clrt.precision import Precision
from clrt.scene.model import Scene
from clrt.scene.placed import object_origins, placed_boxes, placements

_LOWER_EMPTY, _UPPER_EMPTY = 4, 8  #: bits of an inner node's word: a child is a leaf without triangles, as a quarter of leaves are
_AT_ONCE = 1 << 14  #: triangles that numbers are made of at a time: few enough to stay in a cache


def local_origin(scene: Scene) -> FloatArray:
    """The point coordinates are rounded relative to: the middle of all triangles that are seen; without any, of the smallest sphere.

    A large sphere, such as a floor, does not move it: its centre is far from what is seen of it.
    """
    seen = np.array([len(item) > 0 and not item.hidden for item in scene.objects], np.bool_)
    lo, hi = (ends[seen] for ends in scene.boxes)
    if scene.instances:
        lo, hi = (np.concatenate(ends) for ends in zip((lo, hi), placed_boxes(scene, placements(scene), points=0.0), strict=True))
    if len(lo):
        return np.asarray(lo.min(0) / 2.0 + hi.max(0) / 2.0)
    if len(scene.spheres):
        return np.array(scene.spheres.centers[scene.spheres.radii.argmin()])
    return np.zeros(3)


def tree_origins(scene: Scene) -> FloatArray:
    """(objects, 3): the point that the coordinates of each object's tree are relative to."""
    return object_origins(scene, local_origin(scene))


def nodes_of(trees: JoinedTrees) -> NDArray[np.int32]:
    """(m, 2) int32 node words, as geometry.cl has them."""
    leaf = trees.split_axis == LEAF
    inner, hollow = np.flatnonzero(~leaf), leaf & (trees.count == 0)
    empty = np.zeros(len(leaf), np.int32)
    empty[inner] = _LOWER_EMPTY * hollow[trees.child[inner]] + _UPPER_EMPTY * hollow[trees.child[inner] + 1]
    words = np.empty((len(leaf), 2), np.int32)
    words[:, 0] = np.where(leaf, trees.child, trees.split_pos.view(np.int32))
    words[:, 1] = np.where(leaf, (trees.count << 2) | 3, (trees.child << 4) | empty | trees.split_axis)
    return words


def unit_normals(vertices: FloatArray) -> FloatArray:
    """(n, 3) unit geometric normals; zero for zero area. Edges are scaled first, so that no size over- or underflows."""
    normals = np.empty((len(vertices), 3))
    for start in range(0, len(vertices), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        normals[part] = _unit_normals(vertices[part]).T
    return normals


def _unit_normals(vertices: FloatArray) -> FloatArray:
    """(3, n)"""
    corners = _by_axis(vertices)
    a, b = corners[1] - corners[0], corners[2] - corners[0]
    for edge in (a, b):
        x, y, z = np.abs(edge)
        size = np.maximum(np.maximum(x, y), z)
        np.divide(edge, size, out=edge, where=size > 0)
    normal = np.stack([a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)])
    length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    return np.asarray(np.divide(normal, length, out=np.zeros_like(normal), where=length > 0))


def _longest_edges(vertices: FloatArray) -> FloatArray:
    """(n,) |x| + |y| + |z| of the longest edge of each triangle."""
    longest = np.empty(len(vertices))
    for start in range(0, len(vertices), _AT_ONCE):
        a, b, c = _by_axis(vertices[start : start + _AT_ONCE])
        lengths = (x + y + z for x, y, z in (np.abs(b - a), np.abs(c - b), np.abs(a - c)))
        longest[start : start + _AT_ONCE] = reduce(np.maximum, lengths)
    return longest


def _by_axis(vertices: FloatArray) -> FloatArray:
    """(3, 3, n) corners, their axes: which NumPy goes through several times as fast."""
    return np.ascontiguousarray(vertices.transpose(1, 2, 0))


def pack(scene: Scene, trees: Sequence[KdTree], features: Features, precision: Precision) -> Packed:
    """All arrays of a scene. `trees[i]` is the tree of `scene.objects[i]`, over vertices less its row of `tree_origins(scene)`."""
    real, origin = precision.real, local_origin(scene)
    joined = join(trees, [len(item) for item in scene.objects])
    order, blocks = leaf_runs(joined, layout.BOXES)
    slots = np.full(joined.triangles, -1, np.int32)
    slots[order] = np.arange(len(order), dtype=np.int32)
    owners = _owners(scene)[order]
    counts = np.bincount(owners, minlength=len(trees))
    vertices = np.take(in_a_row([item.vertices for item in scene.objects], np.float64, (3, 3)), order, 0)
    objects = _objects(trees, joined, origin, vertices, counts, real)
    return Packed(
        scene=scene,
        origin=origin,
        nodes=nodes_of(joined),
        indices=slots[joined.indices],
        blocks=blocks.astype(np.int32),
        vertices=vertices,
        objects=objects,
        surfaces=_surfaces(scene, order, owners, vertices, real),
        materials=_materials(scene, features, precision),
        frame=_frame(scene, origin, objects, len(vertices), features, precision),
        prim_ids=_prim_ids(scene, order, owners),
        order=order,
        slot_counts=counts,
        origins=object_origins(scene, origin),
        real=real,
        features=features,
        trees=tuple(trees),
    )


def _owners(scene: Scene) -> NDArray[np.int32]:
    """Of each triangle, of all objects in a row, the number of its object."""
    return np.repeat(np.arange(len(scene.objects), dtype=np.int32), [len(item) for item in scene.objects])


def _prim_ids(scene: Scene, order: NDArray[np.int64], owners: NDArray[np.int32]) -> NDArray[np.int64]:
    """Of triangles of all objects in a row, each with its object, the primitive ids."""
    counts = np.array([len(item) for item in scene.objects], np.int64)
    shifts = np.array([item.first_prim for item in scene.objects], np.int64) - (np.cumsum(counts) - counts)
    return order + shifts[owners]


def _objects(
    trees: Sequence[KdTree],
    joined: JoinedTrees,
    origin: FloatArray,
    vertices: FloatArray,
    counts: NDArray[np.int64],
    real: type[np.floating],
) -> NDArray[np.void]:
    """origin : (3,), what trees are relative to; vertices : (s, 3, 3), `counts` of each object"""
    records = np.zeros(len(trees), layout.object_record(real))
    lo, hi = np.array([(tree.lo, tree.hi) for tree in trees]).reshape(-1, 2, 3).transpose(1, 0, 2)
    records["lo"], records["hi"] = rounded_down(lo, real), rounded_up(hi, real)
    longest, some = np.zeros(len(trees)), counts > 0
    if some.any():
        longest[some] = np.maximum.reduceat(_longest_edges(vertices), (np.cumsum(counts) - counts)[some])
    # Where float64 decides, it takes the starts of rays as the world has them, rounded by 2^-53 of the way from its origin: 4u of this is
    # four times as much, so bounds hold for both.
    away = 2.0**-29 * np.abs(origin).sum()
    records["extent"] = rounded_up(np.maximum(np.abs(lo), np.abs(hi)).sum(1) + longest + away, real)
    records["root"] = joined.roots
    return records


def _surfaces(
    scene: Scene, order: NDArray[np.int64], owners: NDArray[np.int32], vertices: FloatArray, real: type[np.floating]
) -> NDArray[np.void]:
    records = np.zeros(len(vertices), layout.surface(real))
    records["geometric"] = unit_normals(vertices)
    records["prim"] = _prim_ids(scene, order, owners)
    records["normal"] = np.take(in_a_row([item.normals for item in scene.objects], np.float64, (3,)), order, 0)
    records["material"] = in_a_row([item.material_ids for item in scene.objects], np.int32)[order]
    records["object"] = owners
    return records


def _materials(scene: Scene, features: Features, precision: Precision) -> NDArray[np.void]:
    dtype = material_dtype(features, precision)
    records = np.zeros(len(scene.materials), dtype)
    for i, given in enumerate(scene.materials):
        material = given.without_phong() if given.metal_rough else given
        for member in dtype.names or ():
            records[member][i] = getattr(material, member)
    return records


def _only_material(scene: Scene) -> int:
    """The material that all triangles have; -1 where they have several, or there are none."""
    ids = [item.material_ids for item in scene.objects if len(item)]
    first = int(ids[0][0]) if ids else -1
    return first if all(bool((of == first).all()) for of in ids) else -1


def _frame(
    scene: Scene, origin: FloatArray, objects: NDArray[np.void], slots: int, features: Features, precision: Precision
) -> NDArray[np.void]:
    camera = scene.camera
    ul, ur, ll, lr = camera.corners / np.abs(camera.corners).max()
    record = np.zeros(1, frame_dtype(features, precision))
    values = {
        "eye": camera.eye, "local_origin": origin, "eye_local": camera.eye - origin, "corner": ul, "along_row": ur - ul,
        "along_column": ll - ul, "twist": ul - ur - ll + lr, "background": scene.background,
        "extent": objects["extent"].max(initial=0.0), "width": camera.width, "height": camera.height,
        "object_count": len(objects), "triangle_slots": slots, "only_material": _only_material(scene),
    }  # fmt: skip
    values |= {name: value(scene) for f in features.active if not features.idle(f) for name, *_, value in f.frame}
    values |= {f.switch_name: not features.idle(f) for f in features.switches}
    for name, value in values.items():
        record[name] = value
    return record
