"""Hard cases 6, 10 to 13, 29 and 33: contraction, degenerate triangles, scales, a mesh no split can part, vertices that are no numbers."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device import program
from clrt.errors import ClrtError
from clrt.rays import RayCaster
from clrt.verify import naive, naive_tree
from clrt.verify.case import SAFE, Context, Outcome, case
from clrt.verify.judge import Truth, against, disagreements, plus, truth, unusable
from clrt.verify.rays import (
    Rays,
    Triangles,
    at_edges,
    at_vertices,
    closed_sphere,
    directions,
    inside,
    joined,
    lattice,
    on_faces,
    quad,
    rays_of,
    toward,
)

_NAIVE_RAYS = 2_000
_BUILD_SECONDS = 5.0  #: a tree over 10,000 identical triangles; it takes some 10 ms
_BUILD_REFERENCES = 4  #: entries of its leaves, a triangle


@contextmanager
def _contraction(state: str) -> Iterator[None]:
    """Programs built within contract a b + c to an FMA wherever their source does not forbid it ("ON"), or nowhere ("OFF")."""
    build = program.build

    def built(device: Any, source: str, options: tuple[str, ...] = program.OPTIONS) -> Any:
        text = source if state == "ON" else re.sub(r"FP_CONTRACT\s+ON", "FP_CONTRACT OFF", source)
        return build(device, f"#pragma OPENCL FP_CONTRACT {state}\n{text}", options)

    program.build = built
    try:
        yield
    finally:
        program.build = build


@case(6, "builds with and without contraction", provokes="FMA asymmetry", oracle="E")
def contraction(context: Context) -> Outcome:
    rng, tri = context.rng(6), closed_sphere(500, (3.0, -2.0, 5.0))
    count = context.share(1.0 if context.full else 0.05)
    vertex, edge = np.array_split(inside(rng, count, tri), 2)
    rays = joined(at_edges(rng, edge, tri), at_vertices(rng, vertex, tri))
    expected = truth(tri, rays)
    counts = []
    for state in ("ON", "OFF"):
        with _contraction(state):
            counts.append(against(context, ("contraction", state), tri, rays, expected))
    lost = naive.brute_force(tri, rays.take(slice(0, _NAIVE_RAYS)), naive.contracted_edges)[0] < 0
    return Outcome(2 * count, plus(*counts), int(lost.sum()), "naive: Woop's edge functions, contracted")


@case(10, "triangles with two equal vertices", provokes="NaN normal", oracle="S")
def equal_vertices(context: Context) -> Outcome:
    """Refused, or counted among the scene's warnings and never hit; rays at them hit the wall behind, with a finite normal."""
    rng, count = context.rng(10), context.share(0.1)
    tri = rng.integers(-8, 9, (60, 3, 3)).astype(np.float32)
    tri[:, 1] = tri[np.arange(60), rng.choice([0, 2], 60)]
    walled = np.concatenate([tri, quad((0, 0, 64), (4096, 0, 0), (0, 4096, 0)).astype(np.float32)])
    rays = toward(rng.integers(-16, 17, (count, 3)) - np.array([0.0, 0, 64]), tri.reshape(-1, 3)[rng.integers(0, 180, count)])

    def wrong(rung: str) -> int:
        try:
            caster = context.caster("equal vertices", walled, rung)
        except ClrtError:
            return 0
        hits = caster.first_hit(rays.origins, rays.directions)
        uncounted = not any("60" in warning and "zero area" in warning for warning in caster.scene.warnings)
        on_wall = (hits["prim_id"] >= 60) & (np.abs(np.abs(hits["normal"][:, 2]) - 1) < 1e-6)
        return int(np.count_nonzero(~on_wall | unusable(hits))) + uncounted

    edges = tri[:, 1:] - tri[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    with np.errstate(invalid="ignore"):
        poisoned = np.isnan(normal / np.linalg.norm(normal, axis=1, keepdims=True)).any(axis=1)
    return Outcome(count, context.each_rung(wrong), int(poisoned.sum()), "one more where they are not counted in a warning")


def _hills() -> Triangles:
    """A sheet whose heights are whole, so that no power of two rounds it."""
    y, x = np.mgrid[-8:9, -8:9]
    return lattice(16, ((3 * x * x + 5 * x * y + 7 * y * y) % 11) / 8.0 - 0.5)


def _scaled(context: Context, number: int, exponent: int, epsilon: naive.MoellerTrumbore) -> Outcome:
    """Triangles and rays times a power of two, directions too: every bit of t, u, v and the same ids."""
    rng, unit = context.rng(number), _hills()
    origins = np.asarray(rng.uniform(-6, 6, (context.rays, 3)), np.float32)
    half = context.rays // 2
    rays = joined(toward(origins[:half], on_faces(rng, half, unit)), at_vertices(rng, origins[half:], unit))
    tri = np.ldexp(unit, exponent)
    far = Rays(np.ldexp(rays.origins, exponent), np.ldexp(rays.directions, exponent))

    def wrong(rung: str) -> int:
        near = context.caster("hills", unit, rung).first_hit(rays.origins, rays.directions)
        hits = context.caster(("hills", exponent), tri, rung).first_hit(far.origins, far.directions)
        return int(np.count_nonzero((hits != near) | unusable(hits)))

    some = slice(0, None, -(-rays.size // _NAIVE_RAYS))
    near_prim, near_t = naive.brute_force(unit, rays.take(some), epsilon)
    prim, t = naive.brute_force(tri, far.take(some), epsilon)
    return Outcome(rays.size, context.each_rung(wrong), int(np.count_nonzero((prim != near_prim) | (t != near_t))))


@case(11, "grid at scale 2^-20", provokes="absolute epsilons", oracle="X")
def small_grid(context: Context) -> Outcome:
    return _scaled(context, 11, -20, naive.MoellerTrumbore(epsilon=1e-6))


@case(12, "grid at scale 2^20", provokes="overflow of squares", oracle="X")
def large_grid(context: Context) -> Outcome:
    """The naive variant compares the determinant's square with those of all three lengths: 2^120 times their squares at unit scale."""
    return _scaled(context, 12, 20, naive.MoellerTrumbore(epsilon=1e-6, relative=True))


@case(13, "scale 1e-30", provokes="denormal products", oracle="E")
def tiny_sphere(context: Context) -> Outcome:
    """A closed sphere; or a clear refusal of it."""
    rng = context.rng(13)
    tri = closed_sphere(500, radius=1e-30)
    start = inside(rng, context.share(1.0 if context.full else 0.05), tri)
    vertex, edge, free = np.array_split(start, 3)
    with np.errstate(under="ignore"):
        rays = joined(at_vertices(rng, vertex, tri), at_edges(rng, edge, tri), rays_of(free, directions(rng, len(free))))
    expected = truth(tri, rays)
    refused = []

    def wrong(rung: str) -> int:
        try:
            hits = context.caster("tiny", tri, rung).first_hit(rays.origins, rays.directions)
        except ClrtError:
            refused.append(rung)
            return 0
        return int(disagreements(rung, hits, expected).sum())

    lost = naive.brute_force(tri, rays.take(slice(0, _NAIVE_RAYS)))[0] < 0
    counts = context.each_rung(wrong)
    return Outcome(rays.size, counts, int(lost.sum()), f"refused by {', '.join(refused)}" if refused else "")


@case(29, "10,000 identical triangles", provokes="runaway build", oracle="S")
def identical(context: Context) -> Outcome:
    """Built in bounded time and memory; `exact` reports the lowest id, the others any of them, and none misses."""
    rng, copies, count = context.rng(29), 10_000, context.share(0.005)
    one = np.array([[[-1, -1, 0], [1, -1, 0], [0, 1, 0.5]]], np.float32)
    tri = np.repeat(one, copies, axis=0)
    rays = toward(rng.uniform(-1, 1, (count, 3)) + np.array([0, 0, -3.0]), on_faces(rng, count, one) * 0.9)
    single = truth(one, rays)
    expected = Truth(single.prim_id, single.t)

    def wrong(rung: str) -> int:
        start = time.perf_counter()
        caster = context.caster("identical", tri, rung)
        slow = time.perf_counter() - start > _BUILD_SECONDS
        large = sum(tree.reference_count for tree in caster.trees) > _BUILD_REFERENCES * copies
        hits = caster.first_hit(rays.origins, rays.directions)
        return int(disagreements(rung, hits, expected).sum()) + slow + large

    runaway = naive_tree.build(tri, 6, middle=True).reference_count > _BUILD_REFERENCES * copies
    return Outcome(count, context.each_rung(wrong), int(runaway), "naive: cells are halved to a depth, whatever is gained")


@case(33, "NaN and infinite vertices", provokes="poisoned bounds", oracle="S", promised=SAFE | {"fast"})
def bad_vertices(context: Context) -> Outcome:
    """Refused by an error that names the face, wherever the bad number stands."""
    rng, good = context.rng(33), closed_sphere(100)
    spoilt = []
    for value in (np.nan, np.inf, -np.inf):
        for _ in range(4):
            face, corner, axis = rng.integers(0, len(good)), rng.integers(0, 3), rng.integers(0, 3)
            tri = good.copy()
            tri[face, corner, axis] = value
            spoilt.append((int(face), tri))
    counts = context.each_rung(lambda rung: sum(not _refused(tri, face, rung, context) for face, tri in spoilt))
    rays = rays_of(np.zeros(3), directions(rng, 50))
    poisoned = sum(_poisoned(tri, rays) for _, tri in spoilt)
    return Outcome(len(spoilt), counts, poisoned, "meshes, not rays; naive: bounds by min and max of all corners")


def _refused(tri: Triangles, face: int, rung: str, context: Context) -> bool:
    """Whether the error names the face that is bad."""
    try:
        RayCaster(tri, precision=rung, device=context.device)
    except ClrtError as error:
        return re.search(rf"(face|triangle) {face}\b", str(error)) is not None
    return False


def _poisoned(tri: Triangles, rays: Rays) -> bool:
    """Whether the mesh's box, made naively, is missed by rays from its middle."""
    lo: NDArray[np.floating] = np.minimum.reduce(tri.reshape(-1, 3))
    hi: NDArray[np.floating] = np.maximum.reduce(tri.reshape(-1, 3))
    with np.errstate(all="ignore"):
        t0, t1 = (lo - rays.origins) / rays.directions, (hi - rays.origins) / rays.directions
        enters = np.minimum(t0, t1).max(axis=1) <= np.maximum(t0, t1).min(axis=1)
        center = (lo + hi) / 2
    return bool(not enters.all() or not np.isfinite(center).all())
