"""Rays through trees against brute force; and how many triangles a ray is tested against, the mark of a tree's quality."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from kdtree_meshes import F64, MESHES, lattice, read_objects, sphere
from kdtree_walk import brute_force, hit_distances, walk

from clrt.kdtree import BUILDERS, KdTree, build_tree

BOTH = pytest.mark.parametrize("builder", sorted(BUILDERS))


def rays_at(vertices: F64, count: int = 200) -> tuple[F64, F64]:
    """Rays from around the mesh at corners, edges and insides of triangles; some parallel to axes, some within planes of corners."""
    rng = np.random.default_rng(12)
    lo, hi = vertices.min(axis=(0, 1)), vertices.max(axis=(0, 1))
    size = max(float((hi - lo).max()), 1e-3 * float(np.abs(hi).max()))
    weights = rng.dirichlet(np.ones(3), count)
    weights[: count // 3] = np.eye(3)[rng.integers(0, 3, count // 3)]
    target = np.einsum("ij,ijk->ik", weights, vertices[rng.integers(0, len(vertices), count)])
    origin = (lo + hi) / 2 + size * rng.normal(size=(count, 3))
    straight = rng.integers(0, 3, count // 3)
    row = np.arange(len(straight))
    origin[-len(straight) :] = target[-len(straight) :]
    origin[row - len(straight), straight] += size * rng.choice([-2, 2], len(straight))
    return origin, (target - origin) / size


@BOTH
@pytest.mark.parametrize("mesh", sorted(set(MESHES) - {"none", "identical", "points", "one point", "sphere of 1e-200"}))
def test_nearest_hits_are_those_of_brute_force(mesh: str, builder: str) -> None:
    vertices = MESHES[mesh]()
    origin, direction = rays_at(vertices)
    tree = build_tree(vertices, builder)
    found = walk(tree, vertices, origin, direction, np.full(len(origin), np.inf))
    t, _ = brute_force(vertices, origin, direction)
    if mesh != "collinear":
        assert np.isfinite(t).sum() > 20
    assert np.array_equal(np.isfinite(found.t), np.isfinite(t))
    hit = np.isfinite(t)
    assert np.array_equal(found.t[hit], t[hit])


@BOTH
def test_rays_within_split_planes_find_what_brute_force_finds(builder: str) -> None:
    vertices = lattice(5)
    tree = build_tree(vertices, builder)
    origin, direction = rays_at(vertices, 400)
    axis = np.random.default_rng(13).integers(0, 3, len(origin))
    row = np.arange(len(origin))
    origin[row, axis] = np.round(origin[row, axis])
    direction[row, axis] = 0.0
    found = walk(tree, vertices, origin, direction, np.full(len(origin), np.inf))
    assert np.array_equal(found.t, brute_force(vertices, origin, direction)[0])


def test_missing_entries_show_in_hits() -> None:
    """The comparison bites: a tree of which every leaf has lost half its triangles misses hits."""
    vertices = sphere()
    tree = build_tree(vertices)
    poor = replace(tree, child=np.where(tree.count > 0, tree.child + tree.count // 2, tree.child), count=tree.count - tree.count // 2)
    origin, direction = rays_at(vertices)
    found = walk(poor, vertices, origin, direction, np.full(len(origin), np.inf))
    assert not np.array_equal(found.t, brute_force(vertices, origin, direction)[0])


def test_large_tree_costs_few_mean_tests() -> None:
    vertices = sphere(60)
    origin, direction = rays_at(vertices, 300)
    found = walk(build_tree(vertices), vertices, origin, direction, np.full(len(origin), np.inf))
    assert found.tests.mean() < 60
    assert found.tests.max() < len(vertices) / 10


def camera_rays(count: int) -> tuple[F64, F64]:
    """Random pixels of 1024 x 1024 of the two scenes' camera: at (0, 0, -1), towards +z, field of view 45 degrees."""
    pixel = np.random.default_rng(14).integers(0, 1024, (count, 2))
    xy = ((pixel + 0.5) / 512 - 1) * np.tan(np.radians(22.5))
    direction = np.column_stack([xy, np.ones(count)])
    return np.tile([0.0, 0, -1], (count, 1)), direction / np.linalg.norm(direction, axis=1, keepdims=True)


