"""The reference tracer against closed forms: what is hit, where, how it is lit."""

from __future__ import annotations

import ast
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from reference_scenes import BLACK, glass, globe, matte, mesh, mirror, plane_y, plane_z, scene, shifted, spheres

from clrt.errors import SceneError
from clrt.reference import exact, render
from clrt.scene.model import Material, PointLight

FULL = Material((0.5, 0.25, 1.0), 0.1, 0.7, 0.4, 3.0)


def test_sphere_head_on_has_the_depth_of_the_formula():
    s = scene([], [matte(1.0)], balls=spheres((0, 0, 0, 1.25, 0)), size=(48, 40))
    picture = render(s)
    cosine = s.camera.directions()[:, :, 2]
    miss_distance = 5.0 * np.sqrt(1.0 - cosine**2)
    seen = miss_distance < 1.25
    assert 200 < seen.sum() < 48 * 40
    expected = 5.0 * cosine - np.sqrt(np.where(seen, 1.25**2 - miss_distance**2, 0.0))
    np.testing.assert_array_equal(picture.prim_id, np.where(seen, 0, -1))
    np.testing.assert_allclose(picture.t[seen], expected[seen], rtol=1e-13)
    assert np.isinf(picture.t[~seen]).all()
    np.testing.assert_array_equal(picture.pixels, np.where(seen, 1.0, 0.0)[:, :, None] * np.ones(3))


@pytest.mark.parametrize("far", [1e3, 1e5])
def test_far_sphere_has_the_depth_of_exact_roots(far):
    s = scene([], [matte(1.0)], balls=spheres((0, 0, 0, 1, 0)), eye=(0, 0, -far), fov=math.degrees(3.0 / far), size=(15, 15))
    picture = render(s)
    offset = far * np.tan(np.radians(3.0 * 180 / np.pi / far) / 2) * (2 * (np.arange(15) + 0.5) / 15 - 1)
    q = np.hypot(offset[None, :], offset[:, None])  # at distance `far`; the line passes the centre at q cos
    angle = np.arctan(q / far)
    with np.errstate(invalid="ignore"):
        depth = far * np.cos(angle) - np.sqrt(1.0 - (far * np.sin(angle)) ** 2)
    np.testing.assert_array_equal(picture.prim_id >= 0, far * np.sin(angle) < 1.0)
    hit = picture.prim_id >= 0
    np.testing.assert_allclose(picture.t[hit], depth[hit], rtol=0, atol=1e-9 * far**0.5)


def test_camera_inside_a_sphere_sees_its_far_side():
    s = scene([], [matte(1.0)], balls=spheres((0, 0, 1, 3, 0)), eye=(0, 0, 0))
    assert render(s).t[0, 0] == 4.0


def test_phong_on_a_plane_has_the_values_of_hand_computation():
    """N.L = 4/5 and R.V = 4/5 by the 3-4-5 triangle; seen along the normal."""
    light = PointLight((3.0, 0.0, -4.0), (1.0, 0.5, 2.0))
    picture = render(scene([mesh(plane_z(0.0))], [FULL], [light], eye=(0, 0, -1)))
    term = 0.7 * 0.8 + 0.4 * 0.8**3
    np.testing.assert_allclose(picture.pixels[0, 0], [0.5 * (0.1 + term), 0.25 * (0.1 + 0.5 * term), 0.1 + 2.0 * term], rtol=1e-14)


@pytest.mark.parametrize("turned", [False, True])
def test_faces_are_two_sided(turned):
    plane = plane_z(0.0)[:, ::-1] if turned else plane_z(0.0)
    front = render(scene([mesh(plane)], [FULL], [(3, 0, -4)], eye=(0, 0, -1))).pixels
    back = render(scene([mesh(plane)], [FULL], [(3, 0, 4)], eye=(0, 0, 1), view=(0, 0, -1))).pixels
    np.testing.assert_allclose(front, back, rtol=1e-14)
    behind = render(scene([mesh(plane)], [FULL], [(3, 0, 4)], eye=(0, 0, -1))).pixels[0, 0]
    np.testing.assert_allclose(behind, [0.05, 0.025, 0.1], rtol=1e-15)


@pytest.mark.parametrize(("light_x", "specular"), [(0.5, 1.0), (-3.0, 0.0)])
def test_exponent_zero_counts_only_where_the_mirror_image_faces_the_viewer(light_x, specular):
    """Viewer at 45 degrees; R.V > 0 for a light near the mirror direction, < 0 for one beyond 45 degrees on the viewer's side."""
    material = Material((1, 1, 1), 0.0, 0.0, 1.0, 0.0)
    s = scene([mesh(plane_z(0.0))], [material], [(light_x, 0, -1)], eye=(-1, 0, -1), view=(1, 0, 1))
    assert render(s).pixels[0, 0, 0] == specular


