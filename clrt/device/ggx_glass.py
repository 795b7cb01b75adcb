"""What rough glass hands on of light from all sides, reflected and refracted: tables for gloss_refraction.cl, by quadrature in float64.

The facets are those of `ggx_albedo`; refraction is masked by G1 on either side (Walter and others 2007). With `fresnel` a facet reflects
the share F of Fresnel's equations and refracts the rest; without it refracts all, but reflects all where the reflection is total.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from clrt.device.ggx_albedo import GLASS_COSINES, alpha_of, chebyshev_fit, chebyshev_nodes, cosine_at, stretched
from clrt.scene.model import FloatArray

MOST_RATIOS = 32  #: of indices, in tables; beyond that, this many between the least and the greatest stand for all
_FIT = 24


def index_ratios(indices: Sequence[float]) -> FloatArray:
    """The ratios n1 / n2 of any two indices of refraction, and 1 for what is outside of all; ascending, none twice."""
    known = np.unique([1.0, *indices])
    ratios = np.unique(np.round(known[:, None] / known[None, :], 9))
    return ratios if len(ratios) <= MOST_RATIOS else np.geomspace(ratios[0], ratios[-1], MOST_RATIOS)


def _fresnel(cosine: FloatArray, ratio: float) -> FloatArray:
    """The reflected share of unpolarised light, 1 where reflection is total; ratio: n1 / n2."""
    through = np.sqrt(np.clip(1.0 - ratio * ratio * (1.0 - cosine * cosine), 0.0, None))
    r_s = (ratio * cosine - through) / (ratio * cosine + through)
    r_p = (cosine - ratio * through) / (cosine + ratio * through)
    return np.asarray((r_s * r_s + r_p * r_p) / 2.0)


def glass_albedo(cosine: FloatArray, alpha: float, ratio: float, fresnel: bool) -> FloatArray:
    """The albedo, (n,), at cosines (n,) > 0 of the viewer. ratio : n1 / n2. Error 2e-3, 5e-3 where all light grazes and some
    is reflected totally (test_ggx)."""
    mu = cosine[:, None, None]
    u, v = ((np.polynomial.legendre.leggauss(48)[0] + 1.0) / 2.0, (np.polynomial.legendre.leggauss(64)[0] + 1.0) / 2.0)
    part = np.polynomial.legendre.leggauss(48)[1][:, None] * np.polynomial.legendre.leggauss(64)[1] / 4.0
    turn, u, v = np.pi * u[:, None], u, 1.0 - v * v
    part = part * 2.0 * np.sqrt(1.0 - v)
    sine = np.sqrt(np.clip((1.0 - mu) * (1.0 + mu), 0.0, None))
    scale = stretched(mu, alpha)
    o_x, o_z = alpha * sine / scale, mu / scale
    height = (1.0 - v) * (1.0 + o_z)
    above = height + o_x * o_x / (1.0 + o_z)
    across = np.sqrt(np.clip(above * (2.0 - above), 0.0, None))
    x, y = alpha * (across * np.cos(turn) + o_x), alpha * across * np.sin(turn)
    length = np.sqrt(x * x + y * y + height * height)
    facet_z = height / length
    met = np.clip((sine * x + mu * height) / length, 0.0, 1.0)
    # Mirrored, then refracted directions along the normal.
    out = np.clip(2.0 * met * facet_z - mu, 0.0, None)
    kept = out * (mu + scale) / (mu * stretched(out, alpha) + out * scale)
    rest = 1.0 - ratio * ratio * (1.0 - met * met)
    into = np.clip(ratio * mu - (ratio * met - np.sqrt(np.clip(rest, 0.0, None))) * facet_z, 0.0, 1.0)
    passed = 2.0 * into / (into + stretched(into, alpha))
    back = _fresnel(met, ratio) if fresnel else (rest < 0.0).astype(np.float64)
    return np.asarray(((back * kept + (1.0 - back) * passed) * part).sum((-1, -2)))


@lru_cache(maxsize=256)
def glass_row(roughness: float, ratio: float, fresnel: bool) -> tuple[float, ...]:
    """The albedo at ggx_place evenly from 0 to 1, GLASS_COSINES values. 10 ms."""
    alpha = float(alpha_of(roughness))
    albedo = glass_albedo(cosine_at(chebyshev_nodes(_FIT), np.asarray(alpha)), alpha, ratio, fresnel)
    return tuple(chebyshev_fit(albedo, np.linspace(0.0, 1.0, GLASS_COSINES)).tolist())
