"""The shadow terminator of coarse smooth meshes: no polygons where light and dark meet; no light through hollows and walls.

Expected values are closed forms: normals interpolated here over the triangles that the reference names, and Hanika's formula by hand.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from reference_scenes import box

import clrt
import clrt.reference
from clrt.device import program
from clrt.device.program import Shape
from clrt.features import Features
from clrt.generate import rabbit_like, uv_sphere
from clrt.mesh import vertex_normals
from clrt.precision import RUNGS, rung
from clrt.reference import ReferencePicture
from clrt.reference.terminator import face_between, lifts
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene

FloatArray = NDArray[np.float64]
Vector = tuple[float, float, float]

BOUND = 1e-4  #: what numerics promise of a pixel in single precision
MARGIN = 2e-5  #: of decisions, as in test_render_reference.py
MATTE = "M 1 1 1 0 1 0 1 0\n"
#: lights at the side of what an eye at -z sees
LIGHTS: tuple[Vector, ...] = ((-40, 4, 8), (36, 16, 12), (12, 40, 4), (-32, -20, 16), (40, 0, -12))


def _camera(eye: Vector, fov: float, size: int, view: Vector = (0, 0, 1)) -> str:
    return f"E {_words(eye)}\nV {_words(view)}\nF {fov}\nR {size} {size}\ndepth 0\n"


def _words(numbers: Vector) -> str:
    return " ".join(repr(float(x)) for x in numbers)


def _mesh(triangles: FloatArray, normals: FloatArray | None = None) -> str:
    parts = [triangles] if normals is None else [triangles, normals]
    rows = np.concatenate([p.reshape(-1, 9) for p in parts], axis=1)
    return "".join("T " + " ".join(map(repr, row)) + "\n" for row in rows.tolist()) + "O\n"


def _globe(radius: float = 1.0, count: int = 200) -> tuple[FloatArray, FloatArray]:
    """A coarse sphere about zero with the sphere's own normals, turned so that no row of pixels runs along a row of edges."""
    vertices, faces = uv_sphere(count)
    c, s = np.cos(0.4), np.sin(0.4)
    corners = vertices[faces] @ (np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])).T
    return radius * corners, corners / np.linalg.norm(corners, axis=-1, keepdims=True)


def _ball(light: Vector, size: int = 96) -> Scene:
    return parse_scene(_camera((0, 0, -5), 24.0, size) + f"L {_words(light)}\n" + MATTE + _mesh(*_globe()))


def _cosines(scene: Scene, seen: ReferencePicture) -> tuple[FloatArray, FloatArray]:
    """N.L and n_geo.L of each pixel, (h, w): towards the first light, by the triangles seen; 0 for none."""
    item, hit = scene.objects[0], seen.prim_id >= 0
    assert item.vertex_normals is not None
    d = scene.camera.directions().astype(np.float64)[hit]
    point, tri = scene.camera.eye + seen.t[hit][:, None] * d, item.vertices[seen.prim_id[hit]]
    # Twice the areas of the three triangles between the point and two corners, along the normal.
    face = np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0])
    around = np.cross(tri[:, [1, 2, 0]] - point[:, None], tri[:, [2, 0, 1]] - point[:, None])
    weights = np.einsum("mci,mi->mc", around, face) / np.einsum("mi,mi->m", face, face)[:, None]
    smooth = np.einsum("mc,mci->mi", weights, item.vertex_normals[seen.prim_id[hit]])
    face[np.einsum("mi,mi->m", face, d) > 0] *= -1
    smooth[np.einsum("mi,mi->m", smooth, face) < 0] *= -1
    result = np.zeros((2, *hit.shape))
    to_light = np.array(scene.lights[0].position) - point
    for picture, normal in zip(result, (smooth, face), strict=True):
        length = np.linalg.norm(normal, axis=1) * np.linalg.norm(to_light, axis=1)
        picture[hit] = np.einsum("mi,mi->m", normal, to_light) / length
    return result[0], result[1]


def _steps(picture: FloatArray, hit: NDArray[np.bool_], light: Vector) -> tuple[float, float]:
    """Along all rows, from the side of the light to the other, beyond the brightest pixel: the greatest rise and the greatest fall."""
    away = slice(None) if light[0] < 0 else slice(None, None, -1)
    rise, fall = 0.0, 0.0
    for row, inside in zip(picture[:, away], hit[:, away], strict=True):
        row = row[inside]
        change = np.diff(row[row.argmax() :]) if len(row) else np.zeros(0)
        rise, fall = max(rise, change.max(initial=0.0)), max(fall, -change.min(initial=0.0))
    return rise, fall


