"""Both builders on meshes that are easy, hard and degenerate: proved by validate(), and by points on the triangles."""

from __future__ import annotations

import numpy as np
import pytest
from kdtree_meshes import F64, MESHES, lattice, read_objects, soup, sphere

from clrt.errors import LimitError, MeshError
from clrt.kdtree import BUILDERS, LEAF, KdTree, build_tree, default_max_depth

BOTH = pytest.mark.parametrize("builder", sorted(BUILDERS))


@BOTH
@pytest.mark.parametrize("mesh", sorted(MESHES))
def test_tree_of_any_mesh_is_proved_right(mesh: str, builder: str) -> None:
    vertices = MESHES[mesh]()
    tree = build_tree(vertices, builder)
    tree.validate(vertices, max_depth=default_max_depth(len(vertices)))
    assert tree.builder == builder
    assert not np.any(np.abs(tree.split_pos[tree.split_pos != 0]) < 2.0**-126)


@BOTH
@pytest.mark.parametrize("mesh", sorted(set(MESHES) - {"none"}))
def test_points_on_triangles_are_found_in_the_leaf_that_holds_them(mesh: str, builder: str) -> None:
    vertices = MESHES[mesh]()
    tree = build_tree(vertices, builder)
    triangle, points = random_points(vertices, 2000)
    missing = np.flatnonzero(~found_at(tree, triangle, points))
    assert missing.size == 0, f"triangle {triangle[missing[0]]} is not found at {points[missing[0]]}"


