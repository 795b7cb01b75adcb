"""RayCaster where the answer is a closed form: limits, signs, scales, ids, counts, rays that are no rays; speed of those."""

from __future__ import annotations

import statistics
import time
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.generate import needle_fan, rabbit_like, uv_sphere
from clrt.precision import RUNGS
from clrt.rays import HIT_DTYPE

Array = NDArray[Any]
CORNER = np.array([[[0.0, 0, 4], [8, 0, 4], [0, 8, 4]]])
UP = np.array([0.0, 0.0, 1.0])
ASIDE = np.array([0.25, 0.5, 0.0])  #: an origin under no edge of `walls`


def walls(heights: list[float]) -> Array:
    """A square of two triangles over [-1, 1]^2 in each plane z = height."""
    a, b, c, d = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    flat = np.array([[a, b, c], [a, c, d]])
    return np.concatenate([flat + z * UP for z in heights])


@pytest.fixture(scope="module", params=list(RUNGS))
def rung(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def stack(rung: str) -> clrt.RayCaster:
    """Squares in z = 1, 2, ..., 8."""
    return clrt.RayCaster(walls([float(z) for z in range(1, 9)]), precision=rung)


@pytest.fixture(scope="module")
def rabbit() -> clrt.RayCaster:
    return clrt.RayCaster(rabbit_like(2000))


def random_rays(count: int, seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    origins = rng.normal(size=(count, 3)) * 2
    return origins, rng.normal(size=(count, 3)) * 0.4 - origins


def test_record_of_a_hit(rung: str) -> None:
    """All numbers are small and whole in binary: every rung gives them without error."""
    hit = clrt.RayCaster(CORNER, precision=rung).first_hit([1.0, 4.0, 1.0], [0.0, 0.0, 2.0])
    assert (hit == np.array([(1.5, 0.125, 0.5, 0, 0, [0.0, 0.0, 1.0])], HIT_DTYPE)).all()


def test_record_of_a_miss(rung: str) -> None:
    hit = clrt.RayCaster(CORNER, precision=rung).first_hit([5.0, 4.0, 1.0], [0.0, 0.0, 2.0])
    assert (hit == np.array([(np.inf, 0.0, 0.0, -1, -1, [0.0, 0.0, 0.0])], HIT_DTYPE)).all()


def test_weights_give_the_point() -> None:
    caster = clrt.RayCaster(rabbit_like(2000))
    corners = caster.scene.objects[0].vertices
    origins, directions = random_rays(2000, 1)
    hits = caster.first_hit(origins, directions)
    hit = hits["prim_id"] >= 0
    a, b, c = np.moveaxis(corners[hits["prim_id"][hit]], 1, 0)
    u, v, t = (hits[name][hit, None] for name in "uvt")
    along_ray = origins[hit] + t * directions[hit]
    assert 500 < hit.sum() < 2000
    assert np.abs(a + u * (b - a) + v * (c - a) - along_ray).max() < 1e-12
    assert (hits["u"] >= 0).all()
    assert (hits["v"] >= 0).all()
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert np.abs(hits["normal"][hit] - normal).max() < 1e-12


def test_both_sides_are_hit_and_the_normal_stays(rung: str) -> None:
    hits = clrt.RayCaster(CORNER, precision=rung).first_hit([[1.0, 1, 0], [1, 1, 8]], [[0.0, 0, 1], [0, 0, -1]])
    assert hits["t"].tolist() == [4.0, 4.0]
    assert hits["normal"].tolist() == [[0, 0, 1], [0, 0, 1]]


@pytest.mark.parametrize(
    ("t_min", "t_max", "t", "count"),
    [
        (0.0, np.inf, 1.0, 8), (1.0, np.inf, 2.0, 7), (0.0, 1.0, np.inf, 0), (1.0, 2.0, np.inf, 0), (1.5, 3.5, 2.0, 2),
        (7.5, 8.0, np.inf, 0), (8.0, np.inf, np.inf, 0), (-np.inf, np.inf, 1.0, 8), (-5.0, 1.5, 1.0, 1), (3.0, 3.0, np.inf, 0),
        (4.0, 3.0, np.inf, 0), (np.nan, 9.0, np.inf, 0), (0.0, np.nan, np.inf, 0), (-np.inf, -1.0, np.inf, 0),
        (np.inf, np.inf, np.inf, 0), (-0.0, 5e-324, np.inf, 0), (1e300, np.inf, np.inf, 0), (0.0, 1e300, 1.0, 8),
    ],
)  # fmt: skip
def test_interval_is_open(t_min: float, t_max: float, t: float, count: int) -> None:
    caster = clrt.RayCaster(walls([float(z) for z in range(1, 9)]))
    rays = ([[0.25, 0.5, 0.0]], UP, t_min, t_max)
    assert caster.first_hit(*rays)["t"].tolist() == [t]
    assert caster.any_hit(*rays).tolist() == [count > 0]
    assert caster.count_hits(*rays).tolist() == [count]


def test_limits_are_in_units_of_the_direction_and_one_a_ray(stack: clrt.RayCaster) -> None:
    lengths = 2.0 ** np.arange(-20, 21)
    origins, directions = np.zeros((41, 3)) + ASIDE, lengths[:, None] * UP
    hits = stack.first_hit(origins, directions, t_min=2.5 / lengths, t_max=3.5 / lengths)
    assert (hits["t"] == 3.0 / lengths).all()
    assert (stack.count_hits(origins, directions, t_max=4.5 / lengths) == 4).all()
    assert not stack.any_hit(origins, directions, t_min=2.25 / lengths, t_max=2.75 / lengths).any()


def test_negative_t_is_behind_the_origin(stack: clrt.RayCaster) -> None:
    rays = ([0.25, 0.5, 5.5], UP)
    assert stack.first_hit(*rays, t_min=-np.inf)["t"].tolist() == [-4.5]
    assert stack.first_hit(*rays, t_min=-3.75, t_max=-0.25)["t"].tolist() == [-3.5]
    assert stack.first_hit(*rays, t_min=-0.25)["t"].tolist() == [0.5]
    assert stack.count_hits(*rays, t_min=-np.inf).tolist() == [8]


def test_a_ray_that_starts_on_a_triangle_does_not_hit_it(stack: clrt.RayCaster) -> None:
    assert stack.first_hit([0.25, 0.5, 3.0], UP)["t"].tolist() == [1.0]
    assert stack.first_hit([0.25, 0.5, 3.0], -UP)["t"].tolist() == [1.0]
    assert stack.count_hits([0.25, 0.5, 3.0], UP).tolist() == [5]


def test_ids_of_equal_t_are_the_lowest() -> None:
    rng = np.random.default_rng(3)
    copies = clrt.RayCaster(np.repeat(walls([2.0, 1.0]), 5, axis=0))
    origins = np.c_[rng.uniform(-0.9, 0.9, (50, 2)), np.zeros(50)]
    lower = origins[:, 1] < origins[:, 0]
    assert (copies.first_hit(origins, UP)["prim_id"] == np.where(lower, 10, 15)).all()
    assert (copies.first_hit(origins, UP, t_min=1.0)["prim_id"] == np.where(lower, 0, 5)).all()
    assert (copies.count_hits(origins, UP) == 10).all()


@pytest.mark.parametrize("triangles", [3, 8, 60])
def test_a_corner_counts_for_each_of_its_triangles(triangles: int) -> None:
    fan = clrt.RayCaster(needle_fan(triangles))
    assert fan.count_hits([0.0, 0.0, -1.0], UP).tolist() == [triangles]
    assert fan.first_hit([0.0, 0.0, -1.0], UP)["prim_id"].tolist() == [0]


def test_every_triangle_of_equal_t_counts_whatever_the_order(rung: str) -> None:
    """Straight down on the corners of a flat sheet: 4 or 8 triangles, all at t = 1, their ids in any order over the tree's leaves."""
    rng = np.random.default_rng(13)
    y, x = np.mgrid[-4:4, -4:4].astype(np.float64)
    a, b, c, d = (np.stack([x + i, y + j, np.ones_like(x)], axis=-1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    odd = ((x + y) % 2 == 1)[..., None, None]
    halves = [np.where(odd, np.stack(p, axis=-2), np.stack(q, axis=-2)) for p, q in (((a, b, d), (a, b, c)), ((b, c, d), (a, c, d)))]
    sheet = rng.permutation(np.concatenate(halves).reshape(-1, 3, 3))
    points = np.stack(np.meshgrid(np.arange(-3.0, 4), np.arange(-3.0, 4)), axis=-1).reshape(-1, 2)
    expected = [np.count_nonzero((sheet == [*point, 1.0]).all(axis=-1).any(axis=-1)) for point in points]
    assert set(expected) == {4, 8}
    caster = clrt.RayCaster(sheet, precision=rung)
    origins = np.c_[points, np.zeros(len(points))]
    assert caster.count_hits(origins, UP).tolist() == expected
    ray_ids, hits = caster.all_hits(origins, UP)
    assert len(ray_ids) == sum(expected)
    assert (np.diff(hits["prim_id"])[np.diff(ray_ids) == 0] > 0).all()


def test_closed_surface_is_crossed_an_even_number_of_times(rabbit: clrt.RayCaster) -> None:
    """From far outside, a ray that meets no edge or corner enters as often as it leaves."""
    origins, directions = random_rays(3000, 4)
    counts = rabbit.count_hits(origins * 20, directions - origins * 19, t_max=1e9)
    assert (counts % 2 == 0).all()
    assert counts.max() >= 4


def test_any_and_count_agree_with_first(rabbit: clrt.RayCaster) -> None:
    origins, directions = random_rays(3000, 5)
    hit = rabbit.first_hit(origins, directions)["prim_id"] >= 0
    assert 0 < hit.sum() < len(hit)
    assert (rabbit.any_hit(origins, directions) == hit).all()
    assert ((rabbit.count_hits(origins, directions) > 0) == hit).all()


def test_the_next_hit_starts_after_the_last(rabbit: clrt.RayCaster) -> None:
    """Counting is stepping on from the last t, and its rounding, while all t of a ray differ by more than that."""
    origins, directions = random_rays(500, 6)
    counts, t = np.zeros(500, int), np.zeros(500)
    for _ in range(20):
        hits = rabbit.first_hit(origins, directions, t_min=t)
        counts += hits["prim_id"] >= 0
        t = hits["t"] * (1 + 2.0**-30)
    assert (rabbit.count_hits(origins, directions) == counts).all()


@pytest.mark.parametrize("exponent", [-1000, -300, -34, -1, 1, 34, 300, 1000])
def test_length_of_the_direction_scales_t_alone(rung: str, exponent: int) -> None:
    caster = clrt.RayCaster(uv_sphere(200), precision=rung)
    origins, directions = random_rays(300, 7)
    unit, scaled = caster.first_hit(origins, directions), caster.first_hit(origins, np.ldexp(directions, exponent))
    assert np.isfinite(unit["t"]).sum() > 50
    assert (scaled["t"] == np.ldexp(unit["t"], -exponent)).all()
    for name in ("u", "v", "prim_id"):
        assert (scaled[name] == unit[name]).all()


@pytest.mark.parametrize("exponent", [-200, -100, -20, 20, 100, 200])
def test_unit_of_the_mesh_changes_no_bit(rung: str, exponent: int) -> None:
    vertices, faces = uv_sphere(200)
    origins, directions = random_rays(300, 8)
    expected = clrt.RayCaster((vertices, faces), precision=rung).first_hit(origins, directions)
    caster = clrt.RayCaster((np.ldexp(vertices, exponent), faces), precision=rung)
    assert caster.first_hit(np.ldexp(origins, exponent), np.ldexp(directions, exponent)).tobytes() == expected.tobytes()


def test_hits_do_not_depend_on_the_company_of_a_ray(rung: str) -> None:
    """Order, number and neighbours of rays, and the sizes of earlier calls, change no bit."""
    origins, directions = random_rays(700, 9)
    caster = clrt.RayCaster(uv_sphere(500), precision=rung)
    expected = caster.first_hit(origins, directions)
    order = np.random.default_rng(0).permutation(700)
    assert caster.first_hit(origins[order], directions[order]).tobytes() == expected[order].tobytes()
    for count in (1, 2, 15, 16, 17, 129):
        assert caster.first_hit(origins[:count], directions[:count]).tobytes() == expected[:count].tobytes()
    again = clrt.RayCaster(uv_sphere(500), precision=rung)
    assert again.first_hit(origins[:5], directions[:5]).tobytes() == expected[:5].tobytes()
    assert again.first_hit(origins, directions).tobytes() == expected.tobytes()


def test_chunks_change_no_bit(rabbit: clrt.RayCaster, monkeypatch: pytest.MonkeyPatch) -> None:
    origins, directions = random_rays(500, 10)
    limits = np.linspace(0.1, 3.0, 500)
    calls = (rabbit.first_hit, rabbit.any_hit, rabbit.count_hits)
    expected = [call(origins, directions, 0.0, limits).tobytes() for call in calls]
    unsure = rabbit.counters
    monkeypatch.setattr("clrt.rays._CHUNK", 64)
    assert [call(origins, directions, 0.0, limits).tobytes() for call in calls] == expected
    assert rabbit.counters == unsure
    assert unsure["rays"] == 500


def test_all_hits_of_a_stack_of_walls(stack: clrt.RayCaster) -> None:
    """Ray i starts below wall i + 1: its hits are the walls above, in order."""
    origins = ASIDE + np.arange(10)[:, None] * UP
    ray_ids, hits = stack.all_hits(origins + UP / 2, UP, t_max=3.0)
    expected = [(i, z - i - 0.5) for i in range(10) for z in range(i + 1, min(9, i + 4))]
    assert list(zip(ray_ids.tolist(), hits["t"].tolist(), strict=True)) == expected
    assert (hits["prim_id"] // 2 == ray_ids + hits["t"] + 0.5 - 1).all()
    assert (hits["u"] + hits["v"] <= 1).all()


@pytest.mark.parametrize("limit", [1, 7, 1 << 20])
def test_all_hits_begin_with_the_first_and_are_as_many_as_counted(
    rabbit: clrt.RayCaster, monkeypatch: pytest.MonkeyPatch, limit: int
) -> None:
    monkeypatch.setattr("clrt.rays._LIST_LIMIT", limit)
    monkeypatch.setattr("clrt.rays._CHUNK", 64)
    origins, directions = random_rays(200, 12)
    ray_ids, hits = rabbit.all_hits(origins, directions)
    counts, first = rabbit.count_hits(origins, directions), rabbit.first_hit(origins, directions)
    assert (np.bincount(ray_ids, minlength=200) == counts).all()
    starts = np.cumsum(counts) - counts
    assert hits[starts[counts > 0]].tobytes() == first[counts > 0].tobytes()
    same_ray = np.diff(ray_ids) == 0
    assert (np.diff(ray_ids) >= 0).all()
    assert (np.diff(hits["t"])[same_ray] > 0).all()


def test_all_hits_of_equal_t_are_ordered_by_id() -> None:
    copies = clrt.RayCaster(np.repeat(walls([1.0, 2.0]), 3, axis=0))
    ray_ids, hits = copies.all_hits([ASIDE, ASIDE], UP)
    assert hits["prim_id"].tolist() == [3, 4, 5, 9, 10, 11] * 2
    assert ray_ids.tolist() == [0] * 6 + [1] * 6
    assert [len(a) for a in copies.all_hits(ASIDE, -UP)] == [0, 0]
    assert [len(a) for a in copies.all_hits([], UP)] == [0, 0]


NO_RAYS: dict[str, tuple[list[float], list[float]]] = {
    "nan origin": ([np.nan, 0, 0], [0, 0, 1]),
    "nan direction": ([0, 0, 0], [0, np.nan, 1]),
    "infinite origin": ([0, 0, -np.inf], [0, 0, 1]),
    "infinite direction": ([0, 0, 0], [0, 0, np.inf]),
    "zero direction": ([0, 0, 0], [0, -0.0, 0]),
    "all nan": ([np.nan] * 3, [np.nan] * 3),
    "infinity and nan": ([np.inf, np.nan, 0], [-np.inf, 0, 0]),
}


@pytest.mark.parametrize("kind", NO_RAYS)
def test_what_is_no_ray_misses_and_leaves_its_neighbours_alone(stack: clrt.RayCaster, kind: str) -> None:
    origins, directions = np.zeros((35, 3)) + ASIDE, np.zeros((35, 3)) + UP
    origins[1::3], directions[1::3] = NO_RAYS[kind]
    bad = np.arange(35) % 3 == 1
    hits = stack.first_hit(origins, directions)
    assert (hits["t"] == np.where(bad, np.inf, 1.0)).all()
    assert (hits["prim_id"] == np.where(bad, -1, hits["prim_id"][0])).all()
    assert np.isfinite(hits["normal"]).all()
    assert (stack.any_hit(origins, directions) == ~bad).all()
    assert (stack.count_hits(origins, directions) == np.where(bad, 0, 8)).all()


def test_rays_that_are_none_cost_little(rabbit: clrt.RayCaster) -> None:
    """At most 2.5 times the time of ordinary rays: medians of calls that take turns, of the processor's time, which others do not share."""
    origins, directions = random_rays(20_000, 11)
    mixed, every = origins.copy(), directions.copy()
    mixed[::2, 1], every[:, 2] = np.nan, np.inf
    contenders = {"ordinary": (origins, directions), "mixed": (mixed, directions), "none": (origins, every)}
    times: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(9):
        for name, rays in contenders.items():
            start = time.process_time()
            rabbit.first_hit(*rays)
            times[name].append(time.process_time() - start)
    median = {name: statistics.median(seconds) for name, seconds in times.items()}
    assert median["mixed"] <= 2.5 * median["ordinary"]
    assert median["none"] <= 2.5 * median["ordinary"]


def test_rungs_without_stages_count_rays_alone() -> None:
    caster = clrt.RayCaster(CORNER, precision="watertight")
    assert caster.counters == {"rays": 0}
    caster.any_hit(np.zeros((7, 3)), UP)
    assert caster.counters == {"rays": 7}