@pytest.mark.parametrize("light", LIGHTS)
def test_coarse_convex_mesh_is_lit_by_its_normals_alone(light: Vector) -> None:
    """No facet of a sphere stands between another's curved surface and the light, so every pixel is max(N.L, 0)."""
    scene = _ball(light)
    seen = clrt.reference.render(scene)
    smooth, face = _cosines(scene, seen)
    expected = np.maximum(smooth, 0.0)
    np.testing.assert_allclose(seen.pixels[..., 0], expected, rtol=0, atol=1e-12)
    sure = seen.margin > MARGIN
    assert sure.mean() > 0.99
    np.testing.assert_allclose(clrt.render(scene).pixels[..., 0][sure], expected[sure], rtol=0, atol=BOUND)
    # By the faces' planes, as polygons would have it, pixels of up to a tenth of the full light are black.
    naive = np.where(face > 0.0, expected, 0.0)
    assert (expected - naive).max() > 0.05


@pytest.mark.parametrize("light", [LIGHTS[1], LIGHTS[4]])
def test_light_falls_off_evenly_along_rows(light: Vector) -> None:
    """A true ball falls by closed form; the mesh may fall half as steeply again, by polygons there is a step."""
    scene = _ball(light)
    seen = clrt.reference.render(scene)
    hit, sure = seen.prim_id >= 0, (seen.prim_id >= 0) & (seen.margin > MARGIN)
    smooth, face = _cosines(scene, seen)
    d = scene.camera.directions().astype(np.float64)
    half = d @ np.array([0.0, 0.0, 5.0])
    square = np.einsum("hwi,hwi->hw", d, d)
    root = half**2 - square * 24.0
    point = ((half - np.sqrt(np.maximum(root, 0.0))) / square)[..., None] * d + scene.camera.eye
    ball = np.where(root > 0.0, np.maximum(np.einsum("hwi,hwi->hw", point, np.array(light) - point), 0.0), 0.0) / np.linalg.norm(light)
    inner = (root > 0.15 * half**2 / 25.0) & sure  # beyond, at the outline, any ball is steep
    allowed = 1.5 * _steps(ball, inner, light)[1] + 0.005
    for picture in (seen.pixels[..., 0], clrt.render(scene).pixels[..., 0].astype(np.float64)):
        rise, fall = _steps(picture, inner & hit, light)
        assert rise < 0.004
        assert fall < allowed
    assert _steps(np.where(face > 0.0, np.maximum(smooth, 0.0), 0.0), inner, light)[1] > allowed


def test_lift_by_hand() -> None:
    """P = (0.5, 0.25, 0), b = (1/4, 1/2, 1/4): depths 0, 0.3, 0.6; P' - P = 0.15 n1 + 0.15 n2. Turned round, P is above all planes."""
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], np.float64)
    normals = np.array([[[0, 0, -1], [0.6, 0, -0.8], [0, 0.8, -0.6]]])
    weights, point, up = np.array([[0.25, 0.5, 0.25]]), np.array([[0.5, 0.25, 0.0]]), np.array([[0, 0, -1.0]])
    lift, growth = lifts(corners, normals, weights, point, up)
    np.testing.assert_allclose(lift, [[0.09, 0.12, -0.21]], rtol=1e-14)
    hollow, steady = lifts(corners, -normals, weights, point, -up)
    np.testing.assert_array_equal(hollow, np.zeros((1, 3)))
    assert steady[0] == 1.0
    # How fast P' moves with P, by differences.
    shift = 1e-6 * np.array([[0.6, -0.8, 0.0]])
    moved, _ = lifts(corners, normals, weights + 1e-6 * np.array([[0.2, 0.6, -0.8]]), point + shift, up)
    assert 0.0 < np.linalg.norm(moved + shift - lift) / 1e-6 <= growth[0]


def test_lift_never_sinks_below_the_face() -> None:
    """A normal that points below its face would pull the point down: what is left is the part along the face."""
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], np.float64)
    normals = np.array([[[0, 0, -1], [0.8, 0, 0.6], [0, 0, -1.0]]])
    lift, _ = lifts(corners, normals, np.array([[0.25, 0.5, 0.25]]), np.array([[0.5, 0.25, 0.0]]), np.array([[0, 0, -1.0]]))
    np.testing.assert_allclose(lift, [[0.5 * 0.4 * 0.8, 0.0, 0.0]], atol=1e-15)


