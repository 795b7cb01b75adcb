"""Environments: where rays see them, how directions to them are drawn, and their light, against closed forms and the float64 references."""

from __future__ import annotations

import re
from dataclasses import replace
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from device_pictures import in_packets, ray_counts

import clrt
from clrt import renderer
from clrt.device import program
from clrt.device.context import Device
from clrt.device.pack import pack
from clrt.device.program import Shape
from clrt.device.session import Buffers
from clrt.features import Features
from clrt.film import Film
from clrt.precision import RUNGS, rung
from clrt.reference import render
from clrt.reference.paths import render_paths
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.model import Environment, Fog, Indirect, Scene
from clrt.scene.sky import default_sky
from clrt.scene.skylight import WORDS, cosines, row_words, texel_words
from tests import ztest

SCENES = Path(__file__).parents[1] / "scenes"
CAMERA = "E 0 0.5 -1.5\nV 0 -0.1 1\nF 60\nR 40 32\n"
FLOOR = "T -9 -1 12 9 -1 12 9 -1 0.5\nT -9 -1 12 9 -1 0.5 -9 -1 0.5\nO\n"
SHINY = "M 1 1 0.5  0 0 0 1  0.9\n" + FLOOR + "M 1 1 1  0 0 0 1  0 1 1.5\nabsorb 0.5 0.1 0.2\nS 0 -0.3 2.5 0.7\n"
MATT = "M 0.9 0.8 0.7  0.1 0.6 0.3 9  0\n" + FLOOR + "M 0.5 0.9 0.6  0 0.7 0 1  0.3\nS -0.2 -0.3 2.2 0.7\nS 0.7 -0.4 1.7 0.4\n"
BALL = "E 0 0 0\nV 0 0 1\nF 14\nR 8 8\nM 0.5 1 0.75  0 0.8 0 1  0\nS 0 0 5 1\n"
SHAPES = [(1, 1), (1, 7), (9, 1), (2, 4), (16, 32), (5, 11)]


def lit(text: str, radiance: np.ndarray, rotation: float = 0.0, **changes: Any) -> Scene:
    """The scene of a text in an environment that no line calls for."""
    return replace(parse_scene(text), environment=Environment(np.asarray(radiance, np.float64), rotation), warnings=(), **changes)


def spiky(height: int, width: int, seed: int = 0) -> np.ndarray:
    """(h, w, 3): mostly faint, a few bright texels, some black."""
    rng = np.random.default_rng(seed)
    radiance = rng.uniform(0.0, 1.0, (height, width, 3)) ** 6 * 8.0
    return radiance * (rng.uniform(size=(height, width, 1)) > 0.2)


# What rays see


@pytest.mark.matrix(keep=4)
@pytest.mark.parametrize(
    ("precision", "shape"), [*(("watertight", s) for s in SHAPES), *((p, (5, 11)) for p in sorted(RUNGS) if p != "watertight")]
)
def test_picture_matches_reference(precision: str, shape: tuple[int, int]) -> None:
    """Seen directly, in a mirror, through glass that absorbs, and by rays that are reflected within for good."""
    scene = lit(CAMERA + SHINY, np.random.default_rng(1).uniform(0.0, 2.0, (*shape, 3)), 0.7)
    reference = render(scene)
    pixels = clrt.render(scene, precision=precision).pixels
    wrong = np.abs(pixels - reference.pixels).max(-1) > 1e-4
    assert not (wrong & (reference.margin > 1e-4)).any()
    assert wrong.mean() < 0.03


