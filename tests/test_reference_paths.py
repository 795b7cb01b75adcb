"""The reference of sampled light against closed forms and quadrature: whoever judges others is judged first."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from reference_scenes import BLACK, box, matte, mesh, mirror, plane_y, plane_z, quad, scene, spheres

from clrt.errors import LimitError, SceneError
from clrt.reference import render
from clrt.reference.paths import PathPicture, render_paths
from clrt.scene.model import Environment, Indirect, Lens, Material, Scene, Shutter

NARROW = 0.01  #: degrees of a picture that is one ray for all purposes


def lamp(radiance: tuple[float, float, float] = (1.0, 1.0, 1.0), of: Material = BLACK) -> Material:
    return replace(of, emission=radiance, emission_line=1)


def looking_down(objects, materials, balls=None, **keys) -> Scene:
    """The point (0, 0, 0) of the plane y = 0, material 0, seen from (-3, 2, 0) as one pixel."""
    floor = [mesh(plane_y(0.0))]
    return scene([*floor, *objects], materials, balls=balls, eye=(-3, 2, 0), view=(3, -2, 0), fov=NARROW, **keys)


def check(picture: PathPicture, expected: float | list[float], relative: float) -> None:
    """Within 4 standard deviations, which are `relative` at most."""
    deviation = np.sqrt(picture.variance_of_mean[0, 0])
    wanted = np.broadcast_to(np.array(expected), 3)
    assert (deviation <= relative * wanted + 1e-12).all()
    assert np.abs(picture.mean[0, 0] - wanted).max() <= 4.0 * deviation.max() + 1e-9


def lambert(polygon: np.ndarray) -> float:
    """Irradiance at the origin of a plane with the normal +y from a polygon above it of radiance 1 (Lambert 1760): half the sum of the
    edges' angles times the cosines of their planes' normals."""
    unit = polygon / np.linalg.norm(polygon, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(unit, np.roll(unit, -1, axis=0), strict=True):
        across = np.cross(a, b)
        total += math.atan2(float(np.linalg.norm(across)), float(a @ b)) * across[1] / np.linalg.norm(across)
    return abs(total) / 2.0


def fan(polygon: np.ndarray) -> np.ndarray:
    return np.array([polygon[[0, k, k + 1]] for k in range(1, len(polygon) - 1)])


def moved(polygon: np.ndarray, *by: float) -> np.ndarray:
    return np.asarray(polygon + np.array(by))


RECTANGLE = np.array([[-1.0, 2.0, -0.5], [1.5, 2.0, -0.5], [1.5, 2.0, 1.0], [-1.0, 2.0, 1.0]])
ANGLES = np.arange(24) * (2.0 * np.pi / 24.0)
DISC = np.stack([np.cos(ANGLES), np.full(24, 1.5), np.sin(ANGLES)], axis=1)


@pytest.mark.parametrize(
    "polygon", [RECTANGLE, moved(RECTANGLE[:3], 0.3, -0.5, 0.2), np.where(RECTANGLE == 1.5, [2.0, 0.0, 0.0], RECTANGLE), DISC],
    ids=["rectangle", "triangle", "slanted", "disc"],
)  # fmt: skip
def test_area_light_over_a_plane_matches_lamberts_formula(polygon: np.ndarray) -> None:
    s = looking_down([mesh(fan(polygon), 2, 1)], [matte(diffuse=0.8), lamp((1.0, 2.0, 0.5))])
    check(render_paths(s, 20000, 1), [0.8 / math.pi * lambert(polygon) * c for c in (1.0, 2.0, 0.5)], 0.02)


def test_lamberts_formula_of_the_many_cornered_disc_is_near_the_discs_own() -> None:
    """A disc of radius R at the height h: pi R^2 / (R^2 + h^2); the polygon has 1.1% less area."""
    assert lambert(DISC) == pytest.approx(math.pi / (1.0 + 1.5**2), rel=0.02)


def test_sphere_light_matches_its_closed_form() -> None:
    """Le (r / d)^2 cos theta, wholly above the horizon; half of a shadow by a screen that hides one half."""
    ball = spheres((1.0, 2.0, 0.0, 0.5, 1))
    expected = 0.9 * 3.0 * 0.25 / 5.0 * (2.0 / math.sqrt(5.0))
    bare = looking_down([], [matte(diffuse=0.9), lamp((3.0, 3.0, 3.0))], ball)
    check(render_paths(bare, 40000, 2), expected, 0.02)
    # The plane z = 0 through the hit and the centre: what is beyond it is hidden by a screen that ends in that plane.
    screen = mesh(quad((-1, 1, 0), (9, 1, 0), (9, 1, 9), (-1, 1, 9)), 2, 2)
    half = looking_down([screen], [matte(diffuse=0.9), lamp((3.0, 3.0, 3.0)), BLACK], ball)
    check(render_paths(half, 40000, 3), expected / 2.0, 0.02)


def test_lamps_are_seen_and_light_through_mirrors_but_once() -> None:
    """Seen directly: Le; in a mirror of 0.5: Le / 2; with indirect light the same, as rays drawn for a lobe do not count it again."""
    wall = mesh(plane_z(2.0), 0, 0)
    check(render_paths(scene([wall], [lamp((2.0, 2.0, 2.0))], fov=NARROW), 10, 1), 2.0, 1e-9)
    behind = mesh(plane_z(-9.0), 2, 1)
    for indirect in (None, Indirect()):
        s = replace(scene([wall, behind], [mirror(0.5), lamp((2.0, 2.0, 2.0))], fov=NARROW), indirect=indirect)
        check(render_paths(s, 10, 1), 1.0, 1e-9)


@pytest.mark.parametrize("depth", [0, 1, 6])
@pytest.mark.parametrize("round_walls", [False, True])
def test_furnace_sums_the_geometric_series_up_to_the_depth(depth: int, round_walls: bool) -> None:
    """All walls shine with e = 0.5 and scatter a = 0.7: hits 0 to depth each add a^k e, and the last one's light from the walls."""
    wall = lamp((0.5, 0.5, 0.5), matte(diffuse=0.7))
    objects = [] if round_walls else [mesh(box((-2, -2, -6), (2, 2, 2)))]
    balls = spheres((0, 0, -5, 3, 0)) if round_walls else spheres((0.3, 0.2, -2, 0.7, 0))
    s = replace(scene(objects, [wall], balls=balls, fov=60.0, depth=depth), indirect=Indirect())
    check(render_paths(s, 20000, 4), 0.5 * sum(0.7**k for k in range(depth + 2)), 0.02)


