"""Results of a benchmark run as they lie in its JSON, with numbers made up."""

from __future__ import annotations

from typing import Any


def series(best: float) -> dict[str, Any]:
    return {"best": best, "median": best * 1.5, "all": [best, best * 1.5, best * 2]}


def ratio(median: float) -> dict[str, Any]:
    return {"median": median, "low": median * 0.9, "high": median * 1.1, "sure": True}


def results() -> dict[str, Any]:
    """A full run on the report's scenes, in which every mark is kept."""
    return {
        "format": 2, "started": "2031-02-03T04:05:06+00:00", "quick": False, "load_before": [0.1, 0.2, 0.3], "load_after": [0.1, 0.2, 0.3],
        "plan": {"peer_rounds": 11, "ladder_rounds": 15, "command_rounds": 7},
        "machine": {
            "cpu": "Some CPU (TM)", "cores": 2, "memory_gib": 8.0, "opencl_platform": "PoCL", "opencl_driver": "3.0", "lanes": 16,
            "python": "3.11.0", "packages": {"numpy": "2.0.0"}, "clrt": "0.1.0", "commit": "abc1234",
        },
        "scenes": [
            {"role": "monkey", "name": "monkey", "generated": False, "triangles": 970},
            {"role": "rabbit", "name": "rabbit", "generated": False, "triangles": 69_453},
        ],
        "versus": {
            "scene": "rabbit", "triangles": 69_453, "views": [view_row(512), view_row(1024)], "general": general_row(),
            "peers": {"versions": {"Embree C++": "3.13.5"}, "missing": [{"name": "Open3D", "reason": "open3d is not installed"}]},
        },
        "incoherent": {
            "scene": "rabbit", "triangles": 69_463, "rays": 1_000_000, "rays_that_differ": 3, "ratio": ratio(1.5),
            "seconds": {"clrt": series(0.125), "embreex": series(0.1875)}, "rates": {"clrt": 6.0, "embreex": 4.0},
        },
        "ladder": [ladder_row("fast", 1.0), ladder_row("watertight", 1.01), ladder_row("exact", 1.05), ladder_row("double", 2.1)],
        "trees": [tree_row(256, None), tree_row(512, {"size": 256, "rays": 1000, "tree_s": series(0.01), "empty_launch_s": series(0.001)})],
        "tests": [tests_row("rabbit", "sah", 23_476, 20, 20.9), tests_row("rabbit", "median", 8_482, 15, 164.5),
                  tests_row("monkey", "sah", 288, 13, 15.6), tests_row("monkey", "median", 258, 10, 53.1)],
        "commands": {
            "scene": "rabbit", "triangles": 69_453, "size": 512, "missing": [], "pixels_that_differ": {"trimesh": 12},
            "first": {"clrt": series(1.0), "trimesh": series(1.25)}, "cached": {"clrt": series(0.25), "trimesh": series(0.5)},
            "ratios": {"trimesh": ratio(2.0)}, "phases": {"read_s": 0.1, "total_s": 0.2},
        },
        "imports": {"import clrt": series(0.0625), "clrt --help": series(0.125)},
        "programs": [{"scene": "rabbit", "effects": ["mirror"], "bytes": 40_000, "absent": ["spheres"], "absent_bytes": 0,
                      "bytes_of_all_effects": 50_000}],
        "growth": {
            "reach": {"size": 1024, "rounds": 7},
            "points": [point("triangles", n, build) for n, build in ((1000, 0.01), (100_000, 0.2), (1_000_000, 1.5), (10_000_000, 20.0))]
            + [point("pixels", 1, 0.2), point("separate", 10, 0.05), point("instances", 10, 0.01)],
            "fits": {"triangles": {"a": 2.0, "b": 1.5, "residual": 0.0123},
                     "beyond": {"fitted_up_to": 100_000, "points": [
                         {"triangles": 1_000_000, "foretold": 20.0, "measured": 22.0},
                         {"triangles": 10_000_000, "foretold": 25.0, "measured": 50.0}]}},
        },
        "marks": [{"what": "a mark", "target": "under 2", "measured": "1", "passed": True, "note": ""}],
    }  # fmt: skip


def view_row(size: int) -> dict[str, Any]:
    def rates(rate: float) -> dict[str, float]:
        return {"primary": rate, "shadow": rate / 2, "both": rate * 0.75}

    peers = {"Embree C++": 1.6, "Mitsuba": 1.3, "embreex": 5.0}
    return {
        "size": size, "hit_share": 0.9, "counts": {}, "seconds": {}, "rays": {}, "pixels_that_differ": {"hit": 0, "lit": 7},
        "cores_used": {"clrt watertight, lit, with shadows": 1.98, "embreex, primary": 1.95, "embreex, shadow": 1.9, "trimesh": 1.0},
        "rates": {f"clrt {rung}": rates(80.0) for rung in ("fast", "watertight", "exact", "double")}
        | {name: rates(80.0 / over) for name, over in peers.items()},
        "ratios": {name: {kind: ratio(over) for kind in ("primary", "shadow", "both")} for name, over in peers.items()},
        "over_fast": {"fast": ratio(1.0), "watertight": ratio(1.01), "exact": ratio(1.05), "double": ratio(2.0)},
    }  # fmt: skip


def general_row() -> dict[str, Any]:
    return {"size": 1024, "rays": 1_048_576, "hit_share": 0.9, "seconds": {}, "rates": {"clrt": 50.0, "Embree C++": 40.0},
            "ratios": {"Embree C++": ratio(1.25)}}  # fmt: skip


def point(kind: str, count: int, build: float) -> dict[str, Any]:
    return {
        "kind": kind, "count": count, "size": 1024, "triangles": count, "rays": 1_048_576, "build_s": series(build), "upload_s": 0.1,
        "trace_s": series(0.02), "nodes": 3, "depth": 2, "references": 2 * count, "device_bytes": 3 * 2**20,
        "peak_bytes": {"before": 2**27, "scene": 2**28, "built": 2**30, "traced": 2**31},
    }  # fmt: skip


def tree_row(size: int, sample: dict[str, Any] | None) -> dict[str, Any]:
    return {
        "scene": "rabbit", "size": size, "tree": "sah", "triangles": 69_453, "nodes": 23_476, "depth": 20, "tests_per_ray": 20.94,
        "rays": 4000, "render_s": series(0.0149), "sample": sample, "brute_s": series(1.5), "brute_picture_s": 6.0, "speed_up": 402.7,
        "speed_up_same_rays": 9.876, "build_s": series(0.1), "brute_tests_per_ray": 50_638.2,
    }  # fmt: skip


def ladder_row(rung: str, over: float) -> dict[str, Any]:
    return {
        "scene": "rabbit", "effects": "shadows alone", "size": 1024, "rung": rung, "render_s": series(0.03 * over), "ratio": ratio(over),
        "decided": {"float64": 5, "exact": 1} if rung == "exact" else None,
    }  # fmt: skip


def tests_row(role: str, tree: str, nodes: int, depth: int, tests: float) -> dict[str, Any]:
    rays = 1_617_156
    return {"role": role, "scene": role, "size": 1024, "tree": tree, "nodes": nodes, "depth": depth, "tests_per_ray": tests, "rays": rays}
