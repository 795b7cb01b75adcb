"""One point of a growth curve, a process of its own, for its memory: `python -m clrt.bench.growth_point KIND COUNT SIZE ROUNDS`.

    triangles    hills of COUNT triangles on a ground: the same surface, ever finer
    separate     COUNT small spheres of triangles, each an object with a tree
    instances    COUNT instances of one such sphere
    pixels       hills of 100,000 triangles, pictures of SIZE squared

Prints JSON: seconds of building, uploading, tracing the primary rays; peaks of memory; what trees there are.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.bench.view import mesh_object, view_scene
from clrt.bench.warm import compile_builder
from clrt.device.context import Device, open_device
from clrt.features import Features
from clrt.generate import grid_mesh, uv_sphere
from clrt.precision import DEFAULT, rung
from clrt.renderer import Prepared, build_trees, open_tracer
from clrt.scene.model import Instance, Scene
from clrt.timing import Series, interleave

FloatArray = NDArray[np.float64]

_SMALL = 20  #: triangles of each of many objects
_HILLS = 100_000  #: triangles behind the curve of pixels
_PATIENCE_S, _MOST = 2.0, 7  #: of building again and again; at least once


def hills(triangles: int) -> FloatArray:
    """(n, 3, 3): a height field whose shape does not depend on the number of triangles."""
    points, faces = grid_mesh(triangles, seed=1)
    return points[faces]


def field(count: int) -> tuple[FloatArray, float]:
    """Middles (count, 3) of spheres in rows and columns on a square of side 2, and their radius: they cover the same part of it."""
    side = int(np.ceil(np.sqrt(count)))
    pitch = 2.0 / side
    row, column = np.divmod(np.arange(count), side)
    return np.stack([pitch * (column + 0.5) - 1.0, np.full(count, 0.4 * pitch), pitch * (row + 0.5) - 1.0], axis=1), 0.4 * pitch


def scene_of(kind: str, count: int, size: int) -> Scene:
    """The scene of a point: camera and ground of the view, primary rays alone."""
    if kind in ("triangles", "pixels"):
        return replace(view_scene(hills(count if kind == "triangles" else _HILLS), size), lights=())
    corners = np.array(list(product((-1.0, 1.0), (0.0, 0.2), (-1.0, 1.0))))
    seen = replace(view_scene(corners[[[0, 3, 5], [2, 4, 7]]], size), lights=())
    points, faces = uv_sphere(_SMALL)
    ball, (places, radius) = points[faces], field(count)
    ground = seen.objects[1].vertices
    if kind == "separate":
        balls = tuple(mesh_object(radius * ball + place, i * len(ball), f"ball {i}") for i, place in enumerate(places))
        return replace(seen, objects=(*balls, mesh_object(ground, count * len(ball), "ground")))
    shape = radius * np.eye(3)
    instances = tuple(Instance(0, np.concatenate([shape, place[:, None]], axis=1)) for place in places)
    hidden = replace(mesh_object(ball, 0, "ball"), hidden=True)
    return replace(seen, objects=(hidden, mesh_object(ground, len(ball), "ground")), instances=instances)


def measure(kind: str, count: int, size: int, rounds: int) -> dict[str, Any]:
    """The point. What is compiled and loaded before it starts is no part of it."""
    device = open_device(None)
    compile_builder(device)
    warm = view_scene(hills(1000), 16)
    open_tracer(build_trees(warm, "sah", _silent, device), Features.of(warm), rung(DEFAULT), device, _silent)
    before = peak()
    scene = scene_of(kind, count, size)
    given = peak()
    prepared, build_s = _repeatedly(lambda: build_trees(scene, "sah", _silent, device), 1 if kind == "pixels" else _MOST)
    built = peak()
    row = _traced(prepared, device, rounds)
    trees = prepared.trees
    return {
        "kind": kind, "count": count, "size": size, "triangles": sum(len(item) for item in scene.objects), "build_s": build_s.to_json(),
        "nodes": sum(t.node_count for t in trees), "depth": max(t.depth for t in trees),
        "references": sum(t.reference_count for t in trees),
        "peak_bytes": {"before": before, "scene": given, "built": built, "traced": peak()}, **row,
    }  # fmt: skip


def _repeatedly(run: Callable[[], Prepared], most: int) -> tuple[Prepared, Series]:
    """The last result, and the seconds of all runs: `most`, or as many as are begun within _PATIENCE_S."""
    taken: list[float] = []
    while not taken or (sum(taken) < _PATIENCE_S and len(taken) < most):
        start = time.perf_counter()
        result = run()
        taken.append(time.perf_counter() - start)
    return result, Series(tuple(taken))


def _traced(prepared: Prepared, device: Device, rounds: int) -> dict[str, Any]:
    features = Features.of(prepared.scene)
    buffers, tracer, _, upload_s = open_tracer(prepared, features, rung(DEFAULT), device, _silent)
    trace = interleave({"trace": lambda: tracer.run(0, tracer.height)}, rounds)["trace"]
    return {"upload_s": upload_s, "trace_s": trace.to_json(), "rays": tracer.width * tracer.height, "device_bytes": buffers.size}


def peak() -> int:
    """Bytes of memory that this process has had at most so far."""
    # On Linux ru_maxrss is not below what the parent had at the fork; the kernel's own mark begins anew with the program.
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return largest if sys.platform == "darwin" else largest * 1024


def _silent(phase: str, fraction: float) -> None:
    """No progress."""


if __name__ == "__main__":
    json.dump(measure(sys.argv[1], *map(int, sys.argv[2:])), sys.stdout)
