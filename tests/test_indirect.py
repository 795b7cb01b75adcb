"""Light from surface to surface: furnaces with a known answer, depth, clamp, and the shares of drawn rays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from device_pictures import ray_counts
from ztest import assert_same, device_batches

import clrt
from clrt.device.context import Device
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS
from clrt.reference.paths import render_paths
from clrt.scene.build import parse_scene
from clrt.scene.model import Indirect

VIEW = "E 0.1 0.2 -0.3\nV 0.3 0.2 1\nF 60\nR 8 8\n"


def furnace(phong: str, walls: str, depth: int = 64, emission: float = 1.0) -> str:
    return f"{VIEW}depth {depth}\nindirect\nM 0.5 0.5 0.5 {phong} 0\narealight {emission} {emission} {emission}\n{walls}"


def cube() -> str:
    lines = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            corners = [np.insert(np.array(c, float), axis, side) for c in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            for triangle in ((0, 1, 2), (0, 2, 3)):
                lines.append("T " + "  ".join(" ".join(map(str, corners[i])) for i in triangle))
    return "\n".join(lines) + "\n"


WALLS = {"ball": "S 0 0 0 2\n", "cube": cube()}


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("walls", WALLS)
def test_furnace_is_emission_over_what_is_lost(walls: str) -> None:
    """L = e + a L with albedo a = C Kd = 0.5: L = 2."""
    batches = device_batches(parse_scene(furnace("0.9 1 0 1", WALLS[walls])), 32, range(16)).mean((1, 2, 3))
    error = batches.std(ddof=1) / np.sqrt(len(batches))
    assert error < 0.01
    assert abs(batches.mean() - 2.0) < 4.0 * error


@pytest.mark.matrix(keep=2)
@pytest.mark.parametrize("precision", RUNGS)
@pytest.mark.parametrize("depth", [0, 1, 2, 3])
def test_depth_ends_the_series(precision: str, depth: int) -> None:
    """Light of at most depth + 1 surfaces: 1 + 1/2 + ... + 2^-(depth + 1); the last by light samples.

    Without depth nothing scatters: Ka counts.
    """
    scene = parse_scene(furnace("0 1 0 1", WALLS["ball"], depth))
    picture = np.mean([clrt.render(scene, samples=16, seed=s, precision=precision).pixels.mean() for s in range(4)])
    assert abs(picture - sum(0.5**k for k in range(depth + 2))) < 2e-3


def test_furnace_with_a_highlight_loses_energy_only() -> None:
    """Kd + 2 Ks / (n + 1) = 0.7 + 0.6 / 21 bounds the albedo: part of the highlight falls below the surface."""
    scene = parse_scene(furnace("0 0.7 0.3 20", WALLS["ball"]).replace("M 0.5 0.5 0.5", "M 1 1 1"))
    mean = device_batches(scene, 32, range(8)).mean()
    assert 1.0 / (1.0 - 0.7) * 0.99 < mean < 1.0 / (1.0 - 0.7 - 0.6 / 21.0) * 1.01


def test_background_lights_through_scattered_rays_alone() -> None:
    text = "E 0 0 -5\nV 0 0 1\nF 10\nR 8 8\nbackground 0.3 0.6 0.9\nM 0.5 0.5 0.5  0.4 1 0 1 0\nS 0 0 0 1\n"
    lit = device_batches(parse_scene(text + "indirect\n"), 8, range(4)).mean(0)
    np.testing.assert_allclose(lit, np.broadcast_to([0.15, 0.3, 0.45], lit.shape), rtol=1e-5)
    flat = clrt.render(parse_scene(text)).pixels
    np.testing.assert_allclose(flat, np.full(flat.shape, 0.2), rtol=1e-5)


ROOM = """E 0 1 -3.4
V 0 0 1
F 40
R 12 12
M 1 1 1  0 0 0 1 0
arealight 12 10 8
T -0.3 1.6 -0.3  0.3 1.6 -0.3  0.3 1.6 0.3
T -0.3 1.6 -0.3  0.3 1.6 0.3  -0.3 1.6 0.3
M 0.8 0.7 0.6  0.1 1 0 1 0
T -1 0 -1  1 0 -1  1 0 1
T -1 0 -1  1 0 1  -1 0 1
T -1 0 1  1 0 1  1 2 1
T -1 0 1  1 2 1  -1 2 1
M 0.8 0.1 0.1  0.1 1 0 1 0
T -1 0 -1  -1 0 1  -1 2 1
T -1 0 -1  -1 2 1  -1 2 -1
M 0.8 0.8 0.8  0.1 0.6 0.4 10 0.2
S 0.4 0.5 0.2 0.3
"""
LAMPS = {
    "area": "",
    "ball": "M 0.5 0.5 0.5 0 1 0 1 0\narealight 3 4 5\nS -0.5 0.5 -0.2 0.2\n",
    "point": "L 0.5 1.8 -0.5  0.5 0.5 0.4\n",
    "glass": "M 1 1 1  0 0 0 1 0 1 1.5\nfresnel\nS -0.4 0.45 -0.2 0.3\n",
}


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("lamp", LAMPS)
@pytest.mark.parametrize("end", ["indirect\n", "indirect\ndepth 1\n", ""])
def test_room_is_that_of_the_reference(lamp: str, end: str) -> None:
    scene = parse_scene(ROOM + LAMPS[lamp] + end)
    reference = render_paths(scene, 400, 3)
    assert_same(device_batches(scene, 32, range(8)), reference.mean, reference.variance_of_mean)


@pytest.mark.slow
def test_panes_that_only_light_samples_pass_lose_no_light() -> None:
    """Light samples go through the pane, scattered rays do not: what these find of lights cannot stand for it."""
    pane = "M 0.5 0.5 1  0 1 0 1 0\nopacity 0.3 of=shadow\nT -0.7 1.2 -0.7  0.7 1.2 -0.7  0 1.2 0.7\n"
    gloss = "M 0.9 0.9 0.9  0 0 0 1 0.8\ngloss 0.4\nS 0.5 1.0 -0.3 0.25\n"
    scene = parse_scene(ROOM + pane + gloss + "indirect\n")
    reference = render_paths(scene, 1000, 3)
    assert_same(device_batches(scene, 64, range(8)), reference.mean, reference.variance_of_mean)


def test_clamp_only_darkens_and_is_told(tmp_path: Path) -> None:
    scene = parse_scene(ROOM + "indirect\n")
    free, cut = clrt.render(scene, samples=16), clrt.render(replace(scene, indirect=Indirect(0.05, 1)), samples=16)
    assert (cut.pixels <= free.pixels + 1e-6).all()
    assert cut.pixels.mean() < 0.9 * free.pixels.mean()
    assert free.stats.bias == ""
    assert cut.stats.bias == "biased: indirect clamp"
    for name in ("a.png", "a.ppm"):
        cut.save(tmp_path / name)
        assert b"biased: indirect clamp" in (tmp_path / name).read_bytes()
        free.save(tmp_path / name)
        assert b"biased" not in (tmp_path / name).read_bytes()


def test_rays_of_indirect_light_are_counted_only_where_it_is(device: Device) -> None:
    ball = furnace("0 1 0 1", WALLS["ball"], 1)
    assert ray_counts(parse_scene(ball), device, samples=1)[0]["indirect"] == 64
    assert "indirect" not in Features.of(parse_scene(ball.replace("indirect\n", ""))).ray_kinds


@pytest.mark.parametrize("depth", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_ambient_part_is_left_out_at_any_depth(depth: int) -> None:
    """Ka stands for what indirect light is; without depth there is none, and Ka does not come back."""
    text = "E 0 0 -5\nV 0 0 1\nF 10\nR 4 4\nM 0.5 0.5 0.5  0.8 1 0 1 0\nS 0 0 0 1\nindirect\ndepth {}\n"
    assert "indirect" in Features.of(parse_scene(text.format(depth))).effects
    assert not clrt.render(parse_scene(text.format(depth)), samples=2).pixels.any()


PANES = "".join(f"T -9 -9 {z}  9 -9 {z}  0 18 {z}\n" for z in (-1.0, -0.8, -0.6))
BEHIND_PANES = (
    "E 0 0 -4\nV 0 0 1\nF 10\nR 6 4\nindirect\n{}M 0.5 0.5 0.5  0 1 0 1 0\nT -9 -9 0  9 -9 0  0 18 0\nM 1 1 1  0 1 0 1 0\nopacity {}\n"
    + PANES
)
LAMP = "M 0 0 0  0 0 0 1 0\narealight 2 2 2\nS 0 0 -9 3\n"


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("opacity", [0.0, 0.4])
@pytest.mark.parametrize("depth", [1, 3])
def test_surfaces_behind_panes_lose_no_light_when_the_depth_ends(opacity: float, depth: int) -> None:
    """Light samples go through any number of panes, scattered rays through as many as the depth allows."""
    scene = parse_scene(BEHIND_PANES.format(LAMP, opacity) + f"depth {depth}\n")
    reference = render_paths(scene, 600, 3)
    assert_same(device_batches(scene, 64, range(8)), reference.mean, reference.variance_of_mean)


def test_lamp_that_is_not_opaque_lights_as_it_is_seen() -> None:
    text = "E 0 0 -4\nV 0 0 1\nF 10\nR 4 3\ndepth 2\nindirect\nM 1 1 1 0 0.5 0 1 0\nopacity 0.3\narealight 1 1 1\nS 0 0 0 1\n"
    scene = parse_scene(text)
    reference = render_paths(scene, 600, 3)
    assert_same(device_batches(scene, 64, range(8)), reference.mean, reference.variance_of_mean)


@pytest.mark.slow
def test_random_numbers_are_those_of_the_ray_whatever_its_packet() -> None:
    """Packets of 16 and of 8 lanes: the same numbers, so the same picture but for rounding; also where only some lanes meet a pane."""
    floor = "E 0 1 -4\nV 0 -0.2 1\nF 40\nR 24 16\nindirect\ndepth 2\nL 2 4 -3\nM 0.8 0.8 0.8  0 0.9 0 1 0\nT -9 0 -9  9 0 -9  0 0 9\n"
    pane = "M 0.2 0.9 0.3  0 0.9 0 1 0\nopacity 0.5\nT -1 0 -1  1 0 -1  0 1.5 -1\n"
    scene = parse_scene(floor + pane + "M 0.9 0.5 0.2  0 0.9 0 1 0.2\nS 0.8 0.5 0.5 0.5\n")
    single, double = (clrt.render(scene, samples=4, precision=rung).pixels for rung in ("watertight", "double"))
    apart = np.abs(single - double).max(axis=2) > 1e-3
    assert apart.mean() < 0.01


@pytest.mark.parametrize(
    ("line", "column", "words"),
    [
        ("indirect clamp=0", 16, "clamp must be greater than 0"),
        ("indirect 3", 10, "indirect takes 0 values"),
        ("indirect\nindirect", 1, "a second indirect line"),
        ("indirect clam=3", 10, 'indirect has no key "clam"; did you mean "clamp"?'),
    ],
)
def test_malformed_line_is_told_with_its_place(line: str, column: int, words: str) -> None:
    with pytest.raises(SceneError) as error:
        parse_scene("E 0 0 0\nV 0 0 1\nF 40\nR 4 4\nM 1 1 1 0 0 0 1 0\nS 0 0 5 1\n" + line + "\n")
    assert f":{7 + line.count(chr(10))}:{column}: error:" in str(error.value)
    assert words in str(error.value)


@pytest.mark.parametrize(("lines", "dark"), [("indirect\n", 1), ("background 1 1 1\n", 1), ("background 1 1 1\nindirect\n", 0)])
def test_background_counts_as_light_where_surfaces_hand_it_on(lines: str, dark: int) -> None:
    warnings = parse_scene(VIEW + "M 1 1 1 0 1 0 1 0\nS 0 0 3 1\n" + lines).warnings
    assert sum("there is no light" in warning for warning in warnings) == dark
