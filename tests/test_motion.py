"""Motion blur: sample by sample as the reference, ramps of known shape, times at which all stands still, and what refuses to run."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from device_pictures import in_packets

import clrt
from clrt.device import program
from clrt.device.context import Device
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS, rung
from clrt.reference.sampled import SampledPicture, at_time, render_samples, sample_times
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene
from clrt.scene.scale import scaled

SCENE = Path(__file__).parents[1] / "scenes" / "motion.txt"
FRAME = "E 0 0 -3\nV 0 0 1\nF 45\nR 12 10\nL 3 4 -5\nbackground 0.2 0.3 0.5\nshutter 0.25 1\n"
ROOM = "M 0.4 0.8 0.9 0.1 0.7 0.3 20 0.2\nT -4 -1.2 -2 4 -1.2 -2 0 -1.2 6\nT -4 -2 2 4 -2 2 0 4 2\nO\n"
FLAT = (
    FRAME + "M 0.9 0.5 0.4 0.05 0.7 0.4 40 0\nT -1 -1 0 1 -1 0 0 1 0.2\nmove 0.5 0.3 0.2\nO\nsun 1 1 -1\n" + ROOM.replace("20 0.2", "20 0")
)
SMOOTH = FRAME + (
    "M 0.9 0.5 0.4 0.05 0.7 0.4 40 0.3\nT -1 -1 0 1 -1 0 0 1 0.2  -0.4 -0.3 -1  0.4 -0.3 -1  0 0.5 -1\nmove 0.5 0.3 0.2\nO\n"
    "M 0.3 0.9 0.3 0.05 0.7 0.4 10 0\nT 0 -1 0.5 1.5 -1 0.5 1 1 0.7\nmove -0.6 0 -0.4\nO\nS -0.8 -0.5 0.6 0.5\n" + ROOM
)
GLASS = FRAME + (
    "M 1 1 1 0 0.1 0.5 60 0.1 0.8 1.5\nT -1 -1 0 1 -1 0 0 1 0\nT -1 -1 0 1 -1 0 0 0 0.9\nT -1 -1 0 0 1 0 0 0 0.9\nT 1 -1 0 0 1 0 0 0 0.9\n"
    "move 0.4 0.2 0.3\nO\n" + ROOM
)
EYE = SMOOTH + "move 0.3 -0.1 0.2 of=eye\nlens 0.05 3\n"
INSTANCE = FLAT.replace("move 0.5", "object flyer hidden=yes\nmove 0.5") + "instance flyer 0.2 0.1 0 turn_z=40 scale=0.8 scale_x=1.5\n"
SCENES = {
    "instance": INSTANCE,
    "flat": FLAT,
    "smooth": SMOOTH,
    "glass": GLASS,
    "eye": EYE,
    "eye alone": FRAME + ROOM + "move 0.3 -0.1 0.2 of=eye\n",
}
#: of the angle to an edge: on the rung `watertight` rays of any origin see edges up to 64u times their reach wide (docs/numerics.md); the
#: reach of these scenes is below 30, a few units off: 64 * 2^-24 * 30 / 2
MARGIN = {"watertight": 6e-5}


@cache
def _seen(name: str, bits: int) -> tuple[Scene, SampledPicture]:
    """A scene of one sample a pixel, and the reference's picture of it."""
    scene = replace(parse_scene(SCENES[name]).with_size(7, 5), seed=7)
    return scene, render_samples(scene, seed=7, bits=bits)


def _agrees(pixels: np.ndarray, reference: SampledPicture, precision: str = "watertight") -> None:
    wrong = np.abs(pixels - reference.pixels).max(-1) > 1e-4
    assert not (wrong & (reference.margin > MARGIN.get(precision, 2e-5))).any()
    assert wrong.sum() <= 1


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("name", SCENES)
def test_samples_match_the_reference(name: str) -> None:
    scene, reference = _seen(name, 24)
    _agrees(clrt.render(scene, samples=1, seed=7).pixels, reference)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", sorted(RUNGS))
@pytest.mark.parametrize("name", ["eye", "eye alone"])
def test_rungs_match_the_reference(name: str, precision: str) -> None:
    scene, reference = _seen(name, 24 if rung(precision).bits == 32 else 32)
    _agrees(clrt.render(scene, samples=1, precision=precision, seed=7).pixels, reference, precision)


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [16, 8, 4, 1])
def test_every_packet_width_matches_the_reference(device: Device, lanes: int) -> None:
    scene, reference = _seen("smooth", 24)
    _agrees(in_packets(scene, device, lanes), reference)


@pytest.mark.slow
def test_samples_are_averaged() -> None:
    scene = replace(parse_scene(FLAT).with_size(6, 5), samples=3)
    _agrees(clrt.render(scene, seed=9).pixels, render_samples(scene, seed=9, bits=24))


