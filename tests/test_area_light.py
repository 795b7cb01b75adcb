"""Area lights against closed forms: Lambert's polygons, the ball's solid angle, what is seen of them, how they are drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ztest import device_batches

import clrt
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS
from clrt.scene.build import parse_scene
from clrt.scene.emitters import emitters_of
from clrt.scene.model import FloatArray, Scene

FLOOR = "M 0.5 0.6 0.7  0 1 0 1 0\nT -900 0 -900  900 0 -900  900 0 900\nT -900 0 -900  900 0 900  -900 0 900\n"
VIEW = "E 0 2 -3\nV 0 -2 3\nF 0.5\nR 8 8\n"
LAMP = "M 1 1 1  0 0 0 1 0\narealight 3 2 1\n"
SQUARE = LAMP + "T -1 3 -1  1 3 -1  1 3 1\nT -1 3 -1  1 3 1  -1 3 1\n"
BALL = LAMP + "S 0 3 0 0.7\n"


def floor_points(scene: Scene) -> FloatArray:
    """Where the pixels' centres see the floor y = 0, (h, w, 3)."""
    d, eye = scene.camera.directions(), scene.camera.eye
    return np.asarray(eye - eye[1] / d[..., 1:2] * d)


def polygon_factor(polygon: FloatArray, point: FloatArray, normal: FloatArray) -> float:
    """The part of the half space over `point` that the polygon covers, weighted by the cosine (Lambert 1760)."""
    v = polygon - point
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(v, np.roll(v, -1, axis=0), strict=True):
        across = np.cross(a, b)
        total += np.arccos(a @ b) * (across @ normal) / np.linalg.norm(across)
    return float(abs(total) / (2.0 * np.pi))


def close(scene: Scene, expected: FloatArray, samples: int = 64, seeds: int = 6) -> None:
    """The picture's mean is within 5 standard errors, and each pixel within 12 of the largest: six seeds tell them roughly."""
    batches = device_batches(scene, samples, range(seeds))
    mean, error = batches.mean(0), batches.std(0, ddof=1) / np.sqrt(seeds)
    assert np.abs(mean - expected).max() < 12.0 * error.max() + 1e-5
    whole = batches.mean((1, 2))
    assert (np.abs(whole.mean(0) - expected.mean((0, 1))) < 5.0 * whole.std(0, ddof=1) / np.sqrt(seeds) + 2e-5).all()


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", RUNGS)
def test_square_light_over_a_floor_is_lamberts_formula(precision: str) -> None:
    scene = parse_scene(VIEW + SQUARE + FLOOR)
    square = np.array([[-1.0, 3, -1], [1, 3, -1], [1, 3, 1], [-1, 3, 1]])
    factor = np.array([[polygon_factor(square, p, np.array([0.0, 1, 0])) for p in row] for row in floor_points(scene)])
    expected = factor[..., None] * np.array([3.0, 2, 1]) * np.array([0.5, 0.6, 0.7])
    pixels = np.mean([clrt.render(scene, samples=64, seed=s, precision=precision).pixels for s in range(8)], axis=0)
    # 512 stratified points of a smooth integrand; measured 0.001.
    np.testing.assert_allclose(pixels, expected, rtol=0.02)
    np.testing.assert_allclose(pixels.mean((0, 1)), expected.mean((0, 1)), rtol=0.002)


def test_back_of_a_light_shines_at_a_grazing_ceiling() -> None:
    """The ceiling a little above the light is lit by its upper side, without the light shadowing itself."""
    light = LAMP + "T -0.3 1.9 -0.3  0.3 1.9 -0.3  0.3 1.9 0.3\nT -0.3 1.9 -0.3  0.3 1.9 0.3  -0.3 1.9 0.3\n"
    ceiling = "M 1 1 1  0 1 0 1 0\nT -9 2 -9  9 2 -9  9 2 9\nT -9 2 -9  9 2 9  -9 2 9\n"
    scene = parse_scene("E 0 1 -3\nV 0 0.46 1\nF 4\nR 8 8\n" + light + ceiling)
    d, eye = scene.camera.directions(), scene.camera.eye
    points = eye + (2.0 - eye[1]) / d[..., 1:2] * d
    assert (points[..., 2] < -0.35).all(), "the pixels see the ceiling beside the light"
    square = np.array([[-0.3, 1.9, -0.3], [0.3, 1.9, -0.3], [0.3, 1.9, 0.3], [-0.3, 1.9, 0.3]])
    factor = np.array([[polygon_factor(square, p, np.array([0.0, 1, 0])) for p in row] for row in points])
    pixels = np.mean([clrt.render(scene, samples=256, seed=s).pixels for s in range(8)], axis=0)
    np.testing.assert_allclose(pixels[..., 0].mean(), 3.0 * factor.mean(), rtol=0.02)


