"""A scene's unit does not matter: all its lengths times a power of two give the same picture."""

from __future__ import annotations

import numpy as np
import pytest

import clrt
from clrt.precision import RUNGS
from clrt.scene.build import parse_scene

EXPONENTS = (-98, -60, -40, 30, 60, 96)


def _text(unit: float, spheres: bool) -> str:
    def at(*values: float) -> str:
        return " ".join(repr(v * unit) for v in values)

    lines = [f"E {at(0, 0, -1)}", "V 0 0 1", "F 45", "R 48 32", f"L {at(5, 5, -5)}", "M 0.5 0.5 1.0 0.1 0.9 0.3 20 0.3 0.2 1.5"]
    if spheres:
        lines += [f"S {at(0, 0, 2, 1)}", f"S {at(0.8, 0.5, 1.2, 0.3)}"]
    else:
        lines += [f"T {at(-1, -1, 2)} {at(1, -1, 2)} {at(0, 1, 2)}", f"T {at(-2, -2, 3)} {at(2, -2, 3)} {at(0, 2, 3)}", "O"]
    return "\n".join(lines)


@pytest.mark.matrix(keep=3)
@pytest.mark.parametrize("precision", sorted(RUNGS))
@pytest.mark.parametrize("spheres", [False, True])
def test_unit_of_a_scene_does_not_matter(precision: str, spheres: bool) -> None:
    at_one = clrt.render(parse_scene(_text(1.0, spheres)), precision=precision).pixels
    assert at_one.std() > 0.05
    for exponent in EXPONENTS:
        picture = clrt.render(parse_scene(_text(2.0**exponent, spheres)), precision=precision).pixels
        assert np.abs(picture - at_one).max() <= 1e-5, f"at 2^{exponent}"
