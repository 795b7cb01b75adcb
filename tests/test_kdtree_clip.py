"""Clipped bounds against exact rationals: never too narrow, and too wide by no more than the padding and rounding."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from kdtree_meshes import F64, exact_bounds

from clrt.kdtree.clip import PAD, clipped_bounds
from clrt.kdtree.common import round_down, round_up, split_positions


def cases(kind: str, n: int = 400) -> tuple[F64, F64, F64]:
    """Triangles and boxes that meet in many ways."""
    rng = np.random.default_rng(len(kind))
    triangles = rng.normal(size=(n, 3, 3))
    lo = rng.normal(size=(n, 3)) * 0.5 - 0.5
    hi = lo + rng.exponential(size=(n, 3))
    if kind == "offset":
        return triangles + 1e6, lo + 1e6, hi + 1e6
    if kind == "grazing":
        # Nearly in the lower z plane of the box: crossings are ill-conditioned.
        triangles[:, :, 2] = lo[:, None, 2] + rng.normal(size=(n, 3)) * 1e-15
    if kind == "touching":
        triangles, lo = np.round(triangles * 2) / 2, np.round(lo * 2) / 2
        hi = lo + rng.integers(0, 3, (n, 3)) / 2
    if kind == "needle":
        triangles[:, 2] = triangles[:, 1] + rng.normal(size=(n, 3)) * 1e-12
    return triangles, lo, hi


@pytest.mark.parametrize("kind", ["random", "offset", "grazing", "touching", "needle"])
def test_clipped_bounds_hold_the_exact_part_and_little_more(kind: str) -> None:
    triangles, box_lo, box_hi = cases(kind)
    lo, hi = clipped_bounds(triangles, box_lo.T.copy(), box_hi.T.copy())
    met = 0
    for i, triangle in enumerate(triangles):
        exact = exact_bounds(triangle, box_lo[i], box_hi[i])
        if exact is None:
            continue
        met += 1
        assert all(Fraction(float(a)) <= b for a, b in zip(lo[:, i], exact[0], strict=True))
        assert all(Fraction(float(a)) >= b for a, b in zip(hi[:, i], exact[1], strict=True))
        if kind in ("random", "offset"):
            excess = 1e4 * PAD * np.abs(triangle).max()
            assert np.all(lo[:, i] >= np.array(exact[0], float) - excess)
            assert np.all(hi[:, i] <= np.array(exact[1], float) + excess)
    assert met > 40


def test_clipped_bounds_are_tighter_than_those_of_one_plane_at_a_time() -> None:
    # A diagonal: cut by x <= 1 and y <= 1 it ends at z = 1, whichever plane comes first; the box of a box would reach to 2.
    triangle = np.array([[[0, 0, 0], [2, 2, 2], [2, 2, 2.0]]])
    lo, hi = clipped_bounds(triangle, np.array([[0.0], [0], [0]]), np.array([[1.0], [1], [2]]))
    assert hi[2, 0] == pytest.approx(1, abs=1e-12)
    assert hi[2, 0] >= 1
    assert lo[:, 0].tolist() == [0, 0, 0]


def test_part_outside_a_corner_of_the_box_is_empty() -> None:
    # Bounds of triangle and box overlap, the triangle passes the corner (1, 1, 1) outside.
    triangle = np.array([[[3.2, 0, 0], [0, 3.2, 0], [0, 0, 3.2]]])
    lo, hi = clipped_bounds(triangle, np.zeros((3, 1)), np.ones((3, 1)))
    assert (lo > hi).any()


def test_nothing_to_clip_gives_nothing() -> None:
    lo, hi = clipped_bounds(np.zeros((0, 3, 3)), np.zeros((3, 0)), np.zeros((3, 0)))
    assert lo.shape == hi.shape == (3, 0)


def test_rounding_outward_brackets_every_value_within_one_step() -> None:
    rng = np.random.default_rng(1)
    values = np.concatenate([rng.normal(size=500) * 10.0 ** rng.integers(-44, 37, 500), [0, 0.1, 1, -1 / 3, 1e-50, -1e-50]])
    down, up = round_down(values), round_up(values)
    assert np.all(down.astype(np.float64) <= values)
    assert np.all(up.astype(np.float64) >= values)
    assert np.all((down == up) | (np.nextafter(down, np.float32(np.inf)) == up))


def test_split_positions_are_never_subnormal() -> None:
    assert split_positions(np.array([1e-39, -1e-39, 1e-45, 1.5, -2.0**-126])).tolist() == [0, 0, 0, 1.5, -(2.0**-126)]
