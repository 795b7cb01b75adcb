"""Reflection, refraction and media of the reference tracer against the laws of optics; and its margins against perturbed pictures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from reference_scenes import box, glass, globe, matte, mesh, mirror, plane_y, plane_z, quad, scene, spheres

from clrt.reference import render
from clrt.reference.bounce import MediumStack
from clrt.scene.model import Material

FULL = Material((0.9, 0.6, 0.3), 0.1, 0.6, 0.4, 8.0)


def test_plane_mirror_shows_the_mirrored_scene():
    """The mirror at z = 3, the scene behind the eye: the same picture as seen from the eye's mirror image, without the mirror."""
    content = [mesh(globe(10, 1.0, (0.4, 0.2, -4.0)))]
    balls = spheres((-1.5, 0.3, -5.0, 0.8, 0))
    lights = [(4, 5, 0), (-6, 2, -1)]
    count = len(content[0])
    s = scene([*content, mesh(plane_z(3.0), first=count, material=1)], [FULL, mirror()], lights, balls, eye=(0, 0, 0), size=(40, 40))
    s = replace(s, background=(0.1, 0.2, 0.3))
    seen = render(s)
    image = replace(s, objects=tuple(content), camera=replace(s.camera, eye=np.array([0, 0, 6.0])))
    direct = render(image, directions=s.camera.directions() * [1, 1, -1])
    assert (direct.prim_id >= 0).mean() > 0.05
    assert (seen.prim_id >= count).all()
    clear = np.minimum(seen.margin, direct.margin) > 1e-9
    assert clear.mean() > 0.99
    np.testing.assert_allclose(seen.pixels[clear], direct.pixels[clear], rtol=0, atol=1e-12)


@pytest.mark.parametrize("depth", [0, 1, 2, 5])
def test_parallel_mirrors_sum_the_geometric_series_up_to_the_depth(depth):
    mirrors = [mesh(plane_z(2.0)), mesh(plane_z(-2.0), first=2)]
    s = scene(mirrors, [mirror(0.5, ambient=0.3)], eye=(0, 0, 0), depth=depth)
    picture = render(s)
    assert picture.pixels[0, 0, 0] == pytest.approx(0.3 * sum(0.5**k for k in range(depth + 1)), rel=1e-15)
    assert picture.rays["reflected"] == depth


def screen_value(x: float, y: float, height: float = 1.0) -> float:
    """What a matte screen shows at (x, y) from the foot of a light `height` above it."""
    return height / math.sqrt(height**2 + x**2 + y**2)


@pytest.mark.parametrize("angle_deg", [0.0, 20.0, 45.0, 70.0])
@pytest.mark.parametrize("seed", [0, 1])
def test_glass_slab_displaces_a_ray_by_snells_formula(angle_deg, seed):
    """A slab of thickness 2 and index 1.5, faces in any orientation; the screen at z = 8 shows where the ray arrives."""
    angle = math.radians(angle_deg)
    slab = box((-60, -50, 0), (50, 60, 2))
    turned = np.random.default_rng(seed).random(len(slab)) < 0.5
    slab[turned] = slab[turned][:, ::-1]
    s = scene([mesh(slab, material=1), mesh(plane_z(8.0), first=12)], [matte(), glass(1.5)], [(4, 0, 7)], eye=(0.3, 0.2, -1))
    picture = render(s, directions=np.array([[[math.sin(angle), 0.0, math.cos(angle)]]]))
    inner = math.asin(math.sin(angle) / 1.5)
    x = 0.3 + 7.0 * math.tan(angle) + 2.0 * math.tan(inner)
    assert picture.pixels[0, 0, 0] == pytest.approx(screen_value(x - 4.0, 0.2), rel=1e-12)
    assert picture.rays["refracted"] == 2


def ball_lens_value(ior: float, height: float = 0.6) -> float:
    """The screen's value for the ray of `height` through a unit ball at the origin: it leaves turned by 2 (i - r) towards the axis."""
    outer, inner = math.asin(height), math.asin(height / ior)
    turn = 2.0 * (outer - inner)
    exit_angle = (math.pi - outer) - (math.pi - 2.0 * inner)  # of the exit point, from +z: the entry's, less the chord's
    y, z = math.sin(exit_angle), math.cos(exit_angle)
    return screen_value(y + (4.0 - z) * math.tan(-turn), 0.0)


