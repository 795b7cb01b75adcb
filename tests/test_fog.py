"""Fog against closed forms and the reference: the exponential, airlight of a lamp, what it takes from lights."""

from __future__ import annotations

import numpy as np
import pytest
from test_indirect import LAMPS, ROOM
from ztest import assert_same, device_batches

import clrt
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS
from clrt.reference.paths import render_paths
from clrt.scene.build import parse_scene
from clrt.scene.scale import scaled

WALL = "M 1 1 1  0 0 0 1 0\narealight 1 0.5 0.25\nT -9 -9 {0}  9 -9 {0}  9 9 {0}\nT -9 -9 {0}  9 9 {0}  -9 9 {0}\n"
BLACK = "fog {} red=0 green=0 blue=0\n"


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", RUNGS)
def test_way_through_fog_leaves_the_exponential(precision: str) -> None:
    scene = parse_scene("E 0 0 -3\nV 0 0 1\nF 0.01\nR 4 4\n" + WALL.format(1) + BLACK.format(0.4))
    pixels = clrt.render(scene, samples=2, precision=precision).pixels
    np.testing.assert_allclose(pixels, np.broadcast_to(np.exp(-1.6) * np.array([1, 0.5, 0.25]), (4, 4, 3)), rtol=1e-5)


def test_ways_add_up_over_a_mirror() -> None:
    text = "E 0 0 -3\nV 0 0 1\nF 0.01\nR 4 4\n" + WALL.format(-5) + "M 1 1 1  0 0 0 1 0.5\nT -9 -9 1  9 -9 1  0 9 1\n" + BLACK.format(0.2)
    pixels = clrt.render(parse_scene(text), samples=2).pixels
    np.testing.assert_allclose(pixels[..., 0], 0.5 * np.exp(-0.2 * 10.0), rtol=1e-5)


def test_light_is_weakened_on_its_way_to_a_surface() -> None:
    text = "E 0 0 -3\nV 0 0 1\nF 0.01\nR 4 4\nL 0 0 -3\nM 1 1 1  0 0.8 0 1 0\nT -9 -9 1  9 -9 1  0 9 1\n" + BLACK.format(0.2)
    pixels = clrt.render(parse_scene(text), samples=2).pixels
    np.testing.assert_allclose(pixels, 0.8 * np.exp(-0.2 * 8.0), rtol=1e-5)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("asymmetry", [0.0, 0.6, -0.5])
def test_airlight_of_a_lamp_is_its_integral(asymmetry: float) -> None:
    """A ray along x at the distance 1 from a point light of colour 1: the integral of s exp(-s x) p(cos) pi exp(-s d), by quadrature."""
    density, ahead = 0.3, 2.0
    text = f"E -{ahead} 0 0\nV 1 0 0\nF 0.01\nR 4 4\nL 0 1 0\nM 1 1 1 0 0 0 1 0\nT 90 90 -99  90 90 -98  90 91 -98\n"
    batches = device_batches(parse_scene(text + f"fog {density} asymmetry={asymmetry}\n"), 256, range(12)).mean((1, 2, 3))
    nodes, weights = np.polynomial.legendre.leggauss(400)
    x = 30.0 * (nodes + 1.0)
    way = np.stack([ahead - x, np.ones_like(x)])
    d = np.hypot(*way)
    g = asymmetry
    phase = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * way[0] / d) ** 1.5)
    expected = 30.0 * (weights * density * np.exp(-density * x) * phase * np.pi * np.exp(-density * d)).sum()
    error = batches.std(ddof=1) / np.sqrt(len(batches))
    assert error < 0.01 * expected
    assert abs(batches.mean() - expected) < 4.0 * error


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("lamp", LAMPS)
@pytest.mark.parametrize("fog", ["fog 0.3 red=0.9 asymmetry=0.4\n", "fog 0.3 green=0.6\nindirect\ndepth 2\n"])
def test_foggy_room_is_that_of_the_reference(lamp: str, fog: str) -> None:
    scene = parse_scene(ROOM + LAMPS[lamp] + fog)
    reference = render_paths(scene, 400, 5)
    assert_same(device_batches(scene, 32, range(8)), reference.mean, reference.variance_of_mean)


