"""Hard cases 30 to 32: directions of any length, rays and intervals of NaN and infinity."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from clrt.reference import exact
from clrt.verify import naive
from clrt.verify.case import Context, Outcome, case
from clrt.verify.judge import Truth, against, disagreements, truth, unusable
from clrt.verify.naive import MoellerTrumbore
from clrt.verify.rays import Rays, Triangles, closed_sphere, directions, hard_aims, inside, joined, rays_of

_NAIVE_RAYS = 2_000
SLOWDOWN = 2.5  #: of NaN and infinite rays against ordinary ones
_TURNS = 5  #: of each kind, alternating; the quickest counts


@case(30, "unnormalised directions 1e-10, 1e10", provokes="t scaling", oracle="E")
def any_length(context: Context) -> Outcome:
    """t in units of the direction's length, within 4 ulp, and the same triangles as for any other length."""
    rng, tri = context.rng(30), closed_sphere(500)
    count = context.share(1.0 if context.full else 0.1)
    rays = hard_aims(rng, count, tri)
    lengths = 10.0 ** rng.choice([-10.0, 10.0, -3.0, 7.0], (rays.size, 1))
    rays = rays_of(rays.origins, rays.directions * lengths)
    expected = truth(tri, rays)
    some = slice(0, None, -(-rays.size // _NAIVE_RAYS))
    lost = naive.brute_force(tri, rays.take(some), MoellerTrumbore(epsilon=1e-6))[0] < 0
    return Outcome(rays.size, against(context, "sphere", tri, rays, expected), int(lost.sum()))


def _spoilt(rng: np.random.Generator, rays: Rays, values: tuple[float, ...]) -> Rays:
    """One of the six numbers of every ray replaced by one of `values`."""
    numbers = np.concatenate([rays.origins, rays.directions], axis=1)
    numbers[np.arange(rays.size), rng.integers(0, 6, rays.size)] = rng.choice(values, rays.size)
    return rays_of(numbers[:, :3], numbers[:, 3:])


def _seconds(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def _wrong_or_slow(context: Context, tri: Triangles, good: Rays, bad: Rays) -> dict[str, int | None]:
    """Bad rays that hit, in any of the three questions; and 1 more where they take too long."""

    def count(rung: str) -> int:
        caster = context.caster("sphere", tri, rung)
        hits = caster.first_hit(*bad)
        wrong = (hits["prim_id"] >= 0) | unusable(hits) | caster.any_hit(*bad) | (caster.count_hits(*bad) > 0)
        turns = [(_seconds(lambda: caster.first_hit(*bad)), _seconds(lambda: caster.first_hit(*good))) for _ in range(_TURNS)]
        slow = min(t[0] for t in turns) > SLOWDOWN * min(t[1] for t in turns)
        return int(wrong.sum()) + slow

    return context.each_rung(count)


def _passed_through(tri: Triangles, rays: Rays) -> int:
    """Rays that a test hits whose comparisons let NaN fall through."""
    return int(np.count_nonzero(naive.brute_force(tri, rays.take(slice(0, _NAIVE_RAYS)), MoellerTrumbore(nan_hits=True))[0] >= 0))


@case(31, "NaN origins and directions", provokes="full traversal", oracle="S")
def nan_rays(context: Context) -> Outcome:
    rng, tri = context.rng(31), closed_sphere(500)
    good = rays_of(inside(rng, context.rays, tri), directions(rng, context.rays))
    bad = _spoilt(rng, good, (np.nan,))
    return Outcome(bad.size, _wrong_or_slow(context, tri, good, bad), _passed_through(tri, bad), "one more where slower than 2.5x")


@case(32, "infinite origins, directions, t_max", provokes="the same", oracle="E")
def infinite_rays(context: Context) -> Outcome:
    """Infinite rays miss. Finite rays with infinite, NaN, reversed and denormal limits of t: as the oracle says."""
    rng, tri = context.rng(32), closed_sphere(500)
    good = rays_of(inside(rng, context.rays, tri), directions(rng, context.rays))
    bad = _spoilt(rng, good, (np.inf, -np.inf))
    counts = _wrong_or_slow(context, tri, good, bad)
    few = joined(good.take(slice(0, context.share(0.02))))
    t_min, t_max = rng.choice([-np.inf, np.inf, np.nan, 0.0, -1.0, 0.9, 1e-300, -1e300, 1e300], (2, few.size))
    t_max = np.where(rng.random(few.size) < 0.5, np.inf, t_max)
    expected = Truth(*exact.first_hit(tri, few.origins, few.directions, t_min, t_max))

    def limits(rung: str) -> int:
        hits = context.caster("sphere", tri, rung).first_hit(*few, t_min, t_max)
        ghosts: NDArray[np.bool_] = (hits["prim_id"] >= 0) & (expected.prim_id < 0)
        return int(np.count_nonzero(disagreements(rung, hits, expected) | ghosts))

    total = {rung: (counts[rung] or 0) + (limits(rung) or 0) for rung in context.rungs}
    return Outcome(bad.size + few.size, total, _passed_through(tri, bad), "one more where slower than 2.5x")
