"""Boxes around the triangles of objects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_SMALL = 1000  #: triangles up to which objects are gone through together
_AT_ONCE = 1000  #: objects gone through together


class Boxed(Protocol):
    """An object with its triangles (n, 3, 3) and the box around them."""

    @property
    def vertices(self) -> FloatArray: ...

    @property
    def box(self) -> tuple[FloatArray, FloatArray]: ...


def box_of(vertices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The least and the greatest coordinates (3,) of triangles (n, 3, 3); zeros where there are none."""
    if not len(vertices):
        return np.zeros(3), np.zeros(3)
    axes = [vertices[:, :, axis] for axis in range(3)]  # NumPy reduces long rows much sooner than short ones
    return np.array([values.min() for values in axes]), np.array([values.max() for values in axes])


def boxes_of(objects: Sequence[Boxed]) -> tuple[FloatArray, FloatArray]:
    """The same (k, 3) of each of k objects: of the small ones at once."""
    lo, hi = np.zeros((len(objects), 3)), np.zeros((len(objects), 3))
    counts = np.array([len(item.vertices) for item in objects], np.int64)
    for i in np.flatnonzero(counts > _SMALL).tolist():
        lo[i], hi[i] = objects[i].box
    small = np.flatnonzero((counts > 0) & (counts <= _SMALL))
    for first in range(0, len(small), _AT_ONCE):
        part = small[first : first + _AT_ONCE]
        corners = np.concatenate([objects[i].vertices for i in part.tolist()]).reshape(-1, 3)
        starts = 3 * (np.cumsum(counts[part]) - counts[part])
        lo[part], hi[part] = np.minimum.reduceat(corners, starts), np.maximum.reduceat(corners, starts)
    return lo, hi