@pytest.mark.parametrize("rotation", [0.0, 0.5 * np.pi, -0.25 * np.pi, 6.0])
def test_each_direction_finds_the_texel_of_the_convention(rotation: float) -> None:
    """Eyes along the axes and close to the poles and the seam; the texel follows from the convention, by hand."""
    radiance = np.arange(24.0).reshape(4, 6, 1) * np.ones(3)
    for view, column, row in (
        ((0.02, -0.02, 1), 3, 2), ((-0.02, 0.02, 1), 2, 1), ((1, -0.02, 0.5), 4, 2), ((-0.02, -0.02, -1), 0, 2), ((0.02, 0.02, -1), 5, 1),
        ((1e-4, 1, 2e-4), 3, 0), ((-1e-4, -1, -2e-4), 0, 3), ((1e-4, 1, -2e-4), 5, 0),
    ):  # fmt: skip
        turned = np.array([view[0] * np.cos(rotation) + view[2] * np.sin(rotation), view[1],
                           view[2] * np.cos(rotation) - view[0] * np.sin(rotation)])  # fmt: skip
        text = "E 0 0 0\nV {:.17g} {:.17g} {:.17g} 0.3 0.1 0.2\nF 1e-3\nR 1 1\nM 1 1 1 0 0 0 1 0\nS 0 0 50 1e-3\n".format(*turned)
        assert clrt.render(lit(text, radiance, rotation)).pixels[0, 0].tolist() == [6.0 * row + column] * 3, view


def test_seam_and_poles_have_no_gap() -> None:
    """Around the seam, the poles and every edge of texels a picture of one colour is one colour."""
    radiance = np.full((3, 5, 3), [0.25, 0.5, 2.0])
    for view, up in (("0 0 -1", "0 1 0"), ("0 1 0", "0 0 1"), ("0 -1 0", "0 0 1"), ("1 0 0", "0 1 0")):
        text = f"E 0 0 0\nV {view} {up}\nF 90\nR 33 33\nM 1 1 1 0 0 0 1 0\nS 0 0 5000 1e-3\n"
        pixels = clrt.render(lit(text, radiance, 1.0)).pixels
        assert (pixels == [0.25, 0.5, 2.0]).all()


# How directions are drawn

_PROBE = """
kernel void probe_draw(global const Frame *frame, global const EnvironmentRow *rows, global const uint *columns, const uint seed,
                       global real *direction, global lane_int *cell, global real *chance, global real *met) {
    const size_t g = get_global_id(0);
    const Draws draws = {(uint)(((g / 64 * PACKET_HEIGHT) << 16) | (g % 64 * PACKET_WIDTH)), 0, seed};
    real to[3 * LANES], with[LANES];
    lane_int into[LANES];
    environment_draw(frame, rows, columns, &draws, 1, to, into, with);
    for (int k = 0; k < LANES; k++) {
        for (int a = 0; a < 3; a++) direction[3 * LANES * g + LANES * a + k] = to[LANES * a + k];
        cell[LANES * g + k] = into[k];
        chance[LANES * g + k] = with[k];
        met[LANES * g + k] = environment_chance(frame, rows, columns, (int)into[k]);
    }
}
"""


def drawn(device: Device, scene: Scene, precision: str, packets: int = 4096) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Directions (n, 3), their texels' numbers, and chances by both functions (n,): one sample each of 16 n pixels."""
    import pyopencl as cl

    features, ladder = Features.of(scene), rung(precision)
    lanes = ladder.lanes(16)
    buffers = Buffers(device, pack(scene, (), features, ladder), features, ladder)
    built = program.build(device, program.compose(features, ladder, lanes, Shape(8, 5)) + _PROBE)
    sizes = {"direction": 3, "cell": 1, "chance": 1, "met": 1}
    kinds = {name: (np.int64 if ladder.bits == 64 else np.int32) if name == "cell" else ladder.real for name in sizes}
    arrays = {name: np.zeros((packets, size, lanes), kinds[name]) for name, size in sizes.items()}
    outs = {name: buffers.upload(array, writable=True) for name, array in arrays.items()}
    cl.Kernel(built, "probe_draw")(
        device.queue, (packets,), None, buffers.frame, buffers.effects["environment_rows"], buffers.effects["environment_columns"],
        np.uint32(3), *outs.values(),
    )  # fmt: skip
    for name, array in arrays.items():
        cl.enqueue_copy(device.queue, array, outs[name])
    return (arrays["direction"].transpose(0, 2, 1).reshape(-1, 3).astype(np.float64), arrays["cell"].ravel(),
            arrays["chance"].ravel().astype(np.float64), arrays["met"].ravel().astype(np.float64))  # fmt: skip


