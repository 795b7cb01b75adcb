"""Hard cases 1 to 9 and 14 to 17: corners and edges of closed meshes, needles, slivers, planes that coincide or lie edge-on."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from clrt.verify import naive
from clrt.verify.case import Context, Outcome, case
from clrt.verify.judge import Truth, against, disagreements, far_off, leaks, plus, truth, unusable
from clrt.verify.naive import Ints, MoellerTrumbore, Predicate
from clrt.verify.rays import (
    Random,
    Rays,
    Triangles,
    at_edges,
    at_vertices,
    closed_sphere,
    directions,
    inside,
    joined,
    on_edges,
    on_faces,
    quad,
    rays_of,
    toward,
    whole_frame,
)

FAR = (148_376.0, 1_234.0, -223_423.0)
TRIANGLES = 500  #: of closed spheres: few enough for the oracle to take a tenth of the rays
_NAIVE_RAYS = 2_000  #: enough for every naive variant to fail


def _judged(context: Context) -> int:
    """Rays that the oracle takes: all of a long run's, or what a second allows."""
    return context.share(1.0 if context.full else 0.1)


def _naive_misses(tri: Triangles, rays: Rays, expected: Truth, predicate: Predicate = naive.TEXTBOOK) -> int:
    """True hits that the naive variant loses."""
    some = slice(0, None, -(-rays.size // _NAIVE_RAYS))
    found = naive.brute_force(tri, rays.take(some), predicate)[0]
    return int(np.count_nonzero((found < 0) & (expected.prim_id[some] >= 0)))


def _closed(context: Context, key: Hashable, tri: Triangles, rays: Rays) -> tuple[dict[str, int | None], int, Rays, Truth]:
    """Rays inside a closed mesh: leaks of all of them, the oracle on a part. Returns counts, naive misses, the part and its truth."""
    some = rays.take(slice(0, None, max(1, rays.size // _judged(context))))
    expected = truth(tri, some)
    rest = rays.take(np.arange(rays.size) % max(1, rays.size // _judged(context)) > 0)
    counts = plus(against(context, key, tri, some, expected), leaks(context, key, tri, rest))
    return counts, _naive_misses(tri, some, expected), some, expected


@case(1, "vertex-aimed rays, closed sphere", provokes="pole and fan leaks", oracle="E")
def vertex_aimed(context: Context) -> Outcome:
    """Half with float64 directions, which pass through the corner exactly."""
    rng, tri = context.rng(1), closed_sphere(TRIANGLES)
    rounded, exact = np.array_split(inside(rng, context.rays, tri), 2)
    rays = joined(at_vertices(rng, rounded, tri), at_vertices(rng, exact, tri, np.float64))
    counts, missed, _, _ = _closed(context, "sphere", tri, rays)
    return Outcome(rays.size, counts, missed)


@case(2, "edge-aimed rays, closed sphere", provokes="contraction leak", oracle="E")
def edge_aimed(context: Context) -> Outcome:
    rng, tri = context.rng(2), closed_sphere(TRIANGLES)
    rays = at_edges(rng, inside(rng, context.rays, tri), tri)
    counts, missed, _, _ = _closed(context, "sphere", tri, rays)
    return Outcome(rays.size, counts, missed)


@case(3, "vertex- and edge-aimed rays at offset (148376, 1234, -223423)", provokes="cancellation", oracle="E")
def far_sphere(context: Context) -> Outcome:
    rng, tri = context.rng(3), closed_sphere(TRIANGLES, FAR, 30.0)
    vertex, edge = np.array_split(inside(rng, context.rays, tri), 2)
    rays = joined(at_vertices(rng, vertex, tri), at_edges(rng, edge, tri))
    counts, missed, _, _ = _closed(context, "far sphere", tri, rays)
    return Outcome(rays.size, counts, missed)


@case(4, "edge-aimed rays at offset 1e6, float32 and float64", provokes="coordinate quantisation", oracle="E")
def quantised_sphere(context: Context) -> Outcome:
    """A unit sphere 32 float32 steps wide; the second half has float64 corners and rays, which float32 cannot tell apart."""
    rng, counts, missed, size = context.rng(4), [], 0, 0
    for dtype in (np.float32, np.float64):
        tri = closed_sphere(TRIANGLES, (1e6, 1e6, -1e6), dtype=dtype)
        rays = at_edges(rng, inside(rng, context.rays // 2, tri), tri, dtype)
        found, lost, _, _ = _closed(context, ("quantised", np.dtype(dtype).name), tri, rays)
        counts.append(found)
        missed, size = missed + lost, size + rays.size
    return Outcome(size, plus(*counts), missed)


@case(5, "random rays from inside a closed mesh", provokes="baseline leak", oracle="S")
def from_inside(context: Context) -> Outcome:
    """All must hit. The sphere is small, so that the determinants of its triangles lie around the textbook's epsilon of 1e-6."""
    rng, tri = context.rng(5), closed_sphere(2_000, radius=2.0**-7)
    rays = rays_of(inside(rng, context.rays, tri), directions(rng, context.rays))
    some = rays.take(slice(0, _NAIVE_RAYS // 4))
    lost = naive.brute_force(tri, some, MoellerTrumbore(epsilon=1e-6))[0] < 0
    return Outcome(rays.size, leaks(context, "small sphere", tri, rays), int(lost.sum()), "naive: determinants below 1e-6 are parallel")


def needles(rng: Random, count: int) -> Triangles:
    """A strip of needles side by side, 1 long and about 2^-20 wide, turned by a whole rotation so that nothing is axis-parallel."""
    edge = np.arange(count + 1) * 2.0**-20
    low = np.stack([edge, np.zeros(count + 1), edge / 3], axis=1)
    high = low + np.array([0.0, 1.0, 0.25])
    strip = np.concatenate([np.stack([low[:-1], low[1:], high[1:]], axis=1), np.stack([low[:-1], high[1:], high[:-1]], axis=1)])
    turn = np.array([[2.0, -2.0, 1.0], [1.0, 2.0, 2.0], [2.0, 1.0, -2.0]]) / 3.0
    return np.asarray((rng.permutation(strip) @ turn.T).astype(np.float32))


@case(7, "needle triangles 1e6:1", provokes="determinant underflow", oracle="E")
def needle_strip(context: Context) -> Outcome:
    rng = context.rng(7)
    tri, count = needles(rng, 64), _judged(context)
    origins = np.asarray(rng.normal(size=(count, 3)) * 0.3 + np.array([0.0, 0.5, 2.0]), np.float32)
    edge, face = np.array_split(origins, 2)
    rays = joined(toward(edge, on_edges(rng, len(edge), tri)), toward(face, on_faces(rng, len(face), tri)))
    expected = truth(tri, rays)
    missed = _naive_misses(tri, rays, expected, MoellerTrumbore(epsilon=1e-6))
    return Outcome(rays.size, against(context, "needles", tri, rays, expected), missed)


def _before_wall(tri: Triangles) -> Triangles:
    """The triangles, and last two of a wall at z = 64 that catches whatever passes them."""
    return np.concatenate([tri, quad((0, 0, 64), (4096, 0, 0), (0, 4096, 0)).astype(tri.dtype)])


@case(9, "collinear, zero-area triangles", provokes="0/0", oracle="E")
def collinear(context: Context) -> Outcome:
    """Three whole corners on a line, aimed at along that line's points: the wall behind is what is hit."""
    rng, count = context.rng(9), _judged(context)
    start, step = rng.integers(-8, 8, (100, 3)), rng.integers(-4, 5, (100, 3))
    step[(step == 0).all(axis=1)] = 1
    tri = np.stack([start, start + step, start + step * rng.integers(2, 5, (100, 1))], axis=1).astype(np.float32)
    tri = tri[:, [0, 2, 1]]
    origins = rng.integers(-16, 17, (count, 3)).astype(np.float64) - np.array([0, 0, 64])
    which = rng.integers(0, len(tri), count)
    rays = toward(origins, tri[which, rng.integers(0, 3, count)])
    walled = _before_wall(tri)
    expected = truth(walled, rays)
    found = naive.brute_force(walled, rays.take(slice(0, _NAIVE_RAYS)), MoellerTrumbore(nan_hits=True))[0]

    def count_wrong(rung: str) -> int:
        hits = context.caster("collinear", walled, rung).first_hit(rays.origins, rays.directions)
        touched = (hits["prim_id"] >= 0) & (hits["prim_id"] < len(tri))
        return int(np.count_nonzero(disagreements(rung, hits, expected) | touched))

    return Outcome(count, context.each_rung(count_wrong), int(np.count_nonzero((found >= 0) & (found < len(tri)))))


def _overlapping(rng: Random, count: int) -> Triangles:
    """Triangles with whole corners in one tilted plane, each twice: a ray meets many of them at exactly one t."""
    s, u, _ = whole_frame(rng)
    places = rng.integers(-6, 7, (count, 3, 2)).astype(np.float64)
    tri = places[..., :1] * s + places[..., 1:] * u
    return np.asarray(np.concatenate([tri, tri])[rng.permutation(2 * count)].astype(np.float32))


@case(14, "coplanar duplicates", provokes="unstable winner", oracle="E")
def coplanar(context: Context) -> Outcome:
    """`exact`: the lowest id of those at equal t. Every rung: the same answer, to the last bit, in a second run."""
    rng, count = context.rng(14), _judged(context)
    tri = _overlapping(rng, 40)
    origins = np.asarray(rng.uniform(-100, 100, (count, 3)), np.float32)
    rays = toward(origins, on_faces(rng, count, tri))
    expected = truth(tri, rays)

    def count_wrong(rung: str) -> int:
        caster = context.caster("coplanar", tri, rung)
        first, second = (caster.first_hit(rays.origins, rays.directions) for _ in range(2))
        return int(np.count_nonzero(disagreements(rung, first, expected) | (first != second)))

    some = slice(0, _NAIVE_RAYS)
    found = naive.brute_force(tri, rays.take(some), last_wins=True)[0]
    return Outcome(count, context.each_rung(count_wrong), _other(found, expected, some), "naive: the last of equal t wins")


def _other(found: Ints, expected: Truth, some: slice) -> int:
    return int(np.count_nonzero(found != expected.prim_id[some]))


@case(15, "two planes 1 ulp apart", provokes="depth order", oracle="E")
def close_planes(context: Context) -> Outcome:
    """Sheets at z = 1 and the next float32, ids in any order, seen from both sides; only `exact` promises which is in front."""
    rng, count = context.rng(15), _judged(context)
    z = [np.float32(1), np.nextafter(np.float32(1), np.float32(2))]
    sheets = [quad((x, y, height), (0.5, 0, 0), (0, 0.5, 0)) for height in z for x in range(-4, 5) for y in range(-4, 5)]
    tri = rng.permutation(np.concatenate(sheets)).astype(np.float32)
    origins = np.asarray(rng.uniform(-3, 3, (count, 3)) * np.array([1, 1, 0]) + [0, 0, 1] + rng.choice([-5, 5], (count, 1)) * [0, 0, 1])
    rays = toward(origins, on_faces(rng, count, tri))
    expected = truth(tri, rays)
    some = slice(0, _NAIVE_RAYS)
    found = naive.brute_force(tri, rays.take(some))[0]
    return Outcome(count, against(context, "planes", tri, rays, expected), _other(found, expected, some))


@case(16, "ray in the triangle's plane", provokes="det = 0", oracle="E")
def in_plane(context: Context) -> Outcome:
    """Whole corners, origins and directions in one tilted plane: no hit, and no number that is not one."""
    rng = context.rng(16)
    planes, per_plane = 6, max(8, _judged(context) // 6)
    parts, triangles = [], []
    for _ in range(planes):
        s, u, n = whole_frame(rng)
        shift = n * rng.integers(-2, 3)
        corners = rng.integers(-8, 9, (4, 3, 2))
        triangles.append(corners[..., :1] * s + corners[..., 1:] * u + shift)
        start, along = rng.integers(-40, 41, (per_plane, 2)), rng.integers(-9, 10, (per_plane, 2))
        along[(along == 0).all(axis=1)] = 1
        parts.append(rays_of(start[:, :1] * s + start[:, 1:] * u + shift, along[:, :1] * s + along[:, 1:] * u))
    wrong, missed = [], 0
    for number, (plane, rays) in enumerate(zip(triangles, parts, strict=True)):
        tri = plane.astype(np.float32)
        wrong.append(_touching(context, ("in plane", number), tri, rays))
        missed += int(np.count_nonzero(naive.brute_force(tri, rays, MoellerTrumbore(nan_hits=True))[0] >= 0))
    return Outcome(planes * per_plane, plus(*wrong), missed, "naive: NaN passes its comparisons")


def _touching(context: Context, key: Hashable, tri: Triangles, rays: Rays) -> dict[str, int | None]:
    """Rays that are said to hit something, where nothing is to be hit."""

    def count(rung: str) -> int:
        hits = context.caster(key, tri, rung).first_hit(rays.origins, rays.directions)
        return int(np.count_nonzero((hits["prim_id"] >= 0) | unusable(hits)))

    return context.each_rung(count)


@case(17, "grazing rays, 1e-6 rad", provokes="error in t", oracle="E")
def grazing(context: Context) -> Outcome:
    """t within 4 ulp of the exact one, wherever the triangle is the same; `exact` reports the right triangle, too."""
    rng, count = context.rng(17), _judged(context)
    s, u, n = whole_frame(rng)
    places = np.stack(np.meshgrid(np.arange(-4, 5), np.arange(-4, 5)), axis=-1).reshape(-1, 2).astype(np.float64)
    tri = np.concatenate([quad(x * s + y * u, s / 2, u / 2) for x, y in places]).astype(np.float32)
    targets = on_faces(rng, count, tri)
    along = rng.normal(size=(count, 2)) @ np.stack([s, u])
    along *= 20 / np.linalg.norm(along, axis=1, keepdims=True)
    rise = 20e-6 * n / np.linalg.norm(n)
    rays = rays_of(targets - along - rise, along + rise)
    expected = truth(tri, rays)

    def wrong(rung: str) -> int:
        hits = context.caster("grazing", tri, rung).first_hit(rays.origins, rays.directions)
        same = (hits["prim_id"] == expected.prim_id) & (expected.prim_id >= 0)
        off = same & far_off(hits["t"], np.where(same, expected.t, 0.0))
        return int(np.count_nonzero(off | disagreements(rung, hits, expected)))

    some = slice(0, _NAIVE_RAYS)
    found, t = naive.brute_force(tri, rays.take(some))
    same = (found == expected.prim_id[some]) & (found >= 0)
    missed = same & far_off(t.astype(np.float64), np.where(same, expected.t[some], 0.0))
    return Outcome(count, context.each_rung(wrong), int(missed.sum()))
