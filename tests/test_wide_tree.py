"""The wide tree of single rays: every triangle in one block, boxes that hold what is below them, children from near to far."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from ray_meshes import MESHES

from clrt.generate import soup
from clrt.kdtree import BASELINES, BUILDERS, build_tree
from clrt.kdtree.joined import join
from clrt.kdtree.wide import WideTree, widen

Array = NDArray[Any]


def wide_of(tri: Array, width: int, builder: str = "sah") -> WideTree:
    return widen(join([build_tree(tri, builder)], [len(tri)]), np.array([len(tri)]), tri.min(axis=1), tri.max(axis=1), width)


def below(wide: WideTree, child: int) -> list[int]:
    """Triangles of a node or block, by walking down."""
    if child < 0:
        return [int(t) for t in wide.blocks[-1 - child] if t >= 0]
    return [t for c in wide.child[child] for t in below(wide, int(c))]


@pytest.mark.parametrize("width", [4, 16])
@pytest.mark.parametrize("builder", [*BUILDERS, *BASELINES])
@pytest.mark.parametrize("name", ["rabbit", "soup", "duplicates", "sizes 1e-8 to 1e8", "fan of needles"])
def test_every_triangle_is_in_one_block_and_in_all_boxes_above(name: str, builder: str, width: int) -> None:
    tri = MESHES[name]().astype(np.float64)
    wide = wide_of(tri, width, builder)
    assert sorted(below(wide, 0)) == list(range(len(tri)))
    assert (wide.blocks[0] == -1).all()
    for node, children in enumerate(wide.child):
        for lane, child in enumerate(children):
            inside = tri[below(wide, int(child))]
            if len(inside):
                assert (wide.lo[node, lane] == inside.min(axis=(0, 1))).all()
                assert (wide.hi[node, lane] == inside.max(axis=(0, 1))).all()
            else:
                assert (wide.lo[node, lane] > wide.hi[node, lane]).all()


def test_each_node_is_the_child_of_one_and_depth_is_the_longest_way_down() -> None:
    wide = wide_of(MESHES["rabbit"]().astype(np.float64), 4)
    inner = wide.child[wide.child >= 0]
    assert sorted(inner.tolist()) == list(range(1, len(wide.child)))
    depth = np.ones(len(wide.child), int)
    for node, children in enumerate(wide.child):  # children come after their parents
        assert (children[children >= 0] > node).all()
        depth[children[children >= 0]] = depth[node] + 1
    assert wide.depth == depth.max()


def test_children_come_from_near_to_far_by_octant() -> None:
    """Points have boxes that lie apart: along a direction, no child in the order can lie behind one that follows it on all axes."""
    points = np.random.default_rng(1).random((600, 3))
    tri = np.repeat(points[:, None], 3, axis=1)
    wide = wide_of(tri, 8)
    for octant in range(8):
        sign = np.where((octant >> np.arange(3)) & 1, -1.0, 1.0)
        for node in range(len(wide.child)):
            order = wide.order[node, :, octant]
            assert sorted(order.tolist()) == list(range(8))
            there = order[(wide.lo[node, order] <= wide.hi[node, order]).all(axis=1)]
            assert set(there.tolist()) == set(order[: len(there)].tolist())
            near = np.where(sign > 0, wide.lo[node, there], -wide.hi[node, there])
            far = np.where(sign > 0, wide.hi[node, there], -wide.lo[node, there])
            for first in range(len(there)):
                assert not (far[first + 1 :] <= near[first]).all(axis=1).any()


@pytest.mark.parametrize("count", [1, 16, 17])
def test_small_meshes_have_one_node(count: int) -> None:
    vertices, faces = soup(count)
    wide = wide_of(np.asarray(vertices[faces]), 16)
    assert wide.child.shape == (1, 16)
    assert np.count_nonzero(wide.blocks >= 0) == len(faces)


def test_no_triangle_makes_a_node_without_children() -> None:
    none = np.zeros((0, 3))
    wide = widen(join([build_tree(np.zeros((0, 3, 3)))], [0]), np.array([0]), none, none, 8)
    assert below(wide, 0) == []
    assert (wide.lo > wide.hi).all()


@pytest.mark.parametrize("builder", ["sah", "brute"])
def test_trees_of_many_objects_are_those_of_each(builder: str) -> None:
    """Node by node, whatever their numbers: boxes, the order of children, and the triangles below."""
    random = np.random.default_rng(6)
    meshes = [random.normal(size=(count, 3, 3)) + 50.0 * random.normal(size=3) for count in (3, 0, 700, 16, 0, 33, 1)]
    trees, counts = [build_tree(mesh, builder) for mesh in meshes], np.array([len(mesh) for mesh in meshes])
    tri, firsts = np.concatenate(meshes), np.cumsum(counts) - counts
    both = widen(join(trees, counts.tolist()), counts, tri.min(axis=1), tri.max(axis=1), 8)

    def compare(node: int, own: WideTree, number: int, first: int) -> None:
        np.testing.assert_array_equal(both.lo[node], own.lo[number])
        np.testing.assert_array_equal(both.order[node], own.order[number])
        for mine, its in zip(both.child[node].tolist(), own.child[number].tolist(), strict=True):
            if its >= 0:
                compare(mine, own, its, first)
            else:
                block = own.blocks[-1 - its]
                np.testing.assert_array_equal(both.blocks[-1 - mine], np.where(block >= 0, block + first, -1))

    deepest = 0
    for root, (mesh, first) in enumerate(zip(meshes, firsts.tolist(), strict=True)):
        if len(mesh):
            alone = wide_of(mesh, 8, builder)
            deepest = max(deepest, alone.depth)
            compare(root, alone, 0, first)
        else:
            assert below(both, root) == []
    assert both.depth == deepest
