"""Rays of pictures that go apart, one by one through wide trees: the same hits as packets have, and only where they pay."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from device_pictures import ray_counts
from numpy.typing import NDArray
from ray_meshes import doubled, sphere

from clrt.device import program
from clrt.device.context import Device
from clrt.features import Features
from clrt.features.single import BLOCKS, SAMPLES_A_TRIANGLE, SINGLE
from clrt.precision import RUNGS, rung
from clrt.renderer import Prepared, build_trees, open_tracer, run_rows
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene

VIEW = "E 0.2 0.3 -0.9\nV 0 -0.1 1\nF 60\nR 40 40\nsamples 8\ndepth 3\n"
MATTE, LAMP = "M 0.8 0.7 0.6  0.1 0.7 0 1  0\n", "M 1 1 1  0 0 0 1  0\narealight 8 8 8\n"


def triangles(tri: NDArray[Any]) -> str:
    return "".join("T " + " ".join(repr(float(x)) for x in t.ravel()) + "\n" for t in tri)


def room() -> NDArray[np.float64]:
    corners = np.array(list(product((-1.0, 1.0), repeat=3)))
    squares = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
    return corners[[(q[a], q[b], q[c]) for q in squares for a, b, c in ((0, 1, 2), (0, 2, 3))]]


BALL = triangles(sphere(300, radius=0.4))
WALLS = f"O\n{MATTE}{triangles(room())}O\n{LAMP}{triangles(0.3 * room()[6:8] + [0, 0.65, 0])}O\n"
SCENES = {
    "indirect": f"{VIEW}indirect\n{MATTE}{BALL}{WALLS}",
    "gloss": f"{VIEW}M 0.8 0.7 0.6  0 0 0 1  0.8\ngloss 0.4\n{BALL}{WALLS}",
    "lens": f"{VIEW}lens 0.05 0.8\nindirect\n{MATTE}{BALL}{WALLS}",
    "glass, spheres": f"{VIEW}indirect\nM 1 1 1  0 0 0 1  0 0.9 1.5\n{BALL}{WALLS}{MATTE}S 0.6 -0.6 0.3 0.3\n",
    "moves, placed": f"{VIEW}indirect\nshutter 0 1\n{MATTE}object ball hidden=yes\n{BALL}{WALLS}"
    "instance ball 0.5 0.2 0.1 scale=0.5 turn_y=30\ninstance ball -0.5 -0.4 0.3 scale=0.7\n"
    f"{MATTE}{triangles(sphere(80, radius=0.2))}move 0.2 0 0\nO\n",
    "opacity": f"{VIEW}indirect\n{MATTE}opacity 0.6\n{BALL}{WALLS}",
}
COINCIDENT = f"{VIEW}indirect\n{MATTE}{triangles(doubled(sphere(100, radius=0.4)))}{WALLS}"
SAME_PIXELS = 0.99  #: on the rungs where two triangles at an edge may be at the same distance: which of them stays hangs on the order


def silent(phase: str, fraction: float) -> None:
    """No progress."""


def in_packets(features: Features) -> Features:
    return Features(tuple(line for line in features.lines if line[0] not in (BLOCKS.name, SINGLE.name)))


def traced(prepared: Prepared, features: Features, precision: str, device: Device) -> NDArray[np.float32]:
    tracer = open_tracer(prepared, features, rung(precision), device, silent)[1]
    run_rows(tracer, "render", silent)
    return tracer.picture()


def both(scene: Scene, precision: str, device: Device) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    features, prepared = Features.of(scene), build_trees(scene, "sah", silent)
    assert SINGLE in features.active
    return traced(prepared, features, precision, device), traced(prepared, in_packets(features), precision, device)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("name", SCENES)
def test_exact_pictures_are_those_of_packets_bit_for_bit(name: str, device: Device) -> None:
    single, packets = both(parse_scene(SCENES[name]), "exact", device)
    assert packets.std() > 0.01
    np.testing.assert_array_equal(single, packets)


def test_of_coincident_triangles_the_same_one_is_hit(device: Device) -> None:
    """What decides a tie first, float32 or float64, hangs on the order, and with it the last bits of the distance."""
    single, packets = both(parse_scene(COINCIDENT), "exact", device)
    np.testing.assert_allclose(single, packets, rtol=2.0**-19, atol=2.0**-19)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", [name for name in RUNGS if name != "exact"])
@pytest.mark.parametrize("name", ["indirect", "glass, spheres", "moves, placed"])
def test_other_rungs_differ_where_edges_are_tied_alone(name: str, precision: str, device: Device) -> None:
    single, packets = both(parse_scene(SCENES[name]), precision, device)
    assert (single == packets).all(axis=2).mean() > SAME_PIXELS
    assert abs(single.mean() - packets.mean()) < 2e-3 * packets.mean()


def test_counts_are_those_of_packets(device: Device) -> None:
    """As many rays of each kind; tests are those of the triangles in blocks."""
    scene = parse_scene(SCENES["indirect"])
    counts = []
    for features in (Features.of(scene), in_packets(Features.of(scene))):
        counts.append(ray_counts(scene, device, "exact", features))
    (single, single_tests), (packets, packet_tests) = counts
    assert single == packets
    assert all(0 < tests < most for tests, most in zip(single_tests, np.array([300, 12, 2]) * sum(single.values()), strict=True))
    assert single_tests != packet_tests


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("lanes", [8, 16, 4, 1])
def test_every_width_compiles_to_the_same_picture(lanes: int, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    if lanes > rung("exact").lanes(device.info.lanes):
        pytest.skip(f"the device has fewer lanes than {lanes}")
    scene = replace(parse_scene(SCENES["indirect"]), samples=2)
    prepared, features = build_trees(scene, "sah", silent), Features.of(scene)
    usual = traced(prepared, features, "exact", device)
    monkeypatch.setattr("clrt.precision.Precision.lanes", lambda self, room: lanes)
    np.testing.assert_allclose(traced(prepared, features, "exact", device), usual, rtol=1e-4, atol=1e-4)


def test_a_deep_wide_tree_has_room_on_the_stack(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = replace(parse_scene(SCENES["indirect"]), samples=2)
    prepared, features = build_trees(scene, "sah", silent), Features.of(scene)
    buffers, tracer, source, _ = open_tracer(prepared, features, rung("fast"), device, silent)
    assert buffers.wide_stack == program.WIDE_STACK
    assert f"#define WIDE_STACK {program.WIDE_STACK}\n" in source
    monkeypatch.setattr(program, "WIDE_STACK", 1)
    deep, deep_tracer, deep_source, _ = open_tracer(prepared, features, rung("fast"), device, silent)
    assert deep.wide_stack > 1
    assert f"#define WIDE_STACK {deep.wide_stack}\n" in deep_source
    for each in (tracer, deep_tracer):
        run_rows(each, "render", silent)
    np.testing.assert_array_equal(deep_tracer.picture(), tracer.picture())


def test_only_scenes_with_many_drawn_rays_have_wide_trees() -> None:
    scene = parse_scene(SCENES["indirect"])
    pixels, most = 40 * 40, scene.triangle_count * SAMPLES_A_TRIANGLE
    assert SINGLE in Features.of(replace(scene, samples=-(-most // pixels))).active
    assert SINGLE not in Features.of(replace(scene, samples=(most - 1) // pixels)).active
    assert SINGLE not in Features.of(scene, ["indirect", "area light", "area shadows"]).active
    mirrors = parse_scene(f"{VIEW}L 0 0.5 0\nM 0.8 0.7 0.6  0 0.5 0 1  0.5\n{BALL}")
    assert SINGLE not in Features.of(mirrors).active
    assert SINGLE not in Features.of(parse_scene(f"{VIEW}indirect\n{MATTE}S 0 0 2 1\n")).active
