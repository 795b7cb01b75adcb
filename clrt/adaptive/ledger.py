"""What is known of each tile at each number of samples that it had."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.adaptive.intervals import Interval, error_interval
from clrt.adaptive.moments import Moments
from clrt.adaptive.replicates import Grid

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]

_STEEP = 2.0  #: power of n by which what neighbours show at level 0 loses its say
_SIDES = np.arange(2)[:, None]


class Ledger:
    """Sums of tiles, level by level, and the picture that any choice of levels makes.

    At level l a tile has samples(l) samples of each replicate. `reached` : (tiles,) the highest level of each tile, -1 for none.
    Sums are kept of each side of a tile by itself: see moments.py.
    """

    def __init__(self, grid: Grid, count: int, first: int = 1) -> None:
        """count : replicates; first : samples of each at level 0."""
        self.grid, self.count, self.first = grid, count, first
        self.pixels = grid.side_pixels  #: (2, tiles)
        self.reached = np.full(grid.count, -1, np.int64)
        self.noise: list[FloatArray] = []  #: (2, tiles) of each level; see Moments
        self.total: list[FloatArray] = []
        self.square: list[FloatArray] = []
        self.bad = np.zeros((2, grid.count))
        self.closed = np.zeros(grid.count, bool)  #: tiles that are not to be sampled further
        self._first: dict[int, FloatArray] = {}
        self._blocks: list[list[Moments]] = []
        self._block: list[IntArray] = []
        self._row: list[IntArray] = []

    def samples(self, level: IntArray | int) -> IntArray:
        """Samples of each replicate."""
        return np.asarray(self.first << np.asarray(level, np.int64))

    def put(self, tiles: IntArray, level: int, found: Moments) -> None:
        """What was found of tiles that had their samples of the level before, or of the first."""
        while len(self.noise) <= level:
            for sums in (self.noise, self.total, self.square):
                sums.append(np.zeros((2, self.grid.count)))
            self._blocks.append([])
            self._block.append(np.full(self.grid.count, -1, np.int64))
            self._row.append(np.zeros(self.grid.count, np.int64))
        self.noise[level][:, tiles], self.total[level][:, tiles] = found.noise, found.total
        self.square[level][:, tiles] = found.square
        self._block[level][tiles], self._row[level][tiles] = len(self._blocks[level]), np.arange(len(tiles))
        self._blocks[level].append(found)
        self.reached[tiles], self.bad[:, tiles] = level, found.bad

    def at(self, sums: list[FloatArray], levels: IntArray) -> FloatArray:
        """(2, tiles) of sums, each tile and side at its level; levels : (2, tiles)."""
        return np.stack(sums)[levels, _SIDES, np.arange(self.grid.count)]

    def priority(self, side: int, levels: IntArray) -> FloatArray:
        """(tiles,): a side's variance of a pixel's mean over what that mean cost, a sample being 1: where a sample brings most."""
        noise = np.stack(self.noise)[levels, side, np.arange(self.grid.count)]
        noise = np.maximum(noise, self._around(side) * 2.0 ** (-_STEEP * levels))
        return np.where(self.closed, 0.0, noise / (np.maximum(self.pixels[side], 1) * 3.0 * self.samples(levels)))

    def _around(self, side: int) -> FloatArray:
        """(tiles,): what is to be expected of a tile that showed less at level 0 than those around it: half their mean."""
        if side not in self._first:
            grid, pixels = self.grid, np.maximum(self.pixels[side], 1)
            noise = np.pad((self.noise[0][side] / pixels).reshape(grid.rows, grid.columns), 1, mode="edge")
            mean = sum(noise[j : j + grid.rows, i : i + grid.columns] for j in range(3) for i in range(3)) / 9.0
            self._first[side] = np.asarray(mean).ravel() * pixels / 2.0
        return self._first[side]

    def numbers(self) -> FloatArray:
        """(2,): finite numbers of the picture on each side, at least 1."""
        return np.asarray(np.maximum(3.0 * (self.pixels - self.bad).sum(1), 1.0))

    def side_error(self, side: int, levels: IntArray) -> Interval:
        """Relative error of the picture's other side, were it sampled as this one, judged by this one alone; levels : (tiles,)."""
        own = np.broadcast_to(levels, (2, self.grid.count))
        noise, total, square = (float(self.at(sums, own)[side].sum()) for sums in (self.noise, self.total, self.square))
        return self._relative(noise, total, square, float(self.numbers()[side]))

    def error(self, levels: IntArray) -> Interval:
        """Relative error of the picture of these levels, (2, tiles): root mean square over pixels and channels over the picture's mean."""
        noise, total, square = (float(self.at(sums, levels).sum()) for sums in (self.noise, self.total, self.square))
        return self._relative(noise, total, square, float(self.numbers().sum()))

    def _relative(self, noise: float, total: float, square: float, numbers: float) -> Interval:
        """For a pixel, (x - mu)^2 less the estimate u of its variance v has the variance 2 R / (R - 1) v^2: docs/error.md."""
        spread = 2.0 * self.count / (self.count - 1.0) * square
        error, mean = error_interval(noise / numbers, spread / numbers**2, self.count - 1), abs(total) / numbers
        if mean == 0.0:
            return error if error.value == 0.0 else Interval(np.inf, 0.0, np.inf)
        return error.scaled(1.0 / mean)

    def picture(self, levels: IntArray) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Mean and standard error, (height, width, 3), with side s of tile t at levels[s, t]."""
        shape = (*self.grid.inside.shape, 3)
        mean, error = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        for level, blocks in enumerate(self._blocks):
            at, block = (levels == level), self._block[level]
            for number, found in enumerate(blocks):
                tiles = np.flatnonzero(at.any(0) & (block == number))
                row, both = self._row[level][tiles], at[:, tiles].all(0)
                mean[tiles[both]], error[tiles[both]] = found.mean[row[both]], found.error[row[both]]
                for side, pixels in enumerate(self.grid.sides):
                    one = at[side, tiles] & ~both
                    for of, to in ((found.mean, mean), (found.error, error)):
                        to[tiles[one][:, None], pixels] = of[row[one][:, None], pixels]
        return self.grid.picture(mean), self.grid.picture(error)
