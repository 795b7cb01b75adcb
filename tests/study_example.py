"""A made-up study with the keys and the shape of a measured one, and its pictures: for tests of what shows studies."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from clrt.image.png import encode

RUNGS = {"fast": 1.0, "watertight": 1.04, "exact": 1.16, "double": 1.93}
SIZE = 48  #: pixels


def number(median: float, unit: str = "", spread: float = 0.03, runs: int = 7) -> dict[str, Any]:
    """A measured number whose interval reaches this part of the median to both sides."""
    half = abs(median) * spread
    return {"median": median, "low": median - half, "high": median + half, "unit": unit, "runs": runs}


def counted(value: float, unit: str = "") -> dict[str, Any]:
    return {"median": value, "low": value, "high": value, "unit": unit, "runs": 1}


def study(scene: str = "example.txt") -> dict[str, Any]:
    """Every part is there, with the odd note and gap that real ones have."""
    return {
        "format": 1, "header": _header(scene),
        "verdict": [
            "Exact visibility costs 1.16x (1.13 to 1.19) over fast and removes 212 wrong primitives.",
            "4x the samples cost 3.9x (3.8 to 4.0) and reduce the error 2.4x (2.3 to 2.5).",
        ],
        "precision": _precision(), "samples": _samples(), "depth": _depth(), "effects": _effects(), "trees": _trees(), "bias": _bias(),
        "phases": _phases(),
    }  # fmt: skip


def _header(scene: str) -> dict[str, Any]:
    return {
        "scene": scene, "scene_sha256": "5f0c" * 16, "clrt": "0.5.0", "date": "2026-01-02T03:04:05Z",
        "machine": {"processor": "Example CPU @ 2.4 GHz", "cores": 2, "threads": 2, "memory": 7.7, "system": "Linux 6.1"},
        "opencl": {"platform": "Portable Computing Language", "device": "cpu-example", "driver": "6.0", "compiler": "LLVM 18"},
        "build_options": ["-cl-std=CL1.2", "-cl-fp32-correctly-rounded-divide-sqrt"], "contraction": "off", "load_average": [0.4, 1.9],
        "size": [SIZE, SIZE], "quick": True, "samples": 4, "seeds": {"points": 10, "first": 1, "reference": 16, "reference_first": 1000},
    }  # fmt: skip


def _precision() -> dict[str, Any]:
    rows = [
        {
            "rung": rung, "build": number(0.8, "s"), "compile_cold": number(9.1 + cost, "s"), "compile_warm": number(0.031, "s"),
            "trace": number(0.412 * cost, "s"), "ratio_to_fast": counted(1, "x") if rung == "fast" else number(cost, "x", 0.025),
            "rays_per_s": number(21.3e6 / cost, "1/s"),
            "wrong_primitives": counted({"fast": 212, "watertight": 31}.get(rung, 0), "of 2,000 rays"),
            "leaks_per_million": counted(14.2 if rung == "fast" else 0, "per million rays"),
            "t_error": counted(3.1e-6 if rung != "double" else 2.3e-15, "1"),
            "picture_error": counted({"fast": 2.1e-3, "watertight": 4.0e-4}.get(rung, 0), "radiance"),
        }
        for rung, cost in RUNGS.items()
    ]  # fmt: skip
    names = ["reference", *RUNGS]
    return {
        "rows": rows, "pictures": {name: f"pictures/{name}.png" for name in names},
        "differences": {rung: {"file": f"pictures/difference-{rung}.png", "scale": 0.05} for rung in ("fast", "watertight")},
        "crop": {"x": 16, "y": 20, "width": 12, "height": 12},
    }  # fmt: skip


def _samples() -> dict[str, Any]:
    counts = [1, 2, 4, 8, 16, 32, 64]
    rows = [
        {
            "samples": n, "seconds": number(0.02 + 0.05 * n, "s", 0.04, 10), "rmse": number(0.11 * n**-0.68, "radiance", 0.06, 10),
            "relative_mse": number(0.3 * n**-1.36, "1", 0.12, 10), "flip": number(0.19 * n**-0.5, "1", 0.05, 10),
            "p99": number(0.42 * n**-0.66, "radiance", 0.09, 10),
        }
        for n in counts
    ]  # fmt: skip
    slope = {"median": -0.66, "low": -0.69, "high": -0.63, "unit": "log error / log samples", "runs": 10}
    return {"rows": rows, "slope": slope, "floor": number(0.0031, "radiance", 0.1, 2), "pareto": [0, 2, 3, 5, 6],
            "reference": {"rung": "double", "samples": 6400, "batches": 16, "times_largest": 100}}  # fmt: skip


def _depth() -> dict[str, Any]:
    errors = {0: 0.21, 1: 0.08, 2: 0.021, 4: 0.0034, 8: 0.0}
    rows: list[dict[str, Any]] = [
        {"depth": depth, "seconds": number(0.3 + 0.11 * depth, "s"), "error": counted(error, "radiance")} for depth, error in errors.items()
    ]
    return {"rows": rows, "against": "root mean square error against depth 8"}


def _effects() -> dict[str, Any]:
    rows = [
        {
            "effect": name, "line": line, "text": text, "cost": number(cost, "s", spread), "share_of_time": number(cost / 0.9, "1", spread),
            "changed_pixels": counted(changed, "1"),
            "max_difference": counted(difference, "radiance"), "error": counted(difference / 5, "radiance"),
        }
        for name, line, text, cost, spread, changed, difference in (
            ("shadows", 4, "light 0 4 2", 0.121, 0.05, 0.21, 0.8), ("mirrors", 9, "mirror 0.4", 0.305, 0.04, 0.33, 0.5),
            ("smooth", 12, "smooth yes", 0.004, 2.0, 0.6, 0.2),
        )
    ]  # fmt: skip
    return {"rows": [*rows, {"effect": "triangles", "note": "nothing would be left to see without it"}]}


def _trees() -> dict[str, Any]:
    trees = (("sah", 1.9, 41201, 24, 3.4, 0.41), ("median", 0.7, 65535, 17, 9.6, 0.93))
    rows: list[dict[str, Any]] = [
        {
            "tree": name, "build": number(build, "s"), "nodes": counted(nodes, "nodes"), "depth": counted(depth, "edges"),
            "tests_per_ray": counted(tests, "tests"), "trace": number(trace, "s"),
        }
        for name, build, nodes, depth, tests, trace in trees
    ]  # fmt: skip
    return {"rows": [*rows, {"tree": "brute", "note": "69,451 triangles: it would take about 40 minutes"}]}


def _bias() -> dict[str, Any]:
    rows = [
        {
            "samples": n, "squared_error": number(0.012 / n, "radiance^2", 0.1, 10),
            "bias_squared": number(2e-6 if n > 1 else -1e-6, "radiance^2", 0.9, 10),
            "variance": number(0.0118 / n, "radiance^2", 0.1, 10),
        }
        for n in (1, 2, 4, 8, 16, 32)
    ]  # fmt: skip
    return {"rows": rows, "verdict": "unbiased"}


def _phases() -> dict[str, Any]:
    seconds = {
        "read": 0.21, "trees": 1.9, "compile cold": 9.2, "compile warm": 0.03, "upload": 0.004, "trace": 0.41, "shade": 0.12,
        "read back": 0.002, "write": 0.017,
    }  # fmt: skip
    rows: list[dict[str, Any]] = [{"phase": name, "seconds": number(value, "s")} for name, value in seconds.items()]
    rows[6] = {"phase": "shade", "seconds": None, "note": "one kernel traces and shades, so that its time is with trace"}
    return {"rows": rows}


def make(folder: Path, content: dict[str, Any] | None = None) -> Path:
    """Write study.json and the pictures of `study()` into `folder`."""
    (folder / "pictures").mkdir(parents=True, exist_ok=True)
    (folder / "study.json").write_text(json.dumps(study() if content is None else content), encoding="utf-8")
    random = np.random.default_rng(5)
    y, x = np.mgrid[0:SIZE, 0:SIZE]
    reference = np.stack([x * 5, y * 5, np.full_like(x, 90)], -1).astype(np.uint8)
    for place, name in enumerate(["reference", *RUNGS]):
        picture = reference.copy()
        picture[20 : 20 + 2 * place, 16:28] = [255, 40, 40]
        (folder / "pictures" / f"{name}.png").write_bytes(encode(picture))
    for rung in RUNGS:
        noise = random.integers(0, 120, (SIZE, SIZE, 1), np.uint8).repeat(3, -1)
        (folder / "pictures" / f"difference-{rung}.png").write_bytes(encode(noise))
    return folder
