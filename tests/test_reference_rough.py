"""Rough lobes and fog of the reference of sampled light, against closed forms and quadrature of the formulas."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from reference_scenes import BLACK, glass, matte, mesh, mirror, plane_z, quad, scene, spheres
from test_reference_paths import NARROW, check, lamp, looking_down
from ztest import chi_square, chi_square_p

from clrt.reference.path_fog import phase
from clrt.reference.path_microfacet import COSINES, density, drawn_facets, lobe, lobe_tables
from clrt.reference.paths import render_paths
from clrt.scene.model import Environment, Fog, Indirect, Material, PointLight, Scene, Shutter

AROUND = Environment(np.ones((1, 1, 3)))


def directions(n: int) -> tuple[np.ndarray, float]:
    """Midpoints of n x 2n cells of the half sphere about +y, equal in solid angle, (2 n^2, 3), and that angle."""
    y, phi = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(2 * n) + 0.5) * (np.pi / n), indexing="ij")
    s = np.sqrt(1.0 - y * y)
    return np.stack([s * np.cos(phi), y, s * np.sin(phi)], axis=-1).reshape(-1, 3), math.pi / n**2


def slanted(slope: float, material: Material, **effects: object) -> Scene:
    """The plane y = 0 seen under the angle whose cosine is `slope`, as one pixel."""
    sine = math.sqrt(1.0 - slope**2)
    s = looking_down([], [material])
    s = replace(s, camera=replace(s.camera, eye=np.array([-sine, slope, 0.0])))
    aim = np.array([sine, -slope, 0.0]) + np.array([[x * slope, x * sine, z] for x in (1e-5, -1e-5) for z in (1e-5, -1e-5)])
    return replace(s, camera=replace(s.camera, corners=aim), **effects)  # type: ignore[arg-type]


@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_density_of_facets_is_normalised(alpha: float) -> None:
    """The integral of D cos over the half sphere is 1; by the facets' angle, finely near 0."""
    angle = np.pi / 2.0 * ((np.arange(20000) + 0.5) / 20000) ** 2
    width = np.pi * np.sqrt(angle * 2.0 / np.pi) / 20000
    total = (density(np.cos(angle), np.asarray(alpha)) * np.cos(angle) * np.sin(angle) * width).sum() * 2.0 * np.pi
    assert total == pytest.approx(1.0, rel=1e-5)


@pytest.mark.parametrize("alpha", [0.2, 0.7])
def test_drawn_facets_follow_their_density(alpha: float) -> None:
    """Chi-square over 40 bands of height and 8 sectors; the bands' shares by the integral of D cos in closed form:
    tangent^2 / (alpha^2 + tangent^2) of it lies within the angle of that tangent."""
    count = 20000
    rng = np.random.default_rng(2)
    normal = np.array([0.6, 0.8, 0.0])
    facet, given = drawn_facets(np.tile(normal, (count, 1)), np.full(count, alpha), rng)
    height = facet @ normal
    np.testing.assert_allclose(given, density(height, np.full(count, alpha)) * height, rtol=1e-9)
    edges = np.linspace(0.0, 1.0, 41)
    within = np.array([(1.0 - e * e) / (alpha**2 * e * e + 1.0 - e * e) if e > 0.0 else 1.0 for e in edges])
    sector = np.floor((np.arctan2(facet @ [0.8, -0.6, 0.0], facet[:, 2]) / np.pi + 1.0) * 4.0).clip(0, 7)
    counts, _, _ = np.histogram2d(height, sector, bins=[edges, np.arange(9) - 0.5])
    expected = np.repeat((within[:-1] - within[1:])[:, None] / 8.0, 8, axis=1) * count
    assert chi_square_p(*chi_square(counts.astype(np.int64), expected)) > 0.001


def test_albedo_of_the_lobe_has_its_closed_value() -> None:
    """At alpha = 1, seen square on: D = 1 / pi, G2 / 4 n_l = 1 / (2 + 2 n_l), so that the integral is that of x / (1 + x): 1 - ln 2."""
    assert lobe_tables(1.0)[0][-1] == pytest.approx(1.0 - math.log(2.0), rel=3e-5)


