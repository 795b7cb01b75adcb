"""Visibility of the rungs against exact arithmetic: wrong primitives of the picture's rays, errors of t, leaks of closed meshes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.errors import MeshError
from clrt.precision import RUNGS
from clrt.rays import RayCaster
from clrt.reference import exact
from clrt.scene.model import Scene
from clrt.study.numbers import Number, counted, proportion
from clrt.study.subject import Subject
from clrt.verify.case import Context
from clrt.verify.judge import leaks
from clrt.verify.rays import Rays, at_edges, at_vertices, directions, joined, rays_of

FloatArray = NDArray[np.float64]

_ORIGINS = 64  #: points inside a closed mesh that rays leave from
_FEWEST_ORIGINS = 4
_TRIED = 4096  #: points of its box that are asked for them
_SEED = 20_130


@dataclass(frozen=True)
class Judged:
    """rows : rung -> its figures; note : how many rays, decided how, or why there are none."""

    rows: dict[str, dict[str, Number]]
    note: str


def wrong_primitives(subject: Subject) -> Judged:
    """Primary rays, through the pixels' centres, whose first triangle is another one than that of exact arithmetic; errors of t.

    Rays on which all rungs agree are checked on a sample, the others all: an error that all rungs share would show in the sample.
    """
    scene = subject.scene
    if any(any(item.motion) for item in scene.objects):
        return Judged({}, "wrong primitives are not counted: objects move")
    try:
        subject.tell("precision: programs of rays", 0.0)
        casters = {name: RayCaster(scene, precision=name, device=subject.device.info.name) for name in RUNGS}
    except MeshError as error:
        return Judged({}, f"wrong primitives are not counted: {error}")
    if not scene.triangle_count:
        return Judged({}, "wrong primitives are not counted: the scene has no triangles")
    rng = np.random.default_rng(_SEED)
    rays = rng.permutation(scene.camera.directions().reshape(-1, 3))
    hits = {name: caster.first_hit(scene.camera.eye, rays) for name, caster in casters.items()}
    prims = np.stack([each["prim_id"] for each in hits.values()])
    disputed = np.flatnonzero((prims != prims[0]).any(axis=0))
    half = max(1, subject.plan.oracle_rays // 2)
    # The order is random, so the rays up to the last that can be decided are a fair sample of all.
    end = len(rays) if len(disputed) <= half else int(disputed[half])
    chosen = np.union1d(disputed[disputed < end], np.arange(min(end, half)))
    subject.tell("precision: the exact oracle", 0.0)
    prim, t = exact.first_hit(_triangles(scene), np.broadcast_to(scene.camera.eye, (len(chosen), 3)), rays[chosen])
    rows = {name: _judge(each[chosen], prim, t, end) for name, each in hits.items()}
    agreed = len(chosen) - int(np.count_nonzero(disputed < end))
    note = f"wrong primitives: of {end:,} primary rays exact arithmetic decided all {len(chosen) - agreed:,} on which rungs differ"
    return Judged(rows, f"{note}, and {agreed:,} others; spheres are left out")


def _triangles(scene: Scene) -> FloatArray:
    """All triangles in the order of their ids."""
    return np.concatenate([item.vertices for item in sorted(scene.objects, key=lambda item: item.first_prim)])


def _judge(hits: NDArray[Any], prim: NDArray[np.int64], t: FloatArray, rays: int) -> dict[str, Number]:
    same = (hits["prim_id"] == prim) & (prim >= 0)
    wrong = int(np.count_nonzero(hits["prim_id"] != prim))
    off = np.abs(hits["t"][same] - t[same]) / t[same]
    return {"wrong_primitives": counted(wrong, f"of {rays:,} rays"), "t_error": counted(float(off.max(initial=0.0)), "1")}


def leak_rates(subject: Subject) -> Judged:
    """Rays from inside the largest closed object that are said to leave it, a million."""
    closed = [item for item in subject.scene.objects if len(item) and is_closed(item.vertices)]
    if not closed:
        return Judged({}, "leaks are not counted: no object is a closed mesh")
    item = max(closed, key=len)
    tri, rng = item.vertices, np.random.default_rng(_SEED)
    origins = inside(tri, rng, subject.device.info.name)
    if len(origins) < _FEWEST_ORIGINS:
        return Judged({}, f"leaks are not counted: {item.name} has too little room inside to start rays from")
    count = subject.plan.leak_rays
    starts = origins[rng.integers(0, len(origins), count)]
    vertex, edge, free = np.array_split(starts, 3)
    rays: Rays = joined(at_vertices(rng, vertex, tri), at_edges(rng, edge, tri), rays_of(free, directions(rng, len(free))))
    subject.tell("precision: leaks", 0.5)
    lost = leaks(Context(device=subject.device.info.name), "study", tri, rays)
    rows = {name: {"leaks_per_million": proportion(found or 0, count, 1e6, "per million rays")} for name, found in lost.items()}
    return Judged(rows, f"leaks: {count:,} rays from inside {item.name}, a third each at corners, at edges and anywhere")


def is_closed(vertices: FloatArray) -> bool:
    """Whether each edge of the triangles (n, 3, 3) belongs to an even number of them: then every ray from inside meets one."""
    ids = np.unique(vertices.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3)
    edges = np.sort(np.concatenate([ids[:, [0, 1]], ids[:, [1, 2]], ids[:, [2, 0]]]), axis=1)
    edges = edges[edges[:, 0] != edges[:, 1]]
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    return bool(len(counts) and (counts % 2 == 0).all())


def inside(tri: FloatArray, rng: np.random.Generator, device: str | None) -> NDArray[np.float32]:
    """Some points inside a closed mesh, float32: a ray from there meets an odd number of triangles, in three directions."""
    lo, hi = tri.min(axis=(0, 1)), tri.max(axis=(0, 1))
    points = (lo + rng.random((_TRIED, 3)) * (hi - lo)).astype(np.float32)
    caster = RayCaster(tri, precision="exact", device=device)
    odd = np.ones(len(points), np.bool_)
    for direction in directions(rng, 3):
        odd &= caster.count_hits(points, direction) % 2 == 1
    return np.asarray(points[odd][:_ORIGINS])
