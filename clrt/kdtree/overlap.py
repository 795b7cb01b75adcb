"""Whether triangles meet boxes, by separating axes (Akenine-Moeller, 2001): the judge of trees, apart from the builders' clipping."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Bools = NDArray[np.bool_]


def triangles_meet_boxes(triangles: F64, lo: F64, hi: F64, slack: F64) -> Bools:
    """Whether each closed triangle meets its closed box grown by `slack` on all sides.

    triangles : (k, 3, 3) corners; lo, hi : (k, 3); slack : (k,). Boxes with lo > hi meet nothing.

    Thirteen axes: three of the box, the triangle's normal, and nine products of their edges. A projection takes at most 8 operations on
    coordinates relative to the box's centre, so it is off by at most 16 u (u = 2^-53) times the axis times the
    greatest of them. With a slack of 2^-42 of that or more, and boxes within the triangle's bounds, the answer is right for some slack
    between half of the one given and twice it.
    """
    # A power of two brings each triangle to the size of 1, so that no product leaves the range of float64.
    _, exponent = np.frexp(np.abs(triangles).max(axis=(1, 2), initial=0))
    triangles = np.ldexp(triangles, -exponent[:, None, None])
    lo, hi, slack = np.ldexp(lo, -exponent[:, None]), np.ldexp(hi, -exponent[:, None]), np.ldexp(slack, -exponent)
    centre = (lo + hi) / 2
    half = (hi - lo) / 2 + slack[:, None]
    corners = triangles - centre[:, None, :]
    meets = (lo <= hi).all(axis=1)
    meets &= (corners.min(axis=1) <= half).all(axis=1) & (corners.max(axis=1) >= -half).all(axis=1)
    edges = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(edges[:, 0], edges[:, 1])
    meets &= np.abs((normal * corners[:, 0]).sum(axis=1)) <= (np.abs(normal) * half).sum(axis=1)
    for edge in range(3):
        for axis in range(3):
            meets &= _overlap_on_product(corners, half, edges[:, edge], axis)
    return np.asarray(meets)


def _overlap_on_product(corners: F64, half: F64, edge: F64, axis: int) -> Bools:
    """Whether projections overlap on the axis edge x unit vector."""
    b, c = (axis + 1) % 3, (axis + 2) % 3
    projected = corners[:, :, b] * edge[:, None, c] - corners[:, :, c] * edge[:, None, b]
    radius = half[:, b] * np.abs(edge[:, c]) + half[:, c] * np.abs(edge[:, b])
    return np.asarray((projected.min(axis=1) <= radius) & (projected.max(axis=1) >= -radius))