def random_points(vertices: F64, count: int) -> tuple[np.ndarray, F64]:
    """Points within random triangles, a third of them on edges, some at corners."""
    rng = np.random.default_rng(11)
    triangle = rng.integers(0, len(vertices), count)
    weights = rng.exponential(size=(count, 3))
    weights[: count // 3, 0] = 0
    weights[: count // 10, 1] = 0
    weights /= weights.sum(axis=1, keepdims=True)
    return triangle, np.einsum("ij,ijk->ik", weights, vertices[triangle])


def found_at(tree: KdTree, triangle: np.ndarray, points: F64) -> np.ndarray:
    """Whether each triangle is in the leaf around its point; where rounding leaves the side of a plane open, in one of both."""
    entries = set()
    for leaf in np.flatnonzero(tree.split_axis == LEAF):
        entries |= {(int(leaf), int(t)) for t in tree.indices[tree.child[leaf] : tree.child[leaf] + tree.count[leaf]]}
    found = np.zeros(len(points), bool)
    point, node = np.arange(len(points)), np.zeros(len(points), np.int64)
    while point.size:
        leaf = tree.split_axis[node] == LEAF
        for p, n in zip(point[leaf], node[leaf], strict=True):
            found[p] |= (int(n), int(triangle[p])) in entries
        point, node = point[~leaf], node[~leaf]
        at, plane = points[point, tree.split_axis[node]], tree.split_pos[node].astype(np.float64)
        rounding = 2.0**-50 * np.abs(points[point]).max(axis=1, initial=0)
        lower, upper = at <= plane + rounding, at >= plane - rounding
        child = tree.child[node]
        point, node = np.concatenate([point[lower], point[upper]]), np.concatenate([child[lower], child[upper] + 1])
    return found


@BOTH
def test_flat_triangles_in_a_split_plane_are_kept_once_or_twice(builder: str) -> None:
    vertices = lattice(6)
    tree = build_tree(vertices, builder)
    flat_in_a_split = np.zeros(len(vertices), bool)
    for axis in range(3):
        planes = np.unique(tree.split_pos[tree.split_axis == axis])
        flat_in_a_split |= (np.ptp(vertices[:, :, axis], axis=1) == 0) & np.isin(vertices[:, 0, axis], planes)
    assert flat_in_a_split.sum() > 100
    assert np.all(np.bincount(tree.indices, minlength=len(vertices)) >= 1)


def test_sah_leaves_hold_no_stray_triangles() -> None:
    for vertices in (soup(), soup(150, 1.0), sphere()):
        assert build_tree(vertices, "sah").validate(vertices) == 0


def test_sah_is_cheaper_than_median_by_its_own_measure() -> None:
    vertices = np.concatenate([sphere(40), sphere(6) * 10 + 50])
    sah, median = (build_tree(vertices, name).sah_cost(8.0) for name in ("sah", "median"))
    assert sah < 0.6 * median


def test_sah_cuts_empty_space_off() -> None:
    small = soup(100, 0.001)
    far = small + np.array([1000.0, 0, 0])
    tree = build_tree(np.concatenate([small, far]), "sah")
    lo, hi = tree.cells()
    filled = (tree.split_axis == LEAF) & (tree.count > 0)
    assert tree.empty_leaf_count > 0
    assert (hi - lo)[filled, 0].max() < 10


@BOTH
def test_depth_limit_is_kept(builder: str) -> None:
    vertices = soup(2000, 0.05)
    for limit in (0, 1, 5, 60):
        tree = build_tree(vertices, builder, max_depth=limit)
        tree.validate(vertices, max_depth=limit)
        assert tree.depth <= limit
    assert build_tree(vertices, builder, max_depth=0).node_count == 1


@BOTH
def test_tree_without_triangles_is_one_empty_leaf(builder: str) -> None:
    tree = build_tree([], builder)
    assert (tree.node_count, tree.leaf_count, tree.reference_count, tree.depth) == (1, 1, 0, 0)
    assert tree.lo.tolist() == tree.hi.tolist() == [0, 0, 0]
    assert tree.sah_cost(8.0) == 0


@BOTH
def test_same_input_gives_same_tree(builder: str) -> None:
    first, second = (build_tree(soup(), builder) for _ in range(2))
    for name in ("split_axis", "split_pos", "child", "count", "indices"):
        assert np.array_equal(getattr(first, name), getattr(second, name))


@BOTH
def test_scaling_by_a_power_of_two_scales_the_planes_alone(builder: str) -> None:
    base, scaled = build_tree(sphere(), builder), build_tree(sphere() * 2.0**40, builder)
    assert np.array_equal(base.indices, scaled.indices)
    assert np.array_equal(base.split_pos * np.float32(2.0**40), scaled.split_pos)


@BOTH
def test_input_is_not_changed(builder: str) -> None:
    vertices = soup()
    before = vertices.copy()
    build_tree(vertices, builder)
    assert np.array_equal(vertices, before)


@BOTH
def test_progress_rises_to_one_and_can_end_the_build(builder: str) -> None:
    seen: list[float] = []
    build_tree(sphere(), builder, progress=seen.append)
    assert len(seen) > 3
    assert seen == sorted(seen)
    assert seen[-1] == 1.0

    def interrupt(fraction: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build_tree(sphere(), builder, progress=interrupt)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e39])
def test_vertices_out_of_range_are_refused_by_triangle(value: float) -> None:
    vertices = soup(10)
    vertices[7, 2, 1] = vertices[8, 0, 0] = value
    with pytest.raises(MeshError, match=r"triangle 7 of 10 .* \(2 such triangles\)"):
        build_tree(vertices)


@pytest.mark.parametrize("shape", [(3, 3), (5, 9), (2, 4, 3), (2, 3, 4)])
def test_vertices_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(MeshError, match="shape"):
        build_tree(np.zeros(shape))


def test_vertices_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(MeshError, match="numbers"):
        build_tree([["a", "b", "c"]])


def test_unknown_builder_and_depth_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match="choose one of sah, median"):
        build_tree(soup(), "bvh")
    for depth in (-1, 61):
        with pytest.raises(LimitError, match="0 to 60"):
            build_tree(soup(), max_depth=depth)


@pytest.mark.parametrize(("scene", "depth", "nodes"), [("monkey.txt", 9, 138), ("rabbit.txt", 17, 18094)])
def test_median_trees_are_about_those_of_the_report(scene: str, depth: int, nodes: int, shared_scene) -> None:  # type: ignore[no-untyped-def]
    objects = read_objects(shared_scene(scene))
    trees = [build_tree(vertices, "median") for vertices in objects]
    for tree, vertices in zip(trees, objects, strict=True):
        tree.validate(vertices)
    assert abs(max(tree.depth for tree in trees) - depth) <= 3
    assert nodes / 2.5 <= sum(tree.node_count for tree in trees) <= nodes * 2.5


@pytest.mark.parametrize("scene", ["monkey.txt", "rabbit.txt"])
def test_sah_trees_of_real_scenes_are_proved_right(scene: str, shared_scene) -> None:  # type: ignore[no-untyped-def]
    for vertices in read_objects(shared_scene(scene)):
        tree = build_tree(vertices)
        assert tree.validate(vertices) == 0
        assert tree.reference_count < 2.5 * len(vertices)
