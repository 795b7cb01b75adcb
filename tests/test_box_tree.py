"""The tree over boxes: every box in one leaf, every node around its children, depth within the stack."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.kdtree.boxtree import NOTHING, BoxTree, build_box_tree, depth_limit


def _leaves(tree: BoxTree) -> tuple[list[int], int]:
    """Boxes in the order of a walk from the root, and the depth; checks that nodes hold their children."""
    found, deepest, waiting, seen = [], 0, [(0, 0)], set()
    while waiting:
        node, depth = waiting.pop()
        assert node not in seen
        seen.add(node)
        deepest = max(deepest, depth)
        if tree.child[node] <= -2:
            found.append(-2 - int(tree.child[node]))
            continue
        for child in (int(tree.child[node]), int(tree.child[node]) + 1):
            assert (tree.lo[node] <= tree.lo[child]).all()
            assert (tree.hi[child] <= tree.hi[node]).all()
            waiting.append((child, depth + 1))
    assert len(seen) == len(tree.child)
    return found, deepest


@pytest.mark.parametrize("kind", ["spread", "same", "line", "doubling"])
@pytest.mark.parametrize("count", [1, 2, 3, 17, 1000])
def test_tree_holds_every_box_once_within_its_depth(kind: str, count: int) -> None:
    rng = np.random.default_rng(count)
    middle = {
        "spread": rng.uniform(-5, 5, (count, 3)), "same": np.ones((count, 3)),
        "line": np.arange(count)[:, None] * np.array([1.0, 0.0, 0.0]),
        "doubling": np.exp2(np.arange(count) % 300)[:, None] * np.array([1.0, 0.0, 0.5]),
    }[kind]  # fmt: skip
    half = rng.uniform(0, 1, (count, 3))
    tree = build_box_tree(middle - half, middle + half)
    found, depth = _leaves(tree)
    assert sorted(found) == list(range(count))
    assert depth == tree.depth <= depth_limit(count)
    for node, child in enumerate(tree.child.tolist()):
        if child <= -2:
            np.testing.assert_array_equal(tree.lo[node], (middle - half)[-2 - child])


def test_tree_over_nothing_says_so() -> None:
    tree = build_box_tree(np.zeros((0, 3)), np.zeros((0, 3)))
    assert tree.child.tolist() == [NOTHING]


def test_tree_of_a_large_box_among_small_ones_sets_it_apart() -> None:
    """By surface area a floor leaves the small boxes in the first step or two, where a split by half would keep it to the end."""
    rng = np.random.default_rng(1)
    middle = np.concatenate([[[0.0, -5.0, 0.0]], rng.uniform(-1, 1, (200, 3))])
    half = np.concatenate([[[100.0, 0.0, 100.0]], np.full((200, 3), 0.01)])
    tree = build_box_tree(middle - half, middle + half)
    sizes = (tree.hi - tree.lo).max(1)
    assert np.count_nonzero(sizes > 10.0) <= 4
