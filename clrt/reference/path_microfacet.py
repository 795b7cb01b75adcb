"""Rough surfaces as mirrors without number: the GGX distribution of facets, what its single reflections hand on, and draws of its facets.

D by Trowbridge and Reitz (1975), Walter and others (2007, equation 33); masking and shadowing by Smith, correlated by height (Heitz
2014, equation 99). Evaluated as the formulas stand, drawn by all facets' normals and not by the visible ones.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from clrt.reference.path_world import Generator

FloatArray = NDArray[np.float64]

COSINES = np.maximum(np.linspace(0.0, 1.0, 129) ** 2, 1e-6)  #: of tables, closer together at 0; linear in between
STEPS = 256  #: of the quadrature behind them, each way


def density(n_h: FloatArray, alpha: FloatArray) -> FloatArray:
    """D: area of facets by solid angle of their normals, over that of the surface; n_h : cosine between facet and surface, > 0."""
    return np.asarray(alpha**2 / (np.pi * (n_h**2 * (alpha**2 - 1.0) + 1.0) ** 2))


def visibility(n_v: FloatArray, n_l: FloatArray, alpha: FloatArray) -> FloatArray:
    """G2 / (4 n_v n_l), both cosines > 0: the part of the facets that is seen from both sides."""
    from_light = n_v * np.sqrt(n_l**2 * (1.0 - alpha**2) + alpha**2)
    from_viewer = n_l * np.sqrt(n_v**2 * (1.0 - alpha**2) + alpha**2)
    return np.asarray(0.5 / (from_light + from_viewer))


def masking(cosine: FloatArray, alpha: FloatArray) -> FloatArray:
    """G1: the part of the facets that is seen from one side, under the cosine > 0."""
    return np.asarray(2.0 * cosine / (cosine + np.sqrt(alpha**2 + (1.0 - alpha**2) * cosine**2)))


def lobe(view: FloatArray, normal: FloatArray, direction: FloatArray, alpha: FloatArray) -> FloatArray:
    """(m,) f cos of facets that reflect all light, 0 where either direction is below the surface; view, normal, direction : (m, 3) unit."""
    half = view + direction
    half = half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-300)
    n_v, n_l, n_h = (np.einsum("mi,mi->m", normal, w) for w in (view, direction, half))
    above = (n_v > 0.0) & (n_l > 0.0)
    n_v, n_l = np.where(above, n_v, 1.0), np.where(above, n_l, 1.0)
    return np.where(above, density(n_h, alpha) * visibility(n_v, n_l, alpha) * n_l, 0.0)


def albedo(n_v: FloatArray, alpha: FloatArray) -> FloatArray:
    """(m,) what the lobe of facets that reflect all light hands on in all: its integral over all directions."""
    return _looked_up(n_v, alpha, 0)


def grazing(n_v: FloatArray, alpha: FloatArray) -> FloatArray:
    """(m,) the mean of (1 - v.h)^5 over that lobe."""
    return _looked_up(n_v, alpha, 1)


def _looked_up(n_v: FloatArray, alpha: FloatArray, which: int) -> FloatArray:
    result = np.empty(len(n_v))
    for value in np.unique(alpha).tolist():
        rows = alpha == value
        result[rows] = np.interp(np.clip(n_v[rows], 0.0, 1.0), COSINES, lobe_tables(value)[which])
    return result


@lru_cache(maxsize=64)
def lobe_tables(alpha: float) -> tuple[FloatArray, FloatArray]:
    """The albedo at COSINES, and the mean of (1 - v.h)^5."""
    n_h, side, counts = facet_grid(alpha)
    whole, steep = np.empty((2, len(COSINES)))
    for k, n_v in enumerate(COSINES.tolist()):
        v_h = np.sqrt(1.0 - n_v**2) * side + n_v * n_h
        n_l = 2.0 * v_h * n_h - n_v
        met = (v_h > 0.0) & (n_l > 0.0)
        # A solid angle of facets is that of directions over 4 v.h (Walter and others 2007, equation 14).
        kept = np.where(met, visibility(np.asarray(n_v), np.where(met, n_l, 1.0), np.asarray(alpha)) * n_l * 4.0 * v_h / n_h, 0.0)
        kept = kept * counts
        whole[k], steep[k] = kept.mean(), (kept * np.where(met, 1.0 - v_h, 0.0) ** 5).mean()
    return whole, steep / whole


def diffuse_grazing(n_v: FloatArray) -> FloatArray:
    """(m,) the mean of (1 - v.h)^5 over the directions of a half sphere, weighted by their cosine, h halfway to the viewer."""
    return np.asarray(np.interp(np.clip(n_v, 0.0, 1.0), COSINES, _diffuse_table()))


@lru_cache(maxsize=1)
def _diffuse_table() -> FloatArray:
    # cos dw / pi is d(sine^2) dphi / 2 pi.
    square = ((np.arange(STEPS) + 0.5) / STEPS)[:, None]
    phi = ((np.arange(STEPS) + 0.5) / STEPS * np.pi)[None, :]
    n_l, side = np.sqrt(1.0 - square), np.sqrt(square) * np.cos(phi)
    v_l = [n_v * n_l + np.sqrt(1.0 - n_v**2) * side for n_v in COSINES.tolist()]
    return np.array([((1.0 - np.sqrt(np.maximum(1.0 + cosine, 0.0) / 2.0)) ** 5).mean() for cosine in v_l])


def facet_grid(alpha: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Facets' normals for means over the density D cos: their parts along the normal (STEPS, 1), those across towards the viewer's side
    (STEPS, STEPS), and what each counts for (STEPS, 1), 1 in the mean.

    With tangent^2 = alpha^2 u / (1 - u), D cos dw is du dphi / 2 pi; one half of phi, as the other is its mirror image. Steps are short
    towards u = 1, where lobes have poles. Right to 1e-4 of lobes' albedos (tests/test_reference_rough.py).
    """
    w = 1.0 - ((np.arange(STEPS) + 0.5) / STEPS)[:, None]
    phi = ((np.arange(STEPS) + 0.5) / STEPS * np.pi)[None, :]
    n_h = np.sqrt(w**3 / (alpha**2 + (1.0 - alpha**2) * w**3))  # 1 - u = w^3
    return n_h, np.sqrt(np.maximum(1.0 - n_h**2, 0.0)) * np.cos(phi), 3.0 * w**2


def drawn_facets(normal: FloatArray, alpha: FloatArray, rng: Generator) -> tuple[FloatArray, FloatArray]:
    """Facets' normals (m, 3) of density D cos by solid angle, and these densities (m,)."""
    m = len(normal)
    u, phi = rng.random(m), 2.0 * np.pi * rng.random(m)
    n_h = np.sqrt((1.0 - u) / (1.0 + (alpha**2 - 1.0) * u))
    sine = np.sqrt(np.maximum(1.0 - n_h**2, 0.0))
    helper = np.eye(3)[np.abs(normal).argmin(axis=1)]
    right = np.cross(normal, helper)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    across = np.cos(phi)[:, None] * right + np.sin(phi)[:, None] * np.cross(normal, right)
    return n_h[:, None] * normal + sine[:, None] * across, density(n_h, alpha) * n_h
