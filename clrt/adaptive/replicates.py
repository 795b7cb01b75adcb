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

HALVES = 2  #: independent sequences of samples, the fewest that tell an error: long ones gain the most from their order (docs/error.md)
MAP_REPLICATES = 8  #: where the error of each pixel is asked for, which two can hardly tell
_SUM_BYTES = 2 * FILM_BYTES
_GOLDEN = 0x9E3779B97F4A7C15

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]


def replicate_seeds(seed: int, count: int = HALVES) -> list[int]:
    """The seeds of the replicates, 0 to 2^32 - 1: words of SplitMix64 (Steele, Lea and Flood 2014) that starts from the scene's seed."""
    return [_mix64((seed * 0x100000001B3 + (i + 1) * _GOLDEN) & (2**64 - 1)) >> 32 for i in range(count)]


def _mix64(x: int) -> int:
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & (2**64 - 1)
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & (2**64 - 1)
    return x ^ (x >> 31)


class Grid:
    """The tiles of a picture, numbered row by row.

    count : of tiles; inside : (count, th, tw) which pixels are not beside the picture; sides : (2, th, tw) the pixels of each side of a
    tile, whose row + column is even and odd: as alike as two sets of pixels can be, and without a common random number.
    """

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.columns, self.rows = -(-width // TILE[0]), -(-height // TILE[1])
        self.count = self.columns * self.rows
        self.inside = self.tilewise(np.ones((height, width), bool))
        odd = (np.add.outer(np.arange(TILE[1]), np.arange(TILE[0])) & 1).astype(bool)
        self.sides: NDArray[np.bool_] = np.stack([~odd, odd])
        self.pixels: IntArray = self.inside.sum((1, 2))  #: (count,) of each tile
        self.side_pixels: IntArray = np.einsum("nyx,syx->sn", self.inside.astype(np.int64), self.sides.astype(np.int64))  #: (2, count)

    def corners(self, tiles: IntArray) -> NDArray[np.int32]:
        """(n, 2): column and row of the first pixel of each."""
        return np.stack([tiles % self.columns * TILE[0], tiles // self.columns * TILE[1]], 1).astype(np.int32)

    def tilewise(self, picture: NDArray[Any]) -> NDArray[Any]:
        """(count, th, tw, ...) of a picture (height, width, ...); zero beside it."""
        beside = (self.rows * TILE[1] - self.height, self.columns * TILE[0] - self.width)
        padded = np.pad(picture, [(0, beside[0]), (0, beside[1]), *[(0, 0)] * (picture.ndim - 2)])
        cut = padded.reshape(self.rows, TILE[1], self.columns, TILE[0], *picture.shape[2:])
        return np.ascontiguousarray(cut.swapaxes(1, 2)).reshape(self.count, TILE[1], TILE[0], *picture.shape[2:])

    def picture(self, tiles: NDArray[Any]) -> NDArray[Any]:
        """(height, width, ...) of all tiles (count, th, tw, ...)."""
        cut = tiles.reshape(self.rows, self.columns, TILE[1], TILE[0], *tiles.shape[3:]).swapaxes(1, 2)
        return np.ascontiguousarray(cut.reshape(self.rows * TILE[1], self.columns * TILE[0], *tiles.shape[3:])[: self.height, : self.width])


class Replicates:
    """The sums of all replicates, each of the same number of samples in a tile. `tracer` renders a scene with the feature "sampling"."""

    def __init__(self, tracer: Tracer, count: int = HALVES, seed: int | None = None) -> None:
        """seed : instead of the scene's own. Raises LimitError where the device has no room for the sums."""
        buffers = tracer.buffers
        self.tracer, self.queue, self.count = tracer, buffers.device.queue, count
        self.grid = Grid(tracer.width, tracer.height)
        size, there = count * self.grid.count * TILE[0] * TILE[1] * _SUM_BYTES, buffers.device.handle.global_mem_size
        if size > min(there // 2, buffers.device.handle.max_mem_alloc_size):
            raise LimitError(
                f"{count} replicates of {tracer.width} x {tracer.height} need {size >> 20:,} MiB on the device, which "
                f"has {there >> 20:,} MiB; take a smaller picture, or --samples without --stderr"
            )
        self.sums = buffers.empty(size)
        self.frame = buffers.frame
        words = replicate_seeds(buffers.packed.scene.seed if seed is None else seed, count)
        self.seeds = np.array(words, np.uint32).astype(np.int32)
        self.launches: list[tuple[IntArray, int, int, range]] = []  #: tiles, first and last but one sample, replicates

    def run(self, tiles: IntArray, first: int, end: int, replicates: range | None = None) -> None:
        """Adds samples [first, end) to the sums of these tiles, which hold those before; waits for them. None: of all replicates."""
        replicates = range(self.count) if replicates is None else replicates
        given = np.empty((len(tiles), len(replicates), 4), np.int32)
        given[:, :, :2] = self.grid.corners(tiles)[:, None]
        given[:, :, 2] = self.seeds[replicates.start : replicates.stop]
        given[:, :, 3] = tiles[:, None] + self.grid.count * np.arange(replicates.start, replicates.stop)
        self.tracer.run_tiles(self.frame, self.sums, (first, end), given.reshape(-1, 4))
        self.launches.append((tiles, first, end, replicates))

    def centre(self, tiles: IntArray) -> None:
        """One sample through the centre of each pixel of these tiles, in the sums of replicate 0; what is sampled next replaces it."""
        record = self.tracer.buffers.packed.frame.copy()
        record["pixel_spread"] = 0
        self.frame = self.tracer.buffers.upload(record)
        self.run(tiles, 0, 1, range(1))
        self.frame = self.tracer.buffers.frame

    def overhead(self) -> float:
        """Seconds that a launch takes whatever it traces: that of a tile beside the picture, the least of a few."""
        beside = np.array([[self.grid.width, self.grid.height, 0, 0]], np.int32)
        seconds = []
        for _ in range(8):
            begin = time.perf_counter()
            self.tracer.run_tiles(self.frame, self.sums, (0, 1), beside)
            seconds.append(time.perf_counter() - begin)
        return min(seconds)

    def values(self, tiles: IntArray, samples: int) -> FloatArray:
        """(count, n, th, tw, 3): means over `samples` samples; what is beside the picture is nothing in particular."""
        with self._mapped() as sums:
            return np.asarray(sums[:, tiles] / samples)

    def means(self, replicate: int, samples: int) -> FloatArray:
        """(h, w, 3) of one replicate over `samples` samples."""
        with self._mapped() as sums:
            return self.grid.picture(sums[replicate] / samples)

    @contextmanager
    def _mapped(self) -> Iterator[FloatArray]:
        import pyopencl as cl

        shape = (self.count, self.grid.count, TILE[1], TILE[0], 3)
        kind: Any = np.float64
        sums: Any = cl.enqueue_map_buffer(self.queue, self.sums, cl.map_flags.READ, 0, shape, kind)[0]
        try:
            yield sums
        finally:
            sums.base.release(self.queue)

    def replay(self, launches: Iterable[tuple[IntArray, int, int, range]]) -> None:
        """The same launches by this tracer, which is one that counts: adds to its counts."""
        self.tracer.begin_counting()
        for tiles, first, end, replicates in launches:
            self.run(tiles, first, end, replicates)
        self.tracer.end_counting()