def test_comment_of_the_scene_holds() -> None:
    pixels = clrt.render(SCENE).pixels.astype(np.float64)
    found = re.findall(r"^# pixel \((\d+),(\d+)\) is (\S+) (\S+) (\S+)$", SCENE.read_text(), re.M)
    assert len(found) >= 9
    for column, row, *color in found:
        wanted = [float(c) for c in color]
        np.testing.assert_allclose(pixels[int(row), int(column)], wanted, rtol=0, atol=0.03 if 0 < wanted[0] < 1 else 0)
    # Five rows alike: three standard deviations of independent samples, which scattered ones do not exceed.
    share = np.array([1, 7 / 8, 5 / 8, 3 / 8, 1 / 8, 0])
    error = pixels[10:15, 7:13, 0].mean(0) - share
    assert (np.abs(error) <= 3 * np.sqrt(share * (1 - share) / (5 * 1024))).all()


def test_moving_eye_blurs_by_distance() -> None:
    """An eye that goes 0.5 to the right sees an edge at the distance z go 0.5 / z to the left: a ramp of that width."""
    walls = "T -8 0.25 2 -8 8 2 0 8 2\nT -8 0.25 2 0 8 2 0 0.25 2\nT -8 -8 1 -8 -0.125 1 0 -0.125 1\nT -8 -8 1 0 -0.125 1 0 -8 1\n"
    head = "E 0 0 0\nV 0 0 1\nF 90\nR 16 16\nsamples 512\nshutter 0 1\nmove 0.5 0 0 of=eye\nM 1 1 1 1 0 0 1 0\n"
    seen = clrt.render(parse_scene(head + walls)).pixels[..., 0].astype(np.float64)
    near, far = seen[10:16].mean(0), seen[0:6].mean(0)
    error = 3 * np.sqrt(0.25 / (6 * 512))
    np.testing.assert_allclose(near, [*[1] * 4, 7 / 8, 5 / 8, 3 / 8, 1 / 8, *[0] * 8], rtol=0, atol=error)
    np.testing.assert_allclose(far, [*[1] * 6, 3 / 4, 1 / 4, *[0] * 8], rtol=0, atol=error)


@pytest.mark.slow
def test_open_for_no_time_is_the_scene_at_that_time() -> None:
    scene = parse_scene(FLAT.replace("shutter 0.25 1", "shutter 0.5 0.5"))
    still = replace(at_time(scene, 0.5), shutter=None)
    assert still.objects[0].vertices[0, 0].tolist() == [-0.75, -0.85, 0.1]
    np.testing.assert_allclose(clrt.render(scene, samples=2).pixels, clrt.render(still, samples=2).pixels, rtol=0, atol=1e-5)


def test_times_are_uniform_while_the_shutter_is_open() -> None:
    scene = replace(parse_scene(FLAT), samples=64)
    times = np.sort(np.stack([sample_times(scene, sample, 5) for sample in range(64)]).reshape(64, -1), axis=0)
    strata = 0.25 + 0.75 * np.arange(65)[:, None] / 64
    assert (times >= strata[:-1]).all()
    assert (times < strata[1:]).all()


def test_late_times_lose_no_more_than_their_distance_rounds() -> None:
    """At the time 1e4 the object has come 5000 units, and float32 has steps of 5e-4 there; no hit is lost and no shadow falls on itself."""
    text = FLAT.replace("shutter 0.25 1", "shutter 10000 10000").replace("move 0.5 0.3 0.2", "move 0.5 0 0")
    moving = parse_scene(text.replace("-1 -1 0 1 -1 0 0 1 0.2", "-5001 -1 0 -4999 -1 0 -5000 1 0.2")).with_size(23, 19)
    fast, sure = (clrt.render(moving, samples=1, precision=precision).pixels for precision in ("fast", "watertight"))
    still = render_samples(replace(at_time(moving, 1e4), samples=1, shutter=None), seed=moving.seed, bits=24).pixels
    assert (np.abs(fast - still).max(-1) > 0.01).sum() <= 2, "pixels whose centre lies within 5e-4 of an edge"
    # Its edges are 64u times their reach wide there, 64 * 2^-24 * 5000 * 2 = 0.04 units of 0.1 a pixel.
    assert (np.abs(sure - still).max(-1) <= 0.01).mean() > 0.95


@pytest.mark.slow
def test_units_do_not_matter() -> None:
    scene = parse_scene(EYE)
    pixels = clrt.render(scene, samples=2).pixels
    for exponent in (-40, 50):
        assert (clrt.render(scaled(scene, exponent), samples=2).pixels == pixels).all()