@pytest.mark.parametrize(("slope", "hidden"), [(0.3, False), (0.5, True), (-0.5, False)])
def test_face_hides_what_is_steeply_behind_it(slope: float, hidden: bool) -> None:
    """From 0.1 above (0.5, 0.25) along (1, 0, slope): the plane is reached 0.1 / slope away, the triangle's edge is 0.25 away."""
    corners, point = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], np.float64), np.array([[0.5, 0.25, 0.0]])
    lift, light = np.array([[0, 0, -0.1]]), np.array([50.5, 0.25, 50 * slope - 0.1])
    answer, closeness = face_between(corners, np.array([[0, 0, -1.0]]), point, lift, light, np.array([1.0]))
    assert bool(answer[0]) == hidden
    assert closeness[0] > 0.0


@pytest.mark.parametrize("light", [(0.3, -0.2, 0.4), (-0.5, 0.3, 0.1)])
def test_hollow_mesh_is_lit_from_within(light: Vector) -> None:
    """The inside of a coarse sphere, seen from inside: there is no lift and nothing is hidden, so every pixel is N.L."""
    corners, normals = _globe()
    thirds = np.full((len(corners), 3), 1 / 3)
    inwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards *= -np.sign(np.einsum("mi,mi->m", inwards, corners[:, 0]))[:, None] / np.linalg.norm(inwards, axis=1)[:, None]
    assert not lifts(corners, -normals, thirds, corners.mean(axis=1), inwards)[0].any()
    assert (np.linalg.norm(lifts(corners, normals, thirds, corners.mean(axis=1), -inwards)[0], axis=1) > 0.01).all()
    scene = parse_scene(_camera((0, 0, -0.4), 70.0, 48) + f"L {_words(light)}\n" + MATTE + _mesh(*_globe()))
    seen = clrt.reference.render(scene)
    smooth, face = _cosines(scene, seen)
    assert (seen.prim_id >= 0).all()
    assert (face > 0.0).all()
    np.testing.assert_allclose(seen.pixels[..., 0], np.maximum(smooth, 0.0), rtol=0, atol=1e-12)
    np.testing.assert_allclose(clrt.render(scene).pixels[..., 0], np.maximum(smooth, 0.0), rtol=0, atol=BOUND)


@pytest.mark.parametrize(
    ("wall", "precision"),
    [("sphere", "watertight"), ("thick sphere", "exact"), ("rounded box", "watertight"),
     pytest.param("sphere", "exact", marks=pytest.mark.slow), pytest.param("thick sphere", "fast", marks=pytest.mark.slow),
     pytest.param("rounded box", "exact", marks=pytest.mark.slow)],
)  # fmt: skip
def test_no_light_enters_a_closed_mesh(wall: str, precision: str) -> None:
    """The inside of closed shells, lit from outside: dark in every pixel, though N.L > 0 holds for many."""
    if wall == "rounded box":
        corners = box((-1, -1, -1), (1, 1, 1))
        mesh = _mesh(corners, corners / np.sqrt(3.0))
    else:
        mesh = _mesh(*_globe()) + (_mesh(*_globe(1.6)) if wall == "thick sphere" else "")
    way = np.random.default_rng(5).normal(size=(6, 3))
    lights = "".join(f"L {_words(tuple(p))}\n" for p in way / np.linalg.norm(way, axis=1)[:, None] * [[1.8], [1.8], [2.5], [2.5], [9], [9]])
    scene = parse_scene(_camera((0.1, 0.2, -0.3), 100.0, 48) + lights + MATTE + mesh)
    seen = clrt.reference.render(scene)
    towards = max(_cosines(replace(scene, lights=(light,)), seen)[0].max() for light in scene.lights)
    assert towards > 0.1, "no light would reach these walls anyway"
    assert not seen.pixels.any()
    assert not clrt.render(scene, precision=precision).pixels[seen.margin > MARGIN].any()


def _rabbit(rng_seed: int, floor: str) -> str:
    vertices, faces = rabbit_like(1000, seed=rng_seed)
    corners, normals = vertices[faces], vertex_normals(vertices, faces)[faces]
    middle, size = (corners.max((0, 1)) + corners.min((0, 1))) / 2, np.ptp(corners, (0, 1)).max()
    return _mesh((corners - middle) / size * 1.6 + (0, 0, 1.2), np.round(normals, 3)) + floor


FLOOR = _mesh(np.array([[[-4, -0.8, -4], [4, -0.8, -4], [4, -0.8, 6]], [[-4, -0.8, -4], [4, -0.8, 6], [-4, -0.8, 6]]], np.float64))
PLASTIC = "M 0.9 0.8 0.7 0.1 0.7 0.4 12 0\n"


@cache
def _rabbit_picture() -> tuple[Scene, ReferencePicture]:
    lights = "L 3 1 1\nL -4 0.5 0.5 0.5 0.5 0.6\n"
    scene = parse_scene(_camera((0, 0, -2), 45.0, 64) + lights + PLASTIC + _rabbit(3, FLOOR) + "S -0.7 0.5 0.5 0.2\n")
    return scene, clrt.reference.render(scene)