def solid_angles(height: int, width: int) -> np.ndarray:
    """(h, w) of the texels, by 4 pi sin(middle) sin(half the angle) / w."""
    middle = (np.arange(height) + 0.5) / height * np.pi
    return np.repeat(4.0 * np.pi * np.sin(middle)[:, None] * np.sin(np.pi / height / 2.0) / width, width, axis=1)


def chi_square(counts: np.ndarray, expected: np.ndarray) -> float:
    """Standard deviations by which chi-square is above its mean (Wilson and Hilferty 1931); entries of few are put together."""
    order = np.argsort(expected.ravel())
    expected, counts = expected.ravel()[order], counts.ravel()[order]
    group = np.minimum(np.cumsum(expected) // 25, max(expected.sum() // 25 - 1, 0)).astype(int)
    e, c = np.bincount(group, expected), np.bincount(group, counts)
    e, c = e[e > 0], c[e > 0]
    freedom = max(len(e) - 1, 1)
    q = float(((c - e) ** 2 / e).sum())
    return float(((q / freedom) ** (1 / 3) - (1 - 2 / (9 * freedom))) / sqrt(2 / (9 * freedom)))


@pytest.mark.parametrize(("precision", "shape"), [*(("watertight", s) for s in SHAPES), ("double", (16, 32))])
def test_directions_are_drawn_by_the_light_of_their_texels(device: Device, precision: str, shape: tuple[int, int]) -> None:
    radiance = spiky(*shape, seed=5) + 1e-3
    scene = lit(BALL, radiance, 2.0)
    direction, cell, chance, met = drawn(device, scene, precision)
    luminance = radiance @ [0.2126, 0.7152, 0.0722]
    angle = solid_angles(*shape)
    power = luminance * angle
    # The texel, and the density: luminance over all of it.
    np.testing.assert_allclose(chance, (luminance / power.sum()).ravel()[cell], rtol=1e-5)
    assert (met == chance).all()
    assert chi_square(np.bincount(cell, minlength=power.size), power.ravel() / power.sum() * len(cell)) < 4.0
    # The place within the texel: even in longitude and in height.
    height, width = shape
    longitude = 0.5 + (np.arctan2(direction[:, 0], direction[:, 2]) - 2.0) / (2 * np.pi)
    u = np.mod(longitude * width - cell % width + 1e-3, width) - 1e-3
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    top, bottom = edges[cell // width], edges[cell // width + 1]
    v = (direction[:, 1] - top) / (bottom - top)
    assert np.abs(np.linalg.norm(direction, axis=1) - 1.0).max() < 1e-6
    # Single precision moves a direction by less than 2^-22, in longitude more near the poles.
    assert ((u > -1e-3) & (u < 1 + 1e-3)).mean() > 0.999
    assert ((v > -1e-5 * height**2) & (v < 1 + 1e-5 * height**2)).all()
    table = np.histogram2d(u, v, (8, 8), ((0, 1), (0, 1)))[0]
    assert chi_square(table, np.full((8, 8), len(cell) / 64)) < 4.0


def test_black_texels_are_never_drawn(device: Device) -> None:
    radiance = np.zeros((6, 8, 3))
    radiance[2, 3], radiance[4, 0], radiance[4, 5] = (0, 0, 1e-6), (1, 1, 1), (5, 0, 0)
    _, cell, chance, _ = drawn(device, lit(BALL, radiance), "watertight", 512)
    assert set(cell.tolist()) == {4 * 8, 4 * 8 + 5}  # the faint one has one word of 2^32, which none of these is
    assert (chance > 0).all()


@pytest.mark.parametrize("shape", [(1, 1), (3, 4), (64, 128), (2, 65536)])
def test_words_are_whole_and_all_there(shape: tuple[int, int]) -> None:
    """Each row that shines has 2^32 words, in proportion to within a word a texel, one at least where it shines and none where not."""
    radiance = spiky(*shape, seed=2)
    radiance[0] *= 1e-12
    radiance[-1, 0] += 1e12
    environment = Environment(radiance)
    columns, rows = texel_words(environment), row_words(environment)
    luminance = radiance @ [0.2126, 0.7152, 0.0722]
    assert ((columns > 0) == (luminance > 0)).all()
    assert (columns.sum(1)[luminance.any(1)] == WORDS).all()
    assert rows.sum() == WORDS
    assert ((rows > 0) == luminance.any(1)).all()
    share = luminance / np.maximum(luminance.sum(1, keepdims=True), 1e-300)
    off = np.abs(columns - share * WORDS)
    off[np.arange(len(off)), luminance.argmax(1)] = 0.0
    assert off.max() <= 1.0


def test_edges_of_rows_are_cosines() -> None:
    for height in (1, 2, 3, 1000):
        expected = np.cos(np.pi * np.arange(height + 1) / height)
        np.testing.assert_allclose(cosines(height), expected, rtol=0, atol=1e-15)
        assert (cosines(height)[[0, -1]] == [1.0, -1.0]).all()
    assert cosines(2)[1] == 0.0


# Light


def seeds(scene: Scene, samples: int, count: int) -> Film:
    film = Film(scene.camera.width, scene.camera.height)
    for seed in range(count):
        film.add(clrt.render(scene, samples=samples, seed=seed).pixels)
    return film


def assert_mean(film: Film, expected: np.ndarray) -> None:
    """Every pixel within 4.9 standard errors (Student's t of 23, 1% over 200 numbers), their mean within 4."""
    error = np.sqrt(film.variance_of_mean) + 1e-6
    assert (np.abs(film.mean - expected) < 4.9 * error).all()
    whole = np.sqrt((error**2).sum((0, 1))) / error[..., 0].size
    assert (np.abs((film.mean - expected).mean((0, 1))) < 4.0 * whole).all()


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("shape", [(1, 1), (4, 6)])
def test_ball_in_a_uniform_environment_shows_its_colour(shape: tuple[int, int]) -> None:
    """A convex body sees all of its half space: C Kd times the radiance at every point."""
    scene = lit(BALL, np.full((*shape, 3), [0.5, 1.0, 2.0]))
    assert_mean(seeds(scene, 32, 24), np.broadcast_to([0.2, 0.8, 1.2], (8, 8, 3)))


@pytest.mark.slow
def test_highlight_in_a_uniform_environment_is_its_integral() -> None:
    """Met square-on, the integral of Ks (R.V)^n / pi is 2 Ks / (n + 1): all of the lobe is above the surface."""
    text = "E 0 0 0\nV 0 0 1\nF 1e-3\nR 4 4\nM 0.5 1 0.75  0 0 0.6 8  0\nT -9 -9 5 9 -9 5 0 9 5\n"
    assert_mean(seeds(lit(text, np.ones((1, 1, 3))), 64, 24), np.broadcast_to(np.array([0.5, 1, 0.75]) * 1.2 / 9, (4, 4, 3)))


def test_cube_of_the_smallest_scene_shows_what_its_comment_says() -> None:
    scene = load_scene(SCENES / "environment.txt")
    found = re.findall(r"^# (pixel|mean) \((\d+),(\d+)\) is (\S+) (\S+) (\S+)$", (SCENES / "environment.txt").read_text(), re.M)
    assert {kind for kind, *_ in found} == {"pixel", "mean"}
    film = seeds(scene, 8, 16)
    for kind, column, row, *color in found:
        place, expected = (int(row), int(column)), np.array(color, float)
        error = np.sqrt(film.variance_of_mean[place])
        assert (np.abs(film.mean[place] - expected) <= 5.0 * error).all(), (column, row)
        assert (error.max() == 0.0) == (kind == "pixel")


@pytest.mark.slow
def test_overcast_sky_shows_white_on_what_faces_it() -> None:
    text = "E 0 5 0\nV 0 -1 0 0 0 1\nF 20\nR 6 6\nM 1 1 1  0 1 0 1  0\nT -9 0 -9 9 0 -9 0 0 20\n"
    scene = replace(parse_scene(text), environment=default_sky())
    assert_mean(seeds(scene, 32, 24), np.ones((6, 6, 3)))


def test_box_without_a_lid_is_dark_where_it_sees_no_sky() -> None:
    """A point in the middle of the bottom of a black box sees the sky through a square hole, at the height 1 above it, 2 a side: the form
    factor is (4 / pi) (1 / sqrt 2) arctan(1 / sqrt 2)."""
    side = "T -1 0 -1 1 0 -1 1 1 -1\nT -1 0 -1 1 1 -1 -1 1 -1\n"
    black = "M 0 0 0 0 0 0 1 0\n" + "".join(
        "T " + " ".join(f"{x * c - z * s:g} {y:g} {x * s + z * c:g}" for x, y, z in np.array(line.split()[1:], float).reshape(3, 3)) + "\n"
        for s, c in ((0, 1), (1, 0), (0, -1), (-1, 0)) for line in side.splitlines()
    )
    text = "E 0 5 0\nV 0 -1 0 0 0 1\nF 0.01\nR 4 4\nM 1 1 1 0 1 0 1 0\nT -1 0 -1 1 0 -1 1 0 1\nT -1 0 -1 1 0 1 -1 0 1\nO\n" + black
    expected = 4 / np.pi / sqrt(2) * np.arctan(1 / sqrt(2))
    assert_mean(seeds(lit(text, np.ones((1, 1, 3))), 64, 24), np.full((4, 4, 3), expected))


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize(
    ("text", "changes"),
    [(MATT, {}), (MATT, {"indirect": Indirect(), "depth": 3}), (SHINY.replace("0 0 0 1  0.9", "0 0.5 0.4 30  0.5"), {"depth": 4})],
    ids=["direct", "indirect", "mirror and glass"],
)
def test_picture_agrees_with_the_path_tracer(text: str, changes: dict[str, Any]) -> None:
    camera = CAMERA.replace("R 40 32", "R 12 10")
    scene = lit(camera + text, spiky(3, 5, seed=9) / 4 + 0.5, 0.4, **changes)
    reference = render_paths(scene, 1000, seed=1)
    verdict = ztest.compare(ztest.device_batches(scene, 64, range(16)), reference.mean, reference.variance_of_mean)
    assert verdict.accepted, verdict.worst


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["fast", "exact"])
def test_every_rung_gives_the_same_mean(precision: str) -> None:
    scene = lit(CAMERA.replace("R 40 32", "R 10 8") + MATT, spiky(3, 5, seed=9) + 0.05, samples=128)
    pixels = clrt.render(scene, precision=precision).pixels
    plain = clrt.render(scene, precision="double").pixels
    assert np.abs(pixels.mean((0, 1)) / plain.mean((0, 1)) - 1.0).max() < 0.02


FLOORED = "E 0 2 -3\nV 0 -0.6 1\nF 30\nR 6 6\n{}T -20 0 -20 20 0 -20 0 0 40\n"


def test_drawn_rays_find_the_highlight_of_a_uniform_environment() -> None:
    """Directions drawn by the light alone rarely fall into a lobe of a few degrees; Kd + 2 Ks / (n + 1) is the mean."""
    scene = lit(FLOORED.format("M 1 1 1  0 0.2 30 500  0\n"), np.ones((2, 3, 3)), indirect=Indirect(), depth=1)
    both, direct = seeds(scene, 16, 24), seeds(replace(scene, indirect=None), 16, 24)
    assert_mean(both, np.full((6, 6, 3), 0.2 + 60 / 501))
    assert both.variance.mean() < 0.05 * direct.variance.mean()


def test_light_samples_find_a_small_bright_patch() -> None:
    """Directions drawn by the floor alone meet the patch, of radiance L, by a chance q: mean Kd L q, variance nearly (Kd L)^2 q."""
    radiance = np.full((16, 32, 3), 0.01)
    radiance[3, 20] = 300.0
    scene = lit(FLOORED.format("M 1 1 1  0 0.7 0 6  0\n"), radiance, indirect=Indirect(), depth=1)
    both, direct = seeds(scene, 16, 24), seeds(replace(scene, indirect=None), 16, 24)
    error = np.sqrt(both.variance_of_mean + direct.variance_of_mean)
    assert (np.abs(both.mean - direct.mean) < 5.0 * error).all(), "nothing but the environment lights a lone floor"
    assert 16 * both.variance.mean() < 0.01 * 0.7 * 300.0 * both.mean.mean()


# Rays and programs


def quiet(phase: str, fraction: float) -> None:
    pass


def test_picture_does_not_depend_on_launches(device: Device) -> None:
    scene = lit(CAMERA + MATT, spiky(8, 16), samples=3, seed=11)
    whole = clrt.render(scene, seed=11).pixels
    prepared = renderer.build_trees(scene, "sah", quiet)
    tracer = renderer.open_tracer(prepared, Features.of(scene), rung("watertight"), device, quiet)[1]
    for sample in range(3):
        tracer.begin_samples(sample, sample + 1)
        for first, end in ((24, 32), (0, 8), (8, 24)):
            tracer.run(first, end)
    assert (tracer.picture() == whole).all()


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [8, 4, 1])
def test_every_packet_width_takes_the_same_samples(device: Device, lanes: int) -> None:
    scene = lit(CAMERA + MATT, spiky(8, 16), samples=2)
    off = np.abs(in_packets(scene, device, lanes) - clrt.render(scene).pixels).max(-1)
    assert (off > 1e-4).mean() < 0.01