def test_indirect_light_of_a_lit_wall_matches_the_form_factor() -> None:
    """A wall of radiance known by its point lights lights the floor as an area light of that radiance: two boundless walls at a right
    angle have the form factor 1/2 for points of the corner's bisecting strip; here by Lambert for a near square, lit from far away."""
    square = np.array([[1.0, 0.5, -1.0], [1.0, 2.5, -1.0], [1.0, 2.5, 1.0], [1.0, 0.5, 1.0]])
    far = 1e6
    s = looking_down([mesh(fan(square), 2, 1)], [matte(diffuse=0.8), matte(diffuse=0.6)], lights=[(-far, 1.5, 0.0)])
    shown = render_paths(replace(s, indirect=Indirect()), 40000, 5)
    direct = render(s).pixels[0, 0, 0]
    check(shown, direct + 0.8 / math.pi * lambert(square) * 0.6, 0.02)


def test_background_lights_by_scattered_rays_alone() -> None:
    s = replace(looking_down([], [matte(ambient=0.3, diffuse=0.8)]), background=(1.0, 0.5, 0.25))
    check(render_paths(s, 10, 1), 0.3, 1e-9)
    check(render_paths(replace(s, indirect=Indirect()), 10, 1), [0.8, 0.4, 0.2], 1e-9)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 7.0])