@pytest.mark.slow
def test_fog_behind_what_lets_light_through_is_that_of_the_reference() -> None:
    pane = "M 0.5 0.5 1  0 1 0 1 0\nopacity 0.5\nT -0.5 1.2 -0.5  0.5 1.2 -0.5  0 1.2 0.5\n"
    scene = parse_scene(ROOM + "L 0.5 1.8 -0.5\nspot 0 1.7 -1  0 -1 0.2  60 softness=0.5\n" + pane + "fog 0.3\n")
    reference = render_paths(scene, 400, 5)
    assert_same(device_batches(scene, 32, range(8)), reference.mean, reference.variance_of_mean)


def test_light_scattered_in_absorbing_glass_is_absorbed_to_the_place() -> None:
    """The eye and a lamp in a ball of glass that swallows red: the integral has exp(-a x) besides the fog's own exponentials."""
    density, absorb = 0.3, 1.0
    text = "E -0.5 0 0\nV 1 0 0\nF 0.01\nR 4 4\nL 0 0.7 0\nM 0 0 0  0 0 0 1 0 1 1\nabsorb 1 0 0\nS 0 0 0 2\ndepth 1\nfog 0.3\n"
    pictures = device_batches(parse_scene(text), 256, range(12)).mean((1, 2))
    nodes, weights = np.polynomial.legendre.leggauss(200)
    x = 1.25 * (nodes + 1.0)  # to the ball's wall
    d = np.hypot(-0.5 + x, 0.7)
    inside = np.pi / (4 * np.pi) * density * np.exp(-density * (x + d))
    red, green = 1.25 * (weights * inside * np.exp(-absorb * x)).sum(), 1.25 * (weights * inside).sum()
    error = pictures.std(axis=0, ddof=1) / np.sqrt(len(pictures))
    mean = pictures.mean(axis=0)
    assert error[0] < 0.02 * red
    assert abs(mean[0] - red) < 4.0 * error[0]
    # Green goes on behind the wall: more than what is scattered inside.
    assert mean[1] > green - 4.0 * error[1]


def test_nothing_comes_from_infinitely_far_away() -> None:
    text = "E 0 0 -3\nV 0 0 1\nF 40\nR 4 4\nbackground 1 1 1\nsun 0 0 -1\nM 1 1 1  0 1 0 1 0\nS 0 0 0 0.5\nfog 0.1\n"
    scene = parse_scene(text)
    assert any("endless fog" in warning for warning in scene.warnings)
    assert "sun" not in Features.of(scene).effects
    assert not clrt.render(scene, samples=2).pixels.any()


def test_no_density_is_no_fog() -> None:
    assert "fog" not in Features.of(parse_scene(ROOM + "fog 0\n")).effects


@pytest.mark.slow
def test_scene_in_other_units_is_the_same() -> None:
    scene = parse_scene(ROOM + "L 0.5 1.8 -0.5\nfog 0.3\n")
    np.testing.assert_allclose(clrt.render(scaled(scene, 30), samples=4).pixels, clrt.render(scene, samples=4).pixels, rtol=1e-4)


@pytest.mark.parametrize(
    ("line", "column", "words"),
    [
        ("fog", 1, "fog takes 1 value"),
        ("fog -1", 5, "density must be at least 0"),
        ("fog 1 red=2", 11, "red must be from 0 to 1"),
        ("fog 1 asymmetry=1", 17, "asymmetry must be greater than -1 and less than 1"),
        ("fog 1\nfog 2", 1, "a second fog line"),
    ],
)
def test_malformed_line_is_told_with_its_place(line: str, column: int, words: str) -> None:
    with pytest.raises(SceneError) as error:
        parse_scene("E 0 0 0\nV 0 0 1\nF 40\nR 4 4\nM 1 1 1 0 0 0 1 0\nS 0 0 5 1\n" + line + "\n")
    assert f":{7 + line.count(chr(10))}:{column}: error:" in str(error.value)
    assert words in str(error.value)
