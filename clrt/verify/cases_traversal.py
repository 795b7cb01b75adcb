"""Hard cases 8 and 18 to 28: what a kd-tree loses. The oracle is all triangles with the same predicate: the tree `brute`, one leaf."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
from numpy.typing import NDArray

from clrt.generate import soup
from clrt.kdtree import LEAF, KdTree, default_max_depth
from clrt.verify import naive, naive_tree
from clrt.verify.case import Context, Outcome, case
from clrt.verify.judge import Truth, lost_in_tree, plus, truth, unusable
from clrt.verify.naive_tree import Habits
from clrt.verify.rays import Array, Random, Rays, Triangles, directions, joined, lattice, on_faces, quad, rays_of, toward

TREES = ("sah", "median")
_NAIVE_RAYS = 4_000
_ORACLE_RAYS = 2_000  #: that `exact` is held against rational arithmetic with, too; a long run takes a hundred times as many


def _against_brute_force(context: Context, key: Hashable, tri: Triangles, rays: Rays) -> dict[str, int | None]:
    """Rays whose hit a tree has lost, for every rung and both builders; of `exact` also those that rational arithmetic denies."""
    some = rays.take(slice(0, None, -(-rays.size // (100 * _ORACLE_RAYS if context.full else _ORACLE_RAYS))))
    expected = truth(tri, some)

    def count(rung: str) -> int:
        everything = _truth_of(context.caster(key, tri, rung, "brute").first_hit(*rays))
        lost = 0
        for tree in TREES:
            hits = context.caster(key, tri, rung, tree).first_hit(*rays)
            lost += lost_in_tree(tri, rays, _truth_of(hits), everything, rung == "exact") + int(unusable(hits).sum())
        if rung == "exact":
            lost += int(np.count_nonzero(context.caster(key, tri, rung).first_hit(*some)["prim_id"] != expected.prim_id))
        return lost

    return context.each_rung(count)


def _truth_of(hits: NDArray[np.void]) -> Truth:
    return Truth(hits["prim_id"], hits["t"])


def _naive_losses(tri: Triangles, rays: Rays, tree: KdTree, habits: Habits | None = None) -> int:
    """Rays on which the naive tree or traversal finds nothing, or something farther than all triangles do."""
    some = rays.take(slice(0, None, max(1, -(-rays.size // _NAIVE_RAYS))))
    return int(np.count_nonzero(naive.brute_force(tri, some)[1] < naive_tree.walk(tree, tri, some, habits).t))


def _sheets() -> Triangles:
    """Three whole-numbered sheets, one across each axis, centered at zero: split planes fall on whole numbers."""
    y, x = np.mgrid[-4:5, -4:5]
    sheet = lattice(8, ((x * x + 2 * x * y + 3 * y * y) % 5 - 2).astype(np.float64))
    return np.concatenate([np.roll(sheet, axis, axis=-1) for axis in range(3)])


def _planes(context: Context, key: Hashable, tri: Triangles) -> NDArray[np.floating]:
    """(k, 2): axis and position of the split planes of both trees, over the mesh as given (its middle is zero)."""
    rows = []
    for builder in TREES:
        (tree,) = context.caster(key, tri, context.rungs[0], builder).trees
        rows.append(_planes_of(tree))
    return np.concatenate(rows)


def _planes_of(tree: KdTree) -> NDArray[np.floating]:
    inner = tree.split_axis != LEAF
    return np.stack([tree.split_axis[inner].astype(np.float64), tree.split_pos[inner].astype(np.float64)], axis=1)


def _on_planes(rng: Random, planes: NDArray[np.floating], points: Array) -> tuple[Array, NDArray[np.int64]]:
    """Points (m, 3) moved into random planes, and the planes' axes (m,)."""
    chosen = planes[rng.integers(0, len(planes), len(points))]
    axis, moved = chosen[:, 0].astype(np.int64), points.copy()
    moved[np.arange(len(points)), axis] = chosen[:, 1]
    return moved, axis


