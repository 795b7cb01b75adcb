"""Results of a benchmark run as they lie in its JSON, with numbers made up."""

from __future__ import annotations

from typing import Any


def series(best: float) -> dict[str, Any]:
    return {"best": best, "median": best * 1.5, "all": [best, best * 1.5, best * 2]}


def results() -> dict[str, Any]:
    """A full run on the report's scenes, in which every mark is kept."""
    return {
        "started": "2031-02-03T04:05:06+00:00", "quick": False, "load_before": [0.1, 0.2, 0.3], "load_after": [0.1, 0.2, 0.3],
        "machine": {
            "cpu": "Some CPU (TM)", "cores": 2, "memory_gib": 8.0, "opencl_platform": "PoCL", "opencl_driver": "3.0", "lanes": 16,
            "python": "3.11.0", "packages": {"numpy": "2.0.0"}, "clrt": "0.1.0", "commit": "abc1234",
        },
        "scenes": [
            {"role": "monkey", "name": "monkey", "generated": False, "triangles": 970},
            {"role": "rabbit", "name": "rabbit", "generated": False, "triangles": 69_453},
        ],
        "trees": [tree_row(256, None), tree_row(512, {"size": 256, "rays": 1000, "tree_s": series(0.01), "empty_launch_s": series(0.001)})],
        "versus": {
            "scene": "rabbit", "size": 1024,
            "rays": {"clrt": {"primary": 1000, "shadow": 500}, "embreex": {"primary": 1000, "shadow": 501}},
            "rates": {
                "clrt": {"primary": 60.0, "shadow": 40.0, "both": 50.0}, "embreex": {"primary": 24.0, "shadow": 20.0, "both": 22.0},
                "ratio": {"primary": 2.5, "shadow": 2.0, "both": 2.27},
            },
            "cores_used": {"clrt without lights": 1.98, "embreex primary": 1.95}, "pixels_that_differ": {"hit": 0, "lit": 7},
        },
        "incoherent": {
            "scene": "rabbit", "triangles": 69_463, "rays": 1_000_000, "rays_that_differ": 3,
            "seconds": {"clrt": series(0.25), "embreex": series(0.125)}, "rates": {"clrt": 4.0, "embreex": 8.0},
        },
        "ladder": [ladder_row("fast", 1.0), ladder_row("watertight", 1.03), ladder_row("exact", 1.08), ladder_row("double", 2.1)],
        "tests": [tests_row("rabbit", "sah", 23_476, 20, 20.9), tests_row("rabbit", "median", 8_482, 15, 164.5),
                  tests_row("monkey", "sah", 288, 13, 15.6), tests_row("monkey", "median", 258, 10, 53.1)],
        "command": {"scene": "rabbit", "size": 512, "seconds": series(0.8), "phases": {"read_s": 0.1, "total_s": 0.7}},
        "programs": [{"scene": "rabbit", "effects": ["mirror"], "bytes": 40_000, "absent": ["spheres"], "absent_bytes": 0,
                      "bytes_of_all_effects": 50_000}],
        "marks": [{"what": "a mark", "target": "under 2", "measured": "1", "passed": True, "note": ""}],
    }  # fmt: skip


def tree_row(size: int, sample: dict[str, Any] | None) -> dict[str, Any]:
    return {
        "scene": "rabbit", "size": size, "tree": "sah", "triangles": 69_453, "nodes": 23_476, "depth": 20, "tests_per_ray": 20.94,
        "rays": 4000, "render_s": series(0.0149), "sample": sample, "brute_s": series(1.5), "brute_picture_s": 6.0, "speed_up": 402.7,
        "speed_up_same_rays": 9.876, "build_s": series(0.25), "brute_tests_per_ray": 50_638.2,
    }  # fmt: skip


def ladder_row(rung: str, ratio: float) -> dict[str, Any]:
    return {
        "scene": "rabbit", "effects": "shadows alone", "size": 1024, "rung": rung, "render_s": series(0.03 * ratio), "ratio": ratio,
        "ratio_median": ratio, "ratio_range": [ratio * 0.9, ratio * 1.1],
        "decided": {"float64": 5, "exact": 1} if rung == "exact" else None,
    }  # fmt: skip


def tests_row(role: str, tree: str, nodes: int, depth: int, tests: float) -> dict[str, Any]:
    rays = 1_617_156
    return {"role": role, "scene": role, "size": 1024, "tree": tree, "nodes": nodes, "depth": depth, "tests_per_ray": tests, "rays": rays}
