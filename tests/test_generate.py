"""Generated meshes are what they are called: closed, outward, of the asked size, the same for the same seed."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.errors import LimitError, SceneError
from clrt.generate import KINDS, grid_mesh, make, needle_fan, rabbit_like, soup, uv_sphere
from clrt.generate.implicit import relax, split_quads, surface_quads
from clrt.generate.rabbit import eyes
from clrt.scene.build import load_scene

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]


def edge_counts(faces: IndexArray) -> tuple[IndexArray, IndexArray]:
    """How often each directed edge occurs, and each undirected one."""
    ahead = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return (np.unique(ahead, axis=0, return_counts=True)[1], np.unique(np.sort(ahead, axis=1), axis=0, return_counts=True)[1])


def volume(vertices: FloatArray, faces: IndexArray) -> float:
    """By the divergence theorem: positive where cross(b - a, c - a) points outward."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.sum(a * np.cross(b, c))) / 6.0


def pieces(count: int, faces: IndexArray) -> int:
    parent = list(range(count))

    def root(v: int) -> int:
        while parent[v] != v:
            parent[v] = parent[parent[v]]
            v = parent[v]
        return v

    for a, b, c in faces.tolist():
        parent[root(a)] = root(b)
        parent[root(b)] = root(c)
    return len({root(v) for v in range(count)})


def fans_per_vertex(faces: IndexArray) -> int:
    """The greatest number of separate fans of triangles around any vertex: 1 for a surface."""
    around: dict[int, list[tuple[int, int]]] = {}
    for a, b, c in faces.tolist():
        for v, edge in ((a, (b, c)), (b, (c, a)), (c, (a, b))):
            around.setdefault(v, []).append(edge)
    most = 0
    for edges in around.values():
        onward, fans = dict(edges), 0
        while onward:
            start, fans = next(iter(onward)), fans + 1
            while start in onward:
                start = onward.pop(start)
        most = max(most, fans)
    return most


def assert_closed_sphere(vertices: FloatArray, faces: IndexArray) -> None:
    directed, undirected = edge_counts(faces)
    assert (directed == 1).all()
    assert (undirected == 2).all()
    assert len(vertices) - len(undirected) + len(faces) == 2
    assert len(np.unique(vertices, axis=0)) == len(vertices)
    assert len(np.unique(faces)) == len(vertices)
    assert fans_per_vertex(faces) == 1
    assert pieces(len(vertices), faces) == 1
    assert volume(vertices, faces) > 0.0


@pytest.mark.parametrize(
    ("triangles", "seed"), [(1000, 0), (1000, 1), (1100, 0), (1300, 6), (1500, 3), (3000, 11), (12_000, 2), (30_000, 0)]
)
def test_rabbit_is_closed_and_of_the_asked_size(triangles: int, seed: int) -> None:
    vertices, faces = rabbit_like(triangles, seed)
    assert abs(len(faces) - triangles) <= 0.02 * triangles
    assert_closed_sphere(vertices, faces)
    np.testing.assert_array_equal(vertices, np.round(vertices, 6))


def test_rabbit_has_the_shape_of_one() -> None:
    vertices, faces = rabbit_like(12_000, 0)
    lo, hi = vertices.min(axis=0), vertices.max(axis=0)
    assert lo[1] == pytest.approx(0.0, abs=0.01)
    assert hi[1] == pytest.approx(1.2, abs=0.05)
    # Two ears: above the head the vertices fall into a left and a right half with a gap between
    tips = vertices[vertices[:, 1] > 1.05, 2]
    assert (tips < -0.05).any()
    assert (tips > 0.05).any()
    assert not (np.abs(tips) < 0.03).any()
    # The volume of ellipsoids of that size; the finer mesh agrees with the coarser
    assert volume(vertices, faces) == pytest.approx(volume(*rabbit_like(4_000, 0)), rel=0.03)


def test_rabbit_triangles_are_no_slivers() -> None:
    vertices, faces = rabbit_like(12_000, 0)
    corners = vertices[faces]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # 1 for an equilateral triangle
    quality = 4.0 * np.sqrt(3.0) * areas / np.sum(sides**2, axis=1)
    assert areas.min() > 0.0
    assert np.median(quality) > 0.8
    assert np.mean(quality < 0.2) < 0.005


