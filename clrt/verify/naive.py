"""Deliberately naive ray-triangle tests in NumPy float32, as textbooks and examples have them: each fails some hard case.

Not for use: they prove that a case bites. Triangles (n, 3, 3), rays as origins and directions (m, 3); everything is rounded to float32.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.verify.rays import Rays, Triangles

F32 = NDArray[np.float32]
Ints = NDArray[np.int64]
#: distances of pairs: corners (k, 3, 3), origins (k, 3), directions (k, 3), all float32 -> t (k,), inf for a miss
Predicate = Callable[[F32, F32, F32], F32]
_PAIRS_AT_ONCE = 1 << 18  #: pairs tested together: what the processor's cache holds
_ZERO, _ONE = np.float32(0), np.float32(1)


def _columns(x: F32) -> tuple[F32, F32, F32]:
    return x[..., 0], x[..., 1], x[..., 2]


def _cross(a: tuple[F32, F32, F32], b: tuple[F32, F32, F32]) -> tuple[F32, F32, F32]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: tuple[F32, F32, F32], b: tuple[F32, F32, F32]) -> F32:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@dataclass(frozen=True)
class MoellerTrumbore:
    """Moeller and Trumbore (1997) in float32 on absolute coordinates.

    epsilon : determinants below it are taken for parallel rays, as in their paper (1e-6); 0 for none
    nan_hits : comparisons written so that NaN falls through to a hit
    relative : determinants are compared with epsilon |e1| |e2| |d|, from squares, which overflow
    """

    epsilon: float = 0.0
    nan_hits: bool = False
    relative: bool = False

    def __call__(self, corners: F32, origin: F32, direction: F32) -> F32:
        d = _columns(direction)
        e1, e2 = _columns(corners[:, 1] - corners[:, 0]), _columns(corners[:, 2] - corners[:, 0])
        to = _columns(origin - corners[:, 0])
        p = _cross(d, e2)
        det = _dot(e1, p)
        q = _cross(to, e1)
        inverse = _ONE / det
        u, v, t = _dot(to, p) * inverse, _dot(d, q) * inverse, _dot(e2, q) * inverse
        if self.nan_hits:
            miss = (u < _ZERO) | (u > _ONE) | (v < _ZERO) | (u + v > _ONE) | (t <= _ZERO)
            return np.asarray(np.where(miss, np.float32(np.inf), np.where(np.isnan(t), _ZERO, t)))
        hit = (u >= _ZERO) & (v >= _ZERO) & (u + v <= _ONE) & (t > _ZERO) & (t < np.float32(np.inf))
        if self.relative:
            hit &= det * det > np.float32(self.epsilon) ** 2 * (_dot(e1, e1) * _dot(e2, e2) * _dot(d, d))
        else:
            hit &= np.abs(det) > np.float32(self.epsilon)
        return np.asarray(np.where(hit, t, np.float32(np.inf)))


def contracted_edges(corners: F32, origin: F32, direction: F32) -> F32:
    """Edge functions of Woop, Benthin and Wald (2013), whose differences of products a compiler has contracted to FMAs.

    a b - c d becomes fma(a, b, -(c d)): the neighbour's edge function is no longer its exact opposite, and rays pass between.
    The FMA is by float64, which holds the product of two float32 numbers exactly.
    """
    rows = np.arange(len(direction))
    kz = np.abs(direction).argmax(axis=1)
    kx, ky = (kz + 1) % 3, (kz + 2) % 3
    relative = corners - origin[:, None, :]
    dx, dy, dz = direction[rows, kx], direction[rows, ky], direction[rows, kz]
    sx, sy = dx / dz, dy / dz
    z = relative[rows, :, kz]
    x = (relative[rows, :, kx] - sx[:, None] * z).T
    y = (relative[rows, :, ky] - sy[:, None] * z).T
    w = [_contracted(x[b], y[a], y[b], x[a]) for a, b in ((1, 2), (2, 0), (0, 1))]
    inside = ((w[0] >= 0) & (w[1] >= 0) & (w[2] >= 0)) | ((w[0] <= 0) & (w[1] <= 0) & (w[2] <= 0))
    det = w[0] + w[1] + w[2]
    t = (w[0] * z[:, 0] + w[1] * z[:, 1] + w[2] * z[:, 2]) / dz / det
    hit = inside & (det != _ZERO) & (t > _ZERO)
    return np.asarray(np.where(hit, t, np.float32(np.inf)))


def _contracted(a: F32, b: F32, c: F32, d: F32) -> F32:
    """fma(a, b, -(c d)) in float32."""
    product = (c * d).astype(np.float64)
    return (a.astype(np.float64) * b.astype(np.float64) - product).astype(np.float32)


TEXTBOOK = MoellerTrumbore()


def brute_force(
    tri: Triangles, rays: Rays, predicate: Predicate = TEXTBOOK, *, last_wins: bool = False
) -> tuple[Ints, F32]:
    """All triangles against all rays: (prim_id, -1 for a miss; t, inf for a miss). Of equal t the first wins, or the last."""
    corners, origins, along = (np.ascontiguousarray(x, np.float32) for x in (tri, rays.origins, rays.directions))
    n = max(1, len(corners))
    best, t_best = np.full(len(origins), -1, np.int64), np.full(len(origins), np.inf, np.float32)
    step = max(1, _PAIRS_AT_ONCE // n)
    with np.errstate(all="ignore"):
        for start in range(0, len(origins), step):
            part = slice(start, start + step)
            rows = len(origins[part])
            which, ray = np.tile(np.arange(len(corners)), rows), np.repeat(np.arange(start, start + rows), len(corners))
            t = predicate(corners[which], origins[ray], along[ray]).reshape(rows, -1)
            order = t[:, ::-1] if last_wins else t
            place = order.argmin(axis=1)
            t_best[part] = order[np.arange(rows), place]
            best[part] = np.where(np.isfinite(t_best[part]), len(corners) - 1 - place if last_wins else place, -1)
    return best, t_best
