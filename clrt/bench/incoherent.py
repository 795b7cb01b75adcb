"""Incoherent rays, against Embree from Python: from points of a mesh in a closed room, in all directions, as indirect light sends them.

Both get the same arrays of rays in one call: clrt's `RayCaster.first_hit` (float64 in, a record a ray out: t, coordinates, ids, normal),
embreex's cheapest call (float32 in, one number a ray out).
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.bench.machine import cores
from clrt.bench.peers import Embreex, RaySet, embreex_available
from clrt.bench.scenes import BenchScene
from clrt.bench.view import largest_mesh
from clrt.device.context import Device
from clrt.precision import DEFAULT
from clrt.rays import RayCaster
from clrt.timing import interleave, paired

FloatArray = NDArray[np.float64]

_MARGIN = 0.3  #: of the mesh's size, between it and the walls
_OFFSET = 1e-5  #: of the mesh's size, off the surface: both tracers start at the same places


def closed_room(mesh: FloatArray) -> FloatArray:
    """Twelve triangles (12, 3, 3) around a mesh (n, 3, 3)."""
    lo, hi = mesh.min((0, 1)), mesh.max((0, 1))
    wide = _MARGIN * (hi - lo).max()
    corners = np.array(list(product(*zip(lo - wide, hi + wide, strict=True))))  # index: 4 x + 2 y + z
    squares = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
    return np.array([corners[[a, b, c]] for q in squares for a, b, c in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))])


def scattered_rays(mesh: FloatArray, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Origins and unit directions (count, 3): points even over the mesh's area, directions in proportion to the cosine to either side."""
    rng = np.random.default_rng(seed)
    normal = np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0])
    area = np.linalg.norm(normal, axis=1)
    tri = np.searchsorted(np.cumsum(area / area.sum()), rng.random(count)).clip(max=len(mesh) - 1)
    u, v = rng.random((2, count))
    root = np.sqrt(u)[:, None]
    corner = mesh[tri]
    point = (1 - root) * corner[:, 0] + root * (1 - v[:, None]) * corner[:, 1] + root * v[:, None] * corner[:, 2]
    away = normal[tri] / area[tri, None] * rng.choice([-1.0, 1.0], count)[:, None]
    ball = rng.normal(size=(count, 3))
    direction = away + ball / np.linalg.norm(ball, axis=1, keepdims=True)
    size = np.ptp(mesh.reshape(-1, 3), axis=0).max()
    return point + _OFFSET * size * away, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def measure_incoherent(bench: BenchScene, count: int, rounds: int, device: Device) -> dict[str, Any]:
    """Million rays a second of both tracers over `count` rays from the largest mesh, in turns; and how many hit otherwise."""
    mesh = largest_mesh(bench)
    room = np.concatenate([mesh, closed_room(mesh)])
    origins, directions = (a.astype(np.float32).astype(np.float64) for a in scattered_rays(mesh, count, 1))
    caster = RayCaster(room, DEFAULT, device=device.info.name)
    contenders: dict[str, Callable[[], object]] = {"clrt": partial(caster.first_hit, origins, directions)}
    with ExitStack() as stack:
        if embreex_available():
            peer = stack.enter_context(Embreex([room], cores()))
            rays = RaySet(origins.astype(np.float32), directions.astype(np.float32))
            peer.load("scattered", rays)
            contenders["embreex"] = partial(peer.trace, "scattered")
        series = interleave(contenders, rounds)
        result: dict[str, Any] = {"scene": bench.name, "triangles": len(room), "rays": count}
        if embreex_available():
            result["rays_that_differ"] = int(np.count_nonzero(peer.nearest(rays).prim != caster.first_hit(origins, directions)["prim_id"]))
    result["seconds"] = {name: times.to_json() for name, times in series.items()}
    result["rates"] = {name: count / times.median / 1e6 for name, times in series.items()}
    if "embreex" in series:
        result["ratio"] = paired(series["embreex"].seconds, series["clrt"].seconds).to_json()
    return result