@pytest.mark.parametrize("ior", [1.0, 1.2, 1.5])
def test_ball_lens_turns_a_ray_by_twice_the_difference_of_angles(ior):
    s = scene([mesh(plane_z(4.0))], [matte(), glass(ior)], [(0, 0, 3)], spheres((0, 0, 0, 1, 1)), eye=(0, 0.6, -3))
    assert render(s).pixels[0, 0, 0] == pytest.approx(ball_lens_value(ior), rel=1e-12)


def test_nested_ball_of_equal_index_changes_nothing():
    materials = [matte(), glass(1.5)]
    lone = scene([mesh(plane_z(4.0))], materials, [(0, 0, 3)], spheres((0, 0, 0, 1, 1)), eye=(0, 0.3, -3))
    nested = replace(lone, spheres=spheres((0, 0, 0, 1, 1), (0.0, 0.1, 0.2, 0.6, 1)))
    one, other = render(lone), render(nested)
    assert other.rays["refracted"] == one.rays["refracted"] + 2
    np.testing.assert_allclose(other.pixels, one.pixels, rtol=1e-13)


def prism_picture(ior: float, depth: int = 5, refract: float = 0.9, reflect: float = 0.0):
    """The background (1) through a right-angled prism: the ray enters a leg straight and meets the slanted face at 45 degrees."""
    p = np.array([[x, y, z] for x in (-1.0, 1.0) for y, z in ((-1, 0), (1, 0), (-1, 2))])
    faces = [p[[0, 1, 2]], p[[3, 5, 4]], *quad(*p[[0, 1, 4, 3]]), *quad(*p[[0, 2, 5, 3]]), *quad(*p[[1, 2, 5, 4]])]
    s = scene([mesh(np.array(faces))], [glass(ior, refract, reflect)], eye=(0.13, -0.2, -3), depth=depth, background=(1.0, 1.0, 1.0))
    return render(s)


def prism(*arguments: float) -> float:
    return float(prism_picture(*arguments).pixels[0, 0, 0])


def test_total_reflection_begins_at_the_critical_angle():
    """sqrt(2) is the index whose critical angle is 45 degrees. Total: in, reflected, out; else in and out."""
    assert prism(math.sqrt(2.0) * (1 + 1e-9)) == pytest.approx(0.9**3, rel=1e-14)
    assert prism(math.sqrt(2.0) * (1 - 1e-9)) == pytest.approx(0.9**2, rel=1e-14)
    assert prism(2.0, 2) == 0.0
    assert prism(1.2, 2) == pytest.approx(0.9**2, rel=1e-14)


@pytest.mark.parametrize(("depth", "paths"), [(0, 0), (1, 1), (3, 2), (5, 3)])
def test_total_reflection_adds_refract_to_reflect(depth, paths):
    """Reflect 1/4, Refract 1/2: every path's weight is its product, with 3/4 at the slanted face.

    The entry's own reflection; in, slant, out; in, slant, back from the exit, slant, out through the entry.
    """
    weights = [0.25, 0.5 * 0.75 * 0.5, 0.5 * 0.75 * 0.25 * 0.75 * 0.5]
    assert prism(2.0, depth, 0.5, 0.25) == pytest.approx(sum(weights[:paths]), rel=1e-14)


def test_hundred_total_reflections_keep_all_energy():
    """A light guide: index 2, walls met at 60 degrees from the normal; entered through its end, the ray never leaves a side wall."""
    guide = box((-1, -1, 0), (1, 1, 1000))
    s = scene([mesh(guide)], [glass(2.0)], eye=(0.1, 0.0, -0.1), depth=120, background=(1.0, 1.0, 1.0))
    outer = math.asin(2.0 * math.sin(math.radians(12.0)))
    picture = render(s, directions=np.array([[[math.sin(outer), 0.0, math.cos(outer)]]]))
    bounces = picture.rays["reflected"]
    assert abs(bounces - 1000 * math.tan(math.radians(12.0)) / 2) <= 1
    assert picture.rays["refracted"] == 2
    assert picture.pixels[0, 0, 0] == pytest.approx(1.0, rel=1e-12)