def test_rabbit_of_the_same_seed_is_the_same() -> None:
    first, again, other = rabbit_like(1_500, 5), rabbit_like(1_500, 5), rabbit_like(1_500, 6)
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    assert first[0].shape != other[0].shape or not np.array_equal(first[0], other[0])


def test_eyes_sit_on_the_coat() -> None:
    vertices, _ = rabbit_like(12_000, 3)
    centers, radius = eyes(12_000, 3)
    nearest = np.linalg.norm(vertices[:, None] - centers, axis=2).min(axis=0)
    assert (nearest < 1.2 * radius).all()
    assert centers[0, 2] > 0.05
    assert centers[1, 2] < -0.05


@pytest.mark.parametrize("triangles", [0, 999, 4_000_001, -5])
def test_rabbit_of_an_impossible_size_is_refused(triangles: int) -> None:
    with pytest.raises(LimitError, match="1,000 to 4,000,000"):
        rabbit_like(triangles)


@pytest.mark.slow
def test_rabbit_of_a_million_triangles_takes_seconds() -> None:
    start = time.perf_counter()
    vertices, faces = rabbit_like(1_000_000, 1)
    assert time.perf_counter() - start < 120.0
    assert abs(len(faces) - 1_000_000) <= 20_000
    directed, undirected = edge_counts(faces)
    assert (directed == 1).all()
    assert (undirected == 2).all()
    assert len(vertices) - len(undirected) + len(faces) == 2


def torus(points: FloatArray) -> FloatArray:
    x, y, z = points.T
    return np.hypot(np.hypot(x, z) - 0.6, y) - 0.25


def ball(points: FloatArray) -> FloatArray:
    distance: FloatArray = np.linalg.norm(points, axis=1) - 0.8
    return distance


@pytest.mark.parametrize("cell", [0.031, 0.05, 0.11])
def test_surface_net_of_a_ball_has_its_volume_and_lies_on_it(cell: float) -> None:
    lo = np.full(3, -1.0)
    net = surface_quads(ball, lo, cell, int(2.0 / cell) + 1)
    assert net is not None
    vertices = relax(ball, *net, step=0.25 * cell, rounds=4)
    faces = split_quads(ball, vertices, net[1])
    assert_closed_sphere(vertices, faces)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 0.8, atol=1e-3 * cell)
    # A chord of length about the cell misses the ball by cell^2 / (8 r)
    assert volume(vertices, faces) == pytest.approx(4.0 / 3.0 * np.pi * 0.8**3, rel=0.5 * (cell / 0.8) ** 2)


def test_surface_net_of_a_torus_keeps_its_hole() -> None:
    net = surface_quads(torus, np.full(3, -1.0), 0.04, 51)
    assert net is not None
    vertices, quads = net
    faces = split_quads(torus, vertices, quads)
    directed, undirected = edge_counts(faces)
    assert (directed == 1).all()
    assert (undirected == 2).all()
    assert len(vertices) - len(undirected) + len(faces) == 0
    assert volume(vertices, faces) == pytest.approx(2.0 * np.pi**2 * 0.6 * 0.25**2, rel=0.02)


def sponge(points: FloatArray) -> FloatArray:
    """A gyroid of narrow holes, cut to a ball: saddles everywhere."""
    x, y, z = 11.0 * points.T
    gyroid = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    return np.maximum(ball(points), gyroid / 19.0)


def sponge_net(cell: float) -> tuple[FloatArray, IndexArray]:
    net = surface_quads(sponge, np.array([-1.0, -1.003, -1.001]), cell, int(2.0 / cell) + 2)
    assert net is not None
    return net


SPONGE_CELLS = (0.033, 0.045, 0.06, 0.083)