def test_highlight_in_uniform_surroundings_has_the_closed_integral(exponent: float) -> None:
    """Seen square on, Ks / pi times the integral of cos^n over the half sphere: 2 Ks / (n + 1); by light samples and by drawn rays."""
    shiny = Material((1.0, 0.5, 0.2), 0.0, 0.3, 0.4, exponent)
    expected = [(0.3 + 0.8 / (exponent + 1.0)) * c for c in (1.0, 0.5, 0.2)]
    s = scene([mesh(plane_z(0.0))], [shiny], fov=NARROW)
    around = Environment(np.ones((2, 4, 3)))
    check(render_paths(replace(s, environment=around), 40000, 6), expected, 0.01)
    check(render_paths(replace(s, background=(1.0, 1.0, 1.0), indirect=Indirect()), 20000, 7), expected, 0.01)
    check(render_paths(replace(s, environment=around, indirect=Indirect()), 40000, 8), expected, 0.01)


def test_sphere_in_uniform_surroundings_shows_its_colour_everywhere() -> None:
    s = scene([], [matte(diffuse=0.6)], balls=spheres((0, 0, 0, 1, 0)), fov=12.0, size=(4, 4))
    picture = render_paths(replace(s, environment=Environment(np.ones((1, 1, 3)))), 4000, 9)
    z = (picture.mean - 0.6) / np.sqrt(picture.variance_of_mean)
    assert np.sqrt(picture.variance_of_mean).max() < 0.02
    assert np.abs(z).max() < 4.0


@pytest.mark.parametrize(("rotation", "brightest"), [(0.0, "z"), (90.0, "x"), (-90.0, "-x"), (180.0, "-z")])
def test_environment_turns_by_its_rotation(rotation: float, brightest: str) -> None:
    """The middle of the picture, towards +z at rotation 0, wanders towards +x; a mirror-free eye sees it as it is."""
    radiance = np.zeros((4, 8, 3))
    radiance[1:3, 3:5] = 1.0
    towards = {"z": (0, 0, 1), "x": (1, 0, 0), "-x": (-1, 0, 0), "-z": (0, 0, -1)}
    for name, view in towards.items():
        s = scene([mesh(plane_y(-50.0))], [matte()], view=view, fov=NARROW)
        picture = render_paths(replace(s, environment=Environment(radiance, math.radians(rotation))), 10, 1)
        check(picture, float(name == brightest), 1e-9)


@pytest.mark.parametrize(("z", "offset"), [(4.0, 0.02), (4.0, -0.3), (1.0, 0.1), (2.0, 0.0005), (2.0, -0.0005)])
def test_lens_blurs_an_edge_by_the_segment_of_its_disc(z: float, offset: float) -> None:
    """An edge at the distance z, sharp plane at 2: the part of the disc from which a ray that aims `offset` a unit beside the edge ends
    beyond it is the segment beyond c = -x / (r (1 - z / 2)): (acos c - c sqrt(1 - c^2)) / pi."""
    wall = quad((0, -50, z), (50, -50, z), (50, 50, z), (0, 50, z))
    s = scene([mesh(wall)], [lamp()], eye=(0, 0, 0), view=(offset, 0.0, 1.0), fov=1e-4)
    # The picture's plane is square to the view, tilted by `offset`: distances along it differ by less than 5%, for offset 0.3.
    turned = replace(s.camera, corners=np.array([[offset + x, y, 1.0] for y in (1e-6, -1e-6) for x in (-1e-6, 1e-6)]))
    picture = render_paths(replace(s, camera=turned, lens=Lens(0.25, 2.0)), 20000, 10)
    width = 0.25 * (1.0 - z / 2.0)
    c = np.clip(-offset * z / abs(width), -1.0, 1.0) if width else -math.copysign(1.0, offset)
    check(picture, (math.acos(c) - c * math.sqrt(1.0 - c * c)) / math.pi, 0.02)


