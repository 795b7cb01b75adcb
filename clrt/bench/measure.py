"""The measurements of one scene: trees against brute force, tests a ray, the whole command, the specialised program."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from clrt.bench.scenes import BenchScene
from clrt.bench.versus import opened
from clrt.device.context import Device
from clrt.errors import ClrtError
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
    versus_size, count_size, command_size : of the other measurements
    incoherent_rays : of rays that go all ways
    ladder_rounds : of the rungs' pictures, whose times lie so near each other that they want more
    """

    rounds: int = 5
    sizes: tuple[int, ...] = (256, 512, 1024)
    sample: int = 256
    brute_limit: int = 10_000_000_000
    brute_count_size: int = 64
    versus_size: int = 1024
    count_size: int = 1024
    command_size: int = 512
    ladder_rounds: int = 15
    incoherent_rays: int = 1_000_000


FULL = Plan()
QUICK = Plan(
    rounds=2, sizes=(32,), sample=16, brute_limit=500_000, brute_count_size=16, versus_size=64, count_size=64, command_size=64,
    ladder_rounds=2, incoherent_rays=2000,
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
    builds = interleave({tree: partial(build_trees, bench.scene, tree, _silent) for tree in TREES}, plan.rounds)
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


def measure_command(bench: BenchScene, size: int, rounds: int, scratch: Path) -> dict[str, Any]:
    """Wall time of `clrt scene.txt -o picture.png` as a process, after one run that fills the kernel cache; the phases of one more."""
    figures_file = scratch / "figures.json"
    command = [sys.executable, "-m", "clrt", str(bench.path.resolve()), "--size", f"{size}x{size}", "-o", str(scratch / "picture.png")]
    series = interleave({"command": partial(_run, command)}, rounds)["command"]
    _run([*command, "--stats", str(figures_file)])
    phases = json.loads(figures_file.read_text())
    wanted = ("read_s", "build_s", "upload_s", "compile_s", "render_s", "write_s", "total_s")
    return {"scene": bench.name, "size": size, "seconds": series.to_json(), "phases": {name: phases[name] for name in wanted}}


def _run(command: list[str]) -> None:
    """Raises ClrtError with what the command said where it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ClrtError(f"{' '.join(command)} ended with {done.returncode}: {done.stderr.strip()}")
