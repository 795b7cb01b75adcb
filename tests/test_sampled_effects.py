"""Sampled effects of the kernels: their means against the reference's, with both variances; and furnaces, whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reference_scenes import box, glass, matte, mesh, mirror, scene, spheres
from sampled_scenes import lamp, many, metal_rough, rough
from ztest import assert_same, device_batches

from clrt.precision import RUNGS
from clrt.reference.paths import render_paths
from clrt.scene.model import Environment, Indirect, Material, Scene

SCENES = many()
QUICK = ("area", "environment", "gloss, area")
#: relative errors of the tables of lobes' albedos, see docs/conventions.md
TABLES = {"gloss": 4e-4, "metal": 4e-4, "glass": 5e-3}


def allowed(name: str) -> float:
    """What is allowed for tables, besides chance and rounding."""
    return max((error for word, error in TABLES.items() if word in name), default=4e-6)


@pytest.mark.matrix(keep=4)
@pytest.mark.parametrize("name", [pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow]) for name in SCENES])
def test_means_agree_with_the_reference(name: str) -> None:
    picture = render_paths(SCENES[name], 800 if name in QUICK else 2500, 1)
    batches = device_batches(SCENES[name], 64, range(12))
    assert np.sqrt(picture.variance_of_mean).mean() < 0.05 * picture.mean.mean()
    assert_same(batches, picture.mean, picture.variance_of_mean, allowed(name))


@pytest.mark.slow
@pytest.mark.parametrize("precision", list(RUNGS))
def test_all_rungs_agree_with_the_reference(precision: str) -> None:
    scene = SCENES["area, mirror, glass, point"]
    picture = render_paths(scene, 1500, 2)
    assert_same(device_batches(scene, 64, range(10), precision), picture.mean, picture.variance_of_mean)


WHITE = {
    "matte": matte(),
    "phong": Material((1.0, 1.0, 1.0), 0.0, 0.6, 0.4, 1.0),
    "mirror": mirror(1.0),
    "glass": replace(glass(1.5), fresnel=True, fresnel_line=1),
    "gloss of a mirror, 0.3": rough(mirror(1.0), 0.3),
    "gloss of a mirror, 0.8": rough(mirror(1.0), 0.8),
    "gloss of glass, fresnel": rough(replace(glass(1.5), fresnel=True, fresnel_line=1), 0.5),
    "gloss of glass": rough(glass(1.3), 0.6),
    "metal, 0.2": metal_rough((1.0, 1.0, 1.0), 1.0, 0.2),
    "metal, 0.9": metal_rough((1.0, 1.0, 1.0), 1.0, 0.9),
    "dielectric, 0.2": metal_rough((1.0, 1.0, 1.0), 0.0, 0.2),
    "dielectric, 0.9": metal_rough((1.0, 1.0, 1.0), 0.0, 0.9),
    "half a metal": metal_rough((1.0, 1.0, 1.0), 0.5, 0.5),
    "opacity": replace(matte(), opacity=0.5, opacity_line=1),
}
#: lose nothing, so that they show 1; what others lose is known for none of them, but nothing shows more
LOSSLESS = [name for name in WHITE if name not in ("phong", "dielectric, 0.2", "dielectric, 0.9", "half a metal")]


def furnace(material: Material, by_background: bool) -> Scene:
    """A ball that fills the picture, in surroundings of radiance 1: found by drawn rays alone, or by light samples and drawn rays."""
    s = scene([], [material], balls=spheres((0, 0, 0, 1, 0)), fov=14.0, size=(6, 6), depth=24, background=(1.0, 1.0, 1.0))
    around = None if by_background else Environment(np.ones((2, 4, 3)), line=1)
    return replace(s, indirect=Indirect(line=1), samples_line=1, environment=around)


@pytest.mark.matrix(keep=4)
@pytest.mark.parametrize("by_background", [True, False], ids=["background", "environment"])
@pytest.mark.parametrize("name", [pytest.param(name, marks=[] if name == "matte" else [pytest.mark.slow]) for name in WHITE])
def test_white_furnace_gains_nothing_and_loses_nothing_unsaid(name: str, by_background: bool) -> None:
    batches = device_batches(furnace(WHITE[name], by_background), 64, range(8))
    if name in LOSSLESS:
        # What facets lose they lose in few samples: a pixel without one of them is brighter, by the albedo.
        assert_same(batches, np.ones((6, 6, 3)), np.zeros((6, 6, 3)), allowed(name), pixels=False)
    else:
        deviation = batches.mean((1, 2, 3)).std(ddof=1) / np.sqrt(8)
        assert 0.6 < batches.mean() < 1.0 + 3.0 * deviation + allowed(name)


@pytest.mark.slow
@pytest.mark.parametrize("depth", [0, 2, 12])
def test_closed_room_shows_the_geometric_series(depth: int) -> None:
    """Walls and a ball send out e = 0.5 and reflect a = 0.7: e (1 + a + ... + a^(depth + 1)), roulette or not."""
    wall = lamp(0.5, 0.5, 0.5, matte(diffuse=0.7))
    s = scene([mesh(box((-2, -2, -6), (2, 2, 2)))], [wall], balls=spheres((0.3, 0.2, -2, 0.7, 0)), fov=60.0, size=(6, 6), depth=depth)
    s = replace(s, indirect=Indirect(line=1), samples_line=1)
    expected = 0.5 * sum(0.7**k for k in range(depth + 2))
    batches = device_batches(s, 256, range(8))
    assert_same(batches, np.full((6, 6, 3), expected), np.zeros((6, 6, 3)))


@pytest.mark.slow
def test_series_of_unlike_reflections_and_the_roulette_are_unbiased() -> None:
    """A lamp inside a ball of two colours of light: 1 / (1 - a) in the limit of depth, per channel; dark channels end early by roulette."""
    wall = replace(lamp(0.3, 0.3, 0.3, matte()), color=(0.8, 0.3, 0.05))
    s = scene([], [wall], balls=spheres((0, 0, 0, 3, 0)), eye=(0, 0, -1), fov=40.0, size=(6, 6), depth=30)
    s = replace(s, indirect=Indirect(line=1), samples_line=1)
    expected = 0.3 / (1.0 - np.array([0.8, 0.3, 0.05])) * (1.0 - np.array([0.8, 0.3, 0.05]) ** 32)
    assert_same(device_batches(s, 64, range(8)), np.broadcast_to(expected, (6, 6, 3)), np.zeros((6, 6, 3)))