@case(8, "axis-aligned needles in the tree", provokes="zero-area clip dropped", oracle="B")
def needles(context: Context) -> Outcome:
    """Needles 1 long and 2^-18 wide along an axis, aimed at near their tips, where a clipped piece is narrower than a float32 step."""
    rng, count = context.rng(8), context.share(0.5)
    base, axis = 1 + rng.random((300, 3)), rng.integers(0, 3, 300)
    along, across = np.eye(3)[axis] * 0.75, np.eye(3)[(axis + 1) % 3] * 2.0**-18
    tri = np.stack([base, base + along, base + along + across], axis=1).astype(np.float32)
    which = rng.integers(0, len(tri), count)
    weights = rng.random((count, 1)) ** 3
    tip, end = tri[which, 0].astype(np.float64), (tri[which, 1].astype(np.float64) + tri[which, 2]) / 2
    rays = toward(np.asarray(rng.uniform(-2, 5, (count, 3)), np.float32), tip + (end - tip) * weights)
    tree = naive_tree.build(tri, 12, naive_tree.by_clipped_area)
    return Outcome(count, _against_brute_force(context, "axis needles", tri, rays), _naive_losses(tri, rays, tree))


@case(18, "directions with +0 and -0 components", provokes="0 * inf", oracle="B")
def signed_zeros(context: Context) -> Outcome:
    rng, tri = context.rng(18), _sheets()
    along = rng.choice([-1.0, -0.0, 0.0, 1.0, 0.5], (context.rays, 3), p=[0.2, 0.3, 0.3, 0.1, 0.1])
    along[(along == 0).all(axis=1), 0] = 1
    start = rng.integers(-10, 11, (context.rays, 3)) / 2.0
    rays = rays_of(start - 8 * along, along)
    return Outcome(rays.size, _against_brute_force(context, "sheets", tri, rays), _naive_losses(tri, rays, naive_tree.build(tri, 10)))


@case(19, "ray that lies in a split plane", provokes="NaN split distance", oracle="B")
def in_split_plane(context: Context) -> Outcome:
    rng, tri = context.rng(19), _sheets()
    tree = naive_tree.build(tri, 10)
    planes = np.concatenate([_planes(context, "sheets", tri), _planes_of(tree)])
    target, axis = _on_planes(rng, planes, on_faces(rng, context.rays, tri))
    along = directions(rng, context.rays)
    along[np.arange(context.rays), axis] = rng.choice([0.0, -0.0], context.rays)
    rays = rays_of(target - 6 * along, along)
    return Outcome(rays.size, _against_brute_force(context, "sheets", tri, rays), _naive_losses(tri, rays, tree))


@case(20, "origin on a split plane", provokes="wrong child", oracle="B")
def origin_on_plane(context: Context) -> Outcome:
    rng, tri = context.rng(20), _sheets()
    tree = naive_tree.build(tri, 10)
    planes = np.concatenate([_planes(context, "sheets", tri), _planes_of(tree)])
    start, _ = _on_planes(rng, planes, rng.uniform(-4, 4, (context.rays, 3)))
    rays = rays_of(start, directions(rng, context.rays))
    lost = _naive_losses(tri, rays, tree, Habits(near_by_origin=True))
    return Outcome(rays.size, _against_brute_force(context, "sheets", tri, rays), lost, "naive: the origin's side is the near one")


@case(21, "triangle flat in a split plane", provokes="reference lost", oracle="B")
def flat_in_plane(context: Context) -> Outcome:
    """Quads in whole-numbered planes across all axes: whatever plane is taken, some of them lie in it."""
    rng, quads = context.rng(21), []
    for place in rng.integers(-5, 6, (100, 3)):
        normal = int(rng.integers(0, 3))
        quads.append(quad(place, np.eye(3)[(normal + 1) % 3], np.eye(3)[(normal + 2) % 3]))
    tri = np.concatenate(quads).astype(np.float32)
    rays = toward(np.asarray(rng.uniform(-9, 9, (context.rays, 3)), np.float32), on_faces(rng, context.rays, tri))
    lost = _naive_losses(tri, rays, naive_tree.build(tri, 10, naive_tree.strictly))
    return Outcome(rays.size, _against_brute_force(context, "flat", tri, rays), lost, "naive: strictly below or strictly above")


@case(22, "ray through the crossing of two split planes", provokes="sliver cell skipped", oracle="B")
def through_crossing(context: Context) -> Outcome:
    """Every fourth square of a flat sheet: at a corner only one of four cells has anything, and rays pass through that corner exactly."""
    rng = context.rng(22)
    sheet = lattice(16)
    low = sheet.min(axis=1)
    tri = sheet[(low[:, 0] % 2 == 0) & (low[:, 1] % 2 == 0)]
    corners = tri.reshape(-1, 3)[rng.integers(0, 3 * len(tri), context.rays)]
    steps = rng.integers(-60, 61, (context.rays, 3))
    steps[:, 2] = rng.integers(1, 61, context.rays)
    rays = toward(corners + steps, corners)
    return Outcome(rays.size, _against_brute_force(context, "squares", tri, rays), _naive_losses(tri, rays, naive_tree.build(tri, 12)))


