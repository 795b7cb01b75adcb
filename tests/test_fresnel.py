"""Fresnel's weights: closed forms of slabs, spheres and prisms, on the device and in the reference; and lines that are wrong."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from device_pictures import ray_counts
from reference_scenes import box, glass, mesh, prism_mesh, scene, spheres

import clrt
from clrt.device.context import Device
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS
from clrt.reference import render
from clrt.scene.build import parse_scene
from clrt.scene.model import Material, Scene

HEAD = "E 0 0 0\nV 0 0 1\nF 60\nR 32 24\nL 5 5 -5\n"
GLASS = "M 1 1 1  0 0 0 1  0 1 1.5\n"
BALL = "S 0 0 3 1\n"


def split_glass(ior: float, total: float = 1.0) -> Material:
    return replace(glass(ior, total), fresnel=True)


def share(angle: float, n1: float, n2: float) -> float:
    """Fresnel's equations as sines and tangents (Born and Wolf 1999, 1.5.2), the mean of both polarisations."""
    if angle == 0.0:
        return ((n1 - n2) / (n1 + n2)) ** 2
    turned = math.asin(n1 / n2 * math.sin(angle))
    s = math.sin(angle - turned) / math.sin(angle + turned)
    p = math.tan(angle - turned) / math.tan(angle + turned)
    return (s * s + p * p) / 2.0


def slab(angle: float, depth: int, ior: float = 1.5, total: float = 1.0) -> tuple[float, float]:
    """A white room around a slab, met at `angle`: by the reference and on the device."""
    walls = [mesh(box((-60, -50, 0), (50, 60, 2)))]
    view = (math.sin(angle), 0.0, math.cos(angle))
    s = scene(walls, [split_glass(ior, total)], eye=(0.3, 0.2, -1), view=view, depth=depth, background=(1.0, 1.0, 1.0))
    return float(render(s).pixels[0, 0, 0]), float(clrt.render(s).pixels[0, 0, 0])


@pytest.mark.parametrize("angle", [0.0, math.pi / 4, math.atan(1.5)], ids=["normal", "45 degrees", "Brewster"])
@pytest.mark.parametrize("depth", [1, 2, 5])
def test_slab_sums_its_reflections_up_to_the_depth(device: Device, angle: float, depth: int) -> None:
    """Each order of reflection inside comes out after one surface more: F, then T^2, T^2 F, T^2 F^2..."""
    f = share(angle, 1.0, 1.5)
    expected = f + sum((1.0 - f) ** 2 * f**k for k in range(depth - 1))
    reference, seen = slab(angle, depth)
    assert reference == pytest.approx(expected, rel=1e-13)
    assert seen == pytest.approx(expected, rel=1e-6)


def test_one_face_reflects_four_percent_and_at_brewsters_angle_half_of_one_polarisation(device: Device) -> None:
    for angle, expected in ((0.0, 0.04), (math.atan(1.5), 0.5 * (1.25 / 3.25) ** 2)):
        reference, seen = slab(angle, 1)
        assert reference == pytest.approx(expected, rel=1e-13)
        assert seen == pytest.approx(expected, rel=1e-6)


def test_reflect_and_refract_are_split_by_their_sum(device: Device) -> None:
    f = 0.04
    reference, seen = slab(0.0, 2, total=0.8)
    assert reference == pytest.approx(0.8 * f + 0.64 * (1 - f) ** 2, rel=1e-13)
    assert seen == pytest.approx(reference, rel=1e-6)
    text = HEAD + GLASS.replace("0 1 1.5", "0.3 0.5 1.5") + "fresnel\n" + BALL
    material = parse_scene(text).materials[0]
    assert (material.reflect, material.refract, material.fresnel) == (0.0, 0.8, True)


def test_equal_indices_pass_unchanged(device: Device) -> None:
    for angle in (0.0, 0.7, 1.5):
        reference, seen = slab(angle, 5, ior=1.0)
        assert reference == pytest.approx(1.0, rel=1e-14)
        assert seen == 1.0


@pytest.mark.slow
def test_equal_indices_spawn_no_reflected_ray(device: Device) -> None:
    text = HEAD + "background 1 1 1\n" + GLASS.replace("1.5", "1") + "fresnel\n" + BALL
    counts, _ = ray_counts(parse_scene(text), device)
    assert counts["fresnel"] == counts["internal"] == 0
    assert counts["refracted"] > 0


