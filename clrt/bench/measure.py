"""The measurements of one scene by itself: trees against brute force, tests a ray; and how much of everything is measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from clrt.bench.growth import Reach
from clrt.bench.scenes import BenchScene
from clrt.bench.versus import opened
from clrt.bench.warm import compile_builder
from clrt.device.context import Device
from clrt.renderer import build_trees, render, run_rows
from clrt.scene.model import Scene
from clrt.stats import RunStats
from clrt.timing import Series, interleave

TREES = ("sah", "median")
_BASELINE = "brute"


@dataclass(frozen=True)
class Plan:
    """How much to measure. Sizes are sides of square pictures.

    sizes : of the table of trees
    sample : of the picture from which brute force is reckoned where a whole one would take it too long. Not too small: in a packet of
        neighbouring pixels that lie far apart, fewer rays go the same way, and brute force looks slower than it is
    brute_limit : pixels times triangles beyond which it takes too long
    brute_count_size : of the picture that its tests are counted in, at most: counting takes longer than tracing
    view_sizes : of the pictures that other tracers are compared in
    count_size, ladder_size, command_size : of the other measurements
    incoherent_rays : of rays that go all ways
    rounds, peer_rounds, ladder_rounds, command_rounds : of trees and brute force; beside peers, where intervals are wanted; of the rungs'
        pictures, whose times lie so near each other that they want more; of whole commands and imports
    reach : of the growth curves
    """

    rounds: int = 5
    peer_rounds: int = 11
    ladder_rounds: int = 15
    command_rounds: int = 7
    sizes: tuple[int, ...] = (256, 512, 1024)
    sample: int = 256
    brute_limit: int = 10_000_000_000
    brute_count_size: int = 64
    view_sizes: tuple[int, ...] = (512, 1024)
    count_size: int = 1024
    ladder_size: int = 1024
    command_size: int = 512
    incoherent_rays: int = 1_000_000
    reach: Reach = field(default_factory=Reach)


FULL = Plan()
QUICK = Plan(
    rounds=2, peer_rounds=2, ladder_rounds=2, command_rounds=1, sizes=(32,), sample=16, brute_limit=500_000, brute_count_size=16,
    view_sizes=(64,), count_size=64, ladder_size=64, command_size=64, incoherent_rays=2000,
    reach=Reach(triangles=10_000, pixels=128, separate=10, instances=100, size=64, rounds=2),
)  # fmt: skip


def figures(scene: Scene, tree: str, device: Device) -> RunStats:
    """The figures of one render with counting."""
    stats = render(scene, tree=tree, device=device.info.name, count=True).stats
    assert stats is not None  # a renderer's picture has figures
    return stats


def measure_trees(bench: BenchScene, plan: Plan, device: Device) -> list[dict[str, Any]]:
    """A row a size and tree: figures of the tree, its render time, brute force's, and how many times faster it is."""
    counted = min(plan.brute_count_size, *plan.sizes)
    brute_tests = figures(bench.scene.with_size(counted, counted), _BASELINE, device).tests_per_ray
    compile_builder(device)
    builds = interleave({tree: partial(build_trees, bench.scene, tree, _silent, device) for tree in TREES}, plan.rounds)
    rows = []
    for size in plan.sizes:
        sampled = size * size * bench.scene.triangle_count > plan.brute_limit
        for row in (_sampled if sampled else _whole)(bench, size, plan, device):
            build_s = builds[row["tree"]].to_json()
            rows.append({"scene": bench.name, "size": size, **row, "build_s": build_s, "brute_tests_per_ray": brute_tests})
    return rows


def _silent(phase: str, fraction: float) -> None:
    """No progress."""