def test_plain_surface_net_of_a_sponge_is_no_surface(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clrt.generate.implicit._single_sheets", lambda values, corners: values)
    for cell in SPONGE_CELLS:
        assert (edge_counts(split_quads(sponge, *sponge_net(cell)))[1] == 4).any()


@pytest.mark.parametrize("cell", SPONGE_CELLS)
def test_surface_net_of_a_sponge_is_a_surface(cell: float) -> None:
    faces = split_quads(sponge, *sponge_net(cell))
    directed, undirected = edge_counts(faces)
    assert (directed == 1).all()
    assert (undirected == 2).all()
    assert fans_per_vertex(faces) == 1


@pytest.mark.parametrize("triangles", [12, 100, 2_500, 40_000])
def test_uv_sphere_is_closed_and_round(triangles: int) -> None:
    vertices, faces = uv_sphere(triangles, 0.5)
    assert abs(len(faces) - triangles) <= max(0.01 * triangles, 8)
    assert_closed_sphere(vertices, faces)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 0.5, rtol=1e-15)
    if triangles >= 2_500:
        assert volume(vertices, faces) == pytest.approx(np.pi / 6.0, rel=20.0 / triangles)


@pytest.mark.parametrize("triangles", [2, 50, 2_500, 40_000])
def test_grid_covers_its_square_once_face_up(triangles: int) -> None:
    vertices, faces = grid_mesh(triangles, seed=3, size=2.0, height=0.25)
    assert abs(len(faces) - triangles) <= max(0.02 * triangles, 4)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    up = np.cross(b - a, c - a)[:, 1]
    assert (up > 0.0).all()
    assert up.sum() / 2.0 == pytest.approx(4.0)
    assert np.abs(vertices[:, 1]).max() <= 0.5


def test_needle_fan_covers_its_polygon_and_faces_the_eye() -> None:
    vertices, faces = needle_fan(1_000, 2.0)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    assert (normal[:, 2] < 0.0).all()
    assert len(faces) == 1_000
    assert (faces[:, 0] == 0).all()
    assert -normal[:, 2].sum() / 2.0 == pytest.approx(0.5 * 1_000 * 4.0 * np.sin(2.0 * np.pi / 1_000))


def test_soup_shares_nothing_and_stays_in_its_cube() -> None:
    vertices, faces = soup(5_000, 1)
    assert len(np.unique(vertices, axis=0)) == 15_000
    np.testing.assert_array_equal(np.sort(faces.ravel()), np.arange(15_000))
    assert np.abs(vertices).max() <= 1.0


@pytest.mark.parametrize("kind", list(KINDS))
def test_make_writes_a_scene_that_loads(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    wanted = 40 if kind == "spheres" else 1_500
    summary = make(kind, path, wanted, seed=2)
    scene = load_scene(path)
    made = len(scene.spheres) if kind == "spheres" else len(scene.objects[0])
    assert abs(made - wanted) <= 0.02 * wanted
    assert f"{scene.triangle_count:,} triangles" in summary
    assert not scene.warnings
    text = path.read_bytes()
    make(kind, path, wanted, seed=2)
    assert path.read_bytes() == text


def test_made_rabbit_stands_on_the_floor_in_front_of_the_eye(tmp_path: Path) -> None:
    make("rabbit-like", tmp_path / "a.txt", 1_500, seed=0)
    scene = load_scene(tmp_path / "a.txt")
    rabbit, ground = scene.objects
    assert len(ground) == 2
    assert np.unique(ground.vertices[..., 1]).tolist() == [-0.5]
    assert rabbit.vertices[..., 1].min() == pytest.approx(-0.5, abs=0.01)
    seen = rabbit.vertices.reshape(-1, 3) - scene.camera.eye
    assert (np.abs(seen[:, :2]) < np.tan(np.radians(22.5)) * seen[:, 2:]).all()


def test_made_spheres_do_not_overlap(tmp_path: Path) -> None:
    make("spheres", tmp_path / "a.txt", 120, seed=3)
    spheres = load_scene(tmp_path / "a.txt").spheres
    apart = np.linalg.norm(spheres.centers[:, None] - spheres.centers, axis=2) - spheres.radii[:, None] - spheres.radii
    assert (apart[~np.eye(120, dtype=bool)] > -1e-5).all()


def test_make_of_an_unknown_kind_lists_the_kinds(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="rabbit-like"):
        make("teapot", tmp_path / "a.txt", 1_000, 0)
    with pytest.raises(LimitError):
        make("sphere", tmp_path / "a.txt", 1, 0)
    assert not list(tmp_path.iterdir())
