"""The precision ladder: number types, kernel files, error bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clrt.errors import ClrtError


@dataclass(frozen=True)
class Precision:
    """One rung. `real`: the number type of lanes; `kernel`: the file that decides a triangle; `promise`: in a sentence."""

    name: str
    real: type[np.floating]
    kernel: str
    promise: str

    @property
    def bits(self) -> int:
        return 8 * np.dtype(self.real).itemsize

    def lanes(self, float_lanes: int) -> int:
        """Lanes of a packet on a device that holds `float_lanes` float32 numbers in a vector."""
        return max(1, float_lanes * 32 // self.bits)


RUNGS = {
    rung.name: rung
    for rung in (
        Precision("fast", np.float32, "triangle_fast.cl", "float32, no promise at edges"),
        Precision("watertight", np.float32, "triangle_watertight.cl", "no ray passes between triangles that share an edge or a vertex"),
    )
}
DEFAULT = "watertight"


def rung(name: str) -> Precision:
    """The rung called `name`. Raises ClrtError that lists the rungs there are."""
    try:
        return RUNGS[name]
    except KeyError:
        raise ClrtError(f"there is no precision '{name}'; choose one of: {', '.join(RUNGS)}") from None
