"""A picture as several independent replicates on the device: the same scene, each with random numbers of its own, in tiles."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device.program import TILE
from clrt.device.session import FILM_BYTES, Tracer
from clrt.errors import LimitError

REPLICATES = 8  #: independent sequences of samples; why not fewer: docs/error.md
HALF = REPLICATES // 2  #: the first so many are half A, the others half B
_SUM_BYTES = 2 * FILM_BYTES
_GOLDEN = 0x9E3779B97F4A7C15

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]


def replicate_seeds(seed: int, count: int = REPLICATES) -> list[int]:
    """The seeds of the replicates, 0 to 2^32 - 1: words of SplitMix64 (Steele, Lea and Flood 2014) that starts from the scene's seed."""
    return [_mix64((seed * 0x100000001B3 + (i + 1) * _GOLDEN) & (2**64 - 1)) >> 32 for i in range(count)]


def _mix64(x: int) -> int:
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & (2**64 - 1)
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & (2**64 - 1)
    return x ^ (x >> 31)


class Grid:
    """The tiles of a picture, numbered row by row. count : of tiles; pixels : (count,) pixels of each that are in the picture."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.columns, self.rows = -(-width // TILE[0]), -(-height // TILE[1])
        self.count = self.columns * self.rows
        across = np.minimum(TILE[0], width - TILE[0] * np.arange(self.columns))
        down = np.minimum(TILE[1], height - TILE[1] * np.arange(self.rows))
        self.pixels: IntArray = np.outer(down, across).ravel().astype(np.int64)

    def corners(self, tiles: IntArray) -> NDArray[np.int32]:
        """(n, 2): column and row of the first pixel of each."""
        return np.stack([tiles % self.columns * TILE[0], tiles // self.columns * TILE[1]], 1).astype(np.int32)

    def places(self, tiles: IntArray) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.bool_]]:
        """Indices (n, th, 1) of rows and (n, 1, tw) of columns, kept inside the picture, and (n, th, tw): which are not beside it."""
        corner = self.corners(tiles)
        rows, columns = corner[:, 1:] + np.arange(TILE[1]), corner[:, :1] + np.arange(TILE[0])
        inside = (rows < self.height)[:, :, None] & (columns < self.width)[:, None, :]
        return np.minimum(rows, self.height - 1)[:, :, None], np.minimum(columns, self.width - 1)[:, None, :], inside


class Replicates:
    """The sums of all replicates, each of the same number of samples in a tile. `tracer` renders a scene with the feature "sampling"."""

    def __init__(self, tracer: Tracer, seed: int | None = None) -> None:
        """seed : instead of the scene's own. Raises LimitError where the device has no room for the sums."""
        buffers = tracer.buffers
        self.tracer, self.queue = tracer, buffers.device.queue
        self.grid = Grid(tracer.width, tracer.height)
        size, there = tracer.width * tracer.height * _SUM_BYTES, buffers.device.handle.global_mem_size
        if size * REPLICATES > there // 2:
            raise LimitError(
                f"{REPLICATES} replicates of {tracer.width} x {tracer.height} need {size * REPLICATES >> 20:,} MiB on the device, which "
                f"has {there >> 20:,} MiB; take a smaller picture, or --samples without --stderr"
            )
        self.sums = [buffers.empty(size) for _ in range(REPLICATES)]
        self.frames = [self._frame(word) for word in replicate_seeds(buffers.packed.scene.seed if seed is None else seed)]
        self.launches: list[tuple[IntArray, int, int, int]] = []  #: tiles, first and last but one sample, replicate

    def _frame(self, seed: int) -> Any:
        record = self.tracer.buffers.packed.frame.copy()
        record["seed"] = np.uint32(seed).astype(np.int32)
        return self.tracer.buffers.upload(record)

    def run(self, tiles: IntArray, first: int, end: int, replicates: range = range(REPLICATES)) -> None:
        """Adds samples [first, end) to the sums of these tiles, which hold those before; waits for them."""
        corners = self.grid.corners(tiles).ravel()
        for sample in range(first, end):
            given = self.tracer.buffers.upload(np.concatenate([np.array([sample, sample, len(tiles)], np.int32), corners]))
            for i in replicates:
                self.tracer.run_tiles(self.frames[i], {"sample_range": given, "sample_sums": self.sums[i]}, len(tiles))
        self.queue.finish()
        self.launches += [(tiles, first, end, i) for i in replicates]

    def centre(self, tiles: IntArray) -> None:
        """One sample through the centre of each pixel of these tiles, in the sums of replicate 0; what is sampled next replaces it."""
        record = self.tracer.buffers.packed.frame.copy()
        record["pixel_spread"] = 0
        kept, self.frames[0] = self.frames[0], self.tracer.buffers.upload(record)
        self.run(tiles, 0, 1, range(1))
        self.frames[0] = kept

    def overhead(self) -> float:
        """Seconds that a launch takes whatever it traces: that of a tile beside the picture, the least of a few."""
        beside = self.tracer.buffers.upload(np.array([0, 0, 1, self.grid.width, self.grid.height], np.int32))
        seconds = []
        for _ in range(8):
            begin = time.perf_counter()
            self.tracer.run_tiles(self.frames[0], {"sample_range": beside, "sample_sums": self.sums[0]}, 1)
            self.queue.finish()
            seconds.append(time.perf_counter() - begin)
        return min(seconds)

    def values(self, tiles: IntArray, samples: int) -> FloatArray:
        """(REPLICATES, n, th, tw, 3): means over `samples` samples; numbers beside the picture are those at its edge."""
        rows, columns, _ = self.grid.places(tiles)
        values = np.empty((REPLICATES, len(tiles), *TILE[::-1], 3))
        for i in range(REPLICATES):
            with self._mapped(i) as sums:
                np.divide(sums[rows, columns], samples, out=values[i])
        return values

    def means(self, replicate: int, samples: int) -> FloatArray:
        """(h, w, 3) of one replicate over `samples` samples."""
        with self._mapped(replicate) as sums:
            return np.asarray(sums / samples)

    @contextmanager
    def _mapped(self, replicate: int) -> Iterator[FloatArray]:
        import pyopencl as cl

        shape = (self.grid.height, self.grid.width, 3)
        kind: Any = np.float64
        sums: Any = cl.enqueue_map_buffer(self.queue, self.sums[replicate], cl.map_flags.READ, 0, shape, kind)[0]
        try:
            yield sums
        finally:
            sums.base.release(self.queue)

    def replay(self, launches: Iterable[tuple[IntArray, int, int, int]]) -> None:
        """The same launches by this tracer, which is one that counts: adds to its counts."""
        self.tracer.begin_counting()
        for tiles, first, end, i in launches:
            self.run(tiles, first, end, range(i, i + 1))
        self.tracer.end_counting()
