"""Wide trees as the device holds them: nodes and blocks of all objects in one array each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.device import layout
from clrt.device.packed import Packed
from clrt.device.rounding import rounded_down, rounded_up
from clrt.kdtree.joined import join
from clrt.kdtree.tree import KdTree
from clrt.kdtree.wide import WideTree, widen

_OCTANTS = np.arange(8)
_ORDER_BITS = 4  #: of a place in `order`
_SPARE = 8  #: stack sizes are multiples of it, so that few programs serve all meshes


@dataclass(frozen=True, eq=False)
class WideArrays:
    """nodes : layout.wide_node records; slots : (blocks, width) int32, -1 where there is none; roots : (objects,) int32 numbers of nodes
    stack : entries of the traversal's stack, at least the depth of the deepest tree
    """

    nodes: NDArray[np.void]
    slots: NDArray[np.int32]
    roots: NDArray[np.int32]
    stack: int


def wide_arrays(packed: Packed, trees: Sequence[KdTree], width: int) -> WideArrays:
    """The wide trees of all objects; triangles that no leaf of a kd-tree names are left out, as they are there."""
    if not trees:
        none = np.zeros(0, layout.wide_node(packed.real, width))
        return WideArrays(none, np.zeros((0, width), np.int32), np.zeros(0, np.int32), _SPARE)
    same = (packed.origins == packed.origins[0]).all()
    corners = packed.vertices - (packed.origins[0] if same else np.repeat(packed.origins, packed.slot_counts, axis=0)[:, None])
    joined = join(trees, [len(item) for item in packed.scene.objects])
    wide = widen(joined, packed.slot_counts, corners.min(axis=1), corners.max(axis=1), width)
    return WideArrays(
        nodes=_records(wide, packed.real),
        slots=wide.blocks.astype(np.int32),
        roots=np.arange(len(trees), dtype=np.int32),
        stack=-(-(wide.depth + 1) // _SPARE) * _SPARE,
    )


def _records(wide: WideTree, real: type[np.floating]) -> NDArray[np.void]:
    records = np.zeros(len(wide.child), layout.wide_node(real, wide.child.shape[1]))
    records["planes"][:, 0::2] = rounded_down(wide.lo, real).transpose(0, 2, 1)
    records["planes"][:, 1::2] = rounded_up(wide.hi, real).transpose(0, 2, 1)
    records["child"] = wide.child
    packed = (wide.order.astype(np.uint32) << (_ORDER_BITS * _OCTANTS).astype(np.uint32)).sum(axis=2, dtype=np.uint32)
    records["order"] = packed.view(np.int32)
    return records
