"""Depth of field: sample by sample as the reference, blurs of known shape, limits that are pinholes, and what refuses to run."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from device_pictures import in_packets

import clrt
from clrt.device import program
from clrt.device.context import Device
from clrt.errors import SceneError
from clrt.features import Features
from clrt.features.camera import lens_axes
from clrt.precision import RUNGS, rung
from clrt.reference.sampled import disc_points, render_samples
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene
from clrt.scene.scale import scaled

SCENE = Path(__file__).parents[1] / "scenes" / "lens.txt"
FLAT = (
    "E 0.5 0 -1\nV 0.1 -0.1 1\nF 45\nR 24 20\nL 5 5 -5\nsun 1 1 -1\nbackground 0.2 0.3 0.5\nM 0.9 0.9 0.9 0.05 0.3 0.4 40 0\n"
    "S 0.4 0 3 0.7\nM 1 1 0.5 0.1 0.9 0.3 20 0\nT -9 -1 12 9 -1 12 0 -1 -3\n"
    "T -1 -1 2 0 1 3 -1 1 4  -0.3 0 -1  0 0 -1  0 0.3 -1\nlens 0.1 3\n"
)
BOUNCING = FLAT.replace("40 0\n", "40 0.6\n") + "M 1 1 1 0 0.1 0.5 60 0.1 0.8 1.5\nS -0.6 0 2.5 0.6\n"
OBLIQUE = re.sub("V.*\nF.*\n", "O -1 1 2  1.5 1.2 1.5  -1 -1 2  1.5 -0.8 1.5\n", BOUNCING)


#: of the angle to an edge: on the rung `watertight` rays of any origin see edges up to 64u times their reach wide (docs/numerics.md), and
#: the reach of these scenes, coordinates and longest edge, is below 60, a few units off: 64 * 2^-24 * 60 / 2
MARGIN = {"watertight": 1.2e-4}


def _agrees(scene: Scene, pixels: np.ndarray, seed: int, bits: int, precision: str = "watertight") -> None:
    reference = render_samples(scene, seed=seed, bits=bits)
    wrong = np.abs(pixels - reference.pixels).max(-1) > 1e-4
    assert not (wrong & (reference.margin > MARGIN.get(precision, 2e-5))).any()
    assert wrong.sum() <= 0.02 * wrong.size


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", sorted(RUNGS))
@pytest.mark.parametrize("text", [BOUNCING, FLAT, OBLIQUE], ids=["bouncing", "flat", "oblique"])
def test_samples_match_the_reference(text: str, precision: str) -> None:
    scene = replace(parse_scene(text), samples=3)
    _agrees(scene, clrt.render(scene, precision=precision, seed=7).pixels, 7, 24 if rung(precision).bits == 32 else 32, precision)


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [16, 8, 4, 1])
def test_every_packet_width_matches_the_reference(device: Device, lanes: int) -> None:
    scene = replace(parse_scene(BOUNCING).with_size(21, 13), samples=2, seed=3)
    _agrees(scene, in_packets(scene, device, lanes), 3, 24)


def test_one_sample_goes_through_the_lens() -> None:
    scene = parse_scene(FLAT)
    pixels = clrt.render(scene, samples=1, seed=5).pixels
    _agrees(scene, pixels, 5, 24)
    assert np.abs(pixels - render_samples(replace(scene, samples=1, lens=None), seed=5, bits=24).pixels).max() > 0.01


def test_comment_of_the_scene_holds() -> None:
    pixels = clrt.render(SCENE).pixels.astype(np.float64)
    found = re.findall(r"^# pixel \((\d+),(\d+)\) is (\S+) (\S+) (\S+)$", SCENE.read_text(), re.M)
    assert len(found) >= 9
    for column, row, *color in found:
        wanted = [float(c) for c in color]
        np.testing.assert_allclose(pixels[int(row), int(column)], wanted, rtol=0, atol=0.03 if 0 < wanted[0] < 1 else 0)
    # Five rows alike: three standard deviations of independent samples, which scattered ones do not exceed.
    share = np.array([1, 0.919837, 0.655751, 0.344249, 0.080163, 0])
    error = pixels[10:15, 5:11, 0].mean(0) - share
    assert (np.abs(error) <= 3 * np.sqrt(share * (1 - share) / (5 * 1024))).all()


def test_small_light_is_seen_as_an_even_disc() -> None:
    """A bright square of side 0.05 at half the focus is spread over a disc of the radius 0.25; its light is neither more nor less."""
    scene = parse_scene(
        "E 0 0 0\nV 0 0 1\nF 90\nR 32 32\nlens 0.5 2\nsamples 512\nM 1 1 1 1 0 0 1 0\n"
        "T -0.025 -0.025 1 -0.025 0.025 1 0.025 0.025 1\nT -0.025 -0.025 1 0.025 -0.025 1 0.025 0.025 1\n"
    )
    seen = clrt.render(scene).pixels[..., 0].astype(np.float64)
    place = np.abs(np.arange(33) - 16) / 16
    nearest, farthest = (np.hypot.outer(*[f(place[:-1], place[1:])] * 2) for f in (np.minimum, np.maximum))
    inside, outside = farthest < 0.25 - 0.036, nearest > 0.25 + 0.036
    share = 0.05**2 / (np.pi * 0.25**2)
    assert inside.sum() >= 24
    assert (seen[outside] == 0).all()
    assert abs(seen[inside].mean() - share) < 4 * np.sqrt(share / (inside.sum() * 512))
    assert abs(seen.sum() / 16**2 - 0.05**2) < 4 * 0.05**2 / np.sqrt(share * 512 * np.pi * 16)
    halves = seen[inside & (nearest < 0.12)].mean(), seen[inside & (nearest >= 0.12)].mean()
    assert abs(halves[0] - halves[1]) < 0.5 * share, "as bright in the middle as at the rim"


def test_disc_points_are_uniform() -> None:
    """Equal areas of the square go to equal areas of the disc: the map's Jacobian is pi/4 everywhere off the diagonals."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1, 1, (2, 1000))
    off = np.abs(np.abs(x) - np.abs(y)) > 1e-3
    step = 1e-6
    along = (disc_points(x + step, y) - disc_points(x - step, y)) / (2 * step)
    across = (disc_points(x, y + step) - disc_points(x, y - step)) / (2 * step)
    area = along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]
    np.testing.assert_allclose(area[off], np.pi / 4, rtol=1e-5)
    assert (np.hypot(*disc_points(x, y).T) <= 1 + 1e-12).all()
    assert disc_points(np.zeros(1), np.zeros(1)).tolist() == [[0.0, 0.0]]