def _mixed(rng: Random) -> Triangles:
    """A few large triangles and axis-parallel quads through a soup of small triangles."""
    vertices, faces = soup(300, seed=1)
    large = rng.uniform(-1, 1, (12, 3, 3))
    flat = [quad(rng.uniform(-0.8, 0.8, 3), np.eye(3)[a - 1] * 0.2, np.eye(3)[a - 2] * 0.2) for a in rng.integers(0, 3, 60)]
    return np.concatenate([vertices[faces], large, *flat]).astype(np.float32)


@case(23, "hit found beyond the current cell", provokes="premature accept or reject", oracle="B")
def beyond_cell(context: Context) -> Outcome:
    """Half of the rays run along an axis, where entry and exit of cells round to the same number as the hit."""
    rng = context.rng(23)
    tri = _mixed(rng)
    half = context.rays // 2
    free, parallel = directions(rng, context.rays - half), np.eye(3)[rng.integers(0, 3, half)]
    target = on_faces(rng, context.rays, tri)
    along = np.concatenate([free, parallel])
    rays = rays_of(target - 3 * along, along)
    tree = naive_tree.build(tri, 12, naive_tree.flat_below)
    early = _naive_losses(tri, rays, tree, Habits(stop_at_hit=True))
    rejected = _naive_losses(tri, rays, tree, Habits(inside_cell=True))
    counts = _against_brute_force(context, "mixed", tri, rays)
    return Outcome(rays.size, counts, min(early, rejected), f"naive: {early:,} accepted too early, {rejected:,} rejected as beyond")


def _single_quad(context: Context, number: int, offset: float, pad: float) -> Outcome:
    """One quad across each axis in turn: rays at its inside hit, rays beside it miss. Naive: the box's slab, padded by `pad`."""
    rng, per_axis = context.rng(number), context.rays // 3
    wrong, lost, total = [], 0, 0
    for axis in range(3):
        side, up = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
        center = offset * np.array([1.0, -1.0, 1.0])
        tri = quad(center, side, up).astype(np.float32)
        place = rng.uniform(-1, 1, (per_axis, 2))
        outside = rng.random(per_axis) < 0.25
        place = np.where(outside[:, None], np.sign(place) * 1.01 + place, place * 0.99)
        target = center + place[:, :1] * side + place[:, 1:] * up
        start = target + 4 * directions(rng, per_axis) + 2 * np.eye(3)[axis] * rng.choice([-3, 3], (per_axis, 1))
        rays = toward(start, target, np.float64)
        wrong.append(_not_as_aimed(context, ("quad", offset, axis), tri, rays, ~outside))
        lost += int(np.count_nonzero(_slab_missed(tri, rays, pad) & ~outside))
        total += per_axis
    return Outcome(total, plus(*wrong), lost)


def _not_as_aimed(context: Context, key: Hashable, tri: Triangles, rays: Rays, hit: NDArray[np.bool_]) -> dict[str, int | None]:
    def count(rung: str) -> int:
        hits = context.caster(key, tri, rung).first_hit(*rays)
        return int(np.count_nonzero(((hits["prim_id"] >= 0) != hit) | unusable(hits)))

    return context.each_rung(count)


def _slab_missed(tri: Triangles, rays: Rays, pad: float) -> NDArray[np.bool_]:
    """Rays that the box test of a textbook rejects: in float32, and a ray must be in the box for some time."""
    start, along = (x.astype(np.float32) for x in rays)
    lo, hi = tri.min(axis=(0, 1)) - np.float32(pad), tri.max(axis=(0, 1)) + np.float32(pad)
    with np.errstate(all="ignore"):
        t0, t1 = (lo - start) / along, (hi - start) / along
        return np.asarray(~(np.minimum(t0, t1).max(axis=1) < np.maximum(t0, t1).min(axis=1)))


@case(24, "flat scene, one quad", provokes="empty root slab", oracle="S")
def flat_scene(context: Context) -> Outcome:
    return _single_quad(context, 24, 0.0, 0.0)


@case(25, "one quad at 1e6", provokes="padding rounds away", oracle="S")
def far_flat_scene(context: Context) -> Outcome:
    return _single_quad(context, 25, 1e6, 1e-4)


