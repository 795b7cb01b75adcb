"""Small scenes as text, and float32 done the careless way, for the cases about pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

DEPTH = 8  #: of all pictures, since a program is made for its depth
#: corners of the faces of the cube [-1, 1]^3, (6, 4, 3)
_CUBE = np.array([
    [[s if a == axis else (1 if (a - axis) % 3 == 1 else 0) * u + (1 if (a - axis) % 3 == 2 else 0) * v for a in range(3)]
     for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    for axis in range(3) for s in (-1, 1)
], np.float64)  # fmt: skip


def rotation(rng: np.random.Generator) -> FloatArray:
    """(3, 3), uniform over all turns."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return np.asarray(q * np.sign(np.linalg.det(q)))


def quads(corners: FloatArray) -> FloatArray:
    """(q, 4, 3) corners in a ring -> (2q, 3, 3) triangles."""
    return np.asarray(corners[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3))


def cube(lo: float = -1.0, hi: float = 1.0) -> FloatArray:
    """(12, 3, 3): the closed cube [lo, hi]^3; corners shared to the last bit."""
    return quads(np.where(_CUBE > 0, hi, lo))


def box(lo: tuple[float, float, float], hi: tuple[float, float, float]) -> FloatArray:
    """(12, 3, 3): a closed box."""
    return quads(np.where(_CUBE > 0, np.array(hi), np.array(lo)))


def grid(cells: int) -> FloatArray:
    """(2 cells^2, 3, 3): the square [-1, 1]^2 in the plane z = 0."""
    line = np.linspace(-1.0, 1.0, cells + 1)
    x, y = (a.ravel() for a in np.meshgrid(line[:-1], line[:-1]))
    step = 2.0 / cells
    # Corners are taken from the same list of numbers, so that neighbours share them to the last bit.
    column, row = (np.rint((a + 1.0) / step).astype(int) for a in (x, y))
    ring = [np.stack([line[column + i], line[row + j], np.zeros(len(x))], -1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return quads(np.stack(ring, 1))


def triangles(corners: FloatArray) -> str:
    """T lines that read back as the same float64 numbers."""
    return "".join("T " + " ".join(map(repr, row)) + "\n" for row in corners.reshape(-1, 9).tolist())


def line(letter: str, *values: float | FloatArray) -> str:
    """One line of a scene text, its numbers exact."""
    numbers = np.concatenate([np.atleast_1d(np.asarray(v, np.float64)) for v in values])
    return letter + " " + " ".join(map(repr, numbers.tolist())) + "\n"


def camera(eye: FloatArray, view: FloatArray, fov: float, size: int, up: FloatArray | None = None) -> str:
    """E, V, F and R of a square picture; without `up`, some vector across the view."""
    if up is None:
        up = np.eye(3)[np.abs(view).argmin()]
    return line("E", eye) + line("V", view, up) + line("F", fov) + f"R {size} {size}\n"


def company(eye: FloatArray, view: FloatArray, scale: float = 1.0) -> str:
    """Lines that call for every effect but smooth normals, though nothing of them is seen: so that all cases share one program.

    A black light, and far behind the eye a ball of a ten-millionth of `scale`.
    """
    text = line("L", eye, np.zeros(3)) + "M 0 0 0 0 0 0 1 0.5 0.5 1.5\n" + line("S", eye - 300.0 * scale * view, 1e-7 * scale)
    return text + f"depth {DEPTH}\n"


def naive_hits(
    origins: FloatArray, directions: FloatArray, corners: FloatArray, epsilon: float, t_max: float = np.inf
) -> NDArray[np.bool_]:
    """(m,) whether rays meet a triangle for epsilon < t < t_max: Moeller and Trumbore in float32, no own primitive, no rebasing."""
    o, d, c = (np.asarray(a, np.float32) for a in (origins, directions, corners))
    e1, e2 = c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]
    with np.errstate(all="ignore"):
        p = np.cross(d[:, None], e2[None])
        inverse = np.float32(1) / (p * e1).sum(-1)
        s = o[:, None] - c[None, :, 0]
        u = (s * p).sum(-1) * inverse
        q = np.cross(s, e1[None])
        v = (d[:, None] * q).sum(-1) * inverse
        t = (e2 * q).sum(-1) * inverse
        return np.asarray(((u >= 0) & (v >= 0) & (u + v <= 1) & (t > np.float32(epsilon)) & (t < np.float32(t_max))).any(1))
