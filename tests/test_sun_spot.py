"""Suns and spots: words, the cone's profile, pictures against the float64 reference and closed forms, rays, programs."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from device_pictures import in_packets, ray_counts
from reference_scenes import globe

import clrt
from clrt.device import program
from clrt.device.context import Device
from clrt.device.program import Shape
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS, rung
from clrt.reference import ReferencePicture, render
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene, SpotLight, SunLight

CAMERA = "E 0 0.5 -1.5\nV 0 -0.1 1\nF 60\nR 56 48\n"
WHITE = "M 1 1 1  0 1 0 1  0\n"
PLAIN = "M 0.5 0.5 1.0  0.1 0.9 0.3 20  0\n"
FLOOR = "M 1 1 0.5  0.1 0.9 0.3 20  0.3\nT -9 -1 12 9 -1 12 9 -1 0.5\nT -9 -1 12 9 -1 0.5 -9 -1 0.5\nO\n"
SUN = "sun 2 3 -1 red=0.9 green=0.8 blue=0.5\n"
SPOT = "spot -2 3 1  2 -3.2 1.7  50 softness=0.6\n"
BOUND = 1e-5  #: docs/effects: what both effects match the reference to
MARGIN = 2e-5


def _mesh(smooth: bool) -> str:
    """Two coarse globes, one reaching into the other."""
    text = ""
    for centre, radius in (((0.0, -0.2, 2.2), 0.7), ((0.5, 0.3, 1.9), 0.4)):
        corners = globe(7, radius, centre)
        rows = np.concatenate([corners, corners - centre], axis=1) if smooth else corners
        text += "".join("T " + " ".join(map(repr, row)) + "\n" for row in rows.reshape(len(rows), -1).tolist()) + "O\n"
    return text


BODIES = {
    "balls": PLAIN + "S 0 -0.3 2.5 0.7\nS 0.9 0.1 1.8 0.25\n" + FLOOR,
    "inside a ball": PLAIN + "S 0 0 2 30\nS 0.2 0 2 0.6\n",
    "mesh": PLAIN + _mesh(False) + FLOOR,
    "smooth mesh": PLAIN + _mesh(True) + FLOOR,
    "glass": "M 1 1 1 0.02 0.1 0.5 60 0.1 0.8 1.5\nS 0 -0.3 2.5 0.7\n" + FLOOR,
}
LAMPS = {"sun": SUN, "spot": SPOT, "hard spot": SPOT.replace("softness=0.6", ""), "all": SUN + SPOT + "sun -1 2 -3\nL 5 5 -5 0.2 0.2 0.2\n"}


@cache
def _reference(body: str, lamp: str) -> tuple[Scene, ReferencePicture]:
    scene = parse_scene(CAMERA + BODIES[body] + LAMPS[lamp])
    return scene, render(scene)


def _compare(pixels: np.ndarray, reference: ReferencePicture) -> None:
    wrong = np.abs(pixels - reference.pixels).max(-1) > BOUND
    unexplained = wrong & (reference.margin > MARGIN)
    assert not unexplained.any(), f"{unexplained.sum()} pixels differ, the first at (row, column) {np.argwhere(unexplained)[0]}"
    assert wrong.mean() < 0.01, "too many pixels lie at an edge for the picture to be a test"
    assert reference.pixels.std() > 1e-2, "a picture of one colour tests nothing"


# Pictures against the reference


@pytest.mark.matrix(keep=2)
@pytest.mark.parametrize("lamp", LAMPS)
@pytest.mark.parametrize("body", BODIES)
def test_picture_matches_reference(body: str, lamp: str) -> None:
    scene, reference = _reference(body, lamp)
    _compare(clrt.render(scene).pixels, reference)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", sorted(RUNGS))
@pytest.mark.parametrize("body", ["balls", "smooth mesh"])
def test_every_rung_matches_reference(precision: str, body: str) -> None:
    scene, reference = _reference(body, "all")
    _compare(clrt.render(scene, precision=precision).pixels, reference)


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [16, 8, 4, 1])
def test_every_packet_width_matches_reference(device: Device, lanes: int) -> None:
    scene, reference = _reference("balls", "all")
    _compare(in_packets(scene, device, lanes), reference)


# Closed forms

WALL = "E 0 0 0\nV 0 0 1\nF 90\nR 51 51\n" + WHITE + "T -9 -9 2 -9 9 2 9 9 2\nT -9 -9 2 9 9 2 9 -9 2\nO\n"


def _wall_points() -> np.ndarray:
    """(51, 51, 3): where the pixels of WALL see the plane z = 2."""
    across = ((np.arange(51) + 0.5) / 51 - 0.5) * 4
    x, y = np.meshgrid(across, -across)
    return np.stack([x, y, np.full_like(x, 2.0)], axis=-1)


def test_sun_lights_a_wall_the_same_all_over() -> None:
    """Kd N.L with N = (0, 0, -1), L = (1, 2, -2) / 3: 2/3, times the colour 0.5 (1, 0.5, 0)."""
    pixels = clrt.render(parse_scene(WALL + "sun 1 2 -2 intensity=0.5 green=0.5 blue=0\n")).pixels
    np.testing.assert_allclose(pixels, np.broadcast_to([1 / 3, 1 / 6, 0.0], pixels.shape), rtol=0, atol=2e-7)


@pytest.mark.parametrize("softness", [0.0, 0.25, 1.0])
@pytest.mark.parametrize("angle", [10.0, 50.0, 90.0])
def test_spot_on_a_wall_has_the_profile_of_its_cone(angle: float, softness: float) -> None:
    """A spot at the eye that shines straight ahead: at the angle a from the axis, cos a times the smooth step in cos a."""
    pixels = clrt.render(parse_scene(WALL + f"spot 0 0 0  0 0 5  {angle} softness={softness}\n")).pixels
    points = _wall_points()
    a = np.arctan2(np.hypot(points[..., 0], points[..., 1]), 2.0)
    outer = math.radians(angle / 2)
    inner = outer * (1 - softness)
    step = (np.cos(a) - math.cos(outer)) / (math.cos(inner) - math.cos(outer)) if softness else np.where(a < outer, 1.0, 0.0)
    step = np.clip(step, 0.0, 1.0)
    expected = np.cos(a) * step**2 * (3 - 2 * step)
    assert (expected > 0).any()
    assert (expected == 0).any()
    away = np.abs(a - outer) > 1e-6
    np.testing.assert_allclose(pixels[away], np.repeat(expected[away][:, None], 3, axis=1), rtol=0, atol=BOUND)


@pytest.mark.parametrize("precision", ["exact", "watertight", *(pytest.param(name, marks=pytest.mark.slow) for name in ("double", "fast"))])
def test_square_throws_a_square_shadow_in_the_sun(precision: str) -> None:
    """A square |x|, |y| <= 0.3 at z = 1, hidden from the eye by none, seen from (1, 0, -1): on the wall the shadow is shifted by -1."""
    square = "T -0.3 -0.3 1 -0.3 0.3 1 0.3 0.3 1\nT -0.3 -0.3 1 0.3 0.3 1 0.3 -0.3 1\nO\n"
    pixels = clrt.render(parse_scene(WALL + square + "sun 1 0 -1\n"), precision=precision).pixels[..., 0]
    x, y, _ = np.moveaxis(_wall_points(), -1, 0)
    shadow = (np.abs(x + 1) < 0.3) & (np.abs(y) < 0.3) & ~((np.abs(x) < 0.6) & (np.abs(y) < 0.6))
    np.testing.assert_allclose(pixels, np.where(shadow, 0.0, math.sqrt(0.5)), rtol=0, atol=2e-7)


@pytest.mark.parametrize("precision", ["exact", "watertight", *(pytest.param(name, marks=pytest.mark.slow) for name in ("double", "fast"))])
def test_wall_of_a_room_is_dark_where_the_sun_is_outside(precision: str) -> None:
    """The inner wall of a sphere faces the sun through the far wall, at grazing angles, too."""
    scene = parse_scene("E 0 0 0\nV 0 0 1\nF 100\nR 48 48\n" + WHITE + "S 0 0 0 1\nsun 0 0 1\nsun 0 1 -1e-3\n")
    assert not clrt.render(scene, precision=precision).pixels.any()


def test_spot_without_edge_is_a_point_light() -> None:
    """180 degrees, and everything in front of it."""
    body = CAMERA + BODIES["balls"]
    spot = clrt.render(parse_scene(body + "spot 1 9 -1  0 -1 0  180\n")).pixels
    assert np.array_equal(spot, clrt.render(parse_scene(body + "L 1 9 -1\n")).pixels)


@pytest.mark.slow
def test_far_point_light_is_a_sun() -> None:
    body = CAMERA + BODIES["balls"]
    near, far = (clrt.render(parse_scene(body + line), precision="double").pixels for line in ("sun 2 3 -1\n", "L 2e7 3e7 -1e7\n"))
    different = np.abs(near - far).max(-1) > 1e-5
    assert different.mean() < 0.002


# Words


def test_words_give_unit_directions_and_angles() -> None:
    scene = parse_scene(WALL + "sun 0 3e29 4e29 red=0.5 intensity=2\nspot 1 2 3  0 0 -2e-200  60 softness=0.25 blue=3\n")
    (sun,), (spot,) = scene.suns, scene.spots
    assert sun == SunLight(pytest.approx((0, 0.6, 0.8)), (1.0, 2.0, 2.0), 9)  # type: ignore[arg-type]
    assert spot == SpotLight((1, 2, 3), (0, 0, -1), pytest.approx(math.pi / 6), pytest.approx(math.pi / 8), (1, 1, 3), 10)  # type: ignore[arg-type]
    assert scene.warnings == ()
    assert scene.lights == ()


def test_right_handed_scene_turns_suns_and_spots() -> None:
    scene = parse_scene(WALL + "sun 3 0 4\nspot 1 2 3  1 0 0  60\n", right_handed=True)
    assert scene.suns[0].direction == pytest.approx((-0.6, 0, 0.8))
    assert (scene.spots[0].position, scene.spots[0].direction) == ((-1, 2, 3), (-1, 0, 0))


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("sun 1 2", '9:5: error: sun takes 3 values, as in "sun 1 2 -1 intensity=0.8", found 2'),
        ("sun 0 -0 0", '9:5: error: the direction to the sun is zero; give it a length, as in "sun 1 2 -1 intensity=0.8"'),
        ("sun 0 x 0", '9:7: error: expected a number (y of the direction to the sun), found "x"'),
        ("sun 0 nan 0", '9:7: error: expected a finite number (y of the direction to the sun), found "nan"'),
        ("sun 0 1 0 red=-1", '9:15: error: red must be at least 0 and at most 1e+30, found "-1"'),
        ("sun 0 1 0 intensity=1e7", '9:21: error: intensity must be from 0 to 1e+06, found "1e7"'),
        ("sun 0 1 0 angle=3", '9:11: error: sun has no key "angle" (its keys: red, green, blue, intensity)'),
        ("spot 0 1 0 0 -1 0", '9:6: error: spot takes 7 values, as in "spot 0 5 0 0 -1 0 40 softness=0.2", found 6'),
        ("spot 0 1 0  0 0 0  40", "9:13: error: the spot's direction is zero; give it a length, as in \"spot 0 5 0 0 -1 0"),
        ("spot 0 1 0  0 -1 0  0", '9:21: error: cone angle in degrees must be greater than 0 and at most 360, found "0"'),
        ("spot 0 1 0  0 -1 0  361", '9:21: error: cone angle in degrees must be greater than 0 and at most 360, found "361"'),
        ("spot 0 1 0  0 -1 0  40 softness=1.5", '9:33: error: softness must be from 0 to 1, found "1.5"'),
        ("spot 0 1 0  0 -1 0  40 softness=", '9:33: error: expected a number (softness), found ""'),
        ("spt 0 1 0  0 -1 0  40", '9:1: error: unknown word "spt"; did you mean "spot"?'),
    ],
)
def test_malformed_line_is_refused_at_its_place(line: str, expected: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_scene(WALL + line + "\n", "scene.txt")
    assert str(caught.value).startswith(f"scene.txt:{expected}")
    assert "\n" not in str(caught.value)


# Rays and programs


@pytest.mark.slow
def test_rays_are_traced_only_where_a_lamp_can_light(device: Device) -> None:
    """A wall that fills the view, and a square behind the eye that throws no shadow: one ray a lit pixel, none outside the cone."""
    behind = "T -1 -1 -30 -1 1 -30 1 1 -30\n"
    points = _wall_points()
    in_cone = np.hypot(points[..., 0], points[..., 1]) < 2 * math.tan(math.radians(20))
    for lamps, shadow in (
        ("sun 0 0 -1\n", 51 * 51),
        ("sun 0 0 1\n", 0),
        ("spot 0 0 0  0 0 1  40\n", int(in_cone.sum())),
        ("spot 0 0 0  0 0 -1  40\n", 0),
        ("sun 0 0 -1\nsun 1 0 -1\nspot 0 0 0  0 0 1  40\nL 0 0 0\n", 3 * 51 * 51 + int(in_cone.sum())),
    ):
        counts, _ = ray_counts(parse_scene(WALL + behind + lamps), device)
        assert counts == {"primary": 51 * 51, "shadow": shadow}, lamps


def test_lone_triangle_throws_no_rays_to_the_sun() -> None:
    lone = parse_scene("E 0 0 0\nV 0 0 1\nF 45\nR 8 8\n" + WHITE + "T -9 -9 2 -9 9 2 9 9 2\nsun 0 0 -1\n")
    assert Features.of(lone).effects == ("sun",)


@pytest.mark.parametrize(
    ("lamps", "there", "absent"),
    [
        ("sun 0 1 -1\n", ("sun_light", "reach_clear"), ("direct_light", "light_point", "lights", "light_planes", "spot", "shadow")),
        ("L 0 1 -1\n", ("direct_light", "shadow_lit"), ("sun_", "suns", "Sun", "spot", "axis;", "slope")),
        ("spot 0 1 -1 0 0 1 40\n", ("direct_light", "shadow_lit", "spot_factor", "slope"), ("sun_", "suns", "Sun")),
    ],
)
def test_program_holds_only_the_lights_called_for(lamps: str, there: tuple[str, ...], absent: tuple[str, ...]) -> None:
    features = Features.of(parse_scene(CAMERA + BODIES["smooth mesh"] + "S 0 0 9 1\n" + lamps))
    for precision in RUNGS:
        source = program.compose(features, rung(precision), 4, Shape(16, 5))
        assert all(word in source for word in there)
        assert [word for word in absent if word in source] == []


def test_counting_a_mixed_scene_names_each_kind_of_ray_once() -> None:
    kinds = Features.of(parse_scene(CAMERA + BODIES["balls"] + LAMPS["all"])).ray_kinds
    assert kinds == ("primary", "shadow", "mirror")
