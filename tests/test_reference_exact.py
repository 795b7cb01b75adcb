"""The exact oracle against hand-made rational cases and against plain Fractions over all pairs."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from reference_scenes import globe, shifted

from clrt.errors import MeshError
from clrt.reference import exact

UNIT = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])


def plain_hits(vertices, origin, direction, t_min, t_max):
    """All (t, id) of one ray, by solving for the crossing point and its barycentric weights in Fractions: no filter, no Pluecker."""
    o, d = [[Fraction(float(x)) for x in p] for p in (origin, direction)]
    hits = []
    for k, triangle in enumerate(vertices):
        a, b, c = ([Fraction(float(x)) for x in p] for p in triangle)
        e1, e2 = [q - p for p, q in zip(a, b, strict=True)], [q - p for p, q in zip(a, c, strict=True)]
        n = cross(e1, e2)
        slope = inner(n, d)
        if slope == 0:
            continue
        t = inner(n, [p - q for p, q in zip(a, o, strict=True)]) / slope
        r = [o[i] + t * d[i] - a[i] for i in range(3)]
        u, v = inner(cross(r, e2), n) / inner(n, n), inner(cross(e1, r), n) / inner(n, n)
        if t_min < t < t_max and u >= 0 and v >= 0 and u + v <= 1:
            hits.append((t, k))
    return sorted(hits)


def cross(p, q):
    return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]


def inner(p, q):
    return sum(x * y for x, y in zip(p, q, strict=True))


def assert_agrees(vertices, origins, directions, t_min=0.0, t_max=np.inf):
    """first_hit, any_hit and count_hits equal the plain answer; returns how many rays hit."""
    prim, t = exact.first_hit(vertices, origins, directions, t_min, t_max)
    blocked = exact.any_hit(vertices, origins, directions, t_min, t_max)
    count = exact.count_hits(vertices, origins, directions, t_min, t_max)
    expected = [plain_hits(vertices, o, d, t_min, t_max) for o, d in zip(origins, directions, strict=True)]
    np.testing.assert_array_equal(prim, [h[0][1] if h else -1 for h in expected])
    np.testing.assert_array_equal(t, [float(h[0][0]) if h else np.inf for h in expected])
    np.testing.assert_array_equal(blocked, [bool(h) for h in expected])
    np.testing.assert_array_equal(count, [len(h) for h in expected])
    return sum(map(bool, expected))


@pytest.mark.parametrize("target", [(0, 0), (1, 0), (0, 1), (0.5, 0), (0, 0.25), (0.5, 0.5), (0.25, 0.25)])
def test_hit_on_vertex_edge_or_inside_counts(target):
    prim, t = exact.first_hit(UNIT, [[*map(float, target), -2.0]], [[0.0, 0.0, 4.0]])
    assert prim[0] == 0
    assert t[0] == 0.5


@pytest.mark.parametrize("target", [(-1e-300, 0.5), (0.5, -1e-300), (1.0, 5e-324), (0.5, np.nextafter(0.5, 1.0))])
def test_miss_by_the_least_amount_is_a_miss(target):
    prim, t = exact.first_hit(UNIT, [[*target, -2.0]], [[0.0, 0.0, 1.0]])
    assert prim[0] == -1
    assert t[0] == np.inf


@pytest.mark.parametrize(
    ("origin", "direction"),
    [
        ((-1.0, 0.25, 0.0), (1.0, 0.0, 0.0)),  # in the plane, through the triangle
        ((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)),  # along an edge
        ((0.2, 0.2, 1.0), (0.0, 0.0, 0.0)),  # no direction
        ((0.2, 0.2, -1.0), (0.0, 0.0, np.nan)),
        ((0.2, np.nan, -1.0), (0.0, 0.0, 1.0)),
        ((0.2, 0.2, -np.inf), (0.0, 0.0, 1.0)),
        ((0.2, 0.2, -1.0), (0.0, 0.0, np.inf)),
        ((0.2, 0.2, -1.0), (0.0, 0.0, -1.0)),  # behind
        ((0.2, 0.2, 0.0), (0.0, 0.0, 1.0)),  # starts on it: t = 0 is outside the open interval
    ],
)
def test_in_plane_unusable_or_backward_ray_misses(origin, direction):
    assert exact.first_hit(UNIT, [origin], [direction])[0][0] == -1
    assert not exact.any_hit(UNIT, [origin], [direction])[0]
    assert exact.count_hits(UNIT, [origin], [direction])[0] == 0


def test_zero_area_is_never_hit():
    line = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.5, 0.5, 0.0]]
    point = [[0.5, 0.5, 0.0]] * 3
    assert exact.count_hits(np.array([line, point]), [[0.5, 0.5, -1.0]], [[0.0, 0.0, 1.0]])[0] == 0


def test_equal_t_goes_to_the_lowest_id():
    vertices = np.concatenate([shifted(UNIT, 0, 0, 1), UNIT[:, [1, 2, 0]], UNIT, UNIT * 2.0])
    prim, t = exact.first_hit(vertices, [[0.25, 0.25, -1.0]], [[0.0, 0.0, 1.0]])
    assert (prim[0], t[0]) == (1, 1.0)


def test_order_of_planes_one_ulp_apart_is_decided():
    z = np.float64(1.0e6)
    nearer = shifted(UNIT, 0, 0, z)
    farther = shifted(UNIT, 0, 0, np.nextafter(z, np.inf))
    for vertices, first in ((np.concatenate([farther, nearer]), 1), (np.concatenate([nearer, farther]), 0)):
        # Seen from so far that both t round to the same number.
        prim, t = exact.first_hit(vertices, [[0.25, 0.25, -1.0e9]], [[0.0, 0.0, 3.0]])
        assert prim[0] == first
        assert t[0] == float(Fraction(10**9 + 10**6, 3))


def test_open_interval_excludes_its_ends():
    ray = ([[0.25, 0.25, -1.0]], [[0.0, 0.0, 1.0]])
    assert exact.any_hit(UNIT, *ray, 0.0, np.nextafter(1.0, 2.0))[0]
    assert not exact.any_hit(UNIT, *ray, 0.0, 1.0)[0]
    assert not exact.any_hit(UNIT, *ray, 1.0, np.inf)[0]
    # t = 1/3 is not a float64: the bound next to it is compared with the fraction, not with the rounded t.
    third = ([[0.25, 0.25, -1.0]], [[0.0, 0.0, 3.0]])
    assert Fraction(1 / 3) < Fraction(1, 3)
    assert exact.any_hit(UNIT, *third, 1 / 3, 1.0)[0]
    assert not exact.any_hit(UNIT, *third, 0.0, 1 / 3)[0]


def test_float32_input_is_taken_exactly():
    vertices = (UNIT * np.float32(0.1)).astype(np.float32)
    origin, direction = np.float32([[0.0, 0.0, -0.3]]), np.float32([[0.0, 0.0, 0.7]])
    t = exact.first_hit(vertices, origin, direction)[1][0]
    assert t == float(Fraction(float(np.float32(0.3))) / Fraction(float(np.float32(0.7))))


@pytest.mark.parametrize(
    ("scale", "offset"),
    [(1.0, 0.0), (1.0, 1e6), (2.0**-20, 148376.0), (1e-30, 0.0), (5e-324, 0.0), (1e-310, 1e-300), (1e307, 0.0), (1.0, 1e15)],
)
def test_random_lattice_agrees_with_plain_fractions(scale, offset):
    """Few coordinates a axis: many rays through vertices, along edges, in planes; many degenerate and equal triangles."""
    rng = np.random.default_rng(7)
    vertices = rng.integers(-3, 4, (24, 3, 3)) * scale + offset
    origins = rng.integers(-3, 4, (60, 3)) * scale + offset
    directions = vertices[rng.integers(0, 24, 60), rng.integers(0, 3, 60)] - origins
    assert assert_agrees(vertices, origins, directions) > 20


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_random_soup_aimed_at_vertices_and_edges_agrees_with_plain_fractions(dtype):
    rng = np.random.default_rng(11)
    vertices = shifted(rng.normal(size=(30, 3, 3)), 148376.0, 1234.0, -223423.0).astype(dtype)
    origins = (vertices.mean(axis=(0, 1)) + 4.0 * rng.normal(size=(80, 3))).astype(dtype)
    pick = vertices[rng.integers(0, 30, 80)]
    s = rng.random((80, 1)) * (rng.random((80, 1)) < 0.5)
    directions = (pick[:, 0] + s * (pick[:, 1] - pick[:, 0]) - origins).astype(dtype)
    assert assert_agrees(vertices, origins, directions) > 30
    assert assert_agrees(vertices, origins, directions, 0.5, 1.0) > 3


def test_mixed_magnitudes_agree_with_plain_fractions():
    rng = np.random.default_rng(5)
    vertices = rng.normal(size=(30, 3, 3)) * 10.0 ** rng.uniform(-12, 12, (30, 1, 1))
    origins = rng.normal(size=(60, 3)) * 10.0 ** rng.uniform(-12, 12, (60, 1))
    target = vertices[rng.integers(0, 30, 60)].mean(axis=1)
    directions = (target - origins) * 10.0 ** rng.uniform(-200, 200, (60, 1))
    assert assert_agrees(vertices, origins, directions) > 40


def test_closed_mesh_has_no_leak_and_the_naive_test_has():
    vertices = globe(16).astype(np.float32)
    rng = np.random.default_rng(3)
    origins = (0.3 * rng.normal(size=(3000, 3))).clip(-0.5, 0.5).astype(np.float32)
    directions = vertices[rng.integers(0, len(vertices), 3000), rng.integers(0, 3, 3000)] - origins
    assert exact.any_hit(vertices, origins, directions).all()
    assert not naive_any(vertices, origins, directions).all()


def naive_any(vertices, origins, directions):
    """Moeller and Trumbore, 1997, in float32 without care."""
    e1, e2 = vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0]
    found = []
    for o, d in zip(origins, directions, strict=True):
        p = np.cross(d, e2)
        inv = np.float32(1.0) / np.einsum("ki,ki->k", e1, p)
        s = o - vertices[:, 0]
        u, q = np.einsum("ki,ki->k", s, p) * inv, np.cross(s, e1)
        v, t = q @ d * inv, np.einsum("ki,ki->k", e2, q) * inv
        found.append(((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)).any())
    return np.array(found)


def test_no_triangles_or_no_rays_gives_empty_answers():
    assert exact.first_hit(np.zeros((0, 3, 3)), [[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])[0][0] == -1
    assert len(exact.first_hit(UNIT, np.zeros((0, 3)), np.zeros((0, 3)))[0]) == 0


def test_bad_arrays_are_refused():
    with pytest.raises(MeshError, match="triangle 0"):
        exact.first_hit(UNIT * np.nan, [[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    with pytest.raises(ValueError, match="float32 or float64"):
        exact.first_hit(UNIT.astype(int), [[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    with pytest.raises(ValueError, match="1 origins, but 2"):
        exact.first_hit(UNIT, [[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]] * 2)


@pytest.mark.slow
def test_hundred_thousand_vertex_rays_are_consistent():
    vertices = globe(32).astype(np.float32)
    rng = np.random.default_rng(9)
    origins = rng.normal(size=(100_000, 3))
    origins = (3.0 * origins / np.linalg.norm(origins, axis=1, keepdims=True)).astype(np.float32)
    directions = vertices[rng.integers(0, len(vertices), 100_000), rng.integers(0, 3, 100_000)] - origins
    count = exact.count_hits(vertices, origins, directions)
    prim, t = exact.first_hit(vertices, origins, directions)
    np.testing.assert_array_equal(prim >= 0, count > 0)
    assert (count != 1).all()  # a line that enters a closed surface leaves it
    assert np.isfinite(t[prim >= 0]).all()