def test_ball_light_is_its_projected_solid_angle() -> None:
    scene = parse_scene(VIEW + BALL + FLOOR)
    to = np.array([0.0, 3, 0]) - floor_points(scene)
    distance = np.linalg.norm(to, axis=-1)
    expected = ((0.7 / distance) ** 2 * to[..., 1] / distance)[..., None] * np.array([3.0, 2, 1]) * np.array([0.5, 0.6, 0.7])
    pixels = np.mean([clrt.render(scene, samples=64, seed=s).pixels for s in range(8)], axis=0)
    np.testing.assert_allclose(pixels, expected, rtol=2e-4)


def test_inside_of_a_shining_ball_lights_what_is_in_it() -> None:
    """From all directions of the half space the same radiance: Kd C Le."""
    scene = parse_scene(VIEW + LAMP + "S 0 0 0 2000\n" + FLOOR)
    close(scene, np.broadcast_to(np.array([1.5, 1.2, 0.7]), (8, 8, 3)))


def test_light_is_seen_as_its_radiance_directly_and_by_mirror() -> None:
    text = "E 0 0 -3\nV 0 0 1\nF 10\nR 4 4\n" + LAMP + "S 0 0 {z} 1\n"
    direct = clrt.render(parse_scene(text.format(z=3)), samples=1)
    np.testing.assert_array_equal(direct.pixels, np.broadcast_to(np.float32([3, 2, 1]), (4, 4, 3)))
    mirror = text.format(z=-9).replace("-9 1", "-9 4") + "M 1 1 1  0 0 0 1 0.5\nT -5 -5 1  5 -5 1  0 9 1\n"
    np.testing.assert_allclose(clrt.render(parse_scene(mirror), samples=1).pixels, np.broadcast_to([1.5, 1.0, 0.5], (4, 4, 3)), rtol=1e-6)


def test_emitters_are_drawn_by_power() -> None:
    scene = parse_scene(VIEW + SQUARE + "T 5 5 5  5 5 5  5 5 5\n" + BALL + "arealight 3 0 0\n".replace("arealight", "# ") + FLOOR)
    found = emitters_of(scene)
    np.testing.assert_allclose(found.area, [2.0, 2.0, 4.0 * np.pi * 0.49])
    np.testing.assert_allclose(found.luminance, 3 * 0.2126 + 2 * 0.7152 + 0.0722)
    assert len(found.area) == 3, "the triangle of zero area is left out"


def test_picture_is_the_same_bit_for_bit_in_any_cut() -> None:
    scene = parse_scene(VIEW.replace("8 8", "40 24").replace("F 0.5", "F 40") + SQUARE + FLOOR + "S 0.5 0.5 0 0.4\n")
    whole = clrt.render(scene, samples=4, seed=9).pixels
    again = clrt.render(scene, samples=4, seed=9).pixels
    np.testing.assert_array_equal(whole, again)
    other = clrt.render(scene, samples=4, seed=10).pixels
    assert (whole != other).any()


def test_scene_in_other_units_is_the_same() -> None:
    scene = parse_scene(VIEW + SQUARE + FLOOR)
    from clrt.scene.scale import scaled

    tiny = scaled(scene, -40)
    np.testing.assert_allclose(clrt.render(tiny, samples=4).pixels, clrt.render(scene, samples=4).pixels, rtol=1e-5)


def test_effects_of_area_lights_are_those_called_for() -> None:
    lit = Features.of(parse_scene(VIEW + SQUARE + FLOOR))
    assert {"area light", "area shadows"} == set(lit.effects)
    dark = Features.of(parse_scene(VIEW + FLOOR + "L 0 5 0\n"))
    assert not any("area" in name for name in dark.effects)


def test_sampled_scene_without_samples_takes_sixteen() -> None:
    scene = parse_scene(VIEW + SQUARE + FLOOR)
    assert clrt.render(scene).stats.samples == 16
    assert clrt.render(scene, samples=3).stats.samples == 3
    assert clrt.render(replace(scene, samples=2, samples_line=1)).stats.samples == 2
    assert clrt.render(parse_scene(VIEW + FLOOR + "L 0 5 0\n")).stats.samples == 1


@pytest.mark.parametrize(
    ("line", "column", "words"),
    [
        ("arealight 1 2\n", 11, 'arealight takes 3 values, as in "arealight 4 4 3", found 2'),
        ("arealight 1 -2 3\n", 13, "green must be at least 0"),
        ("arealight 1 x 3\n", 13, "expected a number"),
        ("arealight 1 2 3\narealight 1 2 3\n", 1, "a second arealight of one material"),
    ],
)
def test_malformed_line_is_told_with_its_place(line: str, column: int, words: str) -> None:
    text = VIEW + "M 1 1 1  0 0 0 1 0\n" + line + "S 0 0 0 1\n"
    with pytest.raises(SceneError) as error:
        parse_scene(text)
    number = 5 + line.count("\n")
    assert f":{number}:{column}: error:" in str(error.value)
    assert words in str(error.value)


def test_arealight_above_any_material_is_an_error() -> None:
    with pytest.raises(SceneError, match=r"5:1: error: arealight before any material"):
        parse_scene(VIEW + "arealight 1 1 1\n" + FLOOR)