def test_smooth_normal_is_the_weighted_mean_of_the_corners():
    corner = np.array([[[0, 0, -1.0], [0.6, 0, -0.8], [0, 0.8, -0.6]]])
    triangle = [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
    s = scene([mesh(triangle, corner_normals=corner)], [matte()], [(0.5, 0.25, -1e9)], eye=(0.5, 0.25, -1))
    n = 0.25 * corner[0, 0] + 0.5 * corner[0, 1] + 0.25 * corner[0, 2]
    assert render(s).pixels[0, 0, 0] == pytest.approx(-n[2] / np.linalg.norm(n), rel=1e-9)
    # Turned normals are brought to the viewer's side.
    turned = scene([mesh(triangle, corner_normals=-corner)], [matte()], [(0.5, 0.25, -1e9)], eye=(0.5, 0.25, -1))
    np.testing.assert_allclose(render(turned).pixels, render(s).pixels, rtol=1e-14)


@pytest.mark.parametrize("bulge", [1.0, -1.0])
def test_light_behind_the_plane_of_a_curved_triangle_reaches_it_where_it_bulges(bulge):
    """At (0.5, 0.25, 0) the normal is (0.3, 0.2, -0.8) and the shadow ray leaves 0.21 above the face, at (0.59, 0.37, -0.21).

    Towards (1, 0, 0.3) it comes down to the plane at x = 1.29, beyond the triangle. A hollow triangle, its normals the other way, has the
    same cosine towards (-1, 0, 0.3), but no lift: its face is between.
    """
    corner = np.array([[[0, 0, -1.0], [0.6 * bulge, 0, -0.8], [0, 0.8 * bulge, -0.6]]])
    point, way = np.array([0.5, 0.25, 0.0]), np.array([bulge, 0.0, 0.3])
    s = scene([mesh([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], corner_normals=corner)], [matte()], [point + 1e6 * way], eye=(0.5, 0.25, -1))
    cosine = (0.3 - 0.24) / np.sqrt(0.77 * 1.09)
    assert render(s).pixels[0, 0, 0] == pytest.approx(cosine if bulge > 0.0 else 0.0, rel=1e-6)


def test_shadow_of_a_sphere_is_the_disc_of_the_tangent_cone():
    """Light at height 6, sphere of radius 1 at height 3: a disc of radius 6 tan(asin(1/3)) on the floor."""
    s = scene([mesh(plane_y(0.0))], [matte(), BLACK], [(0, 6, 0)], spheres((0, 3, 0, 1, 1)),
              eye=(0, 5, -9), view=(0, -5, 9), fov=70.0, size=(64, 48))  # fmt: skip
    picture = render(s)
    point = s.camera.eye + picture.t[:, :, None] * s.camera.directions()
    floor = (picture.prim_id == 0) | (picture.prim_id == 1)
    radius = np.hypot(point[:, :, 0], point[:, :, 2])
    edge = 6.0 * math.tan(math.asin(1.0 / 3.0))
    expected = np.where(radius > edge, 6.0 / np.hypot(6.0, radius), 0.0)
    assert (floor & (radius < edge)).sum() > 50
    np.testing.assert_allclose(picture.pixels[floor, 0], expected[floor], rtol=1e-12, atol=0)


def test_terminator_of_a_sphere_lies_where_the_light_sets():
    """Light at distance 3 from the centre of a unit sphere: lit where the polar angle's cosine exceeds 1/3, by the law of cosines."""
    s = scene([], [matte()], [(0, 3, 0)], spheres((0, 0, 0, 1, 0)), size=(40, 40), fov=25.0)
    picture = render(s)
    hit = picture.prim_id == 0
    n = (s.camera.eye + np.where(hit, picture.t, 0.0)[:, :, None] * s.camera.directions())[hit]
    cosine = n[:, 1]
    expected = np.where(cosine > 1 / 3, (3 * cosine - 1) / np.sqrt(10 - 6 * cosine), 0.0)
    assert 0.2 < (expected > 0).mean() < 0.8
    np.testing.assert_allclose(picture.pixels[hit, 0], expected, rtol=0, atol=1e-13)


def test_light_on_a_surface_is_not_hidden_by_it_but_by_what_is_before():
    wall = mesh(plane_z(0.0))
    ceiling = mesh(shifted(plane_z(-3.0, half=50.0), 0.3, 0.1, 0.0), first=2)
    blocker = mesh(plane_z(-2.0, half=1.0), first=4)
    lit = scene([wall, ceiling], [matte()], [(4, 0, -3)], eye=(0, 0, -1))
    assert render(lit).pixels[0, 0, 0] == pytest.approx(3 / 5, rel=1e-14)
    hidden = scene([wall, ceiling, mesh(shifted(blocker.vertices, 2.5, 0, 0), first=4)], [matte()], [(4, 0, -3)], eye=(0, 0, -1))
    assert render(hidden).pixels[0, 0, 0] == 0.0


def test_sealed_box_is_dark_at_any_offset():
    for offset in (0.0, 1e4, 1e6):
        box = globe(6, 1.0, (offset, -offset, 2 * offset))
        s = scene([mesh(box)], [matte()], [(offset, 5 - offset, 2 * offset)], eye=(offset, -offset, 2 * offset), fov=120.0, size=(24, 24))
        picture = render(s)
        assert (picture.prim_id >= 0).all()
        assert not picture.pixels.any()


def test_rays_at_vertices_of_a_closed_mesh_all_hit():
    ball = globe(10)
    eye = np.array([0.1, 0.2, -0.05])
    aim = np.unique(ball.reshape(-1, 3), axis=0)
    s = scene([mesh(ball)], [matte()], eye=eye, size=(len(aim), 1))
    picture = render(s, directions=(aim - eye)[None])
    assert (picture.prim_id >= 0).all()
    np.testing.assert_allclose(picture.t, 1.0, rtol=1e-12)
    assert (picture.margin < 1e-12).all()


def test_visible_primitive_is_that_of_the_exact_oracle():
    rng = np.random.default_rng(2)
    soup = rng.normal(size=(60, 3, 3))
    soup[30:40] = soup[20:30]  # coplanar duplicates
    eye = np.array([0.0, 0.0, -4.0])
    aim = np.concatenate([soup[:, 0], soup[:, 0] * 0.5 + soup[:, 1] * 0.5, soup.mean(axis=1)])
    directions = (aim - eye).astype(np.float32)[None]
    picture = render(scene([mesh(soup)], [matte()], eye=eye, size=(len(aim), 1)), directions=directions)
    prim, t = exact.first_hit(soup, np.broadcast_to(eye, (len(aim), 3)), directions[0])
    np.testing.assert_array_equal(picture.prim_id[0], prim)
    np.testing.assert_allclose(picture.t[0], t, rtol=1e-11)


def test_chunk_size_changes_nothing():
    s = scene([mesh(globe(8)), mesh(plane_y(-1.2), first=len(globe(8)), material=1)], [FULL, replace(FULL, reflect=0.5)], [(3, 4, -4)],
              spheres((1.5, 0, 0, 0.5, 1)), size=(24, 20))  # fmt: skip
    one, other = render(s), render(s, chunk_bytes=1)
    for name in ("pixels", "prim_id", "t", "margin"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert one.rays == other.rays


def test_offset_of_the_whole_scene_hardly_matters():
    def at(offset):
        move = np.array([1.0, -2.0, 3.0]) * offset
        balls = spheres((*(np.array([1.5, 0, 0]) + move), 0.5, 1))
        objects = [mesh(globe(8) + move), mesh(plane_y(-1.2) + move, first=len(globe(8)), material=1)]
        return render(scene(objects, [FULL, replace(FULL, reflect=0.5)], [np.array([3, 4, -4]) + move], balls,
                            eye=np.array([0, 0, -5]) + move, size=(32, 24)))  # fmt: skip

    here, there = at(0.0), at(2.0**20)
    clear = here.margin > 1e-6
    assert clear.mean() > 0.98
    np.testing.assert_array_equal(here.prim_id[clear], there.prim_id[clear])
    np.testing.assert_allclose(here.pixels[clear], there.pixels[clear], rtol=0, atol=1e-7)


def test_only_needed_rays_are_traced():
    floor = mesh(plane_y(-1.0))
    s = scene([floor], [FULL], [(0, 5, 0), (0, -5, 0)], size=(16, 16), depth=3)
    picture = render(s)
    seen = int((picture.prim_id >= 0).sum())
    assert 0 < seen < 256
    assert picture.rays == {"primary": 256, "shadow": seen, "reflected": 0, "refracted": 0, "passed": 0}
    shiny = render(scene([floor], [mirror(0.5)], [(0, 5, 0)], size=(16, 16), depth=3)).rays
    assert shiny == {"primary": 256, "shadow": 0, "reflected": seen, "refracted": 0, "passed": 0}
    flat = render(scene([floor], [replace(glass(1.5), reflect=0.5)], [(0, 5, 0)], size=(16, 16), depth=0)).rays
    assert flat == {"primary": 256, "shadow": 0, "reflected": 0, "refracted": 0, "passed": 0}


@pytest.mark.parametrize(
    ("directions", "message"),
    [(np.zeros((1, 1, 3)), "zero or not finite"), (np.full((1, 1, 3), np.nan), "zero or not finite"), (np.ones((2, 1, 3)), "shape")],
)
def test_unusable_directions_are_refused(directions, message):
    with pytest.raises(SceneError, match=message):
        render(scene([], [matte()]), directions=directions)


def test_unusable_scenes_are_refused():
    with pytest.raises(SceneError, match="index"):
        render(scene([mesh(plane_z(0.0))], [glass(0.0)]))
    with pytest.raises(SceneError, match="begins at primitive 7"):
        render(scene([mesh(plane_z(0.0), first=7)], [matte()]))


def test_the_reference_imports_nothing_it_judges():
    folder = Path(exact.__file__).parent
    allowed = ("clrt.reference", "clrt.scene.model", "clrt.errors")
    files = list(folder.glob("*.py"))
    assert len(files) > 5
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                assert not name.startswith(("clrt", ".")) or name.startswith(allowed), f"{file.name} imports {name}"
