"""Meshes of a glTF file as parts in the mesh's own space (Khronos, glTF 2.0, chapter 3.7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import FloatArray
from clrt.scene.models.gltf_accessors import read_floats, read_indices
from clrt.scene.models.gltf_file import Document
from clrt.scene.models.gltf_json import Item
from clrt.scene.models.model_file import Part, joined

_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(frozen=True, eq=False)
class UvMap:
    """Where a material's pictures lie: the set of coordinates, and the affine map (2, 3) from its numbers, v down, to (u, v), v down."""

    texcoord: int
    matrix: FloatArray


def read_mesh(document: Document, mesh: Item, placing: Sequence[UvMap | None], apart: Sequence[bool]) -> tuple[Part, ...]:
    """The triangles of a mesh as one part; its primitives as parts of their own where a material of theirs is so marked in `apart`.

    placing : where each material's pictures lie. Raises ModelError.
    """
    primitives = mesh.items("primitives")
    if not primitives:
        raise mesh.fault("has no primitives; export the file again")
    pieces = [piece for item in primitives if (piece := _read_primitive(document, item, placing)) is not None]
    name = mesh.text("name", mesh.path)
    split = any(apart[i] for piece in pieces for i in np.unique(piece.material_ids).tolist() if i >= 0)
    groups = [[piece] for piece in pieces] if split else [pieces] if pieces else []
    return tuple(joined(group, name) for group in groups)


def _read_primitive(document: Document, item: Item, placing: Sequence[UvMap | None]) -> Part | None:
    mode = item.count("mode", _TRIANGLES)
    if mode not in (_TRIANGLES, _STRIP, _FAN):
        if mode > _FAN:
            raise item.fault(f"the mode {mode} is none of glTF (0 to 6)")
        document.notes.add("left out, not supported: points and lines")
        return None
    attributes, notes = item.item("attributes"), document.notes
    if not attributes.has("POSITION"):
        raise item.fault("has no POSITION; export the file again")
    if item.items("targets"):
        notes.add("left out, not supported: morph targets")
    if attributes.has("COLOR_0"):
        notes.add("left out, not supported: colours of vertices")
    points = _attribute(document, attributes, "POSITION", 3)
    corners = _corners(document, item, mode, len(points))
    materials = document.root.items("materials")
    material = item.refer("material", materials, "material") if item.has("material") else -1
    normals = _attribute(document, attributes, "NORMAL", 3, len(points)) if attributes.has("NORMAL") else None
    uvs = _coordinates(document, attributes, placing[material] if material >= 0 else None, item, len(points))
    return Part(
        points[corners], np.full(len(corners), material, np.int32), None if normals is None else normals[corners],
        None if uvs is None else uvs[corners],
    )  # fmt: skip


def _attribute(document: Document, attributes: Item, key: str, width: int, count: int | None = None) -> FloatArray:
    index = attributes.count(key)
    values = read_floats(document, index, width, attributes.place(key))
    if count is not None and len(values) != count:
        raise attributes.fault(f"{key} has {len(values)} elements, POSITION {count}; export the file again")
    return values


def _corners(document: Document, item: Item, mode: int, count: int) -> NDArray[np.int64]:
    """(n, 3) places among the `count` vertices."""
    order = np.arange(count)
    if item.has("indices"):
        order = read_indices(document, item.count("indices"), item.place("indices"))
        wrong = np.flatnonzero(order >= count)
        if len(wrong):
            raise item.fault(f"index {wrong[0]} asks for vertex {order[wrong[0]]}, but there are {count} (0 to {count - 1}), "
                             f"and {len(wrong) - 1} more such indices; export the file again")  # fmt: skip
    if len(order) < 3 or (mode == _TRIANGLES and len(order) % 3):
        raise item.fault(f"has {len(order)} corners, which make no triangles; export the file again")
    if mode == _TRIANGLES:
        return order.reshape(-1, 3)
    first, second, third = order[:-2], order[1:-1], order[2:]
    if mode == _FAN:
        return np.stack([second, third, np.broadcast_to(order[0], second.shape)], axis=1)
    odd = (np.arange(len(first)) % 2).astype(bool)
    return np.stack([first, np.where(odd, third, second), np.where(odd, second, third)], axis=1)


def _coordinates(document: Document, attributes: Item, at: UvMap | None, item: Item, count: int) -> FloatArray | None:
    """(count, 2) u to the right, v up. Without a picture of the material's own the first set, for another's; None where there is none."""
    if at is None:
        if not attributes.has("TEXCOORD_0"):
            return None
        at = UvMap(0, np.eye(2, 3))
    key = f"TEXCOORD_{at.texcoord}"
    if not attributes.has(key):
        document.notes.add(f"{item.path} has a picture but no {key}: it shows the colour of the picture's corner")
    given = _attribute(document, attributes, key, 2, count) if attributes.has(key) else np.zeros((count, 2))
    down = given @ at.matrix[:, :2].T + at.matrix[:, 2]
    return np.stack([down[:, 0], 1.0 - down[:, 1]], axis=1)
