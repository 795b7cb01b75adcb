"""GGX surfaces in float64 as docs/conventions.md has them, for the tests alone: formulas as they stand, integrals by midpoints."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import Scene

FloatArray = NDArray[np.float64]


def alpha_of(roughness: float) -> float:
    return max(roughness**2, 1e-4)


def smith_lambda(cosine: FloatArray, alpha: float) -> FloatArray:
    """Heitz 2014, equation 72."""
    tangent_2 = 1.0 / cosine**2 - 1.0
    return np.asarray((np.sqrt(1.0 + alpha**2 * tangent_2) - 1.0) / 2.0)


def density(cosine: FloatArray, alpha: float) -> FloatArray:
    """D, Walter and others 2007, equation 33."""
    tangent_2 = 1.0 / cosine**2 - 1.0
    return np.asarray(alpha**2 / (np.pi * cosine**4 * (alpha**2 + tangent_2) ** 2))


def lobe(view: FloatArray, light: FloatArray, alpha: float) -> tuple[FloatArray, FloatArray]:
    """D G2 / (4 cos cos) times the cosine of the light, and the cosine between viewer and facet. Unit vectors (..., 3), z the normal."""
    half = view + light
    half = half / np.linalg.norm(half, axis=-1, keepdims=True)
    o, i = view[..., 2], np.maximum(light[..., 2], 1e-12)
    g2 = 1.0 / (1.0 + smith_lambda(o, alpha) + smith_lambda(i, alpha))
    value = density(half[..., 2], alpha) * g2 / (4.0 * o)
    return np.where(light[..., 2] > 0.0, value, 0.0), (view * half).sum(-1)


@lru_cache(maxsize=512)
def means(cosine: float, alpha: float, steps: int = 500) -> tuple[float, float]:
    """E, and the mean of (1 - V.h)^5 in the lobe, B; facets by midpoints of D cos."""
    part, phi = (np.arange(steps) + 0.5) / steps, (np.arange(steps) + 0.5) / steps * np.pi
    tangent = alpha * np.sqrt(1.0 / (1.0 - part) ** 2 - 1.0)[:, None]  # part: 1 - sqrt(1 - r), r the rank under D cos
    m_z = 1.0 / np.sqrt(1.0 + tangent**2)
    met = m_z * (cosine + np.sqrt(1.0 - cosine**2) * tangent * np.cos(phi))
    out = 2.0 * met * m_z - cosine
    seen = (met > 0.0) & (out > 0.0)
    g2 = 1.0 / (1.0 + smith_lambda(np.asarray(cosine), alpha) + smith_lambda(np.where(seen, out, 1.0), alpha))
    weight = np.where(seen, g2 * met / (cosine * m_z), 0.0) * 2.0 * (1.0 - part)[:, None]
    whole = float(weight.mean())
    return whole, float((weight * (1.0 - np.minimum(met, 1.0)) ** 5).mean()) / whole


@lru_cache(maxsize=512)
def cosine_mean(cosine: float, steps: int = 400) -> float:
    """K: the mean of (1 - V.h)^5 over directions weighted by their cosine."""
    z = np.sqrt((np.arange(steps) + 0.5) / steps)[:, None]
    phi = (np.arange(steps) + 0.5) / steps * np.pi
    dot = cosine * z + np.sqrt(1.0 - cosine**2) * np.sqrt(1.0 - z**2) * np.cos(phi)
    return float(((1.0 - np.sqrt((1.0 + dot) / 2.0)) ** 5).mean())


def metal_rough(
    view: FloatArray, light: FloatArray, color: FloatArray, metallic: float, roughness: float
) -> FloatArray:
    """f cos (..., 3) of one view (3,) for lights (..., 3): glTF 2.0, appendix B, with E and S of docs/conventions.md."""
    alpha = alpha_of(roughness)
    whole, grazing = means(float(view[2]), alpha)
    share = min(1.0, (1.0 - grazing) / (1.0 - cosine_mean(float(view[2]))))
    value, met = lobe(view, light, alpha)
    f0 = 0.04 * (1.0 - metallic) + color * metallic
    f = f0 + (1.0 - f0) * ((1.0 - met) ** 5)[..., None]
    matte = (1.0 - f) * (1.0 - metallic) * color * share / np.pi * np.maximum(light[..., 2], 0.0)[..., None]
    return np.asarray(matte + f * (value / whole)[..., None])


def pixel_views(scene: Scene, column: int, row: int, steps: int) -> FloatArray:
    """(steps^2, 3) unit directions of the eye's rays through the middles of a pixel's parts."""
    part = (np.arange(steps) + 0.5) / steps
    s = ((column + part) / scene.camera.width)[None, :, None]
    t = ((row + part) / scene.camera.height)[:, None, None]
    ul, ur, ll, lr = scene.camera.corners
    d = (1 - s) * (1 - t) * ul + s * (1 - t) * ur + (1 - s) * t * ll + s * t * lr
    return np.asarray(d / np.linalg.norm(d, axis=-1, keepdims=True)).reshape(-1, 3)
