"""RayCaster against rational arithmetic: which triangle, how many, how far, and where; and that no ray slips through a closed mesh."""

from __future__ import annotations

from fractions import Fraction as F
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from ray_meshes import MESHES, aimed, points, sphere

import clrt
from clrt.reference import exact

Array = NDArray[Any]
UP = np.array([0.0, 0.0, 1.0])
MEASURED = 2.0**-36  #: of t, u, v: between what is measured (below 2^-42) and what is proven (2^-31)


@pytest.fixture(scope="module")
def casters() -> dict[str, tuple[clrt.RayCaster, Array]]:
    return {name: (clrt.RayCaster(tri), tri) for name, tri in ((name, make()) for name, make in MESHES.items())}


def wrong(caster: clrt.RayCaster, tri: Array, rays: tuple[Array, Array], **limits: Any) -> int:
    """Rays on which first_hit or any_hit differs from the oracle: another triangle, or a t that is off."""
    prim_id, t = exact.first_hit(tri, *rays, **limits)
    hits = caster.first_hit(*rays, **limits)
    with np.errstate(invalid="ignore"):
        off = ~((hits["t"] == t) | (np.abs(hits["t"] - t) <= MEASURED * np.abs(t)))
    return int(np.count_nonzero((hits["prim_id"] != prim_id) | off | (caster.any_hit(*rays, **limits) != (prim_id >= 0))))


