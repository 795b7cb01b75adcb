"""The emitters as arealight.cl draws from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.device import layout
from clrt.device.packed import Packed
from clrt.scene.emitters import emitters_of


def emitters(packed: Packed) -> NDArray[np.void]:
    """One record an emitter; `sum` is the part of all power up to and with it, `bound` that of the error of a point on it."""
    found = emitters_of(packed.scene)
    records = np.zeros(len(found.area), layout.emitter(packed.real))
    if not len(records):
        return records
    corner = found.vertices[:, 0] - packed.origin
    e1, e2 = found.vertices[:, 1] - found.vertices[:, 0], found.vertices[:, 2] - found.vertices[:, 0]
    normal = np.cross(e1, e2)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    records["corner"], records["e1"], records["e2"] = corner, e1, e2
    records["normal"] = np.divide(normal, length, where=length > 0.0, out=np.zeros_like(normal))
    records["radiance"] = found.radiance * found.part[:, None]
    records["luminance"], records["area"] = found.luminance, found.area
    records["radius"] = found.radius
    total = np.cumsum(found.power)
    records["sum"] = total / total[-1]
    records["sum"][-1] = 2.0  # beyond every random number
    size = np.abs(corner).sum(1) + np.abs(e1).sum(1) + np.abs(e2).sum(1) + 3.0 * found.radius
    # Corner, edges, their multiples and sums: three roundings of the whole each, at most.
    records["bound"] = 4.0 * np.finfo(packed.real).eps * size
    return records
