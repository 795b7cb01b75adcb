"""Normals turned by pictures, in float64: the frame from texture coordinates, and how fast such normals turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from clrt.reference.geometry import Primitives
from clrt.reference.shade import Surface, dot
from clrt.reference.texture import coordinates, from_jumps, looked_up
from clrt.scene.model import Scene, Texture

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

ON_A_LINE = 2.0**-40  #: sine of the angle between two edges on the picture up to which there is no frame
BARELY = 1e-30  #: a curvature above 0, for normals that are not their face's though they do not turn


def tilted(scene: Scene, prims: Primitives, surface: Surface) -> Surface:
    """The surface with the normals that normal maps make of its own, where it has any."""
    number = np.array([m.normal_map for m in scene.materials], np.int64)[surface.material]
    strength = np.array([m.normal_strength for m in scene.materials])[surface.material]
    n_shade, curvature, margin = surface.n_shade.copy(), surface.curvature.copy(), surface.margin.copy()
    for index in np.unique(number[number >= 0]).tolist():
        texture = scene.textures[index]
        rows = np.flatnonzero(number == index)
        x, y, framed = _frames(prims, surface, rows)
        rows, x, y = rows[framed], x[framed], y[framed]
        uv, rate = coordinates(prims, surface.prim[rows], surface.point[rows])
        texel = 2.0 * looked_up(texture, uv)[:, :3] - 1.0
        texel[:, :2] *= strength[rows, None]
        length = np.linalg.norm(texel, axis=1)
        kept = length > 0.0
        rows, x, y, uv, rate, texel, length = (a[kept] for a in (rows, x, y, uv, rate, texel, length))
        texel /= length[:, None]
        turned = texel[:, :1] * x + texel[:, 1:2] * y + texel[:, 2:] * n_shade[rows]
        side = dot(turned, surface.n_geo[rows])
        n_shade[rows] = np.where((side < 0.0)[:, None], -turned, turned)
        curvature[rows] += np.maximum(_steepness(texture, rate) * np.maximum(np.abs(strength[rows]), 1.0) / length, BARELY)
        error = surface.pos_err[rows]
        away = from_jumps(texture, uv, rate, surface.prim[rows] >= prims.triangle_count)
        jumps = np.divide(away, error, where=error > 0.0, out=np.full(len(rows), np.inf))
        margin[rows] = np.minimum(np.minimum(margin[rows], jumps), np.abs(side) / (1.0 + curvature[rows] * error))
    return replace(surface, n_shade=n_shade, curvature=curvature, margin=margin)


def _steepness(texture: Texture, rate: FloatArray) -> FloatArray:
    """(m,) the most that 2 texel - 1 changes a length along the surface, by the greatest step between neighbours of the whole picture."""
    if not texture.linear:
        return np.zeros(len(rate))
    texels = texture.picture.texels[:, :, :3] / float(np.iinfo(texture.picture.texels.dtype).max)
    steps = [np.linalg.norm(texels - np.roll(texels, 1, axis=axis), axis=2).max() * texels.shape[axis] for axis in (1, 0)]
    return np.asarray(2.0 * (rate @ steps))


def _frames(prims: Primitives, surface: Surface, rows: IndexArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Unit x (k, 3), perpendicular to the normal, along u; y (k, 3), perpendicular to both, along v; whether there is such a frame (k,)."""
    x, y, framed = np.zeros((len(rows), 3)), np.zeros((len(rows), 3)), np.zeros(len(rows), np.bool_)
    mesh = surface.prim[rows] < prims.triangle_count
    x[mesh], y[mesh], framed[mesh] = _on_triangles(prims, surface.prim[rows[mesh]], surface.n_shade[rows[mesh]])
    sphere = surface.prim[rows[~mesh]] - prims.triangle_count
    out = surface.point[rows[~mesh]] - prims.centers[sphere]
    east = np.cross([0.0, 1.0, 0.0], out) * -1.0
    ring = np.linalg.norm(east, axis=1)
    east /= np.where(ring > 0.0, ring, 1.0)[:, None]
    north = np.cross(east, out)
    north *= np.where(north[:, 1] < 0.0, -1.0, 1.0)[:, None] / np.linalg.norm(out, axis=1)[:, None]
    x[~mesh], y[~mesh], framed[~mesh] = east, north, ring > 0.0
    return x, y, framed


def _on_triangles(prims: Primitives, tri: IndexArray, n: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    corners, uvs = prims.vertices[tri], prims.uvs[tri]
    edges, sides = corners[:, 1:] - corners[:, :1], uvs[:, 1:] - uvs[:, :1]
    turn = np.abs(np.linalg.det(sides))
    framed = turn > ON_A_LINE * np.prod(np.linalg.norm(sides, axis=2), axis=1)
    # Rows: how the point moves as u grows, and as v grows; edges = sides @ moves.
    moves = np.zeros((len(tri), 2, 3))
    moves[framed] = np.linalg.solve(sides[framed], edges[framed])
    x = moves[:, 0] - dot(moves[:, 0], n)[:, None] * n
    length = np.linalg.norm(x, axis=1)
    framed &= length**2 > ON_A_LINE * dot(moves[:, 0], moves[:, 0])
    x /= np.where(framed, length, 1.0)[:, None]
    y = np.cross(n, x)
    return x, np.where((dot(y, moves[:, 1]) < 0.0)[:, None], -y, y), framed