def test_medium_stack_leaves_from_any_place_and_replaces_the_ninth():
    one = np.array([1.0])
    stack = MediumStack.outside(1)
    assert stack.index[0] == 1.0
    for k in range(3):
        stack = stack.crossed(np.array([10 + k]), one * (1.5 + k))
    assert stack.index[0] == 3.5
    stack = stack.crossed(np.array([11]), one * 9.0)  # left from the middle: the newest stays
    assert (stack.index[0], stack.count[0]) == (3.5, 2)
    stack = stack.crossed(np.array([12]), one * 9.0)
    assert (stack.index[0], stack.count[0]) == (1.5, 1)
    stack = stack.crossed(np.array([10]), one * 9.0)
    assert (stack.index[0], stack.count[0]) == (1.0, 0)
    for k in range(9):
        stack = stack.crossed(np.array([k]), one * (2.0 + k))
    assert (stack.index[0], stack.count[0]) == (10.0, 8)
    stack = stack.crossed(np.array([8]), one)
    assert (stack.index[0], stack.count[0]) == (8.0, 7)


def test_shading_normal_cannot_send_a_reflection_below_the_surface():
    """Corner normals tilted by 60 degrees: the mirror direction about them would go under; about the plane's own it goes straight back."""
    tilt = np.broadcast_to([math.sin(1.05), 0.0, -math.cos(1.05)], (2, 3, 3)).copy()
    plane = mesh(plane_z(0.0), corner_normals=tilt)
    s = scene([plane, mesh(plane_z(-9.0), first=2, material=1)], [mirror(), matte(0.7)], eye=(0, 0, -5))
    assert render(s).pixels[0, 0, 0] == 0.7


def mixed_scene(size=(72, 54)):
    ball = globe(7, 0.9, (-1.3, 0.1, 0.5))
    floor = plane_y(-1.0, half=6.0)
    materials = [FULL, replace(FULL, reflect=0.4), replace(glass(1.4, 0.8, 0.1), ambient=0.02), replace(FULL, reflect=0.5, diffuse=0.2)]
    balls = spheres((1.1, -0.2, 0.3, 0.8, 2), (0.2, 0.6, 2.5, 1.1, 3), (0.0, -0.7, -0.8, 0.3, 0))
    smooth = globe(6, 0.5, (0.3, -0.4, 4.5))
    corner = (smooth - [0.3, -0.4, 4.5]) / 0.5
    objects = [mesh(ball), mesh(floor, len(ball), 1), mesh(smooth, len(ball) + 2, 3, corner)]
    return scene(objects, materials, [(3, 5, -4), (-4, 3, 0)], balls, eye=(0.1, 0.5, -5), view=(0, -0.1, 1), fov=50.0, size=size, depth=3,
                 background=(0.2, 0.3, 0.4))  # fmt: skip


def bisected_jumps(s, steps=16):
    """Between pixels side by side, bisect towards where the picture jumps: two pictures of (1, k) rays, and their angle (k,).

    Of each pair's halves the one of greater difference is kept, so that what still differs at the end is a discontinuity.
    """
    d = s.camera.directions()
    left, right = d[:, :-1].reshape(-1, 3), d[:, 1:].reshape(-1, 3)

    def look(directions):
        camera = replace(s.camera, width=len(directions), height=1)
        return render(replace(s, camera=camera), directions=directions[None])

    a, b = look(left), look(right)
    for _ in range(steps):
        keep = difference(a, b) > 0.03
        a, b, left, right = taken(a, keep), taken(b, keep), left[keep], right[keep]
        middle = left + right
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        m = look(middle)
        in_left = difference(a, m) > difference(m, b)
        a, b = mixed(in_left, a, m), mixed(in_left, m, b)
        left, right = np.where(in_left[:, None], left, middle), np.where(in_left[:, None], middle, right)
    return a, b, np.linalg.norm(left - right, axis=1)


