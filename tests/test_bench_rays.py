"""Brute force against the kd-trees, and the rays that the benchmarks hand to Embree."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from device_pictures import ray_counts

import clrt
from clrt.bench.peers import Embreex, embreex_available, primary_rays, shadow_rays
from clrt.bench.scenes import straight
from clrt.cli.main import cli
from clrt.device.context import Device
from clrt.generate import make, uv_sphere
from clrt.kdtree import build_tree
from clrt.scene.build import parse_scene
from clrt.scene.model import Camera, Material, MeshObject, Scene

NEEDS_EMBREEX = pytest.mark.skipif(not embreex_available(), reason="embreex is not installed")


def sphere_scene(triangles: int, distance: float, size: int) -> Scene:
    """A sphere of radius 1 seen from a distance to its centre, without lights."""
    points, faces = uv_sphere(triangles, 1.0)
    vertices = points[faces]
    normals = np.cross(vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    camera = Camera.from_view(np.array([0.1, 0.2, -distance]), np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]), 40.0, size, size)
    material = Material((1.0, 1.0, 1.0), 0.5, 0.5, 0.0, 1.0)
    return Scene(camera, (), (material,), (MeshObject(vertices, normals, np.zeros(len(vertices), np.int32), 0),))


def test_brute_tree_is_one_leaf_and_right() -> None:
    vertices = sphere_scene(300, 4.0, 8).objects[0].vertices
    tree = build_tree(vertices, "brute")
    tree.validate(vertices)
    assert (tree.node_count, tree.depth, tree.reference_count) == (1, 0, len(vertices))
    assert build_tree(np.zeros((0, 3, 3)), "brute").reference_count == 0


def test_brute_force_is_not_offered_by_the_command_line(tmp_path: Path) -> None:
    result = CliRunner().invoke(cli, ["render", str(tmp_path / "scene.txt"), "--tree", "brute"])
    assert result.exit_code == 2
    assert "'brute' is not one of 'sah', 'median'" in result.output


@pytest.mark.parametrize("tree", ["sah", "median"])
def test_brute_force_gives_the_picture_of_the_trees(tree: str, tmp_path: Path) -> None:
    make("rabbit-like", tmp_path / "scene.txt", 1000, 3)
    scene = clrt.load(tmp_path / "scene.txt")
    pictures = [clrt.render(scene, size=(57, 43), tree=name).pixels for name in ("brute", tree)]
    assert np.abs(pictures[0]).max() > 0.5
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=0, atol=1e-6)


def rays_that_enter(scene: Scene, margin: float) -> int:
    """Primary rays that meet the box around the triangles, made larger by `margin` on all sides: slabs, in float64."""
    corners = scene.objects[0].vertices.reshape(-1, 3)
    directions = scene.camera.directions().reshape(-1, 3)
    with np.errstate(divide="ignore"):
        t = np.stack([(bound - scene.camera.eye) / directions for bound in (corners.min(0) - margin, corners.max(0) + margin)])
    enter, leave = t.min(0).max(1), t.max(0).min(1)
    return int(np.count_nonzero((enter <= leave) & (leave >= 0)))


@pytest.mark.parametrize(("distance", "all_enter"), [(1.5, True), (6.0, False)])
def test_brute_force_tests_every_triangle_for_each_ray_that_enters_the_box(distance: float, all_enter: bool) -> None:
    scene = sphere_scene(200, distance, 37)
    entering = rays_that_enter(scene, 0.0)
    assert rays_that_enter(scene, 1e-4) == rays_that_enter(scene, -1e-4) == entering
    assert (entering == 37 * 37) == all_enter
    assert entering > 0
    stats = clrt.render(scene, tree="brute", count=True).stats
    assert stats is not None
    assert stats.ray_counts == {"primary": 37 * 37}
    assert stats.tests_per_ray == pytest.approx(entering * scene.triangle_count / 37**2, rel=1e-12)


#: a wall of 6 x 6 at z = 3, and before it at z = 2 a plate of 1 x 1; the light stands beside the eye
_WALL = """E 0 0 0
V 0 0 1
F 50
R 64 64
L 1 0 0
M 1 1 1 0.2 0.8 0.5 20 0.5
T -3 -3 3 3 -3 3 3 3 3
T -3 -3 3 3 3 3 -3 3 3
O
T -0.5 -0.5 2 0.5 -0.5 2 0.5 0.5 2
T -0.5 -0.5 2 0.5 0.5 2 -0.5 0.5 2
O
S 0 0 2.5 0.1
"""


def wall_by_hand(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """By pixel: whether the plate is hit, and whether the point seen lies in the plate's shadow on the wall."""
    x, y, z = np.moveaxis(scene.camera.directions(), -1, 0)
    plate = (np.abs(x / z * 2) < 0.5) & (np.abs(y / z * 2) < 0.5)
    # From the wall's (X, Y, 3) to the light at (1, 0, 0), z = 2 is passed after a third of the way
    at_x, at_y = (x / z * 3) * 2 / 3 + 1 / 3, (y / z * 3) * 2 / 3
    return plate.ravel(), (~plate & (np.abs(at_x) < 0.5) & (np.abs(at_y) < 0.5)).ravel()


def test_scene_for_the_peer_has_primary_and_shadow_rays_alone(device: Device) -> None:
    scene = parse_scene(_WALL)
    assert ray_counts(scene, device)[0]["mirror"] > 0
    plain = clrt.render(straight(scene), count=True).stats
    assert plain is not None
    assert plain.ray_counts == {"primary": 64 * 64, "shadow": 64 * 64}
    assert plain.effects == ["shadows", "direct light"]


@NEEDS_EMBREEX
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_embree_gets_the_rays_of_the_picture_in_their_order(threads: int) -> None:
    scene = straight(parse_scene(_WALL))
    plate, shadowed = wall_by_hand(scene)
    with Embreex([item.vertices for item in scene.objects], threads) as peer:
        primary = primary_rays(scene)
        hits = peer.nearest(primary)
        np.testing.assert_array_equal(hits.object, plate)
        np.testing.assert_allclose(hits.distance * primary.directions[:, 2], np.where(plate, 2.0, 3.0), rtol=1e-5)
        shadow, pixels = shadow_rays(scene, hits)
        np.testing.assert_array_equal(pixels, np.arange(64 * 64))
        peer.load("shadow", shadow)
        np.testing.assert_array_equal(peer.occluded("shadow"), shadowed)
        peer.trace("shadow")
    assert 50 < np.count_nonzero(shadowed) < 2000


@NEEDS_EMBREEX
def test_points_that_face_away_from_the_light_ask_for_no_shadow_ray() -> None:
    scene = straight(parse_scene(_WALL.replace("L 1 0 0", "L 0 0 2.5")))
    with Embreex([item.vertices for item in scene.objects], 1) as peer:
        hits = peer.nearest(primary_rays(scene))
        _, pixels = shadow_rays(scene, hits)
    stats = clrt.render(scene, count=True).stats
    assert stats is not None
    assert stats.ray_counts is not None
    assert 0 < len(pixels) == np.count_nonzero(~wall_by_hand(scene)[0]) == stats.ray_counts["shadow"]