def judge(casters: dict[str, tuple[clrt.RayCaster, Array]], name: str, count: int, seed: int) -> int:
    caster, tri = casters[name]
    rng = np.random.default_rng(seed)
    return sum(wrong(caster, tri, aimed(rng, tri, count // 2, dtype)) for dtype in (np.float32, np.float64))


@pytest.mark.parametrize("name", MESHES)
def test_first_hit_is_that_of_exact_arithmetic(casters: dict[str, tuple[clrt.RayCaster, Array]], name: str) -> None:
    """20,000 rays in all."""
    assert judge(casters, name, 1700, 1) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", MESHES)
def test_first_hit_is_that_of_exact_arithmetic_over_a_million_rays(casters: dict[str, tuple[clrt.RayCaster, Array]], name: str) -> None:
    assert sum(judge(casters, name, 17_000, seed) for seed in range(100, 105)) == 0


@pytest.mark.parametrize("name", ["sphere, float32", "grid on a lattice", "duplicates", "fan of needles", "sphere at 1e6"])
def test_limits_at_the_very_hit_are_those_of_exact_arithmetic(casters: dict[str, tuple[clrt.RayCaster, Array]], name: str) -> None:
    """t_min or t_max is the float64 number next to a true t, or t itself where that is a float64 number."""
    caster, tri = casters[name]
    rng = np.random.default_rng(2)
    origins, directions = aimed(rng, tri, 300, np.float64)
    t = exact.first_hit(tri, origins, directions)[1]
    hit = np.isfinite(t)
    rays, t = (origins[hit], directions[hit]), t[hit]
    assert len(t) > 80
    assert wrong(caster, tri, rays, t_max=t) == 0
    assert wrong(caster, tri, rays, t_min=t) == 0
    assert wrong(caster, tri, rays, t_min=np.nextafter(t, -np.inf), t_max=np.nextafter(t, np.inf)) == 0


@pytest.mark.parametrize("name", MESHES)
def test_counts_are_those_of_exact_arithmetic(casters: dict[str, tuple[clrt.RayCaster, Array]], name: str) -> None:
    caster, tri = casters[name]
    rays = aimed(np.random.default_rng(3), tri, 270, np.float64)
    assert (caster.count_hits(*rays, t_min=-np.inf) == exact.count_hits(tri, *rays, t_min=-np.inf)).all()


@pytest.mark.parametrize("exponent", [10, 20, 52, 80, 100])
def test_origins_far_away_see_what_exact_arithmetic_says(casters: dict[str, tuple[clrt.RayCaster, Array]], exponent: int) -> None:
    """Along -y from 2^exponent times the mesh's size at the corners of a lattice: float32 has no digit of the mesh left."""
    caster, tri = casters["grid on a lattice"]
    origins = points(np.random.default_rng(14), tri, 150, "corner")
    origins[:, 1] = 2.0**exponent
    assert wrong(caster, tri, (origins, np.tile([0.0, -1.0, 0.0], (150, 1)))) == 0


def exact_record(corners: Array, origin: Array, direction: Array) -> list[F]:
    """t, u, v of the plane's crossing (Cramer's rule) in rational numbers."""
    a, b, c = ([F(x) for x in p] for p in corners.astype(np.float64).tolist())
    o, d = ([F(x) for x in p.tolist()] for p in (origin.astype(np.float64), direction.astype(np.float64)))
    e1, e2, s = ([y - x for x, y in zip(p, q, strict=True)] for p, q in ((a, b), (a, c), (a, o)))

    def triple(p: list[F], q: list[F], r: list[F]) -> F:
        return sum((p[i] * (q[i - 2] * r[i - 1] - q[i - 1] * r[i - 2]) for i in range(3)), F(0))

    volume = -triple(d, e1, e2)
    return [triple(s, e1, e2) / volume, -triple(d, s, e2) / volume, -triple(d, e1, s) / volume]


def errors(found: NDArray[np.void], tri: Array, origins: Array, directions: Array) -> Array:
    """(k, 3) relative errors of t, u, v of the hits among rays; infinite where a zero is not zero."""
    rows = []
    for hit, origin, direction in zip(found, origins, directions, strict=True):
        if hit["prim_id"] < 0:
            continue
        true = exact_record(tri[hit["prim_id"]], origin, direction)
        given = [F(float(hit[name])) for name in "tuv"]
        rows.append([float(abs(x - y) / abs(y)) if y else (0.0 if x == 0 else np.inf) for x, y in zip(given, true, strict=True)])
    return np.array(rows)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", MESHES)
def test_t_u_v_are_those_of_exact_arithmetic(casters: dict[str, tuple[clrt.RayCaster, Array]], name: str, dtype: Any) -> None:
    """Far below the promised 2 ulp of float32; u or v exactly zero where an edge or a corner is met exactly."""
    caster, tri = casters[name]
    rays = aimed(np.random.default_rng(4), tri, 180, dtype)
    off = errors(caster.first_hit(*rays), tri, *rays)
    assert len(off) > 50
    assert off.max() < MEASURED


def test_t_u_v_of_grazing_rays_on_needles() -> None:
    """Triangles a million times longer than wide, under angles down to 1e-9: float64 has no digit of u left, expansions have."""
    rng = np.random.default_rng(5)
    needles = np.array([[[0.0, 0, 0], [1, 0, 0], [0.3, 1e-6, 0]]]) + np.arange(40)[:, None, None] * UP
    needles += rng.normal(size=(40, 1, 3)) * 1e-3
    caster = clrt.RayCaster(needles)
    targets = np.einsum("kc,kca->ka", rng.dirichlet(np.ones(3), 40), needles)
    directions = rng.normal(size=(40, 3)) * np.c_[np.ones((40, 2)), 10.0 ** rng.uniform(-9, -3, 40)]
    origins = targets - directions * 10.0 ** rng.integers(-2, 6, (40, 1))
    hits = caster.first_hit(origins, directions)
    prim_id = exact.first_hit(needles, origins, directions)[0]
    assert (hits["prim_id"] == prim_id).all()
    off = errors(hits, needles, origins, directions)
    assert len(off) >= 5
    assert off.max() < MEASURED


def test_weights_at_corners_and_edges_are_exact() -> None:
    """A triangle whose corners and edges rays meet exactly: u and v are 0, 1 or a half to the last bit."""
    tri = np.array([[[0.0, 0, 3], [4, 0, 3], [0, 4, 3]]])
    targets = np.array([[0.0, 0, 3], [4, 0, 3], [0, 4, 3], [2, 0, 3], [0, 2, 3], [2, 2, 3]])
    for origin in ([1.0, 1, 0], [-3, 7, 1], [1e5, 1, 2]):
        hits = clrt.RayCaster(tri).first_hit(origin, targets - np.array(origin))
        assert hits["u"].tolist() == [0, 1, 0, 0.5, 0, 0.5]
        assert hits["v"].tolist() == [0, 0, 1, 0, 0.5, 0.5]
        assert (hits["t"] == 1).all()


CLOSED = {
    "near": lambda: sphere(2000, dtype=np.float32),
    "at 1e3": lambda: sphere(2000, (1e3, -1e3, 1e3)),
    "at 1e3, float32": lambda: sphere(2000, (1e3, -1e3, 1e3), np.float32),
    "at 1e6": lambda: sphere(2000, (1e6, 1e6, -1e6)),
}


def leaks(tri: Array, rung: str, count: int, seed: int) -> int:
    """Rays from inside a closed mesh at its corners and edges that are said to hit nothing."""
    rng = np.random.default_rng(seed)
    middle = tri.reshape(-1, 3).mean(axis=0, dtype=np.float64)
    origins = (middle + rng.uniform(-0.4, 0.4, (count, 3))).astype(tri.dtype)
    targets = np.concatenate([points(rng, tri, count // 2, "corner"), points(rng, tri, count - count // 2, "edge")])
    return int(np.count_nonzero(~clrt.RayCaster(tri, precision=rung).any_hit(origins, (targets - origins).astype(tri.dtype))))


@pytest.mark.parametrize("rung", ["watertight", "exact", "double"])
@pytest.mark.parametrize("place", CLOSED)
def test_no_ray_leaves_a_closed_mesh(place: str, rung: str) -> None:
    assert leaks(CLOSED[place](), rung, 12_500, 6) == 0


@pytest.mark.slow
@pytest.mark.parametrize("rung", ["watertight", "exact", "double"])
@pytest.mark.parametrize("place", CLOSED)
def test_no_ray_in_a_million_leaves_a_closed_mesh(place: str, rung: str) -> None:
    assert leaks(CLOSED[place](), rung, 250_000, 7) == 0


def test_fast_leaks_where_the_others_do_not() -> None:
    """The rays of the tests above are hard ones."""
    assert leaks(CLOSED["at 1e3"](), "fast", 50_000, 6) > 0


def test_float32_decides_almost_all_random_rays(casters: dict[str, tuple[clrt.RayCaster, Array]]) -> None:
    caster, tri = casters["rabbit"]
    rng = np.random.default_rng(8)
    origins = rng.normal(size=(20_000, 3)) * 2
    caster.first_hit(origins, points(rng, tri, 20_000, "face") + rng.normal(size=(20_000, 3)) * 0.1 - origins)
    counters = caster.counters
    assert counters["rays"] == 20_000
    assert counters["float64"] < 0.05 * 20_000
    assert counters["exact"] <= 0.001 * 20_000


SQUARE = np.array([[[-1.0, -1, 1], [1, -1, 1], [1, 1, 1]], [[-1, -1, 1], [1, 1, 1], [-1, 1, 1]]])


@pytest.mark.parametrize(
    ("beside", "stage"), [(1e-3, ""), (2.0**-13, ""), (1e-9, "float64"), (2.0**-34, "float64"), (2.0**-52, "exact"), (0.0, "exact")]
)
def test_rays_beside_an_edge_go_to_the_stage_that_can_tell(beside: float, stage: str) -> None:
    """Along z, so far beside the diagonal y = x: the float32 bound is some 2^-15 here, that of float64 some 2^-47."""
    caster = clrt.RayCaster(SQUARE)
    x = np.random.default_rng(9).integers(-60, 61, 200) / 128.0
    side = np.where(np.arange(200) % 2, 1.0, -1.0)
    origins = np.c_[x, x + side * beside, np.zeros(200)]
    hits = caster.first_hit(origins, UP)
    counters = caster.counters
    assert (origins[:, 1] - origins[:, 0] == side * beside).all() or beside == 1e-9 or beside == 1e-3
    assert (hits["prim_id"] == ((side > 0) if beside else 0)).all()
    assert (hits["t"] == 1.0).all()
    for name in ("float64", "exact"):
        assert counters[name] >= 200 if name == stage else counters[name] == 0


@pytest.mark.parametrize(("gap", "stage"), [(2.0**-10, ""), (2.0**-40, "float64"), (2.0**-52, "exact"), (0.0, "exact")])
@pytest.mark.parametrize("behind_first", [False, True])
def test_planes_a_gap_apart_go_to_the_stage_that_can_tell(gap: float, stage: str, behind_first: bool) -> None:
    """Which of two hits is nearer: the lower id where both are in one plane."""
    planes = [SQUARE, SQUARE + gap * UP]
    caster = clrt.RayCaster(np.concatenate(planes[::-1] if behind_first else planes))
    x = np.random.default_rng(10).uniform(-0.9, 0.9, (200, 2))
    x = x[np.abs(x[:, 0] - x[:, 1]) > 0.01]
    hits = caster.first_hit(np.c_[x, np.zeros(len(x))], UP)
    nearer = 2 if behind_first and gap else 0
    assert (hits["prim_id"] == nearer + (x[:, 1] > x[:, 0])).all()
    counters = caster.counters
    for name in ("float64", "exact"):
        assert counters[name] >= len(x) if name == stage else counters[name] == 0
