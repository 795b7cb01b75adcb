"""The node hierarchy of a glTF file: what stands where (Khronos, glTF 2.0, chapter 3.5)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from clrt.scene.model import FloatArray
from clrt.scene.models.gltf_file import Document
from clrt.scene.models.gltf_json import Item


def placed_nodes(document: Document) -> Iterator[tuple[Item, FloatArray]]:
    """Each node of the file's scene with its world_from_node, (4, 4) float64; parents before children. Raises ModelError."""
    nodes = document.root.items("nodes")
    waiting = [(index, np.eye(4)) for index in reversed(_roots(document, nodes))]
    seen: set[int] = set()
    while waiting:
        index, world_from_parent = waiting.pop()
        node = nodes[index]
        if index in seen:
            raise node.fault("is the child of two nodes, or of itself; export the file again")
        seen.add(index)
        world_from_node = world_from_parent @ parent_from_node(node)
        if not np.isfinite(world_from_node).all():
            raise node.fault("its transform is beyond the range of numbers; export the file again")
        yield node, world_from_node
        children = list(node.places("children", len(nodes), "node"))
        waiting += [(child, world_from_node) for child in reversed(children)]


def _roots(document: Document, nodes: list[Item]) -> list[int]:
    """The roots of the scene that the file would have shown; of all nodes where it has no scenes."""
    scenes = document.root.items("scenes")
    if scenes:
        which = document.root.refer("scene", scenes, "scene") if document.root.has("scene") else 0
        if len(scenes) > 1:
            document.notes.add(f"of its {len(scenes)} scenes number {which} is read")
        return list(scenes[which].places("nodes", len(nodes), "node"))
    children = {child for node in nodes for child in node.places("children", len(nodes), "node")}
    return [i for i in range(len(nodes)) if i not in children]


def parent_from_node(node: Item) -> FloatArray:
    """The node's own transform, (4, 4): its matrix, or translation * rotation * scale."""
    if node.has("matrix"):
        return np.array(node.vector("matrix", (0.0,) * 16), np.float64).reshape(4, 4, order="F")
    result = np.eye(4)
    turned = rotation(np.array(node.vector("rotation", (0.0, 0.0, 0.0, 1.0))))
    result[:3, :3] = turned * np.array(node.vector("scale", (1.0, 1.0, 1.0)))
    result[:3, 3] = node.vector("translation", (0.0, 0.0, 0.0))
    return result


def rotation(quaternion: FloatArray) -> FloatArray:
    """(3, 3) of a quaternion x, y, z, w of any length but zero; the identity for zero."""
    length = float(np.linalg.norm(quaternion))
    x, y, z, w = quaternion / length if length > 0.0 else (0.0, 0.0, 0.0, 1.0)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def normal_matrix(matrix: FloatArray) -> FloatArray:
    """(3, 3): what takes normals along, up to their length, when `matrix` (3, 3) takes points: its cofactors, which it has without an
    inverse, too; turned round for a mirror, which keeps the outer side the outer one."""
    a, b, c = matrix
    cofactors = np.array([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    return 0.0 - cofactors if np.linalg.det(matrix) < 0.0 else cofactors


def corner_order(matrix: FloatArray) -> list[int]:
    """The order of a triangle's corners in which the cross product of its edges points to the same side, moved by `matrix` (3, 3)."""
    return [0, 2, 1] if np.linalg.det(matrix) < 0.0 else [0, 1, 2]
