"""validate() against planted faults: each must be found and named; and the overlap test under it against exact rationals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from kdtree_meshes import F64, exact_bounds, soup, sphere

from clrt.kdtree import BUILDERS, LEAF, KdTree, build_tree
from clrt.kdtree.overlap import triangles_meet_boxes

BOTH = pytest.mark.parametrize("builder", sorted(BUILDERS))


def without_entry(tree: KdTree, entry: int) -> KdTree:
    """The tree with one entry of `indices` taken out of its leaf."""
    leaf = (tree.split_axis == LEAF) & (tree.child <= entry) & (tree.child + tree.count > entry)
    after = (tree.split_axis == LEAF) & (tree.child > entry)
    count, child = tree.count - leaf.astype(np.int32), tree.child - after.astype(np.int32)
    return replace(tree, indices=np.delete(tree.indices, entry), count=count, child=child)


def changed(tree: KdTree, name: str, at: int, value: float) -> KdTree:
    """The tree with one number of one array changed."""
    array = getattr(tree, name).copy()
    array[at] = value
    return replace(tree, **{name: array})


def some_tree(builder: str = "sah") -> tuple[F64, KdTree]:
    vertices = soup(300, 0.1)
    tree = build_tree(vertices, builder)
    tree.validate(vertices)
    assert tree.node_count > 20
    return vertices, tree


@BOTH
def test_triangle_removed_from_a_leaf_it_reaches_into_is_found(builder: str) -> None:
    vertices, tree = some_tree(builder)
    lo, hi = tree.cells()
    weights = np.random.default_rng(1).dirichlet(np.ones(3), 300)
    caught = 0
    for leaf in np.flatnonzero(tree.count):
        for entry in range(tree.child[leaf], tree.child[leaf] + tree.count[leaf]):
            points = weights @ vertices[tree.indices[entry]]
            if ((points > lo[leaf] + 1e-6) & (points < hi[leaf] - 1e-6)).all(axis=1).any():
                with pytest.raises(ValueError, match=f"triangle {tree.indices[entry]} reaches into leaf {leaf},"):
                    without_entry(tree, entry).validate(vertices)
                caught += 1
        if caught > 150:
            break
    assert caught > 100


def arrays(child: list[int], count: list[int], indices: list[int]) -> dict[str, Any]:
    """These arrays of a tree."""
    return {name: np.array(value, np.int32) for name, value in (("child", child), ("count", count), ("indices", indices))}


def flat_in_the_middle() -> tuple[F64, KdTree]:
    """Triangle 2 lies in the plane x = 0 that separates the others, in a tree laid out by hand."""
    vertices = np.array(
        [
            [[-1, 0, 0], [-0.5, 1, 0], [-0.5, 0, 1]],
            [[1, 0, 0], [0.5, 1, 0], [0.5, 0, 1]],
            [[0, 0, 0], [0, 1, 0], [0, 0, 1]],
        ],
        np.float64,
    )
    axes, planes = np.array([0, LEAF, LEAF], np.uint8), np.zeros(3, np.float32)
    lo, hi = np.array([-1.0, 0, 0]), np.array([1.0, 1, 1])
    return vertices, KdTree(lo, hi, axes, planes, **arrays([1, 0, 2], [0, 2, 1], [0, 2, 1]), depth=1, builder="hand")


def test_flat_triangle_may_be_on_either_side_but_not_on_none() -> None:
    vertices, lower = flat_in_the_middle()
    assert lower.validate(vertices) == 0
    upper = replace(lower, **arrays([1, 0, 1], [0, 1, 2], [0, 1, 2]))
    assert upper.validate(vertices) == 0
    both = replace(lower, **arrays([1, 0, 2], [0, 2, 2], [0, 2, 1, 2]))
    assert both.validate(vertices) == 0
    with pytest.raises(ValueError, match="triangle 2 reaches into leaf"):
        without_entry(lower, 1).validate(vertices)


@pytest.mark.parametrize("at", [0.0, 0.25])
def test_triangle_that_is_a_point_of_the_plane_may_be_on_either_side_but_not_on_none(at: float) -> None:
    vertices, lower = flat_in_the_middle()
    vertices[2] = 0.0, at, at
    assert lower.validate(vertices) == 0
    assert replace(lower, **arrays([1, 0, 1], [0, 1, 2], [0, 1, 2])).validate(vertices) == 0
    with pytest.raises(ValueError, match="triangle 2 reaches into leaf"):
        without_entry(lower, 1).validate(vertices)


def test_flat_triangle_may_not_be_split_between_both_sides_of_its_plane() -> None:
    vertices, tree = flat_in_the_middle()
    # Both sides of x = 0 are cut again at y = 0.5; triangle 2 is below it on one side, above it on the other: half of it twice.
    axes, planes = np.array([0, 1, 1, LEAF, LEAF, LEAF, LEAF], np.uint8), np.array([0, 0.5, 0.5, 0, 0, 0, 0], np.float32)
    halves = arrays([1, 3, 5, 0, 2, 3, 4], [0, 0, 0, 2, 1, 1, 2], [0, 2, 0, 1, 1, 2])
    with pytest.raises(ValueError, match="triangle 2 reaches into leaf"):
        replace(tree, split_axis=axes, split_pos=planes, depth=2, **halves).validate(vertices)
    whole = arrays([1, 3, 5, 0, 2, 4, 5], [0, 0, 0, 2, 2, 1, 1], [0, 2, 0, 2, 1, 1])
    assert replace(tree, split_axis=axes, split_pos=planes, depth=2, **whole).validate(vertices) == 0


def test_stray_entries_are_counted_not_refused() -> None:
    vertices, tree = flat_in_the_middle()
    assert replace(tree, **arrays([1, 0, 3], [0, 3, 1], [0, 1, 2, 1])).validate(vertices) == 1


@BOTH
def test_swapped_children_are_found(builder: str) -> None:
    vertices, tree = some_tree(builder)
    for lower in tree.child[tree.split_axis != LEAF][:12]:
        order = np.arange(tree.node_count)
        order[[lower, lower + 1]] = lower + 1, lower
        swapped = {name: getattr(tree, name)[order] for name in ("split_axis", "split_pos", "child", "count")}
        with pytest.raises(ValueError, match="kd-tree: "):
            replace(tree, **swapped).validate(vertices)


@BOTH
def test_shifted_split_is_found(builder: str) -> None:
    vertices, tree = some_tree(builder)
    for node in np.flatnonzero(tree.split_axis != LEAF)[:5]:
        lo, hi = (bound[node, tree.split_axis[node]] for bound in tree.cells())
        for share in (0.02, 0.98):
            with pytest.raises(ValueError, match=r"reaches into leaf|not strictly inside"):
                changed(tree, "split_pos", node, lo + share * (hi - lo)).validate(vertices)


def test_changed_axis_is_found() -> None:
    vertices, tree = some_tree()
    with pytest.raises(ValueError, match=r"reaches into leaf|not strictly inside"):
        changed(tree, "split_axis", 0, (int(tree.split_axis[0]) + 1) % 3).validate(vertices)


def first(tree: KdTree, leaf: bool) -> int:
    """The first inner node, or the first leaf with triangles."""
    return int(np.flatnonzero((tree.count > 0) if leaf else (tree.split_axis != LEAF))[0])


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (lambda t: replace(t, depth=t.depth + 1), "depth is given as"),
        (lambda t: replace(t, depth=t.depth - 1), "depth is given as"),
        (lambda t: changed(t, "child", 0, 3), "children of node 0"),
        (lambda t: changed(t, "child", 1 + first(t, False), -5), "children of node 1"),
        (lambda t: changed(t, "child", first(t, False), t.node_count), "children of node 0"),
        (lambda t: changed(t, "count", 0, 1), "inner node 0 has a triangle count"),
        (lambda t: changed(t, "count", first(t, True), 10_000), "leaves the .* indices"),
        (lambda t: changed(t, "count", first(t, True), -1), "leaves the .* indices"),
        (lambda t: changed(t, "count", first(t, True), 1), "overlap or leave gaps"),
        (lambda t: changed(t, "child", first(t, True), t.child[first(t, True)] + 1), "overlap or leave gaps"),
        (lambda t: changed(t, "indices", 5, 300), r"indices\[5\] is not one of the 300 triangles"),
        (lambda t: changed(t, "indices", 5, -1), r"indices\[5\] is not one of the 300 triangles"),
        (lambda t: changed(t, "indices", t.child[first(t, True)], t.indices[t.child[first(t, True)] + 1]), "has triangle .* twice"),
        (lambda t: changed(t, "split_axis", 0, LEAF), "inner nodes call for"),
        (lambda t: changed(t, "split_axis", 0, 7), "split axis above 3"),
        (lambda t: changed(t, "split_pos", 0, 50), "split of node 0 is not strictly inside"),
        (lambda t: changed(t, "split_pos", 0, np.nan), "split of node 0 is not strictly inside"),
        (lambda t: changed(t, "split_pos", 0, t.lo[t.split_axis[0]] - 1), "split of node 0 is not strictly inside"),
        (lambda t: changed(t, "hi", 0, t.hi[0] - 1e-9), "is not within the bounds"),
        (lambda t: changed(t, "lo", 0, np.nan), "not finite"),
        (lambda t: replace(t, split_pos=t.split_pos.astype(np.float64)), "split_pos is float64"),
        (lambda t: replace(t, count=t.count[:-1]), "count has .* entries"),
        (lambda t: replace(t, indices=t.indices[:-1]), "leaves the .* indices"),
    ],
)
def test_fault_in_the_arrays_is_named(fault, message: str) -> None:  # type: ignore[no-untyped-def]
    vertices, tree = some_tree()
    with pytest.raises(ValueError, match=message):
        fault(tree).validate(vertices)


def test_depth_beyond_a_given_limit_is_found() -> None:
    vertices, tree = some_tree()
    tree.validate(vertices, max_depth=tree.depth)
    with pytest.raises(ValueError, match="beyond the limit"):
        tree.validate(vertices, max_depth=tree.depth - 1)


def test_tree_of_other_triangles_is_refused() -> None:
    _, tree = some_tree()
    with pytest.raises(ValueError, match="kd-tree: "):
        tree.validate(soup(300, 0.1, seed=99))
    with pytest.raises(ValueError, match="shape"):
        tree.validate(np.zeros((300, 9)))


def test_statistics_of_a_tree_by_hand() -> None:
    vertices, tree = flat_in_the_middle()
    tree.validate(vertices)
    stats = tree.stats()
    assert (stats["nodes"], stats["leaves"], stats["empty_leaves"], stats["references"], stats["depth"]) == (3, 2, 0, 3, 1)
    assert (stats["mean_leaf_size"], stats["greatest_leaf_size"]) == (1.5, 2)
    # Cell 2 x 1 x 1, half its area 5; each half a unit cube, half its area 3: 8 + (2 + 1) * 3 / 5.
    assert stats["sah_cost"] == pytest.approx(8 + 3 * 3 / 5)


def test_overlap_agrees_with_exact_clipping() -> None:
    rng = np.random.default_rng(3)
    triangles = rng.integers(-6, 7, (600, 3, 3)) / 4.0
    lo = rng.integers(-4, 3, (600, 3)) / 4.0
    hi = lo + rng.integers(0, 7, (600, 3)) / 4.0
    meets = triangles_meet_boxes(triangles, lo, hi, np.full(600, 2.0**-44))
    expected = np.array([exact_bounds(*case) is not None for case in zip(triangles, lo, hi, strict=True)])
    assert 100 < expected.sum() < 500
    assert np.array_equal(meets, expected)


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1e30])
def test_overlap_does_not_depend_on_scale(scale: float) -> None:
    rng = np.random.default_rng(4)
    triangles, lo = rng.normal(size=(500, 3, 3)), rng.normal(size=(500, 3)) - 0.5
    slack = np.full(500, 1e-12)
    unit = triangles_meet_boxes(triangles, lo, lo + 0.5, slack)
    assert np.array_equal(triangles_meet_boxes(triangles * scale, lo * scale, (lo + 0.5) * scale, slack * scale), unit)


def test_sphere_with_a_lost_triangle_is_found_whichever_it_is() -> None:
    vertices = sphere(10)
    tree = build_tree(vertices)
    for triangle in range(0, len(vertices), 7):
        lost = tree
        while np.any(lost.indices == triangle):
            lost = without_entry(lost, int(np.argmax(lost.indices == triangle)))
        with pytest.raises(ValueError, match=f"triangle {triangle} reaches"):
            lost.validate(vertices)