@pytest.mark.slow
@pytest.mark.parametrize("precision", sorted(RUNGS))
def test_smooth_rabbit_matches_reference(precision: str) -> None:
    """Bumps, hollows, self-shadows and highlights, with a ball to shadow them: kernel against reference, pixel by pixel."""
    scene, seen = _rabbit_picture()
    wrong = np.abs(clrt.render(scene, precision=precision).pixels - seen.pixels).max(-1) > BOUND
    unexplained = wrong & (seen.margin > MARGIN)
    assert not unexplained.any(), f"{unexplained.sum()} pixels differ, the first at (row, column) {np.argwhere(unexplained)[0]}"
    assert wrong.mean() < 0.02
    assert (seen.margin > MARGIN).mean() > 0.97


@pytest.fixture
def by_polygons(monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs that take no triangle for curved, once its normal is interpolated."""
    compose, mark = program.compose, "hit->normal[a] = choose(hit->curved, mixed[a], hit->normal[a]);"

    def careless(*arguments: Any, **options: Any) -> str:
        source = compose(*arguments, **options)
        assert source.count(mark) == 1
        return source.replace(mark, mark + " hit->curved = NO_LANES;")

    monkeypatch.setattr(program, "compose", careless)


def test_kernel_without_curved_triangles_shows_polygons(by_polygons: None) -> None:
    scene = _ball(LIGHTS[0])
    seen = clrt.reference.render(scene)
    smooth, face = _cosines(scene, seen)
    sure = (seen.margin > MARGIN) & (np.abs(face) > MARGIN)
    off = np.abs(clrt.render(scene).pixels[..., 0] - np.maximum(smooth, 0.0))
    assert (off[sure & (smooth > 0.0) & (face < 0.0)] > 0.0).all()
    assert off[sure].max() > 0.05


FLAT_AND_SMOOTH = (
    _camera((0, 0, -2), 45.0, 72) + "L 3 1 1\nL -4 0.5 0.5 0.5 0.5 0.6\n" + PLASTIC + "M 0.9 0.8 0.7 0.1 0.7 0.4 12 0.4\n"
    + FLOOR + _mesh(box((0.5, -0.8, 0), (0.9, 0.1, 0.4))) + "S -0.7 0.5 0.5 0.2\n" + _mesh(0.3 * _globe()[0] + (-0.3, 0, 0.6), _globe()[1])
)  # fmt: skip


def test_flat_triangles_and_spheres_stay_to_the_bit(request: pytest.FixtureRequest) -> None:
    scene = parse_scene(FLAT_AND_SMOOTH)
    prim = clrt.reference.render(scene).prim_id
    rounded = clrt.render(scene).pixels
    request.getfixturevalue("by_polygons")
    polygons = clrt.render(scene).pixels
    first = scene.objects[-1].first_prim
    other = ~((prim >= first) & (prim < scene.triangle_count))
    assert other.mean() > 0.5
    np.testing.assert_array_equal(rounded[other], polygons[other])
    assert np.abs(rounded - polygons).max() > 0.01


def test_lone_curved_triangle_can_hide_itself() -> None:
    """Its face may stand between it and the light, so the program needs shadows; a flat one does not."""
    triangle = np.array([[[-1, -1, 0], [1, -1, 0], [0, 1, 0]]], np.float64)
    normals = np.array([[[0.6, 0.0, -0.8], [-0.6, 0.0, -0.8], [0.0, -0.6, -0.8]]])
    scene = parse_scene(_camera((0, 0, -3), 45.0, 48) + "L 4 0.5 1\n" + MATTE + _mesh(triangle, normals))
    assert "shadows" in Features.of(scene).effects
    assert "shadows" not in Features.of(parse_scene(_camera((0, 0, -3), 45.0, 48) + "L 4 0.5 1\n" + MATTE + _mesh(triangle))).effects
    seen = clrt.reference.render(scene)
    assert (_cosines(scene, seen)[0] > 0.05).any(), "some normals face the light behind the plane"
    assert not seen.pixels.any()
    assert not clrt.render(scene).pixels[seen.margin > MARGIN].any()


def test_source_without_smooth_triangles_knows_no_lift() -> None:
    text = _camera((0, 0, -3), 45.0, 16) + "L 4 0.5 -1\n" + MATTE + _mesh(box((-1, -1, -1), (1, 1, 1)))
    source = program.compose(Features.of(parse_scene(text)), rung("watertight"), 16, Shape(stack=8))
    assert not re.search(r"\blift\b|\bcurved\b|corner_normals", source)