def test_total_reflection_reflects_all(device: Device) -> None:
    """A right-angled prism of index 2: in straight, all of it at the slanted face, out straight; 8/9 at each of the other faces."""
    s = scene([prism_mesh()], [split_glass(2.0)], eye=(0.13, -0.2, -3), depth=3, background=(1.0, 1.0, 1.0))
    expected = 1.0 / 9.0 + (8.0 / 9.0) ** 2
    assert render(s).pixels[0, 0, 0] == pytest.approx(expected, rel=1e-13)
    assert clrt.render(s).pixels[0, 0, 0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("depth", [1, 2, 4, 9])
def test_white_furnace_lacks_only_what_the_depth_cuts_off(device: Device, depth: int) -> None:
    """A ball meets every ray inside at one angle: all but T F^(depth - 1) of the energy has left it."""
    s = scene([], [split_glass(1.5)], [], spheres((0, 0, 3, 1, 0)), eye=(0, 0, 0), fov=44.0, size=(24, 24), depth=depth,
              background=(1.0, 1.0, 1.0))  # fmt: skip
    direction = s.camera.directions().reshape(-1, 3)
    sine = 3.0 * np.linalg.norm(direction[:, :2], axis=1)  # of incidence: the distance from the middle, over the radius of 1
    left = [1.0 if x > 1.0 else 1.0 - (1.0 - f) * f ** (depth - 1) for x in sine for f in [share(math.asin(min(x, 1.0)), 1.0, 1.5)]]
    expected = np.array(left).reshape(24, 24, 1)
    expected = np.broadcast_to(expected, (24, 24, 3))
    assert expected.min() < 1.0
    np.testing.assert_allclose(render(s).pixels, expected, atol=1e-12)
    np.testing.assert_allclose(clrt.render(s).pixels, expected, atol=1e-5)


NESTED = (
    HEAD.replace("32 24", "64 48") + "background 0.2 0.3 0.5\nM 1 1 0.5 0.1 0.9 0.3 20 0.5 0 0\nT -9 -1 12 9 -1 12 9 -1 0.5\n"
    "T -9 -1 12 9 -1 0.5 -9 -1 0.5\nO\nM 1 1 1 0 0.1 0.5 60 0.1 0.9 1.33\nfresnel\nS 0 -0.1 3 0.9\nM 1 1 1 0 0.1 0.5 60 0.1 0.8 1.6\n"
    "S 0.1 0 2.9 0.4\nM 1 1 1 0 0 0 1 0 1 1.5\nfresnel\nT -1.6 -1 3 -1 -1 2.6 -1.2 0.3 3 -0.9 0.1 -0.7 0.2 0.3 -0.7 0 0.6 -0.8\n"
)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", sorted(RUNGS))
def test_nested_and_smooth_glass_matches_the_reference(device: Device, precision: str) -> None:
    picture_matches(parse_scene(NESTED), precision)


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [16, 8, 4, 1])
def test_every_packet_width_matches_the_reference(device: Device, lanes: int) -> None:
    picture_matches(parse_scene(NESTED), "watertight", replace(device, info=replace(device.info, lanes=lanes)))


def picture_matches(s: Scene, precision: str, device: Device | None = None) -> None:
    from clrt import renderer
    from clrt.device.context import open_device
    from clrt.precision import rung

    prepared = renderer.build_trees(s, "sah", lambda *_: None)
    tracer = renderer.open_tracer(prepared, Features.of(s), rung(precision), device or open_device(), lambda *_: None)[1]
    renderer.run_rows(tracer, "render", lambda *_: None)
    reference = render(s)
    wrong = np.abs(tracer.picture() - reference.pixels).max(-1) > 1e-4
    assert not (wrong & (reference.margin > 2e-5)).any()
    assert wrong.mean() < 0.02


def test_feature_is_called_for_by_the_word_alone() -> None:
    with_word = dict(Features.of(parse_scene(HEAD + GLASS + "fresnel\n" + BALL)).lines)
    assert with_word["fresnel"] == 7
    for text in (GLASS + BALL, GLASS + "fresnel\n" + GLASS + BALL, "depth 0\n" + GLASS + "fresnel\n" + BALL):
        assert "fresnel" not in dict(Features.of(parse_scene(HEAD + text)).lines)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("fresnel\n" + GLASS + BALL, '6:1: error: fresnel before any material; add a line of glass above it, such as "M 1 1 1 0 0 0.5'),
        ("M 1 1 1 0 0 0 1 0.5\n  fresnel\n" + BALL, "7:3: error: fresnel needs a material that light passes through; give the M of line 6"),
        ("M 1 1 1 0 0 0 1 0.5 0 1.5\nfresnel\n" + BALL, "7:1: error: fresnel needs a material that light passes through"),
        (GLASS + "fresnel\n" + BALL + "fresnel\n", "9:1: error: a second fresnel of one material; the first is line 7"),
        (GLASS + "fresnel 1\n" + BALL, '7:9: error: fresnel takes 0 values, as in "fresnel", found 1'),
        (GLASS + "fresnel weight=1\n" + BALL, '7:9: error: fresnel has no key "weight"'),
        (GLASS + "fresnell\n" + BALL, '7:1: error: unknown word "fresnell"; did you mean "fresnel"?'),
    ],
)
def test_wrong_line_is_refused_at_its_place(text: str, expected: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_scene(HEAD + text, "scene.txt")
    assert str(caught.value).splitlines()[0].startswith("scene.txt:" + expected)


def test_word_belongs_to_its_own_material() -> None:
    s = parse_scene(HEAD + GLASS + BALL + GLASS + "fresnel\n" + BALL + GLASS + BALL + "fresnel\n")
    assert [m.fresnel for m in s.materials] == [False, True, True]