def test_moving_object_covers_the_pixel_for_its_part_of_the_time() -> None:
    """A lamp of width 1 that starts with its near edge 1 beside the line of sight, at a speed of 2: seen from t = 0.5 to 1 of 0 to 1.6;
    with the eye moving along at 1, from t = 1 on."""
    strip = replace(mesh(quad((-2, -5, 0), (-1, -5, 0), (-1, 5, 0), (-2, 5, 0))), motion=(2.0, 0.0, 0.0))
    s = scene([strip], [lamp()], fov=NARROW)
    check(render_paths(replace(s, shutter=Shutter(0.0, 1.6)), 20000, 11), 0.5 / 1.6, 0.02)
    check(render_paths(replace(s, shutter=Shutter(0.0, 1.6, (1.0, 0.0, 0.0))), 20000, 12), 0.6 / 1.6, 0.02)


def test_moving_lamp_lights_from_where_it_is() -> None:
    """The mean over the time of Lambert's formula for the shifted rectangle."""
    light = replace(mesh(fan(RECTANGLE), 2, 1), motion=(0.0, 0.0, 3.0))
    s = replace(looking_down([light], [matte(diffuse=0.8), lamp()]), shutter=Shutter(0.0, 1.0))
    times = (np.arange(200) + 0.5) / 200
    expected = np.mean([0.8 / math.pi * lambert(moved(RECTANGLE, 0.0, 0.0, 3.0 * t)) for t in times])
    check(render_paths(s, 20000, 13), float(expected), 0.02)


def test_pictures_without_sampled_effects_match_the_tracer() -> None:
    """Phong, shadows, mirrors, glass with absorption, spheres: the tracer's picture on a grid of 16 x 16 places a pixel."""
    glass = replace(Material((1.0, 1.0, 1.0), 0.02, 0.1, 0.3, 20.0, 0.1, 0.8, 1.4), absorb=(0.1, 0.2, 0.5), absorb_line=1)
    full = Material((0.9, 0.6, 0.3), 0.1, 0.6, 0.4, 8.0)
    boxes = [box((-1.6, -0.8, 0.2), (-0.7, 0.3, 1.1)), box((-0.4, -0.9, -1), (0.1, 0, -0.6))]
    objects = [mesh(plane_y(-1.0, 6.0), 0, 1), mesh(boxes[0], 2, 0), mesh(boxes[1], 14, 2)]
    balls = spheres((1.1, -0.2, 0.3, 0.8, 2), (0.2, 0.6, 2.5, 1.1, 1))
    s = scene(objects, [full, replace(full, reflect=0.4), glass], [(3, 5, -4), (-4, 3, 0)], balls, eye=(0.1, 0.5, -5), view=(0, -0.1, 1),
              size=(8, 6), depth=4, background=(0.2, 0.3, 0.4))  # fmt: skip
    fine = render(s.with_size(8 * 16, 6 * 16)).pixels.reshape(6, 16, 8, 16, 3).mean((1, 3))
    picture = render_paths(s, 600, 14)
    # The grid misses a pixel's integral by less than a row of its cells where edges cross it.
    error = np.sqrt(picture.variance_of_mean + (1 / 16 / np.sqrt(12)) ** 2 / 16)
    assert np.sqrt(picture.variance_of_mean).max() < 0.02
    assert (np.abs(picture.mean - fine) / error).max() < 4.6


def test_means_are_the_same_for_a_seed_and_vary_as_stated() -> None:
    s = looking_down([mesh(fan(RECTANGLE), 2, 1)], [matte(), lamp()])
    assert (render_paths(s, 50, 1).mean == render_paths(s, 50, 1).mean).all()
    means = np.array([render_paths(s, 50, seed).mean[0, 0, 0] for seed in range(200)])
    stated = np.mean([render_paths(s, 50, seed).variance_of_mean[0, 0, 0] for seed in range(20)])
    assert means.var(ddof=1) == pytest.approx(stated, rel=0.4)  # chi-square of 199: 0.1 is a standard deviation


def test_what_has_no_one_expectation_is_refused() -> None:
    s = looking_down([], [matte()])
    with pytest.raises(LimitError, match="take 2 or more"):
        render_paths(s, 1, 0)
    with pytest.raises(SceneError, match="clamp"):
        render_paths(replace(s, indirect=Indirect(clamp=3.0)), 10, 0)