def test_environment_that_is_only_seen_draws_nothing() -> None:
    for scene in (lit(CAMERA + SHINY, spiky(4, 8)), lit(CAMERA + MATT, np.zeros((4, 8, 3)))):
        features = Features.of(scene)
        assert "environment" in features.effects
        assert "environment light" not in features.effects
        source = program.compose(features, rung("watertight"), 8, Shape(8, 5))
        assert "environment_find" in source
        assert "sampl" not in source
        assert "environment_draw" not in source


def test_environment_behind_fog_neither_lights_nor_is_seen() -> None:
    scene = lit(CAMERA + MATT.replace("0.1 0.6 0.3 9  0", "0 0.6 0.3 9  0"), spiky(4, 8), fog=Fog(0.1), samples=2)
    assert "environment light" not in Features.of(scene).effects
    assert not clrt.render(scene).pixels.any()


def test_lone_triangle_is_lit_without_rays() -> None:
    scene = lit("E 0 0 0\nV 0 0 1\nF 45\nR 8 8\nM 1 1 1 0 1 0 1 0\nT -9 -9 2 -9 9 2 9 9 2\n", spiky(4, 8))
    assert Features.of(scene).effects == ("environment", "environment light")


def test_rays_to_the_environment_are_traced_only_where_it_can_light(device: Device) -> None:
    """Light from above alone: the lower half of a ball's picture sends no rays up, nor does what the eye does not meet."""
    radiance = np.zeros((2, 1, 3))
    radiance[0] = 1.0
    down = "E 0 -5 0\nV 0 1 0 0 0 1\nF 5\nR 8 8\nM 1 1 1 0 1 0 1 0\nS 0 0 0 1\n"
    counts, _ = ray_counts(lit(down, radiance), device, samples=4)
    assert counts["primary"] == 256
    assert counts["shadow"] < 32, "a cap of 13 degrees about the lowest point sees the sky under its rim alone"
    from_above = lit(down.replace("E 0 -5 0\nV 0 1 0", "E 0 5 0\nV 0 -1 0"), radiance)
    assert ray_counts(from_above, device, samples=4)[0]["shadow"] > 224
