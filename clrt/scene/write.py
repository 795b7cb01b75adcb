"""Scene text, written: triangles as `T` lines that read back bit for bit, and files that appear whole or not at all."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clrt.errors import SceneError
from clrt.files import atomic_write, check_writable


def point_texts(points: NDArray[np.float64]) -> NDArray[np.object_]:
    """One ``x y z`` a row, each number the shortest decimal that reads back as the same float64.

    points : (n, k) float64; the answer is (n,) of str
    """
    columns = points.shape[1]
    # One format over the flat list is the fastest exact route in CPython; -0.0 + 0.0 == 0.0 drops the sign of zero
    flat = (np.ascontiguousarray(points, np.float64) + 0.0).ravel().tolist()
    lines = ("\n".join([" ".join(["%r"] * columns)] * len(points)) % tuple(flat)).replace(".0 ", " ").replace(".0\n", "\n")
    texts = np.empty(len(points), object)
    texts[:] = lines.removesuffix(".0").split("\n") if len(points) else []
    return texts


def triangle_lines(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], normals: NDArray[np.float64] | None = None
) -> str:
    """The `T` lines of a mesh: 9 numbers each, or 18 where `normals` gives one normal a vertex.

    vertices : (n, 3) float64, scene units; faces : (m, 3) integers into vertices
    normals : (n, 3) float64 or None

    Each vertex is turned into text once and shared by its triangles: 70,000 triangles take about 0.1 s.
    """
    if not len(faces):
        return ""
    points = point_texts(vertices)
    fields = [points[faces[:, corner]].tolist() for corner in range(3)]
    if normals is not None:
        directions = point_texts(normals)
        fields += [directions[faces[:, corner]].tolist() for corner in range(3)]
    return "T " + "\nT ".join(map(" ".join, zip(*fields, strict=True))) + "\n"


def line(letter: str, *numbers: ArrayLike) -> str:
    """One line of scene text: ``line("S", center, radius)`` gives ``S 0 0 1 0.5``."""
    flat = np.concatenate([np.ravel(np.asarray(n, np.float64)) for n in numbers])
    return f"{letter} {point_texts(flat[None])[0]}\n"


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file whole or not at all; what stands there is replaced.

    Raises SceneError where the path is a folder, or its folder is missing or closed.
    """
    try:
        check_writable(path)
        with atomic_write(path) as file:
            file.write(text.encode("utf-8"))
    except OSError as error:
        raise SceneError(f"{path}: cannot be written: {error.strerror or error}; choose another place") from error
