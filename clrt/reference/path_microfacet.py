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

COSINES = 129  #: of the table of a lobe's albedo; linear between them is right to 1e-4
STEPS = 256  #: of the quadrature behind it, each way; right to 1e-4


def density(n_h: FloatArray, alpha: FloatArray) -> FloatArray:
    """D: area of facets by solid angle of their normals, over that of the surface; n_h : cosine between facet and surface, > 0."""
    return np.asarray(alpha**2 / (np.pi * (n_h**2 * (alpha**2 - 1.0) + 1.0) ** 2))


def visibility(n_v: FloatArray, n_l: FloatArray, alpha: FloatArray) -> FloatArray:
    """G2 / (4 n_v n_l), both cosines > 0: the part of the facets that is seen from both sides."""
    from_light = n_v * np.sqrt(n_l**2 * (1.0 - alpha**2) + alpha**2)
    from_viewer = n_l * np.sqrt(n_v**2 * (1.0 - alpha**2) + alpha**2)
    return np.asarray(0.5 / (from_light + from_viewer))


def lobe(view: FloatArray, normal: FloatArray, direction: FloatArray, alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
    """f cos of facets that reflect all light, (m,), 0 where either direction is below the surface; and the cosine between the viewer
    and the facet. view, normal, direction : (m, 3) unit"""
    half = view + direction
    half = half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-300)
    n_v, n_l, n_h = (np.einsum("mi,mi->m", normal, w) for w in (view, direction, half))
    above = (n_v > 0.0) & (n_l > 0.0)
    n_v, n_l = np.where(above, n_v, 1.0), np.where(above, n_l, 1.0)
    value = np.where(above, density(n_h, alpha) * visibility(n_v, n_l, alpha) * n_l, 0.0)
    return value, np.einsum("mi,mi->m", view, half)


def albedo(n_v: FloatArray, alpha: FloatArray) -> FloatArray:
    """(m,) what the lobe of facets that reflect all light hands on in all: its integral over all directions."""
    result = np.empty(len(n_v))
    for value in np.unique(alpha).tolist():
        rows = alpha == value
        cosines, table = albedo_table(value)
        result[rows] = np.interp(np.clip(n_v[rows], 0.0, 1.0), cosines, table)
    return result


@lru_cache(maxsize=64)
def albedo_table(alpha: float) -> tuple[FloatArray, FloatArray]:
    """Cosines (COSINES,), closer together at 0, and the albedo at each.

    Quadrature over facets instead of directions: with the normals' tangent^2 = alpha^2 u / (1 - u), D cos dw is du dphi / 2 pi, and
    a solid angle of facets is that of directions over 4 v.h (Walter and others 2007, equation 14).
    """
    u = ((np.arange(STEPS) + 0.5) / STEPS)[:, None]
    phi = ((np.arange(STEPS) + 0.5) / STEPS * np.pi)[None, :]  # the other half is its mirror image
    n_h = np.sqrt((1.0 - u) / (1.0 + (alpha**2 - 1.0) * u))
    sine = np.sqrt(np.maximum(1.0 - n_h**2, 0.0))
    cosines = np.maximum(np.linspace(0.0, 1.0, COSINES) ** 2, 1e-6)
    table = np.empty(COSINES)
    for k, n_v in enumerate(cosines.tolist()):
        v_h = np.sqrt(1.0 - n_v**2) * sine * np.cos(phi) + n_v * n_h
        n_l = 2.0 * v_h * n_h - n_v
        met = (v_h > 0.0) & (n_l > 0.0)
        kept = visibility(np.asarray(n_v), np.where(met, n_l, 1.0), np.asarray(alpha)) * n_l * 4.0 * v_h / n_h
        table[k] = np.where(met, kept, 0.0).mean()
    return cosines, table


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
