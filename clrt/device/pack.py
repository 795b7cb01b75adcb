"""Scene and trees to the arrays that the device holds: plain NumPy of the dtypes in layout.py.

Coordinates are taken relative to a local origin in float64 before they are rounded, so that a scene far from zero loses
nothing; the numbers as given go along in float64 for the tests that need them. Triangles lie in the order in which the
trees' leaves first name them ("slots"), which keeps a leaf's triangles near each other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from clrt.device import layout
from clrt.device.packed import FloatArray, Packed
from clrt.device.program import frame_dtype, material_dtype
from clrt.device.rounding import rounded_down, rounded_up
from clrt.errors import LimitError
from clrt.features import Features
from clrt.kdtree.arrays import LEAF
from clrt.kdtree.runs import leaf_runs
from clrt.kdtree.tree import KdTree
from clrt.precision import Precision
from clrt.scene.model import MeshObject, Scene
from clrt.scene.placed import object_origins, placed_boxes, placements

_LOWER_EMPTY, _UPPER_EMPTY = 4, 8  #: bits of an inner node's word: a child is a leaf without triangles, as a quarter of leaves are
MOST_NODES = 1 << 27  #: of all trees together


def local_origin(scene: Scene) -> FloatArray:
    """The point coordinates are rounded relative to: the middle of all triangles that are seen; without any, of the smallest sphere.

    A large sphere, such as a floor, does not move it: its centre is far from what is seen of it.
    """
    boxes = [o.box for o in scene.objects if len(o) and not o.hidden]
    if scene.instances:
        boxes += zip(*placed_boxes(scene, placements(scene), points=0.0), strict=True)
    if boxes:
        lo = np.min([b[0] for b in boxes], 0)
        hi = np.max([b[1] for b in boxes], 0)
        return np.asarray(lo / 2.0 + hi / 2.0)
    if len(scene.spheres):
        return np.array(scene.spheres.centers[scene.spheres.radii.argmin()])
    return np.zeros(3)


def tree_origins(scene: Scene) -> FloatArray:
    """(objects, 3): the point that the coordinates of each object's tree are relative to."""
    return object_origins(scene, local_origin(scene))


def nodes_of(tree: KdTree, first_node: int, first_index: int) -> NDArray[np.int32]:
    """(m, 2) int32 node words, as geometry.cl has them. Raises LimitError where a child's number has no room."""
    if first_node + len(tree.split_axis) > MOST_NODES:
        raise LimitError(f"the trees of the scene have more than {MOST_NODES:,} nodes; leave some of its triangles out")
    leaf = tree.split_axis == LEAF
    inner, hollow = np.flatnonzero(~leaf), leaf & (tree.count == 0)
    empty = np.zeros(len(leaf), np.int32)
    empty[inner] = _LOWER_EMPTY * hollow[tree.child[inner]] + _UPPER_EMPTY * hollow[tree.child[inner] + 1]
    words = np.empty((len(leaf), 2), np.int32)
    words[:, 0] = np.where(leaf, tree.child + first_index, tree.split_pos.view(np.int32))
    words[:, 1] = np.where(leaf, (tree.count << 2) | 3, ((tree.child + first_node) << 4) | empty | tree.split_axis)
    return words


def unit_normals(vertices: FloatArray) -> FloatArray:
    """(n, 3) unit geometric normals; zero for zero area. Edges are scaled first, so that no size over- or underflows."""
    e1, e2 = vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0]
    for e in (e1, e2):
        x, y, z = np.abs(e).T
        size = np.maximum(np.maximum(x, y), z)[:, None]
        np.divide(e, size, out=e, where=size > 0)
    normal = np.cross(e1, e2)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(np.divide(normal, length, out=np.zeros_like(normal), where=length > 0))


