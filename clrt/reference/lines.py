"""Which triangles may a line meet? A conservative float64 sieve over all (ray, triangle) pairs, as matrix products.

The line of a ray (o, d) passes a triangle on the inside where the three numbers

    w0 = d . (B x C),  w1 = d . (C x A),  w2 = d . (A x B)      with A = v0 - o, B = v1 - o, C = v2 - o

have no two opposite signs (Pluecker's criterion). Each w is linear in the six Pluecker coordinates of the line:

    d . ((a - o) x (b - o)) = d . (a x b) + (d x o) . (a - b)

so that all pairs are three products of an (m, 6) by a (6, n) matrix. Coordinates are first divided by a power of two (no
overflow) and taken from the centre of the triangles' box (no loss at large offsets).

Error bound, u = 2^-53, gamma(k) = k u / (1 - k u) (Higham 2002, ch. 3). The shifted coordinates have one rounding each, a - b is
taken from the given numbers with one rounding. The abs-cross product of two vectors is at most sqrt(2) times the product of their
lengths, hence with Cauchy-Schwarz

    a x b      off by gamma(4) sqrt(2) |a||b|      (two shifts, product, difference)
    d x o      off by gamma(3) sqrt(2) |d||o|
    the dot product of six terms, summed in any order, fused or not: gamma(6) of the sum of absolute terms
    |w - w_exact| <= 10 sqrt(2) u |d| (|a||b| + |o||a - b|) + O(u^2)  <  16 u |d| (|a||b| + |o||a - b|).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

UNIT_ROUNDOFF = 2.0**-53
LINE_ERROR = 16.0 * UNIT_ROUNDOFF  #: the bound above, over |d| (|a||b| + |o||a - b|)
SAFETY = 100.0  #: every bound is widened by this factor: a slip in a derivation costs time, never a wrong answer
UNDERFLOW = 1e-290  #: above every absolute error of underflow, where all coordinates are at most about 1
TILE_BYTES = 24 << 20  #: default memory of one tile of pairs
BYTES_PER_PAIR = 64  #: three products, minimum, maximum, masks


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """The edges of n triangles as columns, ready to multiply.

    exponent : coordinates are multiplied by 2^-exponent
    center : (3,) the origin of the shifted coordinates, already scaled
    columns : (3, 6, n) for w0, w1, w2: rows 0..2 a x b, rows 3..5 a - b
    length : (3, n) |a - b|; product : (3, n) |a||b|; reach : (3, n) max(|a|, |b|)
    middle : (n, 3), radius : (n,) a ball around each triangle, scaled and shifted
    """

    exponent: int
    center: FloatArray
    columns: FloatArray
    length: FloatArray
    product: FloatArray
    reach: FloatArray
    middle: FloatArray
    radius: FloatArray

    @classmethod
    def build(cls, vertices: FloatArray, largest: float) -> EdgeTable:
        """vertices : (n, 3, 3) float64, finite. `largest`: no coordinate of vertices or ray origins is greater."""
        exponent = int(np.frexp(largest)[1]) if largest > 0.0 else 0
        scaled = np.ldexp(vertices, -exponent)
        corners = scaled.reshape(-1, 3)
        center = (corners.min(axis=0) + corners.max(axis=0)) / 2.0 if len(corners) else np.zeros(3)
        a = scaled[:, [1, 2, 0]].transpose(1, 2, 0)  # edge k runs from corner k+1 to corner k+2: (3, 3, n)
        b = scaled[:, [2, 0, 1]].transpose(1, 2, 0)
        difference = a - b
        a, b = a - center[:, None], b - center[:, None]
        columns = np.concatenate([np.cross(a, b, axis=1), difference], axis=1)
        len_a, len_b = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
        middle = (scaled.min(axis=1) + scaled.max(axis=1)) / 2.0
        radius = np.linalg.norm(scaled - middle[:, None], axis=2).max(axis=1, initial=0.0)
        return cls(exponent, center, columns, np.linalg.norm(difference, axis=1), len_a * len_b, np.maximum(len_a, len_b),
                   middle - center, radius)  # fmt: skip

    def __len__(self) -> int:
        return len(self.radius)

    def rounding_scale(self, origin_norm: float) -> FloatArray:
        """(3, n): |a||b| + |o||a - b|, what LINE_ERROR is relative to, for origins up to `origin_norm` from the centre."""
        return self.product + origin_norm * self.length

    def angle_scale(self, origin_norm: float) -> FloatArray:
        """(3, n): at least |a - b| times the distance from the origin to any point of the edge."""
        return self.length * (origin_norm + self.reach)


@dataclass(frozen=True, eq=False)
class Lines:
    """m lines, scaled to a table: origin (m, 3) from its centre; direction (m, 3), greatest component in [0.5, 1).

    direction_exponent : (m,) the given direction is direction * 2^direction_exponent
    """

    origin: FloatArray
    direction: FloatArray
    direction_exponent: IndexArray

    @classmethod
    def build(cls, table: EdgeTable, origins: FloatArray, directions: FloatArray) -> Lines:
        """origins, directions : (m, 3) float64, finite; directions not zero."""
        exponent = np.frexp(np.abs(directions).max(axis=1, initial=0.0))[1].astype(np.int64)
        return cls(np.ldexp(origins, -table.exponent) - table.center, np.ldexp(directions, -exponent[:, None]), exponent)


def near_pairs(
    table: EdgeTable, lines: Lines, band: FloatArray | None = None, tile_bytes: int = TILE_BYTES
) -> Iterator[tuple[IndexArray, IndexArray]]:
    """All pairs (ray, triangle) whose line meets the triangle or passes it closely, tile by tile; others may be among them.

    band : (m,) pairs are kept where the line passes each edge on the inside, or outside at less than `band` times |a - b| times the
        distance; None keeps those that rounding cannot rule out.
    Tiles hold at most about `tile_bytes`. Rays are visited in the order of their distance from the triangles.
    """
    pairs = max(1024, tile_bytes // BYTES_PER_PAIR)
    n_tile = max(1, min(len(table), 2048))
    m_tile = max(1, pairs // n_tile)
    norms = np.linalg.norm(lines.origin, axis=1)
    order = np.argsort(norms, kind="stable")
    for start in range(0, len(order), m_tile):
        rays = order[start : start + m_tile]
        scale, limit = _thresholds(table, float(norms[rays[-1]]), None if band is None else band[rays])
        o, d = lines.origin[rays], lines.direction[rays]
        rows = np.concatenate([d, np.cross(d, o)], axis=1)
        columns = table.columns / scale[:, None, :]
        for first in range(0, len(table), n_tile):
            i, j = _sieve(rows, columns[:, :, first : first + n_tile], limit)
            j = j + first
            close = _meets_ball(table, o[i], d[i], j) if band is None else slice(None)
            yield rays[i[close]], j[close]


def _thresholds(table: EdgeTable, origin_norm: float, band: FloatArray | None) -> tuple[FloatArray, FloatArray]:
    """Column scale (3, n), a power of two, and limit (m or 1, 1): |w| / scale beyond the limit surely has the sign of w.

    |d| < 2 for the scaled directions. With a band, edges too short for it are held to their rounding error instead: the scale is at
    least 1e-6 of the rounding scale, and the limit grows by 1e6 rounding errors (1e-6 in all).
    """
    rounding = table.rounding_scale(origin_norm)
    error = SAFETY * 2.0 * LINE_ERROR
    if band is None:
        scale, limit = rounding, np.full((1, 1), error)
    else:
        scale, limit = np.maximum(table.angle_scale(origin_norm), 1e-6 * rounding), (2.0 * band + 1e6 * error)[:, None]
    scale = np.ldexp(1.0, np.frexp(np.maximum(scale, UNDERFLOW / error))[1])
    return scale, limit


def _sieve(rows: FloatArray, columns: FloatArray, limit: FloatArray) -> tuple[IndexArray, IndexArray]:
    """The pairs of a tile whose w0, w1, w2 have no two surely opposite signs."""
    w = rows @ columns[0]
    low, high = w.copy(), w
    for k in (1, 2):
        w = rows @ columns[k]
        np.minimum(low, w, out=low)
        np.maximum(high, w, out=high)
    i, j = np.nonzero((low >= -limit) | (high <= limit))
    return i, j


def _meets_ball(table: EdgeTable, o: FloatArray, d: FloatArray, j: IndexArray) -> NDArray[np.bool_]:
    """Not surely off the ball around triangle j. Relative error of the distance below 20 u (|c - o|); held to 1e-12."""
    to_ball = table.middle[j] - o
    distance = np.linalg.norm(np.cross(to_ball, d), axis=1) / np.linalg.norm(d, axis=1)
    slack = 1e-12 * (np.linalg.norm(to_ball, axis=1) + np.linalg.norm(table.middle[j], axis=1) + np.linalg.norm(o, axis=1))
    near: NDArray[np.bool_] = distance <= table.radius[j] * (1.0 + 1e-12) + slack + UNDERFLOW
    return near