@pytest.mark.parametrize(("alpha", "place"), [(0.25, 50), (0.25, 128), (0.6, 30), (0.6, 90)])
def test_tables_of_the_lobe_match_quadrature_over_directions(alpha: float, place: int) -> None:
    way, solid = directions(500)
    n_v = float(COSINES[place])
    view = np.broadcast_to([math.sqrt(1.0 - n_v**2), n_v, 0.0], way.shape)
    values = lobe(view, np.broadcast_to([0.0, 1.0, 0.0], way.shape), way, np.full(len(way), alpha)) * solid
    whole, steep = (table[place] for table in lobe_tables(alpha))
    assert values.sum() == pytest.approx(whole, rel=5e-4)
    half = (view + way) / np.linalg.norm(view + way, axis=1, keepdims=True)
    mean = (values * (1.0 - (view * half).sum(axis=1)) ** 5).sum() / values.sum()
    assert mean == pytest.approx(steep, rel=2e-3, abs=1e-5)


@pytest.mark.parametrize("slope", [1.0, 0.4, 0.1])
@pytest.mark.parametrize("gloss", [0.45, 0.9])
def test_rough_mirror_in_uniform_surroundings_loses_nothing(slope: float, gloss: float) -> None:
    """Reflect 0.8 shows 0.8, by light samples and by drawn rays."""
    rough = replace(mirror(0.8), gloss=gloss, gloss_line=1)
    by_rays = render_paths(slanted(slope, rough, background=(1.0, 1.0, 1.0)), 20000, 1)
    check(by_rays, 0.8, 0.02)
    check(render_paths(slanted(slope, rough, environment=AROUND), 60000, 2), 0.8, 0.03)


@pytest.mark.parametrize("slope", [1.0, 0.4, 0.15])
@pytest.mark.parametrize("fresnel", [False, True])
def test_rough_glass_in_uniform_surroundings_loses_nothing(slope: float, fresnel: bool) -> None:
    """From outside one surface of glass hands on all of Refract, whichever way; the ray behind it meets the background, too."""
    rough = replace(glass(1.5, 0.7), gloss=0.6, gloss_line=1, fresnel=fresnel)
    check(render_paths(slanted(slope, rough, background=(1.0, 1.0, 1.0)), 40000, 3), 0.7, 0.02)


@pytest.mark.parametrize("slope", [1.0, 0.3])
def test_white_metal_in_uniform_surroundings_loses_nothing(slope: float) -> None:
    metal = Material((1.0, 0.5, 0.2), 0.0, 0.0, 0.0, 1.0, metal_rough=True, metallic=1.0, roughness=0.7, metal_rough_line=1)
    picture = render_paths(slanted(slope, metal, background=(1.0, 1.0, 1.0)), 20000, 4)
    deviation = math.sqrt(picture.variance_of_mean[0, 0, 0])
    assert deviation < 0.02
    assert abs(picture.mean[0, 0, 0] - 1.0) < 4.0 * deviation + 1e-4
    assert (np.diff(picture.mean[0, 0]) < 0.0).all()


