"""Lamps that fall off with the distance: closed forms, the float64 reference, other units, and programs without them."""

from __future__ import annotations

import numpy as np
import pytest

import clrt
from clrt.device import program
from clrt.device.program import Shape
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import rung
from clrt.reference import render
from clrt.scene.build import parse_scene
from clrt.scene.scale import scaled

WALL = "E 0 0 0\nV 0 0 1\nF 90\nR 51 51\nM 1 1 1  0 1 0 1  0\nT -9 -9 2 -9 9 2 9 9 2\nT -9 -9 2 9 9 2 9 -9 2\nO\n"
BODIES = (
    "E 0 0.5 -1.5\nV 0 -0.1 1\nF 60\nR 56 48\nM 0.5 0.5 1.0  0.1 0.9 0.3 20  0.2\nS 0 -0.3 2.5 0.7\nS 0.9 0.1 1.8 0.25\n"
    "T -9 -1 12 9 -1 12 9 -1 0.5\nT -9 -1 12 9 -1 0.5 -9 -1 0.5\nO\n"
)


def _wall_points() -> np.ndarray:
    across = ((np.arange(51) + 0.5) / 51 - 0.5) * 4
    x, y = np.meshgrid(across, -across)
    return np.stack([x, y, np.full_like(x, 2.0)], axis=-1)


def test_lamp_on_a_wall_falls_off_with_the_square_of_the_distance() -> None:
    """Kd N.L c / d^2 with the lamp at (1, 0, 0.5)."""
    way = _wall_points() - np.array([1.0, 0.0, 0.5])
    expected = 2.0 * 1.5 / np.linalg.norm(way, axis=-1) ** 3
    pixels = clrt.render(parse_scene(WALL + "spot 1 0 0.5  0 0 1  360 falloff=yes intensity=2\n")).pixels
    np.testing.assert_allclose(pixels, np.broadcast_to(expected[..., None], pixels.shape), rtol=2e-6)


@pytest.mark.parametrize("softness", [0.0, 0.7, 1.0])
def test_lamp_of_more_than_half_a_turn_has_the_profile_of_its_cone(softness: float) -> None:
    """A cone of 300 degrees that shines away from the wall: s^2 (3 - 2 s) in the cosine, between 180 degrees and its edge."""
    way = _wall_points() / np.linalg.norm(_wall_points(), axis=-1, keepdims=True)
    cosine, outer = -way[..., 2], np.cos(np.radians(150.0))
    inner = np.cos(np.radians(150.0 * (1.0 - softness)))
    s = np.clip((cosine - outer) / (inner - outer), 0.0, 1.0) if softness else (cosine > outer).astype(float)
    expected = way[..., 2] * s * s * (3.0 - 2.0 * s)
    pixels = clrt.render(parse_scene(WALL + f"spot 0 0 0  0 0 -1  300 softness={softness}\n")).pixels
    assert 0.1 < (expected > 0).mean() < 1.0
    np.testing.assert_allclose(pixels[..., 0], expected, atol=2e-6)


@pytest.mark.slow
def test_whole_turn_without_softness_is_a_point_light() -> None:
    turned = clrt.render(parse_scene(BODIES + "spot 1 4 -1  0 1 0  360\n")).pixels
    assert np.array_equal(turned, clrt.render(parse_scene(BODIES + "L 1 4 -1\n")).pixels)


ONE = "spot -2 3 1  2 -3.2 1.7  50 softness=0.6 falloff=yes intensity=20\n"
SEVERAL = "spot -1 2 1  0 0 1  360 falloff=yes intensity=5\nL 5 5 -5 0.2 0.2 0.2\nsun 1 3 -1 intensity=0.2\n"


@pytest.mark.parametrize("lamp", [pytest.param(ONE, marks=pytest.mark.slow), SEVERAL])
def test_picture_matches_reference(lamp: str) -> None:
    scene = parse_scene(BODIES + lamp)
    pixels, reference = clrt.render(scene).pixels, render(scene)
    wrong = np.abs(pixels - reference.pixels).max(-1) > 1e-5
    assert not (wrong & (reference.margin > 5e-5)).any()
    assert wrong.mean() < 0.01
    assert reference.pixels.std() > 1e-2


def test_metal_rough_surface_sees_the_fall_off() -> None:
    """One lamp with and without: the ratio is the square of the distance."""
    body = WALL.replace("M 1 1 1  0 1 0 1  0\n", "M 0.8 0.6 0.4 0 1 0 1 0\nmaterial metallic=0.5 roughness=0.5\n")
    plain = clrt.render(parse_scene(body + "L 1 0 0.5\n"), samples=1).pixels
    weak = clrt.render(parse_scene(body + "spot 1 0 0.5  0 0 1  360 falloff=yes\n"), samples=1).pixels
    square = ((_wall_points() - np.array([1.0, 0.0, 0.5])) ** 2).sum(axis=-1, keepdims=True)
    assert plain.min() > 0.01
    np.testing.assert_allclose(weak * square, plain, rtol=3e-6)


@pytest.mark.parametrize("exponent", [-30, 7, 30])
def test_picture_does_not_depend_on_the_unit_of_length(exponent: int) -> None:
    scene = parse_scene(BODIES + "spot -1 2 1  0 0 1  360 falloff=yes intensity=5\n")
    np.testing.assert_allclose(clrt.render(scaled(scene, exponent)).pixels, clrt.render(scene).pixels, atol=1e-6)


def test_key_takes_yes_or_no() -> None:
    assert [parse_scene(WALL + f"spot 0 0 0  0 0 1  40 falloff={word}\n").spots[0].falloff for word in ("yes", "no")] == [True, False]
    with pytest.raises(SceneError, match=r'9:36: error: falloff must be yes or no, found "maybe"'):
        parse_scene(WALL + "spot 0 0 0  0 0 1  40      falloff=maybe\n")


@pytest.mark.parametrize(("lamp", "there"), [("falloff=no", False), ("falloff=yes", True)])
def test_program_has_falloff_only_where_a_lamp_asks_for_it(lamp: str, there: bool) -> None:
    features = Features.of(parse_scene(WALL + f"spot 0 0 0  0 0 1  40 {lamp}\n"))
    assert ("falloff" in program.compose(features, rung("watertight"), 16, Shape(16))) is there
    assert ("falloff" in features.effects) is there
