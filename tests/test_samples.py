"""Antialiasing: the mean of samples against the reference's, exact areas, independence of launches, and what refuses to run."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from device_pictures import in_packets

import clrt
from clrt import renderer
from clrt.device import program
from clrt.device.context import Device
from clrt.errors import LimitError, SceneError
from clrt.features import Features
from clrt.film import Film
from clrt.precision import RUNGS, rung
from clrt.reference import render
from clrt.reference.sampled import render_samples
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.model import Scene

SCENE = Path(__file__).parents[1] / "scenes" / "samples.txt"
TEXT = (
    "E 0 0 -1\nV 0 0 1\nF 45\nR 24 20\nL 5 5 -5\nbackground 0.2 0.3 0.5\nM 0.9 0.9 0.9 0.05 0.3 0.4 40 0.6 0 1\nS 0.4 0 3 0.7\n"
    "M 1 1 1 0 0.1 0.5 60 0.1 0.8 1.5\nS -0.6 0 2.5 0.6\nM 1 1 0.5 0.1 0.9 0.3 20 0 0 0\nT -9 -1 12 9 -1 12 0 -1 -3\n"
)


def _quiet(phase: str, fraction: float) -> None:
    """No progress."""


def _tracer(scene: Scene, device: Device, precision: str = "watertight") -> renderer.Tracer:
    prepared = renderer.build_trees(scene, "sah", _quiet)
    return renderer.open_tracer(prepared, Features.of(scene), rung(precision), device, _quiet)[1]


def test_comment_of_the_scene_holds() -> None:
    """Areas of pixels that are whole numbers of elementary intervals are met to the last bit."""
    pixels = clrt.render(SCENE).pixels
    found = re.findall(r"^# pixel \((\d+),(\d+)\) is (\S+) (\S+) (\S+)$", SCENE.read_text(), re.M)
    assert len(found) >= 6
    for column, row, *color in found:
        assert pixels[int(row), int(column)].tolist() == [float(c) for c in color], (column, row)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", sorted(RUNGS))
def test_mean_of_samples_matches_the_reference(precision: str) -> None:
    scene = replace(parse_scene(TEXT), samples=3)
    pixels = clrt.render(scene, precision=precision, seed=7).pixels
    reference = render_samples(scene, seed=7, bits=24 if rung(precision).bits == 32 else 32)
    wrong = np.abs(pixels - reference.pixels).max(-1) > 1e-4
    assert not (wrong & (reference.margin > 2e-5)).any()
    assert wrong.sum() <= 0.02 * wrong.size


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("lanes", [8, 16, 4, 1])
def test_every_packet_width_takes_the_same_samples(device: Device, lanes: int) -> None:
    scene = replace(parse_scene(TEXT).with_size(21, 13), samples=2, seed=3)
    reference = render_samples(scene, seed=3, bits=24)
    wrong = np.abs(in_packets(scene, device, lanes) - reference.pixels).max(-1) > 1e-4
    assert not (wrong & (reference.margin > 2e-5)).any()


def test_picture_does_not_depend_on_launches(device: Device) -> None:
    scene = replace(parse_scene(TEXT).with_size(33, 37), samples=4, seed=11)
    whole = clrt.render(scene, seed=11).pixels
    tracer = _tracer(scene, device)
    for sample in range(4):
        tracer.begin_samples(sample, sample + 1)
        for first, end in ((24, 37), (0, 8), (8, 24)):
            tracer.run(first, end)
    assert (tracer.picture() == whole).all()


def test_same_seed_gives_the_same_picture_and_another_seed_another() -> None:
    scene = parse_scene(TEXT)
    one, again, other = (clrt.render(scene, samples=2, seed=s).pixels for s in (4294967295, 4294967295, 0))
    assert (one == again).all()
    assert (one != other).any()


def test_one_sample_is_the_pixels_centre_and_draws_nothing() -> None:
    scene = parse_scene(TEXT.replace("R 24 20", "R 24 20\nsamples 1"))
    plain = parse_scene(TEXT)
    sources = [program.compose(Features.of(s), rung("watertight"), 8, program.Shape(8, 5)) for s in (scene, plain)]
    assert sources[0] == sources[1]
    assert "sampl" not in sources[0]
    assert (clrt.render(scene, seed=5).pixels == clrt.render(plain).pixels).all()
    assert (clrt.render(plain, samples=2).pixels != clrt.render(plain).pixels).any()


def test_means_are_unbiased_by_independent_seeds() -> None:
    """z of each pixel's mean over 24 seeds against 32 x 32 places on a grid in float64; 1% of all pictures may fail (Sidak)."""
    scene = replace(parse_scene(TEXT.replace("24 20", "8 6")), samples=8)
    film = Film(8, 6)
    for seed in range(24):
        film.add(clrt.render(scene, seed=seed).pixels)
    fine = render(scene.with_size(256, 192)).pixels.reshape(6, 32, 8, 32, 3).mean((1, 3))
    # The grid misses a pixel's integral by less than a row of its cells where edges cross it.
    error = np.sqrt(film.variance_of_mean + (1 / 32 / np.sqrt(12)) ** 2 / 32)
    assert (np.abs(film.mean - fine) / error).max() < 4.9  # Student's t of 23 degrees of freedom, 1% over 144 numbers


def test_counters_count_all_samples() -> None:
    stats = clrt.render(parse_scene(TEXT), samples=3, seed=2, count=True).stats
    assert stats is not None
    assert (stats.samples, stats.seed, stats.primary_rays) == (3, 2, 3 * 24 * 20)
    assert stats.ray_counts is not None
    reference = render_samples(replace(parse_scene(TEXT), samples=3), seed=2, bits=24).rays
    assert stats.ray_counts["primary"] == reference["primary"]
    assert abs(stats.ray_counts["shadow"] - reference["shadow"]) <= 0.01 * reference["shadow"]


def test_progress_goes_on_over_samples() -> None:
    told: list[float] = []
    clrt.render(parse_scene(TEXT), samples=4, progress=lambda phase, part: told.append(part) if phase == "render" else None)
    assert told == sorted(told)
    assert {0.0, 0.25, 0.5, 0.75, 1.0} <= set(told)


@pytest.mark.parametrize(
    ("line", "column", "found"),
    [("samples 0", 9, "1 to 65536"), ("samples 1.5", 9, "whole"), ("samples", 1, "takes 1 value"), ("samples x", 9, "expected a number"),
     ("samples 65537", 9, "65536"), ("samples nan", 9, "finite"), ("samples 2 seed=1", 11, "no key")],
)  # fmt: skip
def test_malformed_line_is_refused_with_its_place(line: str, column: int, found: str) -> None:
    with pytest.raises(SceneError, match=rf"<text>:3:{column}: error: .*{re.escape(found)}"):
        parse_scene(f"E 0 0 -1\nV 0 0 1\n{line}\nF 45\nR 8 8\nM 1 1 1 1 0 0 1 0\nS 0 0 3 1\n")


def test_second_line_is_refused() -> None:
    with pytest.raises(SceneError, match=r"<text>:2:1: error: a second samples line"):
        parse_scene("samples 2\nsamples 3\nE 0 0 -1\nV 0 0 1\nF 45\nR 8 8\nM 1 1 1 1 0 0 1 0\nS 0 0 3 1\n")


@pytest.mark.parametrize(("samples", "seed"), [(0, 0), (1 << 17, 0), (1, -1), (1, 1 << 32)])
def test_numbers_out_of_range_are_refused(samples: int, seed: int) -> None:
    with pytest.raises(LimitError, match="out of range"):
        clrt.render(load_scene(SCENE), samples=samples, seed=seed)
