"""The precision ladder: number types, kernel files, error bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clrt.errors import ClrtError


@dataclass(frozen=True)
class Precision:
    """One rung.

    real : the number type of lanes; kernels : the files that decide a triangle; promise : in a sentence
    surface_kernels : files of its own for what follows a hit
    """

    name: str
    real: type[np.floating]
    kernels: tuple[str, ...]
    promise: str
    surface_kernels: tuple[str, ...] = ()

    @property
    def decides_in_stages(self) -> bool:
        """Whether its kernels count the lanes that float64 and expansions decide."""
        return "triangle_exact.cl" in self.kernels

    @property
    def bits(self) -> int:
        return 8 * np.dtype(self.real).itemsize

    def lanes(self, float_lanes: int) -> int:
        """Lanes of a packet on a device that holds `float_lanes` float32 numbers in a vector."""
        room = float_lanes * 32 // self.bits
        return next((n for n in (16, 8, 4) if n <= room), 1)


RUNGS = {
    rung.name: rung
    for rung in (
        Precision("fast", np.float32, ("triangle_fast.cl",), "float32, no promise at edges"),
        Precision("watertight", np.float32, ("triangle_watertight.cl",), "no ray passes between triangles that share an edge or a vertex"),
        Precision(
            "exact",
            np.float32,
            ("expansion.cl", "exact.cl", "triangle_exact.cl"),
            "the visible primitive of exact arithmetic",
            ("surface_exact.cl",),
        ),
        Precision("double", np.float64, ("triangle_watertight.cl",), "float64 throughout, and watertight"),
    )
}
DEFAULT = "watertight"


def rung(name: str) -> Precision:
    """The rung called `name`. Raises ClrtError that lists the rungs there are."""
    try:
        return RUNGS[name]
    except KeyError:
        raise ClrtError(f"there is no precision '{name}'; choose one of: {', '.join(RUNGS)}") from None
