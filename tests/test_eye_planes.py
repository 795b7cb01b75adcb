"""Planes through an origin that rays share and the edges of triangles: what float32 says beyond its bounds is right."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pyopencl as cl
import pytest
from numpy.typing import NDArray

from clrt import renderer
from clrt.device import layout, program
from clrt.device.context import Device
from clrt.device.prepare import prepare
from clrt.features import Features
from clrt.precision import rung
from clrt.scene.build import parse_scene

EYE = (0.25, -0.5, -3.0)


def planes_of(corners: NDArray[np.float64], precision: str, device: Device) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """The records that the device makes of (n, 3, 3) corners as seen from EYE, and their corners less EYE, a slot each."""
    lines = [f"E {' '.join(map(repr, EYE))}", "V 0 0 1", "F 40", "R 8 8", "M 1 1 1  0 1 0 1  0"]
    lines += ["T " + "  ".join(" ".join(map(repr, corner)) for corner in t) for t in corners.tolist()]
    scene = parse_scene("\n".join([*lines, "O", ""]))
    trees = renderer.build_trees(scene, "sah", lambda phase, fraction: None)
    buffers, source, _ = renderer.fill_buffers(trees, Features.of(scene), rung(precision), device)
    prepare(buffers, program.build(device, source))
    planes = np.empty(buffers.packed.slots, layout.edge_planes(buffers.precision.real))
    cl.enqueue_copy(device.queue, planes, buffers.eye_planes)
    return planes, buffers.packed.vertices.reshape(-1, 3, 3)


def triangles(random: np.random.Generator, count: int, smallest: float) -> NDArray[np.float64]:
    """(count, 3, 3): of sizes from `smallest` to 1, a third of them thin."""
    size = smallest ** random.uniform(0.0, 1.0, (count, 1, 1))
    shape = random.normal(0.0, 1.0, (count, 3, 3))
    shape[::3, 2] = shape[::3, 1] + 1e-3 * shape[::3, 2]
    return random.uniform(-1.0, 1.0, (count, 1, 3)) + size * shape


def rational(vector: NDArray[Any]) -> list[Fraction]:
    return [Fraction(float(x)) for x in vector]


def from_eye(point: NDArray[np.float64]) -> list[Fraction]:
    return [x - Fraction(o) for x, o in zip(rational(point), EYE, strict=True)]


def triple(p: list[Fraction], q: list[Fraction], r: list[Fraction]) -> Fraction:
    return sum((p[i] * (q[(i + 1) % 3] * r[(i + 2) % 3] - q[(i + 2) % 3] * r[(i + 1) % 3]) for i in range(3)), Fraction(0))


def unit(vector: NDArray[np.float64], real: type) -> NDArray[Any]:
    return np.asarray(vector / np.sqrt((vector**2).sum()), real)


@pytest.mark.parametrize(("precision", "least"), [("watertight", 0.05), ("double", 0.005)])
def test_signs_of_edge_functions_are_right_beyond_their_bound(precision: str, least: float, device: Device) -> None:
    """For directions that pass edges as nearly as they can tell. `least` : of the bound, what some wrong sign must reach."""
    random = np.random.default_rng(11)
    planes, corners = planes_of(triangles(random, 150, 1e-4), precision, device)
    real, wrong = rung(precision).real, []
    for slot, c in np.ndindex(len(planes), 3):
        ends = corners[slot, [(c + 1) % 3, (c + 2) % 3]]
        b, e = (from_eye(end) for end in ends)
        for weight in random.uniform(0.0, 1.0, 6):
            d, plane = unit(ends[0] + weight * (ends[1] - ends[0]) - EYE, real), planes["uvw"[c]][slot]
            computed = d[2] * plane[2] + (d[0] * plane[0] + d[1] * plane[1])
            if computed * np.sign(float(triple(rational(d), b, e))) <= 0.0:
                wrong.append(abs(computed) / float(planes["bound"][slot]))
    assert len(wrong) > 50
    assert max(wrong) <= 1.0
    assert max(wrong) > least, "a bound far too wide would send many rays to float64"


@pytest.mark.parametrize("smallest", [1e-3, 1e-9])
def test_distances_to_planes_are_within_their_bound(smallest: float, device: Device) -> None:
    """From triangles across the ray to those that it nearly runs in, of all sizes."""
    random = np.random.default_rng(12)
    planes, corners = planes_of(triangles(random, 150, smallest), "exact", device)
    off = []
    for slot, plane in enumerate(planes):
        v = [from_eye(corner) for corner in corners[slot]]
        e1, e2 = ([x - y for x, y in zip(v[i], v[0], strict=True)] for i in (1, 2))
        normal = plane["normal"].astype(float)
        for graze in 10.0 ** random.uniform(-6.0, 0.0, 6):
            across = np.cross(normal, random.normal(size=3))
            d = unit(across / np.sqrt((across**2).sum()) + graze * normal / np.sqrt((normal**2).sum()), np.float32)
            rate = d[2] * plane["normal"][2] + (d[0] * plane["normal"][0] + d[1] * plane["normal"][1])
            if abs(rate) <= np.float32(2.0) * plane["normal_bound"]:
                continue
            inverse = np.float32(1.0) / rate
            t, true = plane["offset"] * inverse, triple(v[0], e1, e2) / triple(rational(d), e1, e2)
            off.append(float(abs(Fraction(float(t)) - true)) / float(inverse * inverse * plane["t_bound"]))
    assert len(off) > 500
    assert max(off) <= 1.0
    assert max(off) > 0.05, "a bound 20 times too wide would send many rays to float64"


def test_normals_of_planes_are_brought_to_one_size(device: Device) -> None:
    planes, _ = planes_of(triangles(np.random.default_rng(13), 150, 1e-9), "exact", device)
    size = np.sqrt((planes["normal"].astype(float) ** 2).sum(1))
    assert (size >= 1.0 - 1e-6).all()
    assert (size < 2.0 + 1e-6).all()
