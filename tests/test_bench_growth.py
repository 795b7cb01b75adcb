"""Growth curves of `make bench`: the scenes of their points, the fits, and one point measured."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from clrt.bench.growth import Reach, curve, fits_of, logarithm, points
from clrt.bench.growth_point import field, hills, scene_of


def test_a_logarithm_is_found_and_its_residual_measured() -> None:
    n = [1000, 2000, 4000, 8000]
    fit = logarithm(n, [3.0 + 0.5 * float(np.log2(x)) for x in n])
    assert fit == pytest.approx({"a": 3.0, "b": 0.5, "residual": 0.0}, abs=1e-12)
    # Off by +-1 in a pattern that is orthogonal to both 1 and log2 n, the fit stays and the residual is 1 over the mean
    fit = logarithm(n, [10.0 + s for s in (1.0, -1.0, -1.0, 1.0)])
    assert fit == pytest.approx({"a": 10.0, "b": 0.0, "residual": 0.1}, abs=1e-12)


def row(kind: str, number: int, nanoseconds: float) -> dict[str, Any]:
    """A point in which a ray takes this long at best."""
    rays = number if kind == "pixels" else 1000
    best = nanoseconds * rays * 1e-9
    return {"kind": kind, "count": number, "triangles": number, "rays": rays, "trace_s": {"best": best, "median": 2 * best}}


def test_fits_are_a_ray_and_foretell_large_meshes_from_small_ones() -> None:
    rows = [row("triangles", 2**k, 1.0 + k) for k in (10, 12, 14, 16)] + [row("triangles", 2**20, 42.0)]
    rows += [row("pixels", 2**k, 10.0 - 0.5 * k) for k in (10, 12, 14)] + [row("instances", 10, 5.0)]
    fits = fits_of(rows)
    assert set(fits) == {"triangles", "pixels", "beyond"}, "too few instances for a curve"
    assert fits["pixels"] == pytest.approx({"a": 10.0, "b": -0.5, "residual": 0.0}, abs=1e-9)
    (beyond,) = fits["beyond"]["points"]
    assert beyond == pytest.approx({"triangles": 2**20, "foretold": 21.0, "measured": 42.0})
    assert fits["beyond"]["fitted_up_to"] == 2**16
    numbers, times = curve(rows, "pixels")
    assert numbers == [1024, 4096, 16384]
    assert times == pytest.approx([5.0, 4.0, 3.0])


def test_points_reach_as_far_as_asked() -> None:
    found = list(points(Reach(triangles=30_000, pixels=512, separate=10, instances=1000, size=64)))
    assert [count for kind, count, _ in found if kind == "triangles"] == [1000, 3000, 10_000, 30_000]
    assert [size for kind, _, size in found if kind == "pixels"] == [128, 256, 512]
    assert [count for kind, count, _ in found if kind == "separate"] == [1, 10]
    assert [count for kind, count, _ in found if kind == "instances"] == [1, 10, 100, 1000]
    assert {size for kind, _, size in found if kind != "pixels"} == {64}


def test_hills_are_the_same_surface_ever_finer() -> None:
    coarse, fine = hills(80_000), hills(320_000)  # both fine enough for the smallest waves
    assert len(fine) == pytest.approx(4 * len(coarse), rel=0.03)
    for mesh in (coarse, fine):
        assert np.ptp(mesh[..., 0]) == pytest.approx(2.0)
    areas = [0.5 * np.linalg.norm(np.cross(m[:, 1] - m[:, 0], m[:, 2] - m[:, 0]), axis=1).sum() for m in (coarse, fine)]
    assert areas[1] == pytest.approx(areas[0], rel=0.02)


@pytest.mark.parametrize("count", [1, 7, 100])
def test_many_objects_and_instances_are_the_same_triangles(count: int) -> None:
    separate, placed = scene_of("separate", count, 16), scene_of("instances", count, 16)
    ball = placed.objects[0]
    assert ball.hidden
    assert len(separate.objects) == len(placed.instances) + 1 == count + 1
    for item, instance in zip(separate.objects, placed.instances, strict=False):
        matrix = instance.world_from_object
        np.testing.assert_allclose(item.vertices, ball.vertices @ matrix[:, :3].T + matrix[:, 3], atol=1e-12)
    places, radius = field(count)
    nearest = min((np.linalg.norm(a - b) for i, a in enumerate(places) for b in places[:i]), default=9.0)
    assert nearest > 2.0 * radius, "they do not touch"


@pytest.mark.slow
def test_a_point_tells_times_trees_and_memory() -> None:
    command = [sys.executable, "-m", "clrt.bench.growth_point", "instances", "10", "64", "3"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["count"], found["triangles"], found["rays"]) == (10, 22, 64 * 64)
    assert len(found["trace_s"]["all"]) == 3
    peaks = found["peak_bytes"]
    assert 10**7 < peaks["before"] <= peaks["scene"] <= peaks["built"] <= peaks["traced"]
