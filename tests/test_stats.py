"""The figures of a run: sums by hand, the JSON and its keys."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from clrt.stats import RAY_KINDS, ObjectStats, RunStats

#: the interface: keys may be added, never taken away
KEYS = {
    "clrt", "scene", "width", "height", "tree", "device", "precision", "effects", "objects", "read_s", "build_s", "compile_s",
    "render_s", "write_s", "total_s", "nodes", "depth", "tests_per_ray", "primary_rays", "rays", "rays_per_s", "ray_counts",
    "samples", "seed", "decided", "count_s", "upload_s", "triangles", "primary_rays_per_s",
}  # fmt: skip
OBJECT_KEYS = {"name", "triangles", "nodes", "leaves", "references", "depth", "build_s", "tests_per_ray"}


def counted_run() -> RunStats:
    objects = [
        ObjectStats("object 1", triangles=12, nodes=7, leaves=4, references=15, depth=3, build_s=0.25, tests_per_ray=1.5),
        ObjectStats("object 2", triangles=2, nodes=1, leaves=1, references=2, depth=0, build_s=0.125, tests_per_ray=0.25),
    ]
    counts = {"primary": 600, "shadow": 300, "mirror": 100}
    return RunStats(width=30, height=20, objects=objects, ray_counts=counts, render_s=0.5, effects=["shadows"])


def plain_run() -> RunStats:
    objects = [ObjectStats("object 1", triangles=12, nodes=7, leaves=4, references=15, depth=3, build_s=0.25)]
    return RunStats(width=30, height=20, objects=objects, render_s=0.5)


def test_counted_run_sums_over_objects_and_kinds() -> None:
    run = counted_run()
    assert (run.triangles, run.nodes, run.depth) == (14, 8, 3)
    assert run.tests_per_ray == 1.75
    assert (run.primary_rays, run.rays, run.rays_per_s, run.primary_rays_per_s) == (600, 1000, 2000.0, 1200.0)


def test_plain_run_knows_primary_rays_and_no_counts() -> None:
    run = plain_run()
    assert (run.primary_rays, run.primary_rays_per_s) == (600, 1200.0)
    assert (run.rays, run.rays_per_s, run.tests_per_ray) == (None, None, None)


def test_empty_run_has_no_rates_and_depth_zero() -> None:
    run = RunStats()
    assert (run.depth, run.nodes, run.primary_rays_per_s) == (0, 0, None)


def test_to_json_has_the_stable_keys() -> None:
    data = counted_run().to_json()
    assert data.keys() >= KEYS
    assert data["objects"][0].keys() >= OBJECT_KEYS
    assert data["ray_counts"] == {"primary": 600, "shadow": 300, "mirror": 100, "refracted": 0}
    assert plain_run().to_json()["ray_counts"] is None


def test_write_json_reads_back_as_strict_json(tmp_path: Path) -> None:
    path = tmp_path / "stats.json"
    counted_run().write_json(path)
    assert json.loads(path.read_text(), parse_constant=pytest.fail) == counted_run().to_json()


def test_write_json_not_a_number_writes_nothing(tmp_path: Path) -> None:
    run = counted_run()
    run.objects[0].tests_per_ray = float("nan")
    with pytest.raises(ValueError, match="JSON"):
        run.write_json(tmp_path / "stats.json")
    assert list(tmp_path.iterdir()) == []


def test_every_key_stands_in_the_table_of_the_readme() -> None:
    readme = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    table = readme.partition("## Figures of a run")[2].partition("## Figures\n")[0]
    run = json.loads(counted_run().json_text())
    keys = {*run, *run["objects"][0], *RAY_KINDS}
    assert sorted(key for key in keys if f"`{key}`" not in table) == []
