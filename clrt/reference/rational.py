"""Ray against triangle in exact arithmetic: float64 numbers as integers times a power of two.

Python's integers have no limit, so every sum and product below is exact, at any magnitude from denormals to 1e308.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
BigArray = NDArray[np.object_]

BATCH = 20_000  #: pairs at a time, some 10 kB of integers each


def evaluate(vertices: FloatArray, origins: FloatArray, directions: FloatArray) -> tuple[BoolArray, BigArray, BigArray]:
    """Where the whole line meets the closed triangle, for k pairs.

    vertices : (k, 3, 3), origins, directions : (k, 3) float64, finite; taken as the exact numbers they are
    Returns hit (k,) bool: the line crosses the triangle's plane in one point, which lies in the closed triangle (so never for a line in
    the plane, a zero direction or a triangle of zero area), and t = numerator / denominator, (k,) Python integers each, the denominator
    positive where hit and 1 elsewhere.
    """
    hit = np.zeros(len(vertices), np.bool_)
    numerator, denominator = np.empty(len(vertices), object), np.empty(len(vertices), object)
    for start in range(0, len(vertices), BATCH):
        part = slice(start, start + BATCH)
        hit[part], numerator[part], denominator[part] = _evaluate(vertices[part], origins[part], directions[part])
    return hit, numerator, denominator


def _evaluate(vertices: FloatArray, origins: FloatArray, directions: FloatArray) -> tuple[BoolArray, BigArray, BigArray]:
    points, exponent = _integers(np.concatenate([vertices.reshape(-1, 9), origins], axis=1))
    d, d_exponent = _integers(directions)
    o = points[9:]
    a, b, c = ([points[3 * k + axis] - o[axis] for axis in range(3)] for k in range(3))
    b_x_c = _cross(b, c)
    w0, w1, w2 = _dot(d, b_x_c), _dot(d, _cross(c, a)), _dot(d, _cross(a, b))
    # The plane's normal is n = A x B + B x C + C x A, so that d . n is the sum of the three, and A . n = A . (B x C).
    d_n, a_n = w0 + w1 + w2, _dot(a, b_x_c)
    inside = ((w0 >= 0) & (w1 >= 0) & (w2 >= 0)) | ((w0 <= 0) & (w1 <= 0) & (w2 <= 0))
    hit = (inside & (d_n != 0)).astype(np.bool_)
    # t is a length over a direction: the two powers of two join the numerator or the denominator.
    shift = np.where(hit, exponent - d_exponent, 0)
    sign = np.where(d_n < 0, -1, 1).astype(object)
    numerator = np.where(hit, a_n * sign, 0) << np.maximum(shift, 0).astype(object)
    denominator = np.where(hit, d_n * sign, 1) << np.maximum(-shift, 0).astype(object)
    return hit, numerator, denominator


def _integers(x: FloatArray) -> tuple[list[BigArray], IndexArray]:
    """(k, c) float64 -> c columns of k Python integers and (k,) exponents, with x == integer * 2^exponent a row."""
    mantissa, exponent = np.frexp(x)
    digits = np.ldexp(mantissa, 53).astype(np.int64)
    power = exponent.astype(np.int64) - 53
    lowest = np.where(digits == 0, np.int64(4096), power).min(axis=1)
    shift = np.where(digits == 0, 0, power - lowest[:, None])
    big = digits.astype(object) << shift.astype(object)
    return [big[:, column] for column in range(x.shape[1])], lowest


def _cross(p: list[BigArray], q: list[BigArray]) -> list[BigArray]:
    return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]


def _dot(p: list[BigArray], q: list[BigArray]) -> BigArray:
    total: BigArray = p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
    return total


def rounded(numerator: BigArray, denominator: BigArray) -> FloatArray:
    """The quotients as correctly rounded float64 (Python's division of integers is); beyond the range +-inf."""
    return np.array([_divide(p, q) for p, q in zip(numerator, denominator, strict=True)], np.float64)


def _divide(p: int, q: int) -> float:
    try:
        return p / q
    except OverflowError:
        return np.inf if p > 0 else -np.inf


def inside_range(
    t: FloatArray, numerator: BigArray, denominator: BigArray, t_min: FloatArray, t_max: FloatArray
) -> BoolArray:
    """t_min < numerator / denominator < t_max, exactly. `t` is the rounded quotient.

    Rounding is monotone and the bounds are float64: only where t equals a bound is there anything left to decide.
    """
    above, below = t > t_min, t < t_max
    for k in np.flatnonzero(t == t_min):
        above[k] = t_min[k] == -np.inf or (np.isfinite(t_min[k]) and Fraction(numerator[k], denominator[k]) > Fraction(t_min[k]))
    for k in np.flatnonzero(t == t_max):
        below[k] = t_max[k] == np.inf or (np.isfinite(t_max[k]) and Fraction(numerator[k], denominator[k]) < Fraction(t_max[k]))
    return above & below


def nearest(ray: IndexArray, prim: IndexArray, t: FloatArray, numerator: BigArray, denominator: BigArray) -> IndexArray:
    """One pair a ray, ordered by ray: the least exact t, among equals the lowest primitive.

    ray, prim : (k,); t : (k,) rounded quotients. Returns indices into the pairs.
    """
    order = np.lexsort((prim, t, ray))
    if not len(order):
        return order
    starts = np.flatnonzero(np.r_[True, ray[order][1:] != ray[order][:-1]])
    ends = np.r_[starts[1:], len(order)]
    best: IndexArray = order[starts]
    # Rounding is monotone: only pairs of the same rounded t as the first can beat it.
    follows = np.zeros(len(starts), np.bool_)
    several = ends - starts > 1
    follows[several] = t[order[starts[several] + 1]] == t[order[starts[several]]]
    for k in np.flatnonzero(follows):
        tied = [int(p) for p in order[starts[k] : ends[k]] if t[p] == t[best[k]]]
        best[k] = min(tied, key=lambda p: (Fraction(int(numerator[p]), int(denominator[p])), int(prim[p])))
    return best
