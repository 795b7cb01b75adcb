"""Trees as the device reads them: two words a node."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.device import pack
from clrt.errors import LimitError
from clrt.kdtree import build_tree, joined
from clrt.kdtree.joined import join
from clrt.kdtree.tree import KdTree


@pytest.fixture(scope="module")
def tree() -> KdTree:
    """Of 600 small triangles in three far clusters, with space between them."""
    random = np.random.default_rng(7)
    centers = random.choice([-10.0, 0.0, 10.0], (600, 1, 3)) + random.normal(0.0, 0.5, (600, 1, 3))
    return build_tree(centers + random.normal(0.0, 0.05, (600, 3, 3)), "sah")


def behind_another(tree: KdTree) -> tuple[np.ndarray, np.ndarray]:
    """The words of a tree that stands behind a small one: the split or first entry, and the shape of each node."""
    small = build_tree(np.arange(27.0).reshape(3, 3, 3) ** 2, "brute")
    words = pack.nodes_of(join([small, tree], [3, 600]))
    assert len(words) == len(small.split_axis) + len(tree.split_axis)
    split, shape = words[len(small.split_axis) :].T
    return split, shape


def test_inner_nodes_say_which_of_their_children_hold_nothing(tree: KdTree) -> None:
    split, shape = behind_another(tree)
    inner = np.flatnonzero(shape & 3 != 3)
    child = (shape[inner] >> 4) - 1
    empty = shape == 3  # a leaf of no triangles
    assert empty.any()
    np.testing.assert_array_equal(shape[inner] >> 2 & 1, empty[child])
    np.testing.assert_array_equal(shape[inner] >> 3 & 1, empty[child + 1])
    np.testing.assert_array_equal(split[inner].view(np.float32), tree.split_pos[inner])


def test_leaves_say_where_their_triangles_are(tree: KdTree) -> None:
    first, shape = behind_another(tree)
    leaves = np.flatnonzero(shape & 3 == 3)
    covered = np.concatenate([np.arange(a, a + n) for a, n in zip(first[leaves], shape[leaves] >> 2, strict=True)])
    np.testing.assert_array_equal(np.sort(covered), 3 + np.arange(tree.reference_count))


def test_joined_trees_name_their_own_triangles(tree: KdTree) -> None:
    other = build_tree(np.random.default_rng(8).normal(0.0, 1.0, (40, 3, 3)), "median")
    both = join([tree, other, tree], [600, 40, 600])
    np.testing.assert_array_equal(both.indices, np.concatenate([tree.indices, other.indices + 600, tree.indices + 640]))
    np.testing.assert_array_equal(both.roots, np.cumsum([0, tree.node_count, other.node_count]))


def test_more_nodes_than_words_can_name_are_refused(tree: KdTree, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joined, "MOST_NODES", 2 * tree.node_count - 1)
    join([tree], [600])
    with pytest.raises(LimitError, match="nodes"):
        join([tree, tree], [600, 600])
