"""Every pixel gets the colour of what lies in it: a square a pixel, each of a material of its own: the picture is known beforehand."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt import renderer
from clrt.device.context import Device
from clrt.device.session import Tracer
from clrt.features import Features
from clrt.precision import rung
from clrt.scene.model import Camera, Material, MeshObject, Scene

WIDTH, HEIGHT = 21, 11  #: neither whole packets nor whole groups, and enough triangles for groups


def _silent(phase: str, fraction: float) -> None:
    pass


def squares(material: NDArray[np.int32], colors: NDArray[np.float32]) -> Scene:
    """A square of two triangles a pixel, at distance 1; material (HEIGHT, WIDTH) into colors (n, 3), of which ambient light shows all."""
    y, x = (index.ravel() for index in np.mgrid[:HEIGHT, :WIDTH])
    corner = {(i, j): np.stack([x + i - WIDTH / 2, HEIGHT / 2 - y - j, np.ones(x.size)], axis=1) for i in (0, 1) for j in (0, 1)}
    halves = [np.stack([corner[0, 0], corner[1, 0], corner[1, 1]], 1), np.stack([corner[0, 0], corner[1, 1], corner[0, 1]], 1)]
    vertices = np.concatenate(halves)
    normals = np.tile([0.0, 0.0, -1.0], (len(vertices), 1))
    mesh = MeshObject(vertices, normals, np.tile(material.ravel(), 2), 0, name="squares")
    w, h = WIDTH / 2, HEIGHT / 2
    camera = Camera(np.zeros(3), np.array([[-w, h, 1.0], [w, h, 1.0], [-w, -h, 1.0], [w, -h, 1.0]]), WIDTH, HEIGHT)
    materials = tuple(Material((float(r), float(g), float(b)), 1.0, 0.0, 0.0, 1.0) for r, g, b in colors)
    return Scene(camera, (), materials, (mesh,), source="<squares>")


def drawn(scene: Scene, device: Device, lanes: int, precision: str, bands: tuple[int, ...]) -> NDArray[np.float32]:
    """The picture from launches over the rows between neighbours of `bands`."""
    narrow = replace(device, info=replace(device.info, lanes=lanes))
    prepared = renderer.build_trees(scene, "sah", _silent)
    tracer: Tracer = renderer.open_tracer(prepared, Features.of(scene), rung(precision), narrow, _silent)[1]
    for first, end in pairwise(bands):
        tracer.run(first, end)
    return tracer.picture()


@pytest.fixture(scope="module")
def colors() -> NDArray[np.float32]:
    return np.random.default_rng(1).uniform(0.0, 1.0, (WIDTH * HEIGHT, 3)).astype(np.float32)


@pytest.mark.parametrize(("lanes", "precision"), [(16, "watertight"), (8, "fast"), (4, "watertight"), (1, "watertight"), (16, "double")])
def test_pixels_have_their_own_colours_whole_or_in_bands(lanes: int, precision: str, device: Device, colors: NDArray[np.float32]) -> None:
    scene = squares(np.arange(WIDTH * HEIGHT, dtype=np.int32).reshape(HEIGHT, WIDTH), colors)
    for bands in ((0, HEIGHT), (0, 3, 4, HEIGHT)):
        np.testing.assert_array_equal(drawn(scene, device, lanes, precision, bands), colors.reshape(HEIGHT, WIDTH, 3))


def test_one_material_of_several_is_the_one_that_triangles_have(device: Device, colors: NDArray[np.float32]) -> None:
    picture = drawn(squares(np.full((HEIGHT, WIDTH), 2, np.int32), colors[:4]), device, 16, "watertight", (0, HEIGHT))
    np.testing.assert_array_equal(picture, np.broadcast_to(colors[2], picture.shape))
