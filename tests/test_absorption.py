"""Absorption in glass: closed forms of slabs, chords and nested media, on the device and in the reference; and lines that are wrong."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from device_pictures import ray_counts
from reference_scenes import box, glass, mesh, prism_mesh, scene, spheres

import clrt
from clrt import renderer
from clrt.device.context import Device, open_device
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS, rung
from clrt.reference import render
from clrt.scene.build import parse_scene
from clrt.scene.model import Material, Scene

HEAD = "E 0 0 0\nV 0 0 1\nF 60\nR 32 24\nL 5 5 -5\n"
GLASS = "M 1 1 1  0 0 0 1  0 1 1.5\n"
BALL = "S 0 0 3 1\n"
COEFFICIENTS = np.array([0.0, 0.3, 1.7])
WHITE = (1.0, 1.0, 1.0)


def tinted(ior: float = 1.0, coefficients: np.ndarray = COEFFICIENTS, refract: float = 1.0) -> Material:
    return replace(glass(ior, refract), absorb=tuple(coefficients.tolist()))


def both_show(s: Scene, expected: np.ndarray, rel: float = 2e-5) -> None:
    """The only pixel of `s` has this colour in the reference, and on the device but for what its points are off, times the coefficient."""
    np.testing.assert_allclose(render(s).pixels[0, 0], expected, rtol=1e-12, atol=1e-300)
    np.testing.assert_allclose(clrt.render(s).pixels[0, 0], expected, rtol=rel, atol=1e-30)


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 70.0])
def test_slab_leaves_the_exponential_of_the_way_inside(device: Device, angle_deg: float) -> None:
    angle = math.radians(angle_deg)
    view = (math.sin(angle), 0.0, math.cos(angle))
    walls = [mesh(box((-60, -50, 0), (50, 60, 2)))]
    s = scene(walls, [tinted(1.5, refract=0.9)], eye=(0.3, 0.2, -1), view=view, background=WHITE)
    way = 2.0 / math.cos(math.asin(math.sin(angle) / 1.5))
    both_show(s, 0.81 * np.exp(-COEFFICIENTS * way))


@pytest.mark.parametrize("height", [0.0, 0.3, 0.9, 0.999])
@pytest.mark.parametrize("ior", [1.0, 1.5])
def test_sphere_leaves_the_exponential_of_the_chord(device: Device, height: float, ior: float) -> None:
    s = scene([], [tinted(ior)], [], spheres((0, 0, 0, 1, 0)), eye=(0, height, -3), background=WHITE)
    chord = 2.0 * math.sqrt(1.0 - (height / ior) ** 2)
    both_show(s, np.exp(-COEFFICIENTS * chord), rel=1e-4 if height > 0.99 else 2e-5)


def test_inner_medium_replaces_the_outer(device: Device) -> None:
    """A clear bubble takes its part of the way; a tinted one its own coefficients: the medium of the highest rank has the say."""
    other = np.array([0.9, 0.1, 0.0])
    for inner, coefficients in ((glass(1.0), np.zeros(3)), (tinted(1.0, other), other)):
        balls = spheres((0, 0, 0, 1, 0), (0, 0, 0.1, 0.4, 1))
        s = scene([], [tinted(), inner], [], balls, eye=(0, 0, -3), background=WHITE)
        both_show(s, np.exp(-COEFFICIENTS * 1.2 - coefficients * 0.8))


@pytest.mark.parametrize("depth", [1, 5])
def test_eye_inside_sees_through_its_medium(device: Device, depth: int) -> None:
    s = scene([], [tinted()], [], spheres((0, 0, 0, 4, 0)), eye=(0, 0, 1), background=WHITE, depth=depth)
    both_show(s, np.exp(-COEFFICIENTS * 3.0))


def test_ray_that_never_leaves_keeps_only_what_is_not_absorbed(device: Device) -> None:
    """A lone face is entered and never left: the way is endless."""
    face = mesh(box((-60, -50, 0), (50, 60, 2))[:2])
    s = scene([face], [tinted()], eye=(-9, 0, 1), view=(-1, 0, 0), background=WHITE)
    s = replace(s, camera=replace(s.camera, eye=np.array([-70.0, 0.3, 1.0]), corners=-s.camera.corners))
    assert render(s).prim_id[0, 0] >= 0
    both_show(s, np.array([1.0, 0.0, 0.0]))


def test_way_goes_on_through_total_reflection(device: Device) -> None:
    """A prism of index 2: in at height y, up along z to the slanted face at z = 1 - y, out at right angles: 2 long altogether."""
    s = scene([prism_mesh()], [tinted(2.0)], eye=(0.13, -0.2, -3), background=WHITE)
    both_show(s, np.exp(-COEFFICIENTS * 2.0))


def test_fresnel_and_absorption_multiply(device: Device) -> None:
    """Straight on: F and T by the faces, e a crossing; reflections inside make one crossing more each."""
    walls = [mesh(box((-60, -50, 0), (50, 60, 2)))]
    s = scene(walls, [replace(tinted(1.5), fresnel=True)], eye=(0.3, 0.2, -1), background=WHITE, depth=4)
    f, e = 0.04, np.exp(-COEFFICIENTS * 2.0)
    both_show(s, f + (1 - f) ** 2 * (e + f * e**2 + f**2 * e**3))


def test_light_in_the_glass_is_seen_through_the_way_back(device: Device) -> None:
    """A card inside of a ball glows 0.5: what is seen of it has come 0.75 through the medium."""
    card = mesh(np.array([[[-0.4, -0.4, -0.25], [0.5, -0.4, -0.25], [0, 0.5, -0.25]]]), material=1)
    s = scene([card], [tinted(), Material(WHITE, 0.5, 0.0, 0.0, 1.0)], [], spheres((0, 0, 0, 1, 0)), eye=(0, 0, -3))
    both_show(s, 0.5 * np.exp(-COEFFICIENTS * 0.75))


def test_opaque_medium_ends_the_path(device: Device) -> None:
    """All of the light is swallowed on the way in: no ray goes on from the far wall."""
    text = HEAD.replace("32 24", "4 4").replace("60", "5") + "background 1 1 1\n" + GLASS + "absorb 900 900 900\n" + BALL
    s = parse_scene(text)
    assert ray_counts(s, device)[0]["refracted"] == render(s).rays["refracted"] == 16


NESTED = (
    HEAD.replace("32 24", "64 48") + "background 0.2 0.3 0.5\nM 1 1 0.5 0.1 0.9 0.3 20 0.5 0 0\nT -9 -1 12 9 -1 12 9 -1 0.5\n"
    "T -9 -1 12 9 -1 0.5 -9 -1 0.5\nO\nM 1 1 1 0 0.1 0.5 60 0.1 0.9 1.33\nfresnel\nabsorb 0.5 0.1 0\nS 0 -0.1 3 0.9\n"
    "M 1 1 1 0 0.1 0.5 60 0.1 0.8 1.6\nabsorb 0 1 2\nS 0.1 0 2.9 0.4\n"
)


def matches_the_reference(s: Scene, precision: str, device: Device) -> None:
    prepared = renderer.build_trees(s, "sah", lambda *_: None)
    tracer = renderer.open_tracer(prepared, Features.of(s), rung(precision), device, lambda *_: None)[1]
    renderer.run_rows(tracer, "render", lambda *_: None)
    reference = render(s)
    wrong = np.abs(tracer.picture() - reference.pixels).max(-1) > 1e-4
    assert not (wrong & (reference.margin > 2e-5)).any()
    assert wrong.mean() < 0.02


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", sorted(RUNGS))
def test_every_rung_matches_the_reference(device: Device, precision: str) -> None:
    matches_the_reference(parse_scene(NESTED), precision, device)


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [16, 8, 4, 1])
def test_every_packet_width_matches_the_reference(lanes: int) -> None:
    opened = open_device()
    matches_the_reference(parse_scene(NESTED), "watertight", replace(opened, info=replace(opened.info, lanes=lanes)))


@pytest.mark.parametrize("exponent", [-98, -30, 40])
def test_unit_of_length_does_not_matter(device: Device, exponent: int) -> None:
    """All lengths times 2^e and the coefficient, which is given a length, divided by it."""
    unit = 2.0**exponent
    text = f"E 0 0 0\nV 0 0 1\nF 60\nR 32 24\nL 0 {5 * unit!r} 0\nbackground 1 1 1\n{GLASS}absorb 0 {0.5 / unit!r} {2.0 / unit!r}\n"
    seen = clrt.render(parse_scene(f"{text}S 0 0 {3 * unit!r} {unit!r}\n")).pixels
    at_one = clrt.render(parse_scene(f"{HEAD}background 1 1 1\n{GLASS}absorb 0 0.5 2\n{BALL}")).pixels
    assert at_one.std() > 0.05
    assert np.abs(seen - at_one).max() <= 1e-5


def test_feature_is_called_for_by_a_coefficient_above_zero() -> None:
    def lines(text: str) -> dict[str, int]:
        return dict(Features.of(parse_scene(HEAD + text)).lines)

    assert lines(GLASS + "absorb 0 0.1 0\n" + BALL)["absorption"] == 7
    unused = GLASS + "absorb 1 1 1\n" + GLASS + BALL
    for text in (GLASS + BALL, GLASS + "absorb 0 0 0\n" + BALL, unused, "depth 0\n" + GLASS + "absorb 1 1 1\n" + BALL):
        assert "absorption" not in lines(text)


def test_without_depth_the_pictures_agree(device: Device) -> None:
    s = replace(parse_scene(NESTED), depth=0)
    matches_the_reference(s, "watertight", device)


TRIANGLES = "T -1 -1 2 1 -1 2 0 1 2\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("absorb 1 1 1\n" + GLASS + BALL, "6:1: error: absorb before any material; add a line of glass above it"),
        ("M 1 1 1 0 0 0 1 0.5\n  absorb 1 1 1\n" + BALL, "7:3: error: absorb needs a material that light passes through"),
        (GLASS + "absorb 1 1\n" + BALL, '7:8: error: absorb takes 3 values, as in "absorb 0.8 0.2 0.1", found 2'),
        (GLASS + "absorb 1 -0.5 1\n" + BALL, '7:10: error: green must be at least 0 and at most 1e+30, found "-0.5"'),
        (GLASS + "absorb 1 1 nan\n" + BALL, "7:12: error: expected a finite number (blue)"),
        (GLASS + "absorb 1 1 x\n" + BALL, "7:12: error: expected a number (blue)"),
        (GLASS + "absorb 1 1 1\n" + BALL + "absorb 2 2 2\n", "9:1: error: a second absorb of one material; the first is line 7"),
        (GLASS + TRIANGLES + GLASS + " absorb 1 1 1\n" + TRIANGLES, "9:2: error: the glass of object 1 absorbs differently"),
        (GLASS + "absorp 1 1 1\n" + BALL, '7:1: error: unknown word "absorp"; did you mean "absorb"?'),
    ],
)
def test_wrong_line_is_refused_at_its_place(text: str, expected: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_scene(HEAD + text, "scene.txt")
    assert str(caught.value).splitlines()[0].startswith("scene.txt:" + expected)


def test_objects_apart_absorb_each_its_own() -> None:
    s = parse_scene(HEAD + GLASS + TRIANGLES + "O\n" + GLASS + "absorb 1 1 1\n" + TRIANGLES)
    assert [m.absorb for m in s.materials] == [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)]
