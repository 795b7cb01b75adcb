"""Cases 39 to 42: spheres, by the kernels' own sphere_trace on arrays of rays, against extended precision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import clrt.reference
from clrt.precision import rung as rung_named
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene
from clrt.verify import pictures, probe
from clrt.verify.case import ALL, Context, Outcome, case

FloatArray = NDArray[np.float64]
Wide = np.longdouble
FIRM = 2e-5  #: margin of the reference above which a pixel's decisions are certain

_KERNEL = """
kernel void probe_spheres(global const real *origin, global const real *direction, global const Sphere *spheres, global const int *skip,
                          global real *t, global int *slot) {
    Geometry geometry;
    geometry.slot_count = 0;
    geometry.spheres = spheres + get_global_id(0);
    geometry.sphere_count = 1;
    Rays rays;
    real lane[LANES];
    lane_int number[LANES];
    const size_t first = get_global_id(0) * LANES;
    for (int a = 0; a < 3; a++) {
        for (int k = 0; k < LANES; k++) lane[k] = origin[3 * (first + k) + a];
        rays.origin[a] = load_lanes(lane);
        for (int k = 0; k < LANES; k++) lane[k] = direction[3 * (first + k) + a];
        rays.direction[a] = load_lanes(lane);
    }
    for (int k = 0; k < LANES; k++) number[k] = skip[first + k];
    rays.skip = load_lanes(number);
    rays.t_min = (real_n)0;
    rays.active = ALL_LANES;
    rays_prepare(&rays, R(0.0));
    Hits hits;
    hits.t = (real_n)INFINITY;
    hits.slot = (mask_n)-1;
    sphere_trace(&geometry, &rays, 0, &hits);
    store_lanes(hits.t, lane);
    store_lanes(hits.slot, number);
    for (int k = 0; k < LANES; k++) {
        t[first + k] = lane[k];
        slot[first + k] = (int)number[k];
    }
}
"""


@dataclass(frozen=True, eq=False)
class Balls:
    """n rays, each against a sphere of its packet: center (p, 3) and radius (p,) of p packets of `lanes` rays, in the numbers as given.

    origin, direction : (p, lanes, 3) of the rung's number type
    own : the rays start on their sphere
    """

    center: FloatArray
    radius: FloatArray
    origin: NDArray[np.floating]
    direction: NDArray[np.floating]
    own: bool = False

    def trace(self, context: Context, rung: str) -> FloatArray:
        """(p, lanes) t by the kernel; inf for a miss."""
        real = rung_named(rung).real
        t, slot = np.zeros(self.origin.shape[:2], real), np.zeros(self.origin.shape[:2], np.int32)
        skip = np.full(t.shape, 0 if self.own else -1, np.int32)
        records = probe.sphere_records(self.center, self.radius, real)
        arrays = [self.origin.astype(real), self.direction.astype(real), records, skip, t, slot]
        probe.run(_KERNEL, "probe_spheres", len(t), arrays, device=context.device, precision=rung, effects=("spheres",))
        return np.where(slot == 0, t.astype(np.float64), np.inf)

    def truth(self) -> tuple[NDArray[np.longdouble], NDArray[np.longdouble], NDArray[np.longdouble]]:
        """(p, lanes) each: the smaller and the larger root (NaN where there is none), and the distance of the line from the center."""
        d, radius = self.direction.astype(Wide), self.radius.astype(Wide)[:, None]
        f = self.origin.astype(Wide) - self.center.astype(Wide)[:, None]
        square = (d * d).sum(-1)
        b = -(f * d).sum(-1) / square
        near = f + b[..., None] * d
        away = np.sqrt((near * near).sum(-1))
        with np.errstate(invalid="ignore"):
            root = np.sqrt((radius - away) * (radius + away) / square)
        return b - root, b + root, away

    def naive(self) -> FloatArray:
        """(p, lanes) t by the textbook in float32: b^2 - 4 a c."""
        d = self.direction.astype(np.float32)
        f = self.origin.astype(np.float32) - self.center.astype(np.float32)[:, None]
        a, b = (d * d).sum(-1), 2 * (f * d).sum(-1)
        c = (f * f).sum(-1) - self.radius.astype(np.float32)[:, None] ** 2
        with np.errstate(invalid="ignore"):
            root = np.sqrt(b * b - 4 * a * c)
            first, second = (-b - root) / (2 * a), (-b + root) / (2 * a)
            t = np.where(first > 0, first, np.where(second > 0, second, np.inf))
        return t.astype(np.float64)


def _wrong(balls: Balls, t: FloatArray, unit: float) -> tuple[int, int]:
    """Disagreements of t with the truth in roundings of `unit`, and the rays left out as nearer than 4 ulp (8 units) to a tangent.

    With |f| the distance to the center, the line's distance from it is known to 8 unit |f|: what that leaves of the root is
    allowed, and 4 ulp.
    """
    first, second, away = balls.truth()
    reach = np.linalg.norm(balls.origin.astype(np.float64) - balls.center[:, None], axis=-1)
    radius = balls.radius[:, None]
    band = np.abs(away - radius) < 8 * unit * reach
    expected = np.where(first > 0, first, second)
    meets = (away <= radius) & (expected > 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        half = np.sqrt(np.maximum((radius - away) * (radius + away), 0))
        allowed = 8 * unit * (np.abs(expected) + reach * away / half)
        far = ~(np.abs(t - expected) <= allowed)
    return int(np.count_nonzero(~band & ((np.isfinite(t) != meets) | (meets & far)))), int(np.count_nonzero(band))


def _packets(context: Context, rung: str, part: float) -> tuple[int, int]:
    lanes = probe.lanes_of(context.device, rung)
    return max(1, context.share(part) // lanes), lanes


def _unit_rows(v: FloatArray) -> FloatArray:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _aimed(context: Context, rung: str, number: int, distances: tuple[float, ...], spread: tuple[float, float]) -> Balls:
    """Rays from `distances` radii away, past the center at `spread` radii."""
    rng = context.rng(number)
    packets, lanes = _packets(context, rung, 0.5)
    real = rung_named(rung).real
    radius = np.exp(rng.uniform(-3, 3, packets)).astype(real).astype(np.float64)
    center = (rng.normal(size=(packets, 3)) * radius[:, None]).astype(real).astype(np.float64)
    far = rng.choice(distances, (packets, lanes, 1)) * radius[:, None, None]
    towards = _unit_rows(rng.normal(size=(packets, lanes, 3)))
    side = _unit_rows(np.cross(towards, rng.normal(size=(packets, lanes, 3))))
    origin = (center[:, None] - far * towards).astype(real)
    target = center[:, None] + side * (rng.uniform(*spread, (packets, lanes, 1)) * radius[:, None, None])
    return Balls(center, radius, origin, _unit_rows(target - origin).astype(real))


def _judge(context: Context, number: int, distances: tuple[float, ...], spread: tuple[float, float]) -> Outcome:
    left_out = 0

    def wrong(rung: str) -> int:
        nonlocal left_out
        balls = _aimed(context, rung, number, distances, spread)
        count, band = _wrong(balls, balls.trace(context, rung), 2.0 ** (-53 if rung_named(rung).bits == 64 else -24))
        left_out = max(left_out, band)
        return count

    counts = context.each_rung(wrong)
    balls = _aimed(context, "watertight", number, distances, spread)
    note = f"{left_out:,} rays within 4 ulp of a tangent left out"
    return Outcome(balls.origin[..., 0].size, counts, _wrong(balls, balls.naive(), 2.0**-24)[0], note)


@case(39, "far spheres, distance/radius 1e3 and 1e5", provokes="the textbook discriminant", oracle="D", promised=ALL)
def far_spheres(context: Context) -> Outcome:
    return _judge(context, 39, (1e3, 1e5), (0.0, 1.2))


@case(41, "tangent rays", provokes="the sign of the root", oracle="D", promised=ALL)
def tangent_rays(context: Context) -> Outcome:
    return _judge(context, 41, (2.0, 10.0, 100.0), (1.0 - 1e-5, 1.0 + 1e-5))


@case(40, "a sphere of radius 1e6 as a floor", provokes="cancellation", oracle="D", promised=ALL)
def floor_sphere(context: Context) -> Outcome:
    """Rays from heights 0.1 to 100 above it: t within 1e-5, where they meet it at more than 1 degree."""

    def balls_for(rung: str) -> Balls:
        rng = context.rng(40)
        packets, lanes = _packets(context, rung, 0.5)
        real = rung_named(rung).real
        height = 10.0 ** rng.uniform(-1, 2, (packets, lanes))
        place = rng.uniform(-100, 100, (packets, lanes, 2))
        origin = np.stack([place[..., 0], height, place[..., 1]], -1).astype(real)
        direction = np.asarray(rng.normal(size=origin.shape))
        direction[..., 1] = -np.abs(direction[..., 1]) - 0.05
        center, radius = np.tile((0.0, -1e6, 0.0), (packets, 1)), np.full(packets, 1e6)
        return Balls(center, radius, origin, _unit_rows(direction).astype(real))

    def off(balls: Balls, t: FloatArray) -> int:
        first, second, _ = balls.truth()
        height = balls.origin[..., 1].astype(np.float64)
        expected = np.where(first > 0, first, second).astype(np.float64)
        steep = (first > 0) & (height / np.where(first > 0, expected, np.inf) > 0.0175)
        return int(np.count_nonzero(steep & ~(np.abs(t - expected) <= 1e-5 * expected)))

    scene = _ball_on_floor()
    reference = clrt.reference.render(scene)
    firm = reference.margin > FIRM

    def wrong(rung: str) -> int:
        balls = balls_for(rung)
        pixels = firm & ~(np.abs(context.render(scene, rung) - reference.pixels) <= 1e-3).all(-1)
        return off(balls, balls.trace(context, rung)) + int(np.count_nonzero(pixels))

    balls = balls_for("watertight")
    rays = balls.origin[..., 0].size + int(firm.sum())
    return Outcome(
        rays, context.each_rung(wrong), off(balls, balls.naive()), "single rays, and a picture with shadows against the reference"
    )


def _ball_on_floor() -> Scene:
    """A ball on a floor sphere, with its shadow, from a height of 1."""
    eye, view = np.array((0.2, 1.0, -3.0)), np.array((0.0, -0.3, 1.0))
    text = pictures.camera(eye, view, 50.0, 64, np.array((0.0, 1.0, 0.0))) + pictures.company(eye, view)
    return parse_scene(text + "L 3 4 -2\nM 0.9 0.8 0.7 0.1 0.8 0 1 0\nS 0 -1e6 0 1e6\nM 0.3 0.5 0.9 0.1 0.8 0.3 9 0.3\nS 0 0.5 0 0.5\n")


@case(42, "origin on a sphere, inside and outside", provokes="the wrong root", oracle="S", promised=ALL)
def origin_on_sphere(context: Context) -> Outcome:
    """Outwards there is nothing; inwards the far side, twice the way to the point nearest to the center."""

    def balls_for(rung: str) -> Balls:
        rng = context.rng(42)
        packets, lanes = _packets(context, rung, 0.5)
        real = rung_named(rung).real
        radius = (10.0 ** rng.uniform(-4, 4, packets)).astype(real).astype(np.float64)
        center = (rng.normal(size=(packets, 3)) * radius[:, None] * 3).astype(real).astype(np.float64)
        normal = _unit_rows(rng.normal(size=(packets, lanes, 3)))
        direction = _unit_rows(rng.normal(size=normal.shape)).astype(real)
        return Balls(center, radius, (center[:, None] + normal * radius[:, None, None]).astype(real), direction, own=True)

    def off(balls: Balls, t: FloatArray, unit: float) -> int:
        f = balls.origin.astype(np.float64) - balls.center[:, None]
        d = balls.direction.astype(np.float64)
        b = -(f * d).sum(-1)
        size = np.linalg.norm(f, axis=-1)
        error = 16 * unit * size
        outside = (b < -error) & np.isfinite(t)
        inside = (b > error) & ~(np.abs(t - 2 * b) <= 2 * error)
        return int(np.count_nonzero(outside | inside))

    counts = context.each_rung(
        lambda rung: off(b := balls_for(rung), b.trace(context, rung), 2.0 ** (-53 if rung_named(rung).bits == 64 else -24))
    )
    balls = balls_for("watertight")
    return Outcome(balls.origin[..., 0].size, counts, off(balls, balls.naive(), 2.0**-24))