@pytest.mark.parametrize("slope", [1.0, 0.3])
@pytest.mark.parametrize(("metallic", "roughness"), [(0.0, 0.6), (0.5, 0.8)])
def test_metal_rough_in_uniform_surroundings_matches_quadrature(slope: float, metallic: float, roughness: float) -> None:
    """The formulas of glTF 2.0, appendix B, written out here, with E and S of docs/conventions.md."""
    color, alpha = np.array([0.9, 0.5, 0.1]), roughness**2
    way, solid = directions(400)
    view = np.array([-math.sqrt(1.0 - slope**2), slope, 0.0])
    half = (view + way) / np.linalg.norm(view + way, axis=1, keepdims=True)
    v_h, n_h, n_l = half @ view, half[:, 1], way[:, 1]
    d = alpha**2 / (np.pi * ((n_h**2) * (alpha**2 - 1.0) + 1.0) ** 2)
    g = 2.0 * n_l * slope / (n_l * np.sqrt(alpha**2 + (1 - alpha**2) * slope**2) + slope * np.sqrt(alpha**2 + (1 - alpha**2) * n_l**2))
    single = d * g / (4.0 * slope) * solid  # D G / (4 NV NL) NL dw
    straight = 0.04 * (1.0 - metallic) + color * metallic
    fresnel = straight + (1.0 - straight) * (1.0 - v_h[:, None]) ** 5
    shine = (fresnel * single[:, None]).sum(axis=0) / single.sum()
    b = (single * (1.0 - v_h) ** 5).sum() / single.sum()
    k = (n_l / np.pi * solid * (1.0 - v_h) ** 5).sum()
    base = ((1.0 - fresnel) * (n_l / np.pi * solid)[:, None]).sum(axis=0) * (1.0 - metallic) * color * min(1.0, (1.0 - b) / (1.0 - k))
    material = Material(tuple(color), 0.0, 0.0, 0.0, 1.0, metal_rough=True, metallic=metallic, roughness=roughness, metal_rough_line=1)
    expected = shine + base
    assert (expected <= 1.0).all()
    for effects in ({"environment": AROUND}, {"background": (1.0, 1.0, 1.0), "indirect": Indirect()}):
        picture = render_paths(slanted(slope, material, **effects), 40000, 5)
        deviation = np.sqrt(picture.variance_of_mean[0, 0])
        assert (deviation < 0.01).all()
        assert (np.abs(picture.mean[0, 0] - expected) < 4.0 * deviation + 2e-3 * expected).all()


def test_gloss_is_lit_by_area_lights_and_by_no_points() -> None:
    rough = replace(mirror(1.0), gloss=0.6, gloss_line=1)
    s = replace(looking_down([], [rough], lights=[(3.0, 2.0, 0.0)]))
    check(render_paths(s, 10, 1), 0.0, 0.0)
    # A lamp that fills the half space: an emitting sphere around everything.
    s = looking_down([], [rough, lamp((0.5, 0.5, 0.5))], spheres((0, 0, 0, 50, 1)))
    check(render_paths(s, 60000, 2), 0.5, 0.03)


@pytest.mark.parametrize("g", [-0.5, 0.0, 0.7])
def test_phase_is_normalised_and_its_mean_cosine_is_the_asymmetry(g: float) -> None:
    x, w = np.polynomial.legendre.leggauss(200)
    assert 2.0 * np.pi * (phase(g, x) * w).sum() == pytest.approx(1.0, rel=1e-9)
    assert 2.0 * np.pi * (phase(g, x) * x * w).sum() == pytest.approx(g, abs=1e-9)


def test_fog_leaves_the_exponential_of_the_way() -> None:
    """A lamp seen through 5 units of fog that scatters nothing; a background through endless fog; a mirror doubles the way."""
    fog = Fog(0.3, (0.0, 0.0, 0.0))
    s = replace(scene([mesh(plane_z(0.0))], [lamp((2.0, 1.0, 0.5))], fov=NARROW), fog=fog)
    check(render_paths(s, 10, 1), [2.0 * math.exp(-1.5), math.exp(-1.5), 0.5 * math.exp(-1.5)], 1e-7)
    empty = replace(scene([mesh(plane_z(-50.0))], [BLACK], fov=NARROW, background=(1.0, 1.0, 1.0)), fog=fog)
    check(render_paths(empty, 10, 1), 0.0, 0.0)
    back = scene([mesh(plane_z(0.0)), mesh(plane_z(-7.0), 2, 1)], [mirror(0.5), lamp()], fov=NARROW)
    check(render_paths(replace(back, fog=fog), 10, 1), 0.5 * math.exp(-0.3 * 12.0), 1e-7)


