"""Geometry of a scene's triangles, against rational arithmetic and plain search."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from clrt.scene.model import FloatArray
from clrt.scene.triangles import components, face_normals, scaled, unit


def test_components_match_a_flood_fill() -> None:
    rng = np.random.default_rng(2)
    for count, points in ((1, 3), (40, 30), (60, 90), (300, 500)):
        faces = rng.integers(0, points, (count, 3))
        found = components(rng.standard_normal((points, 3))[faces])
        assert found.tolist() == flood_fill(faces.tolist())


def flood_fill(faces: list[list[int]]) -> list[int]:
    """Component numbers by the plainest method there is."""
    number = [-1] * len(faces)
    for seed in range(len(faces)):
        if number[seed] >= 0:
            continue
        label, stack = max(number) + 1, [seed]
        while stack:
            face = stack.pop()
            if number[face] < 0:
                number[face] = label
                stack += [other for other in range(len(faces)) if set(faces[face]) & set(faces[other])]
    return number


def test_components_of_a_long_shuffled_strip_are_one() -> None:
    order = np.random.default_rng(4).permutation(20_000)
    x = order.astype(float)
    zero = np.zeros_like(x)
    strip = np.stack([np.stack([x, zero, zero], 1), np.stack([x + 1, zero, zero], 1), np.stack([x, zero + 1, x], 1)], 1)
    assert not components(strip).any()


def exact_cross(triangle: list[list[float]]) -> list[Fraction]:
    (ax, ay, az), (bx, by, bz) = ([Fraction(c) - Fraction(o) for c, o in zip(p, triangle[0], strict=True)] for p in triangle[1:])
    return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]


def needles() -> FloatArray:
    """Triangles whose corners lie in a line, some exactly, most but for roundings."""
    rng = np.random.default_rng(9)
    start, step = rng.uniform(-10, 10, (200, 3)), rng.uniform(-1, 1, (200, 3))
    start[:100], step[:100] = np.round(start[:100]), np.round(step[:100])
    near = np.stack([start, start + step, start + 3 * step], axis=1)
    # Exactly in a line through the origin, with differences that float64 cannot hold.
    multiples = start[100:, None, :] * np.array([-1.0, 2.0**40, 2.0**20])[:, None]
    # (1 + e)(1 - e) - 1 is not 0, but rounds to it; 2^53 - 0.5 rounds to 2^53.
    e = 2.0**-52
    lost = np.array([[[0, 0, 0], [1 + e, 1, 0], [1, 1 - e, 0]], [[0.5, 0, 0], [2.0**53, 2.0**53, 0], [2.0**54, 2.0**54, 0]]])
    return np.concatenate([near, multiples, lost])


def test_area_is_zero_exactly_where_rational_arithmetic_says_so() -> None:
    triangles = needles()
    flat = [not any(exact_cross(t)) for t in triangles.tolist()]
    assert 150 < sum(flat) < 250  # both kinds occur
    assert (face_normals(triangles) == 0.0).all(axis=1).tolist() == flat


def test_plain_cross_product_decides_needles_wrongly_in_both_ways() -> None:
    triangles = needles()
    plain = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    flat = np.array([not any(exact_cross(t)) for t in triangles.tolist()])
    called_flat = np.logical_not(plain.any(axis=1))
    assert (called_flat & ~flat).any()
    assert (~called_flat & flat).any()


def test_normals_of_needles_match_rational_arithmetic() -> None:
    triangles = needles()
    normals = face_normals(triangles)
    for triangle, normal in zip(triangles.tolist(), normals, strict=True):
        cross = exact_cross(triangle)
        largest = max(map(abs, cross))
        if largest:
            exact = np.array([float(c / largest) for c in cross])
            np.testing.assert_allclose(normal, exact / np.linalg.norm(exact), atol=2.0**-23)


@pytest.mark.parametrize("scale", [1e-300, 1e-30, 2.0**-500, 1.0, 1e30, 5e-324])
def test_normals_survive_any_scale(scale: float) -> None:
    triangle = np.array([[[0.0, 0, 1], [2, 0, 1], [0, 2, 3]]]) * scale
    expected = np.array([[0.0, -(0.5**0.5), 0.5**0.5]])
    np.testing.assert_allclose(face_normals(triangle), expected, atol=1e-15)
    np.testing.assert_allclose(unit(np.array([[0.0, -3.0, 3.0]]) * scale), expected, atol=1e-15)


def test_unit_vectors_have_length_one_to_four_ulp() -> None:
    vectors = np.random.default_rng(1).standard_normal((2000, 3)) * 10.0 ** np.linspace(-300, 300, 2000)[:, None]
    for vector, result in zip(vectors.tolist(), unit(vectors).tolist(), strict=True):
        squared = sum((Fraction(c) ** 2 for c in result), Fraction(0))
        assert abs(squared - 1) < Fraction(8, 2**52)
        cosine_of_sides = result[0] * vector[1] - result[1] * vector[0]
        assert abs(cosine_of_sides) <= 4 * 2.0**-52 * max(map(abs, vector))


@pytest.mark.parametrize("exponent", [-1060, -1001, -999, 0, 999, 1001, 1020])
def test_scaling_is_by_powers_of_two_at_any_size(exponent: int) -> None:
    rng = np.random.default_rng(7)
    vectors = np.ldexp(rng.uniform(-1, 1, (50, 3)), exponent + rng.integers(-3, 3, (50, 1)))
    vectors[0, 1] = -0.0
    for vector, result in zip(vectors.tolist(), scaled(vectors).tolist(), strict=True):
        shift = math.frexp(max(map(abs, vector)))[1]
        assert [math.ldexp(x, -shift) for x in vector] == result
        assert [math.copysign(1, x) for x in vector] == [math.copysign(1, x) for x in result]
