"""The order in which a large batch of rays is traced: those that go the same way from about the same place one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device import kernel_cache
from clrt.device.program import SORT_BITS
from clrt.device.session import Buffers

_BINS = 8 << (3 * SORT_BITS)
_RUNS = 16  #: shares of the rays, each sorted by a work-item of its own: a few for each core, as every one has a table of all bins
FEWEST = 1 << 14  #: rays; fewer are traced as they come: measured, the caches then hold what they need


#: runs of rays are looked at here and there, as many, and as long; alike if directions, and origins in units of the mesh, spread no further
_SAMPLES, _RUN, _DIRECTIONS, _ORIGINS = 64, 16, 0.25, 0.125


def in_order_already(origins: NDArray[Any], directions: NDArray[Any], size: float) -> bool:
    """Whether most neighbours among rays (n, 3), (n, 3) go about the same way from about the same place, as a camera's do.

    size : of the mesh. The answer decides about speed alone.
    """
    starts = np.linspace(0, max(0, len(origins) - _RUN), _SAMPLES).astype(np.int64)
    rows = starts[:, None] + np.arange(min(_RUN, len(origins)))
    with np.errstate(all="ignore"):  # rays may hold NaN, infinities and directions of length 0
        start, along = origins[rows].astype(np.float64), directions[rows].astype(np.float64)
        along /= np.linalg.norm(along, axis=2, keepdims=True)
        alike = (np.ptp(along, axis=1).sum(axis=1) <= _DIRECTIONS) & (np.ptp(start, axis=1).sum(axis=1) <= _ORIGINS * size)
    return bool(2 * np.count_nonzero(alike) > _SAMPLES)


class RaySorter:
    """Kernels and buffers of the sort (ray_sort.cl). lo, hi : (3,) the box of the triangles, at unit size, that the grid lies over."""

    def __init__(self, buffers: Buffers, built: Any, lo: NDArray[np.float64], hi: NDArray[np.float64]) -> None:
        import pyopencl as cl

        self._buffers, self._capacity = buffers, 0
        self._kernels = [cl.Kernel(built, name) for name in ("sort_count", "sort_offsets", "sort_scatter")]
        size = float((hi - lo).max())
        self._grid = np.array([*lo, 0.0]), np.full(4, (1 << SORT_BITS) / size if size > 0.0 else 0.0)
        self._counts = buffers.empty(4 * _BINS * _RUNS)

    def order(self, given: Sequence[Any], count: int) -> Any:
        """A buffer with the numbers of the rays in the order to trace them in; `given`: the arguments GIVEN_PARAMETERS of given.cl."""
        with kernel_cache.loading() if self._capacity == 0 else nullcontext():  # first launches are part of compiling
            return self._sorted(given, count)

    def _sorted(self, given: Sequence[Any], count: int) -> Any:
        self._reserve(count)
        queue, run = self._buffers.device.queue, -(-count // _RUNS)
        sizes = np.int32(count), np.int32(run)
        counting, offsets, scatter = self._kernels
        counting(queue, (_RUNS,), (1,), *given, *self._grid, *sizes, self._keys, self._counts)
        offsets(queue, (1,), (1,), np.int32(_RUNS), self._counts)
        scatter(queue, (_RUNS,), (1,), *sizes, self._keys, self._counts, self._order)
        return self._order

    def _reserve(self, count: int) -> None:
        if count > self._capacity:
            self._capacity = count
            self._keys, self._order = self._buffers.empty(2 * count), self._buffers.empty(4 * count)
