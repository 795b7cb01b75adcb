"""A sky for scenes that bring no light of their own."""

from __future__ import annotations

import numpy as np

from clrt.scene.model import Environment

_HORIZON = np.array([0.50, 0.47, 0.44])
_GROUND = np.array([0.22, 0.21, 0.20])
_ROWS = 1024  #: 0.18 degrees each: less than a pixel of a usual picture


def default_sky() -> Environment:
    """An overcast sky without a sun, the same all round, above a grey ground: (1024, 1, 3) texels.

    As in the overcast sky of Moon and Spencer (1942), radiance grows linearly with the sine of the elevation, here to about 2.6 times the
    horizon's at the zenith. The zenith is set so that a white diffuse surface that faces straight up shows 1 in each colour. Below the
    horizon the radiance fades to the ground's, without an edge that mirrors would show.
    """
    up = np.cos(np.pi * (np.arange(_ROWS) + 0.5) / _ROWS)[:, None]
    zenith = (3.0 - _HORIZON) / 2.0  # integral of 2 s (H (1 - s) + Z s) over s from 0 to 1 is H / 3 + 2 Z / 3 = 1
    above = _HORIZON + (zenith - _HORIZON) * up
    below = _GROUND + (_HORIZON - _GROUND) * (1.0 - np.abs(up)) ** 8
    return Environment(np.where(up > 0.0, above, below)[:, None, :], name="default sky")