def difference(a, b):
    return np.abs(a.pixels - b.pixels).max(axis=2)[0]


def taken(picture, keep):
    return replace(picture, pixels=picture.pixels[:, keep], margin=picture.margin[:, keep])


def mixed(choice, a, b):
    return replace(a, pixels=np.where(choice[None, :, None], a.pixels, b.pixels), margin=np.where(choice, a.margin, b.margin))


@pytest.mark.slow
def test_margins_are_small_on_both_sides_of_every_jump():
    """Whatever jumps between two rays 1e-7 apart was decided by less: outlines, shadows, in mirrors and glass, total reflection."""
    a, b, angle = bisected_jumps(mixed_scene())
    jump = difference(a, b) > 0.02
    assert (angle < 1e-6).all()
    assert jump.sum() > 300
    worst = np.maximum(a.margin, b.margin)[0, jump] / angle[jump]
    assert worst.max() < 4.0


def test_margins_are_small_in_few_pixels():
    """Two bounces off curved mirrors and glass magnify errors a thousandfold in places: there, and only there, much is close."""
    margin = render(replace(mixed_scene(), depth=2)).margin
    assert not np.isnan(margin).any()
    assert (margin < 1e-5).mean() < 0.01
    assert (margin < 1e-7).mean() < 0.001
    straight = render(replace(mixed_scene(), depth=0)).margin
    assert (straight < 1e-5).mean() < 0.003


def test_margin_of_a_lone_edge_is_the_angle_to_it():
    triangle = mesh([[[0, -50, 0], [0, 50, 0], [80, 0, 0]]])
    for angle in (1e-4, -1e-4, 3e-8, -3e-8):
        s = scene([triangle], [matte(1.0)], eye=(0, 0, -2))
        picture = render(s, directions=np.array([[[math.sin(angle), 0.0, math.cos(angle)]]]))
        assert (picture.prim_id[0, 0] == 0) == (angle > 0)
        assert picture.margin[0, 0] == pytest.approx(abs(angle), rel=1e-6)


def test_margin_of_a_shadow_edge_is_that_of_the_segment():
    """The blocker's edge is off the segment by 1e-5; both ends of the segment are about 5 from the eye."""
    for gap in (1e-5, -1e-5):
        wall = mesh(plane_z(0.0))
        blocker = mesh([[[1 + gap, -50, -2], [1 + gap, 50, -2], [80, 0, -2]]], first=2, material=0)
        s = scene([wall, blocker], [matte()], [(2, 0, -4)], eye=(0, 0, -5))
        picture = render(s)
        assert (picture.pixels[0, 0, 0] > 0) == (gap > 0)
        assert 1e-6 / 5 < picture.margin[0, 0] < 1e-5


@pytest.mark.parametrize("excess", [1e-5, -1e-5, 1e-8, -1e-8])
def test_margin_near_the_critical_angle_is_the_angle_to_it(excess):
    """sin = n / sqrt(2) reaches 1 at sqrt(2); k = 1 - sin^2 = -2 excess, and turning by x changes k by 2 x."""
    margin = prism_picture(math.sqrt(2.0) * (1 + excess)).margin[0, 0]
    assert abs(excess) / 4.0 < margin < abs(excess) * 4.0
    assert prism_picture(1.7).margin[0, 0] == np.inf


@pytest.mark.parametrize(("specular", "decided"), [(0.5, True), (0.0, False)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_margin_of_a_setting_light_counts_where_the_highlight_jumps(specular, decided, side):
    """N.L = 1e-5 on either side; the highlight is 0.6^2 there, the diffuse term goes to zero by itself."""
    material = Material((1, 1, 1), 0.1, 0.5, specular, 2.0)
    s = scene([mesh(plane_z(0.0))], [material], [(-4, 0, -4e-5 * side)], eye=(3, 0, -4), view=(-3, 0, 4))
    picture = render(s)
    assert (picture.pixels[0, 0, 0] > 0.2) == (decided and side > 0)
    low, high = (1e-6, 4e-5) if decided else (np.inf, np.inf)
    assert low <= picture.margin[0, 0] <= high