def pack(scene: Scene, trees: Sequence[KdTree], features: Features, precision: Precision) -> Packed:
    """All arrays of a scene. `trees[i]` is the tree of `scene.objects[i]`, over vertices less its row of `tree_origins(scene)`."""
    real, origin = precision.real, local_origin(scene)
    nodes, indices, orders, blocks = [], [], [], []
    objects = np.zeros(len(trees), layout.object_record(real))
    node = index = slot = 0
    for number, (item, tree) in enumerate(zip(scene.objects, trees, strict=True)):
        order, parts = leaf_runs(tree, len(item), layout.BOXES)
        slots = np.full(len(item), -1, np.int64)
        slots[order] = np.arange(len(order))
        objects[number] = _object_record(item, tree, node, real)
        nodes.append(nodes_of(tree, node, index))
        indices.append((slots[tree.indices] + slot).astype(np.int32))
        orders.append(order)
        blocks.append(parts + np.array([slot, 0]))
        node, index, slot = node + len(tree.split_axis), index + len(tree.indices), slot + len(order)
    given = [np.take(item.vertices, order, 0) for item, order in zip(scene.objects, orders, strict=True)]
    vertices = np.concatenate(given) if given else np.zeros((0, 3, 3))
    return Packed(
        scene=scene,
        origin=origin,
        nodes=np.concatenate(nodes) if nodes else np.zeros((0, 2), np.int32),
        indices=np.concatenate(indices) if indices else np.zeros(0, np.int32),
        blocks=np.concatenate(blocks).astype(np.int32) if blocks else np.zeros((0, 2), np.int32),
        vertices=vertices,
        objects=objects,
        surfaces=_surfaces(scene, orders, vertices, real),
        materials=_materials(scene, features, precision),
        frame=_frame(scene, origin, objects, len(vertices), features, precision),
        prim_ids=_prim_ids(scene, orders),
        orders=tuple(orders),
        origins=object_origins(scene, origin),
        real=real,
        features=features,
        trees=tuple(trees),
    )


def _prim_ids(scene: Scene, orders: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.concatenate([o.first_prim + k for o, k in zip(scene.objects, orders, strict=True)] or [np.zeros(0, np.int64)])


def _object_record(item: MeshObject, tree: KdTree, root: int, real: type[np.floating]) -> NDArray[np.void]:
    record = np.zeros((), layout.object_record(real))
    record["lo"], record["hi"] = rounded_down(tree.lo, real), rounded_up(tree.hi, real)
    edges = (np.abs(item.vertices[:, (c + 1) % 3] - item.vertices[:, c]).T for c in range(3))
    longest = max((x + y + z).max(initial=0.0) for x, y, z in edges)
    reach = np.maximum(np.abs(tree.lo), np.abs(tree.hi)).sum() + longest
    record["extent"] = rounded_up(np.asarray(reach), real)
    record["root"] = root
    return record


def _surfaces(scene: Scene, orders: Sequence[NDArray[np.int64]], vertices: FloatArray, real: type[np.floating]) -> NDArray[np.void]:
    records = np.zeros(len(vertices), layout.surface(real))
    records["geometric"] = unit_normals(vertices)
    records["prim"] = _prim_ids(scene, orders)
    first = 0
    for number, (item, order) in enumerate(zip(scene.objects, orders, strict=True)):
        part = records[first : first + len(order)]
        part["normal"], part["material"], part["object"] = item.normals[order], item.material_ids[order], number
        first += len(order)
    return records


def _materials(scene: Scene, features: Features, precision: Precision) -> NDArray[np.void]:
    dtype = material_dtype(features, precision)
    records = np.zeros(len(scene.materials), dtype)
    for i, given in enumerate(scene.materials):
        material = given.without_phong() if given.metal_rough else given
        for member in dtype.names or ():
            records[member][i] = getattr(material, member)
    return records


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
        "object_count": len(objects), "triangle_slots": slots,
    }  # fmt: skip
    values |= {name: value(scene) for f in features.active if not features.idle(f) for name, *_, value in f.frame}
    values |= {f.switch_name: not features.idle(f) for f in features.switches}
    for name, value in values.items():
        record[name] = value
    return record