@case(26, "ray nearly parallel to split planes", provokes="overflow", oracle="B")
def nearly_parallel(context: Context) -> Outcome:
    """One or two components down to 1e-44 (float32), some of them in a plane: 1/d overflows, and 0 * inf follows."""
    rng, tri = context.rng(26), _sheets()
    tree = naive_tree.build(tri, 10)
    planes = np.concatenate([_planes(context, "sheets", tri), _planes_of(tree)])
    along = directions(rng, context.rays)
    tiny = rng.permuted(np.tile([True, True, False], (context.rays, 1)), axis=1) & (rng.random((context.rays, 3)) < 0.8)
    along = np.where(tiny, np.sign(along) * 10.0 ** rng.uniform(-44, -6, (context.rays, 3)), along)
    start = on_faces(rng, context.rays, tri) - 6 * along
    inside, _ = _on_planes(rng, planes, start)
    rays = rays_of(np.where(rng.random((context.rays, 1)) < 0.5, inside, start), along)
    return Outcome(rays.size, _against_brute_force(context, "sheets", tri, rays), _naive_losses(tri, rays, tree))


@case(27, "triangles that span all leaves", provokes="tested again and again", oracle="B")
def spanning(context: Context) -> Outcome:
    """Sheets from corner to corner of the box, in a soup: a ray costs no more triangle tests than all triangles are, on average."""
    rng, count = context.rng(27), context.share(0.5)
    vertices, faces = soup(100, seed=2)
    large = np.concatenate([quad((0, 0, 0), (1, 0, z), (0, 1, 1 - abs(z))) for z in np.linspace(-0.99, 0.99, 40)])
    tri = np.concatenate([vertices[faces], large]).astype(np.float32)
    rays = rays_of(rng.uniform(-1, 1, (count, 3)) - np.array([0, 0, 3.0]), rng.uniform(-0.3, 0.3, (count, 3)) + np.array([0, 0, 1.0]))
    counts = _against_brute_force(context, "spanning", tri, rays)
    some = rays.take(slice(0, 500))
    centered, moved = tri - _middle(tri), Rays(some.origins - _middle(tri), some.directions)

    def too_many(rung: str) -> int:
        (tree,) = context.caster("spanning", tri, rung).trees
        return int(naive_tree.walk(tree, centered, moved).tests.mean() > len(tri))

    tests = naive_tree.walk(naive_tree.build(tri, 14, middle=True), tri, some).tests
    return Outcome(count, plus(counts, context.each_rung(too_many)), int(np.count_nonzero(tests > len(tri))), "naive: halves cells")


def _middle(tri: Triangles) -> Array:
    return np.asarray((tri.min(axis=(0, 1)).astype(np.float64) + tri.max(axis=(0, 1))) / 2)


@case(28, "tree at its depth limit", provokes="stack overflow", oracle="B")
def depth_limit(context: Context) -> Outcome:
    """Smaller and smaller clusters toward a corner: every octave asks for splits of its own. Fails where no tree reaches the limit."""
    rng = context.rng(28)
    count, octaves = context.share(0.2), 24
    scale = 2.0 ** -np.arange(octaves)[:, None, None, None]
    cluster = 0.6 + 0.1 * rng.uniform(-1, 1, (octaves, 12, 1, 3)) + 0.05 * rng.uniform(-1, 1, (octaves, 12, 3, 3))
    tri = (cluster * scale).reshape(-1, 3, 3).astype(np.float32)
    target = on_faces(rng, count, tri)
    span = np.abs(target).max(axis=1, keepdims=True)
    half = count // 2
    near = toward((target + 2 * span * directions(rng, count))[:half], target[:half])
    rays = joined(near, toward(np.full((count - half, 3), -1.0), target[half:]))
    counts = _against_brute_force(context, "octaves", tri, rays)
    shallow = context.each_rung(lambda rung: int(_deepest(context, "octaves", tri, rung) < default_max_depth(len(tri))))
    lost = _naive_losses(tri, rays, naive_tree.build(tri, 60), Habits(stack=8))
    return Outcome(rays.size, plus(counts, shallow), lost, "naive: a stack of 8, a tree of any depth")


def _deepest(context: Context, key: Hashable, tri: Triangles, rung: str) -> int:
    return max(tree.depth for builder in TREES for tree in context.caster(key, tri, rung, builder).trees)