def test_light_on_surfaces_is_dimmed_by_the_fog_on_its_way() -> None:
    """Lit from 3 units away, seen from 5: exp(-8 sigma); with falloff a ninth of it."""
    for falloff in (False, True):
        light = PointLight((0.0, 0.0, -3.0), falloff=falloff)
        s = scene([mesh(plane_z(0.0))], [matte(diffuse=0.9)], [light], eye=(0.0, 0.0, -5.0), view=(0.0, 0.0, 1.0), fov=NARROW)
        picture = render_paths(replace(s, fog=Fog(0.2, (0.0, 0.0, 0.0))), 10, 1)
        check(picture, 0.9 * math.exp(-1.6) / (9.0 if falloff else 1.0), 1e-6)


@pytest.mark.parametrize("g", [-0.4, 0.0, 0.6])
@pytest.mark.parametrize("falloff", [False, True])
def test_airlight_of_a_point_matches_the_integral(g: float, falloff: bool) -> None:
    """A ray along z from -5 to 0, the light 2 above z = -1: the integral of sigma exp(-sigma s) albedo p pi c exp(-sigma d) / d^2."""
    sigma = 0.25
    s = scene([mesh(plane_z(0.0))], [BLACK], [PointLight((0.0, 2.0, -1.0), falloff=falloff)], fov=NARROW)
    picture = render_paths(replace(s, fog=Fog(sigma, (1.0, 0.5, 0.2), g)), 40000, 6)
    way = (np.arange(20000) + 0.5) * 5.0 / 20000
    d = np.hypot(way - 4.0, 2.0)
    cosine = (4.0 - way) / d  # of the light's turn: it comes from ahead, and goes back to the eye
    turned = (1.0 - g * g) / (4.0 * np.pi * (1.0 + g * g - 2.0 * g * cosine) ** 1.5)
    value = sigma * np.exp(-sigma * (way + d)) * turned * np.pi / (d * d if falloff else 1.0)
    integral = float(value.sum() * 5.0 / 20000)
    check(picture, [integral, 0.5 * integral, 0.2 * integral], 0.02)


def test_airlight_of_a_small_lamp_is_that_of_a_point_of_its_power_seen_that_way() -> None:
    """A square lamp of area A far off to the side, facing the ray: Le A / d^2 for Le times solid angle."""
    side = 0.2
    square = quad(*((20.0, y * side, -2.5 + z * side) for y, z in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))))
    s = scene([mesh(plane_z(0.0)), mesh(square, 2, 1)], [BLACK, lamp((100.0, 100.0, 100.0))], fov=NARROW)
    picture = render_paths(replace(s, fog=Fog(0.1)), 20000, 7)
    way = (np.arange(2000) + 0.5) * 5.0 / 2000
    d = np.hypot(way - 2.5, 20.0)
    value = 0.1 * np.exp(-0.1 * (way + d)) / (4.0 * np.pi) * 100.0 * side**2 * (20.0 / d) / d**2
    check(picture, float(value.sum() * 5.0 / 2000), 0.02)


def test_fog_of_a_moving_shadow_is_lit_for_its_part_of_the_time() -> None:
    """A screen between the light and the whole ray for 30% of the time."""
    screen = replace(mesh(quad((-10, 1, -9), (10, 1, -9), (10, 1, 9), (-10, 1, 9)), 2, 0), motion=(200.0, 0.0, 0.0))
    objects = [mesh(plane_z(0.0)), screen]
    still = scene([objects[0]], [BLACK], [PointLight((0.0, 2.0, -2.5))], fov=NARROW)
    lit = render_paths(replace(still, fog=Fog(0.25)), 60000, 8)
    # Its edge passes the plane of light and ray at t = 0.05.
    part = render_paths(replace(still, objects=tuple(objects), fog=Fog(0.25), shutter=Shutter(0.02, 0.12)), 60000, 10)
    deviation = math.sqrt(part.variance_of_mean[0, 0, 0] + lit.variance_of_mean[0, 0, 0] * 0.49)
    assert deviation < 0.02 * lit.mean[0, 0, 0]
    assert abs(part.mean[0, 0, 0] - 0.7 * lit.mean[0, 0, 0]) < 4.0 * deviation
