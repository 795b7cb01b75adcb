"""Where shadow rays leave a coarse smooth mesh: not from its faces, but from the curved surface that they stand for.

Hanika, "Hacking the Shadow Terminator" (Ray Tracing Gems II, 2021, chapter 4). Formula and limits: docs/conventions.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


def lifts(
    corners: FloatArray, normals: FloatArray, weights: FloatArray, point: FloatArray, n_geo: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """From hit points to the curved surface: sum of b_i max(0, (V_i - P).n_i) n_i, and up to the face where that lies below it.

    corners : (m, 3, 3) V_i; normals : (m, 3, 3) unit n_i, on the side of the shading normal; weights : (m, 3) b_i; point : (m, 3) P
    n_geo : (m, 3) unit, on the viewer's side
    Returns the lift (m, 3), and by how much at most an error of P in the face's plane grows in P + lift (m,).
    """
    depth = np.maximum(np.einsum("mci,mci->mc", corners - point[:, None], normals), 0.0)
    parts = depth[:, :, None] * normals
    lift = np.einsum("mc,mci->mi", weights, parts)
    lift -= np.minimum(np.einsum("mi,mi->m", lift, n_geo), 0.0)[:, None] * n_geo
    # The derivative by P: that of the projections turns nothing longer; that of the weights is parts times their gradients.
    change = np.linalg.norm(np.einsum("mci,mcj->mij", parts, _gradients(corners, n_geo)), axis=(1, 2))
    return lift, 1.0 + change


def _gradients(corners: FloatArray, n_geo: FloatArray) -> FloatArray:
    """(m, 3, 3) of the barycentric weights: n x (the opposite edge) / twice the area, up to one sign for all; zero for no area."""
    edges = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    across = np.cross(n_geo[:, None], edges)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)[:, None, None]
    gradients: FloatArray = np.divide(across, area, where=area > 0.0, out=np.zeros_like(across))
    return gradients


def face_between(
    corners: FloatArray, n_geo: FloatArray, point: FloatArray, lift: FloatArray, light: FloatArray, pos_err: FloatArray
) -> tuple[BoolArray, FloatArray]:
    """Does the face itself stand between its lifted points and the light? Only where the light is behind its plane.

    point : (m, 3) on the face; pos_err : (m,) of point + lift; light : (3,), at none of these points
    Returns the answer (m,) and how far it is from another (m,), in units of the errors of Rays.
    """
    height, behind = np.einsum("mi,mi->m", lift, n_geo), np.einsum("mi,mi->m", light - point, n_geo)
    start = point + lift
    way = light - start
    length = np.linalg.norm(way, axis=1)
    fall = height - behind  # of the whole way
    below = (behind <= 0.0) & (fall > 0.0)
    s = np.divide(height, fall, where=below, out=np.zeros_like(height))
    inside = _depth_inside(corners, n_geo, start + s[:, None] * way)
    # Where the way meets the plane is off by the error of its start, slanted, and by the distance times that of its direction.
    sine = np.divide(fall, length, where=below, out=np.ones_like(fall))
    error = (pos_err + s * length) / sine
    moved = pos_err / length
    closeness = np.where(below, np.abs(inside) / error, np.abs(behind) / length / (1.0 + moved))
    return below & (inside >= 0.0), closeness


def _depth_inside(corners: FloatArray, n_geo: FloatArray, point: FloatArray) -> FloatArray:
    """(m,) least distance of points of the plane from the three edges' lines, negative outside (then at most the distance)."""
    edges = np.roll(corners, -1, axis=1) - corners
    inward = np.cross(n_geo[:, None], edges)
    around = np.einsum("mi,mi->m", np.cross(edges[:, 0], edges[:, 1]), n_geo)
    inward = np.where((around < 0.0)[:, None, None], -inward, inward)
    length = np.linalg.norm(inward, axis=2, keepdims=True)
    inward = np.divide(inward, length, where=length > 0.0, out=np.zeros_like(inward))
    depth: FloatArray = np.einsum("mci,mci->mc", point[:, None] - corners, inward).min(axis=1, initial=np.inf)
    return depth