def test_right_handed_motion_is_turned() -> None:
    scene = parse_scene(EYE, right_handed=True)
    assert [o.motion for o in scene.objects] == [(-0.5, 0.3, 0.2), (0.6, 0.0, -0.4), (0.0, 0.0, 0.0)]
    assert scene.shutter is not None
    assert scene.shutter.eye_motion == (-0.3, -0.1, 0.2)


@pytest.mark.parametrize("line", ["", "shutter 0 1\n", "shutter 0 1\nmove 0 0 0\n"])
def test_nothing_that_moves_adds_nothing(line: str) -> None:
    plain = FRAME.replace("shutter 0.25 1\n", "") + ROOM
    scenes = parse_scene(plain), parse_scene(plain.replace("T -4 -2", line + "T -4 -2"))
    sources = [program.compose(Features.of(s), rung("watertight"), 8, program.Shape(8, 5)) for s in scenes]
    assert sources[0] == sources[1]
    assert "shutter" not in sources[0]


def test_objects_of_a_split_scene_move_together() -> None:
    text = FRAME + "M 1 1 1 1 0 0 1 0\nT 0 0 3 1 0 3 0 1 3\nT 5 0 3 6 0 3 5 1 3\nmove 1 2 3\n"
    assert [o.motion for o in parse_scene(text, split_objects=True).objects] == [(1, 2, 3), (1, 2, 3)]


@pytest.mark.parametrize(
    ("text", "warning"),
    [("T 0 0 3 1 0 3 0 1 3\n", "the shutter has no effect"),
     ("T 0 0 3 1 0 3 0 1 3\nmove 1 0 0\nS 0 0 3 1\n", "line 11: a sphere does not move")],
)  # fmt: skip
def test_what_stands_still_is_told(text: str, warning: str) -> None:
    assert any(w.startswith(warning) for w in parse_scene(FRAME + "M 1 1 1 1 0 0 1 0\n" + text).warnings)


BASE = "E 0 0 -1\nV 0 0 1\nF 45\nR 8 8\nL 0 0 -5\nM 1 1 1 1 0 0 1 0\n"
WALL = "T 0 0 3 1 0 3 0 1 3\n"


@pytest.mark.parametrize(
    ("lines", "line", "column", "found"),
    [("shutter 1\n" + WALL, 7, 9, "takes 2 values"), ("shutter 1 0\n" + WALL, 7, 11, "before it opens"),
     ("shutter 0 x\n" + WALL, 7, 11, "number"),
     ("shutter 0 2e6\n" + WALL, 7, 11, "1e+06"), ("shutter 0 1\nshutter 0 1\n" + WALL, 8, 1, "a second shutter"),
     (WALL + "move 1 0 0\n", 8, 1, 'such as "shutter 0 1"'), ("shutter 0 1\n" + WALL + "move 1 0\n", 9, 6, "takes 3 values"),
     ("shutter 0 1\n" + WALL + "move 1 0 nan\n", 9, 10, "finite"),
     ("shutter 0 1\n" + WALL + "move 1 0 0 of=eyes\n", 9, 15, "object or eye"),
     ("shutter 0 1\n" + WALL + "move 1 0 0\nmove 1 0 0\n", 10, 1, "a second move of one object"),
     ("shutter 0 1\n" + WALL + "move 1 0 0 of=eye\nmove 1 0 0 of=eye\n", 10, 1, "a second move of the eye"),
     ("shutter 0 1\n" + WALL + "O\nS 0 0 3 1\nmove 1 0 0\n", 11, 1, "spheres do not move"),
     ("shutter 0 1\n" + WALL + "arealight 1 1 1\nmove 1 0 0\n", 10, 1, "sends out light"),
     ("shutter 0 1\nM 1 1 1 0 0 0 1 0 1 1.5\nT 3 -1 -2 4 1 0 3 0 0\nmove -4 0 0\n", 10, 1, "the eye and something that light"),
     ("shutter 0 1\n" + WALL + "M 1 1 1 0 0 0 1 0 1 1.5\nS 0 0 0.5 0.5\nmove 0 0 2 of=eye\n", 11, 1, "the eye and something"),
     ])  # fmt: skip
def test_malformed_lines_are_refused_with_their_place(lines: str, line: int, column: int, found: str) -> None:
    with pytest.raises(SceneError, match=rf"<text>:{line}:{column}: error: .*{re.escape(found)}"):
        parse_scene(BASE + lines)


def test_glass_that_passes_beside_the_eye_is_fine() -> None:
    text = "shutter 0 1\nM 1 1 1 0 0 0 1 0 1 1.5\nT 3 -1 2 4 1 2 3 0 3\nmove -6 0 0\nO\n" + "M 1 1 1 0 0 0 1 0 1 1.5\nS 0 0 4 0.5\n"
    assert parse_scene(BASE + text).objects[0].motion == (-6, 0, 0)
