"""Trees as the device reads them: two words a node."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.device import pack
from clrt.errors import LimitError
from clrt.kdtree import build_tree
from clrt.kdtree.tree import KdTree


@pytest.fixture(scope="module")
def tree() -> KdTree:
    """Of 600 small triangles in three far clusters, with space between them."""
    random = np.random.default_rng(7)
    centers = random.choice([-10.0, 0.0, 10.0], (600, 1, 3)) + random.normal(0.0, 0.5, (600, 1, 3))
    return build_tree(centers + random.normal(0.0, 0.05, (600, 3, 3)), "sah")


def test_inner_nodes_say_which_of_their_children_hold_nothing(tree: KdTree) -> None:
    split, shape = pack.nodes_of(tree, 5, 0).T
    inner = np.flatnonzero(shape & 3 != 3)
    child = (shape[inner] >> 4) - 5
    empty = shape == 3  # a leaf of no triangles
    assert empty.any()
    np.testing.assert_array_equal(shape[inner] >> 2 & 1, empty[child])
    np.testing.assert_array_equal(shape[inner] >> 3 & 1, empty[child + 1])
    np.testing.assert_array_equal(split[inner].view(np.float32), tree.split_pos[inner])


def test_leaves_say_where_their_triangles_are(tree: KdTree) -> None:
    first, shape = pack.nodes_of(tree, 0, 40).T
    leaves = np.flatnonzero(shape & 3 == 3)
    covered = np.concatenate([np.arange(a, a + n) for a, n in zip(first[leaves], shape[leaves] >> 2, strict=True)])
    np.testing.assert_array_equal(np.sort(covered), 40 + np.arange(tree.reference_count))


def test_more_nodes_than_words_can_name_are_refused(tree: KdTree) -> None:
    with pytest.raises(LimitError, match="nodes"):
        pack.nodes_of(tree, pack.MOST_NODES, 0)
