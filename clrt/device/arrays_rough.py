"""The tables of rough surfaces as ggx.cl and gloss_refraction.cl read them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device.ggx_albedo import lobe_table, share_table
from clrt.device.ggx_glass import glass_row, index_ratios
from clrt.device.packed import Packed


def facet_albedos(packed: Packed) -> NDArray[Any]:
    """(GGX_ROUGHNESSES, GGX_COSINES) of ggx.cl."""
    return lobe_table().astype(packed.real)


def diffuse_shares(packed: Packed) -> NDArray[Any]:
    """(GGX_ROUGHNESSES, METAL_SHARES) of metal_rough.cl."""
    return share_table().astype(packed.real)


def glass_albedos(packed: Packed) -> NDArray[Any]:
    """One array as gloss_refraction.cl describes it: ratios of indices, where each material's rows begin, the rows."""
    materials = packed.scene.materials
    ratios = index_ratios([m.ior for m in materials if m.refract > 0.0])
    kinds: dict[tuple[float, bool], int] = {}
    first = [kinds.setdefault((m.gloss, m.fresnel), len(kinds)) if m.gloss > 0.0 and m.refract > 0.0 else 0 for m in materials]
    rows = [glass_row(gloss, ratio, fresnel) for gloss, fresnel in kinds for ratio in ratios.tolist()]
    head = [float(len(ratios)), float(len(materials)), *ratios.tolist(), *(float(kind * len(ratios)) for kind in first)]
    return np.concatenate([head, np.array(rows).ravel()]).astype(packed.real)