def _whole(bench: BenchScene, size: int, plan: Plan, device: Device) -> list[dict[str, Any]]:
    """Brute force over the whole picture, in turns with the trees."""
    scene = bench.scene.with_size(size, size)
    series = interleave({tree: _whole_picture(scene, tree, device) for tree in (*TREES, _BASELINE)}, plan.rounds)
    brute_s, rows = series[_BASELINE], []
    for tree in TREES:
        ratio = brute_s.best / series[tree].best
        rows.append(_row(figures(scene, tree, device), series[tree]) | {
            "sample": None, "brute_s": brute_s.to_json(), "brute_picture_s": brute_s.best, "speed_up": ratio, "speed_up_same_rays": ratio,
        })  # fmt: skip
    return rows


def _sampled(bench: BenchScene, size: int, plan: Plan, device: Device) -> list[dict[str, Any]]:
    """Brute force and the trees over the same smaller picture, all in turns with the trees over the whole one.

    What brute force would take over the whole picture follows from its time a ray, less that of an empty launch.
    """
    scene, small = (bench.scene.with_size(n, n) for n in (size, plan.sample))
    tracers = {tree: opened(small, tree, device) for tree in (*TREES, _BASELINE)}
    contenders: dict[str, Callable[[], object]] = {tree: _whole_picture(scene, tree, device) for tree in TREES}
    contenders |= {f"{tree}, sample": partial(tracer.run, 0, plan.sample) for tree, tracer in tracers.items()}
    contenders["empty launch"] = partial(tracers[_BASELINE].run, 0, 0)
    series = interleave(contenders, plan.rounds)
    empty_s, brute_s, rows = series["empty launch"], series[f"{_BASELINE}, sample"], []
    for tree in TREES:
        stats, sample, sample_s = figures(scene, tree, device), figures(small, tree, device), series[f"{tree}, sample"]
        estimate = whole_from_sample(brute_s.best, empty_s.best, sample.rays or 1, stats.rays or 0)
        rows.append(_row(stats, series[tree]) | {
            "sample": {"size": plan.sample, "rays": sample.rays, "tree_s": sample_s.to_json(), "empty_launch_s": empty_s.to_json()},
            "brute_s": brute_s.to_json(), "brute_picture_s": estimate, "speed_up": estimate / series[tree].best,
            "speed_up_same_rays": _ratio(brute_s.best - empty_s.best, sample_s.best - empty_s.best),
        })  # fmt: skip
    return rows


def whole_from_sample(sample_s: float, empty_s: float, sample_rays: int, rays: int) -> float:
    """Seconds of one launch over `rays`, from one over `sample_rays` of the same kind and an empty one."""
    return empty_s + (sample_s - empty_s) * rays / sample_rays


def _ratio(longer: float, shorter: float) -> float | None:
    """None where the shorter time is lost in the launch around it."""
    return longer / shorter if shorter > 0.0 else None


def _whole_picture(scene: Scene, tree: str, device: Device) -> Callable[[], object]:
    """Rendering as `clrt` does it, band of rows by band."""
    return partial(run_rows, opened(scene, tree, device), "render", _silent)


def _row(stats: RunStats, render_s: Series) -> dict[str, Any]:
    return {
        "tree": stats.tree, "triangles": stats.triangles, "nodes": stats.nodes, "depth": stats.depth,
        "tests_per_ray": stats.tests_per_ray, "rays": stats.rays, "render_s": render_s.to_json(),
    }  # fmt: skip


def count_tests(bench: BenchScene, size: int, device: Device) -> list[dict[str, Any]]:
    """Tests a ray over all rays of a square picture, and the size of the trees; a row a tree. A busy machine counts the same."""
    scene = bench.scene.with_size(size, size)
    counted = [figures(scene, tree, device) for tree in TREES]
    return [
        {
            "role": bench.role, "scene": bench.name, "size": size, "tree": stats.tree, "nodes": stats.nodes, "depth": stats.depth,
            "tests_per_ray": stats.tests_per_ray, "rays": stats.rays, "ray_counts": stats.ray_counts,
        }
        for stats in counted
    ]  # fmt: skip