def test_axes_are_those_of_the_view() -> None:
    axes = lens_axes(parse_scene(FLAT).camera)
    forward = np.array([0.1, -0.1, 1]) / np.linalg.norm([0.1, -0.1, 1])
    right = np.cross([0, 1, 0], forward) / np.linalg.norm(np.cross([0, 1, 0], forward))
    np.testing.assert_allclose(axes, [right, np.cross(forward, right), forward], atol=1e-12)


def test_no_radius_is_a_pinhole() -> None:
    scene, plain = (parse_scene(FLAT.replace("lens 0.1 3\n", line)) for line in ("lens 0 3\n", ""))
    sources = [program.compose(Features.of(s), rung("watertight"), 8, program.Shape(8, 5)) for s in (scene, plain)]
    assert sources[0] == sources[1]
    assert "lens" not in sources[0]


@pytest.mark.slow
def test_units_do_not_matter() -> None:
    scene = parse_scene(BOUNCING)
    pixels = clrt.render(scene, samples=2).pixels
    for exponent in (-40, 50):
        assert (clrt.render(scaled(scene, exponent), samples=2).pixels == pixels).all()


def test_right_handed_scene_is_the_mirror_image() -> None:
    scene, turned = (parse_scene(FLAT, right_handed=flag) for flag in (False, True))
    assert turned.lens == scene.lens
    pixels, mirrored = (render_samples(replace(s, samples=64)).pixels.mean((0, 1)) for s in (scene, turned))
    np.testing.assert_allclose(pixels, mirrored, atol=0.02)


@pytest.mark.parametrize(
    ("line", "column", "found"),
    [("lens 0.1", 6, "takes 2 values"), ("lens -1 3", 6, "at least 0"), ("lens 0.1 0", 10, "greater than 0"), ("lens x 3", 6, "number"),
     ("lens 0.1 nan", 10, "finite"), ("lens 0.1 3 blades=6", 12, "no key"), ("lens 1e9 1", 6, "1e+06 times as wide")],
)  # fmt: skip
def test_malformed_line_is_refused_with_its_place(line: str, column: int, found: str) -> None:
    with pytest.raises(SceneError, match=rf"<text>:3:{column}: error: .*{re.escape(found)}"):
        parse_scene(f"E 0 0 -1\nV 0 0 1\n{line}\nF 45\nR 8 8\nM 1 1 1 1 0 0 1 0\nS 0 0 3 1\n")


def test_second_line_is_refused() -> None:
    with pytest.raises(SceneError, match=r"<text>:2:1: error: a second lens line"):
        parse_scene("lens 1 3\nlens 1 3\nE 0 0 -1\nV 0 0 1\nF 45\nR 8 8\nM 1 1 1 1 0 0 1 0\nS 0 0 3 1\n")
