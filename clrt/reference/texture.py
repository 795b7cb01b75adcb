"""Pictures on surfaces, in float64: coordinates from corners or from longitude and latitude, wrapping, mixing of decoded colours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.reference.geometry import Primitives
from clrt.reference.shade import Surface
from clrt.scene.model import Scene, Texture

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]


def tints(scene: Scene, prims: Primitives, surface: Surface) -> tuple[FloatArray, FloatArray]:
    """What the pictures multiply the colours of m hits by, (m, 3), and the margin (m,): how far each hit is from another texel where
    texels are not mixed, or from a seam, over the hit's error."""
    tint, margin = np.ones((len(surface.prim), 3)), np.full(len(surface.prim), np.inf)
    number = np.array([m.texture for m in scene.materials], np.int64)[surface.material]
    for index in np.unique(number[number >= 0]).tolist():
        rows, texture = np.flatnonzero(number == index), scene.textures[index]
        uv, rate = coordinates(prims, surface.prim[rows], surface.point[rows])
        tint[rows] = looked_up(texture, uv)[:, :3]
        away = from_jumps(texture, uv, rate, surface.prim[rows] >= prims.triangle_count)
        margin[rows] = np.divide(away, surface.pos_err[rows], where=surface.pos_err[rows] > 0.0, out=np.full(len(rows), np.inf))
    return tint, margin


def coordinates(prims: Primitives, prim: IndexArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
    """u, v (m, 2) of points on primitives, and how fast each changes along the surface (m, 2), 1 / length."""
    uv, rate = np.empty((len(prim), 2)), np.empty((len(prim), 2))
    mesh = prim < prims.triangle_count
    corners, values = prims.vertices[prim[mesh]], prims.uvs[prim[mesh]]
    # The gradient g of u in the triangle's plane: g . e1 and g . e2 are the differences of the corners' values.
    edges = corners[:, 1:] - corners[:, :1]
    gradient = np.linalg.pinv(edges) @ (values[:, 1:] - values[:, :1])
    uv[mesh] = values[:, 0] + np.einsum("mi,mic->mc", point[mesh] - corners[:, 0], gradient)
    rate[mesh] = np.linalg.norm(gradient, axis=1)
    sphere = prim[~mesh] - prims.triangle_count
    x, y, z = (point[~mesh] - prims.centers[sphere]).T
    radius, ring = prims.radii[sphere], np.hypot(x, z)
    uv[~mesh] = np.stack([0.5 + np.arctan2(x, -z) / (2.0 * np.pi), 0.5 + np.arctan2(y, ring) / np.pi], axis=1)
    rate[~mesh] = np.stack([1.0 / (2.0 * np.pi * np.maximum(ring, 1e-12 * radius)), 1.0 / (np.pi * radius)], axis=1)
    return uv, rate


def looked_up(texture: Texture, uv: FloatArray) -> FloatArray:
    """(m, 4) linear colours and alpha at uv (m, 2)."""
    height, width = texture.picture.texels.shape[:2]
    place = np.stack([uv[:, 0] * width, (1.0 - uv[:, 1]) * height], axis=1)
    if not texture.linear:
        x, y = np.floor(place).T
        return _texel(texture, x, y)
    low = np.floor(place - 0.5)
    p, q = (place - 0.5 - low).T[:, :, None]
    x, y = low.T
    upper = (1.0 - p) * _texel(texture, x, y) + p * _texel(texture, x + 1.0, y)
    lower = (1.0 - p) * _texel(texture, x, y + 1.0) + p * _texel(texture, x + 1.0, y + 1.0)
    result: FloatArray = (1.0 - q) * upper + q * lower
    return result


def _texel(texture: Texture, x: FloatArray, y: FloatArray) -> FloatArray:
    """(m, 4) linear colours and alpha of the texels x, y (m,), whole numbers of any size. Alpha is never encoded."""
    texels = texture.picture.texels
    height, width = texels.shape[:2]
    code = texels[_wrapped(y, height, texture.wrap), _wrapped(x, width, texture.wrap)]
    value: FloatArray = code / float(np.iinfo(texels.dtype).max)
    if not texture.srgb:
        return value
    value[:, :3] = np.where(value <= 0.04045, value / 12.92, np.power((value + 0.055) / 1.055, 2.4))[:, :3]
    return value


def _wrapped(i: FloatArray, size: int, wrap: str) -> IndexArray:
    if wrap == "clamp":
        return np.clip(i, 0, size - 1).astype(np.int64)
    if wrap == "repeat":
        return np.mod(i, size).astype(np.int64)
    turned = np.mod(i, 2 * size)
    return np.where(turned < size, turned, 2 * size - 1 - turned).astype(np.int64)


def from_jumps(texture: Texture, uv: FloatArray, rate: FloatArray, on_sphere: NDArray[np.bool_]) -> FloatArray:
    """(m,) lengths along the surface to where the colour jumps: between texels not mixed; where longitudes meet without repeating."""
    height, width = texture.picture.texels.shape[:2]
    away = np.full(len(uv), np.inf)
    if not texture.linear:
        place, speed = uv * (width, height), rate * (width, height)
        gap = np.abs(place - np.round(place))
        away = np.divide(gap, speed, where=speed > 0.0, out=np.full_like(gap, np.inf)).min(axis=1)
    if texture.wrap != "repeat":
        seam = np.minimum(uv[:, 0], 1.0 - uv[:, 0]) / np.where(on_sphere, rate[:, 0], 1.0)
        away = np.where(on_sphere, np.minimum(away, seam), away)
    return away