def trace(objects: list[F64], trees: list[KdTree], origin: F64, direction: F64, t_max: F64, any_hit: bool) -> tuple[F64, F64, np.ndarray]:
    """Nearest distance, normal and triangle tests of rays through all objects."""
    t, normal, tests = t_max.copy(), np.zeros_like(origin), np.zeros(len(origin), np.int64)
    for vertices, tree in zip(objects, trees, strict=True):
        found = walk(tree, vertices, origin, direction, t, any_hit)
        hit = found.triangle >= 0
        a, b, c = vertices[found.triangle[hit]].transpose(1, 0, 2)
        t[hit], normal[hit] = found.t[hit], np.cross(b - a, c - a)
        tests += found.tests
    return t, normal, tests


def mean_tests(objects: list[F64], trees: list[KdTree], count: int) -> float:
    """Mean triangle tests of camera rays and of a shadow and a mirror ray from each hit."""
    origin, direction = camera_rays(count)
    t, normal, tests = trace(objects, trees, origin, direction, np.full(count, np.inf), any_hit=False)
    hit = np.isfinite(t)
    assert hit.sum() > count / 10
    direction, normal = direction[hit], normal[hit] / np.linalg.norm(normal[hit], axis=1, keepdims=True)
    normal *= -np.sign((normal * direction).sum(axis=1, keepdims=True))
    point = origin[hit] + t[hit, None] * direction + 1e-5 * normal
    to_light = np.array([5.0, 5.0, -5.0]) - point
    mirrored = direction - 2 * (direction * normal).sum(axis=1, keepdims=True) * normal
    _, _, shadow = trace(objects, trees, point, to_light, np.ones(len(point)), any_hit=True)
    _, _, mirror = trace(objects, trees, point, mirrored, np.full(len(point), np.inf), any_hit=False)
    return float(np.concatenate([tests, shadow, mirror]).mean())


@pytest.mark.parametrize(("scene", "mark"), [("monkey.txt", 30), ("rabbit.txt", 40)])
def test_rays_of_real_scenes_stay_under_their_mark_of_tests(scene: str, mark: float, shared_scene) -> None:  # type: ignore[no-untyped-def]
    objects = read_objects(shared_scene(scene))
    sah, median = (mean_tests(objects, [build_tree(vertices, name) for vertices in objects], 3000) for name in ("sah", "median"))
    assert sah < mark
    assert sah < median / 2


@pytest.mark.slow
def test_real_scene_builds_within_its_time(shared_scene) -> None:  # type: ignore[no-untyped-def]
    vertices = read_objects(shared_scene("rabbit.txt"))[0]
    seconds = []
    for _ in range(5):
        start = time.process_time()
        build_tree(vertices)
        seconds.append(time.process_time() - start)
    assert min(seconds) < 0.6


@pytest.mark.slow
def test_million_triangles_build_within_their_time() -> None:
    vertices = sphere(710)
    assert len(vertices) > 1_000_000
    start = time.process_time()
    tree = build_tree(vertices)
    assert time.process_time() - start < 10
    assert tree.reference_count < 4 * len(vertices)
    rays = np.random.default_rng(15).integers(0, len(vertices), 200)
    origin = np.tile([0.3, -0.2, 0.1], (200, 1))
    direction = vertices[rays].mean(axis=1) - origin
    found = walk(tree, vertices, origin, direction, np.full(200, np.inf))
    assert np.array_equal(found.t, hit_distances(origin, direction, vertices[found.triangle]))
    assert np.all(np.abs(found.t - 1) < 1e-6)
