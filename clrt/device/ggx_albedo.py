"""What GGX lobes hand on of light from all sides (directional albedo), by quadrature in float64, as tables for ggx.cl.

Single scattering loses the light that facets send to other facets; lobes divided by their albedo lose nothing (Turquin 2019, "Practical
multiple scattering compensation for microfacet models"). Smith's masking, height-correlated (Heitz 2014); facets for reflection are
integrated over slopes, for glass over the square that visible normals are drawn from (Dupuy and Benyoub 2023).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from clrt.scene.model import FloatArray

LEAST_ALPHA = 1e-4  #: as in ggx.cl
ROUGHNESSES, COSINES = 65, 129  #: nodes of the table of the lobe: see ggx_table
SHARE_COSINES = 65  #: of the table of the diffuse share
GLASS_COSINES = 129

_FIT_ROUGHNESSES, _FIT_COSINES = 16, 20  #: nodes of the polynomials that the tables are filled from


def alpha_of(roughness: FloatArray | float) -> FloatArray:
    """GGX's width for a roughness from 0 to 1."""
    return np.maximum(np.asarray(roughness, np.float64) ** 2, LEAST_ALPHA)


def cosine_at(place: FloatArray, alpha: FloatArray) -> FloatArray:
    """The inverse of ggx_place: cosines, fine where they are like alpha."""
    return np.asarray(np.minimum(place * alpha / (1.0 + alpha - place), 1.0))


def lobe_albedo(cosine: FloatArray, alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The albedo of the lobe D G2 / (4 cos cos), and that of the lobe times (1 - V.H)^5; both of the shape that the arguments share.

    In slopes of facets, directions above the surface come from a disc whose rim a ray from the slope 0 meets once: at q(phi). Error 2e-6
    at these nodes, against 300 x 300 (test_ggx).
    """
    cosine, alpha = (np.asarray(a, np.float64)[..., None, None] for a in np.broadcast_arrays(cosine, alpha))
    sine = np.sqrt(np.clip((1.0 - cosine) * (1.0 + cosine), 0.0, None))
    # Towards the viewer, then away: the rim's shape changes at a right angle, where nodes gather.
    nodes, weights = np.polynomial.legendre.leggauss(12)
    turn, part = np.pi / 2.0 * ((nodes + 1.0) / 2.0) ** 2, weights * (nodes + 1.0) / 4.0
    along = np.concatenate([np.sin(turn), -np.sin(turn)])[:, None]
    part = np.concatenate([part, part])[:, None]
    reach = np.abs(sine / cosine * along)
    rim = np.sqrt(reach * reach + 1.0) + reach
    rim = np.where(along > 0.0, 1.0 / rim, rim)
    # The slope is alpha tan psi, nodes gather at the rim, where directions graze.
    nodes, weights = np.polynomial.legendre.leggauss(16)
    left = (1.0 - nodes) / 2.0
    widest = np.arctan2(rim, alpha)
    psi = widest * (1.0 - left**3)
    part = part * 1.5 * weights * left**2 * widest * np.sin(2.0 * psi)
    slope = alpha * np.tan(psi)
    facet_z = 1.0 / np.sqrt(1.0 + slope * slope)
    met = np.maximum(facet_z * (cosine - sine * slope * along), 0.0)
    out = np.clip(2.0 * met * facet_z - cosine, 0.0, None)
    kept = 2.0 * out / (cosine * stretched(out, alpha) + out * stretched(cosine, alpha)) * met / facet_z
    schlick = (1.0 - np.minimum(met, 1.0)) ** 5
    return np.asarray((kept * part).sum((-1, -2))), np.asarray((kept * schlick * part).sum((-1, -2)))


def stretched(cosine: FloatArray, alpha: FloatArray | float) -> FloatArray:
    return np.asarray(np.sqrt(cosine * cosine + alpha * alpha * np.clip((1.0 - cosine) * (1.0 + cosine), 0.0, None)))


def chebyshev_nodes(count: int) -> FloatArray:
    """Chebyshev's of [0, 1]."""
    return np.asarray((1.0 - np.cos(np.pi * (np.arange(count) + 0.5) / count)) / 2.0)


def chebyshev_fit(values: FloatArray, places: FloatArray) -> FloatArray:
    """Values at `places` of [0, 1], along the last axis, of the polynomial through those at Chebyshev's nodes."""
    count = values.shape[-1]
    through = np.linalg.inv(np.polynomial.chebyshev.chebvander(2.0 * chebyshev_nodes(count) - 1.0, count - 1)).T
    return np.asarray(values @ through @ np.polynomial.chebyshev.chebvander(2.0 * places - 1.0, count - 1).T)


@cache
def lobe_table() -> FloatArray:
    """(ROUGHNESSES, COSINES): the lobe's albedo at sqrt(alpha) and ggx_place evenly from 0 to 1. 20 ms, once."""
    alpha = np.maximum(chebyshev_nodes(_FIT_ROUGHNESSES)[:, None] ** 2, 1e-12)
    albedo, _ = lobe_albedo(cosine_at(chebyshev_nodes(_FIT_COSINES)[None, :], alpha), alpha)
    by_cosine = chebyshev_fit(albedo, np.linspace(0.0, 1.0, COSINES))
    return np.ascontiguousarray(chebyshev_fit(by_cosine.T, np.linspace(0.0, 1.0, ROUGHNESSES)).T)


def diffuse_grazing(cosine: FloatArray) -> FloatArray:
    """The mean of (1 - V.H)^5 over light from all sides weighted by its cosine, (n,), for the viewer at cosines (n,)."""
    nodes, weights = np.polynomial.legendre.leggauss(48)
    turn, square = np.pi * (nodes[:, None] + 1.0) / 2.0, (nodes + 1.0) / 2.0
    part = weights[:, None] * weights / 4.0
    light_z, light_x = np.sqrt(square), np.sqrt(1.0 - square) * np.cos(turn)
    mu = cosine[:, None, None]
    both = mu * light_z + np.sqrt(np.clip(1.0 - mu * mu, 0.0, None)) * light_x
    return np.asarray(((1.0 - np.sqrt(np.clip((1.0 + both) / 2.0, 0.0, 1.0))) ** 5 * part).sum((-1, -2)))


@cache
def share_table() -> FloatArray:
    """(ROUGHNESSES, SHARE_COSINES): what the diffuse part of a metal-rough surface may hand on, at sqrt(alpha) and the root of the cosine.

    Of light from all sides the specular part, divided by its albedo, hands on F0 + (1 - F0) B, the diffuse part (1 - F0) (1 - K) at most,
    with B the mean of (1 - V.H)^5 over the lobe and K over the cosine. Where B > K these are more than 1: (1 - B) / (1 - K) makes it 1.
    Takes 40 ms, once.
    """
    alpha, cosine = alpha_of(chebyshev_nodes(_FIT_ROUGHNESSES))[:, None], chebyshev_nodes(_FIT_COSINES)[None, :] ** 2
    albedo, grazing = lobe_albedo(cosine, alpha)
    places = np.linspace(0.0, 1.0, SHARE_COSINES)
    by_cosine = chebyshev_fit(grazing / albedo, places)
    mean = chebyshev_fit(by_cosine.T, np.linspace(0.0, 1.0, ROUGHNESSES)).T
    return np.asarray(np.minimum((1.0 - mean) / (1.0 - diffuse_grazing(places**2)), 1.0))
