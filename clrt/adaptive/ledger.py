"""What is known of each tile at each number of samples that it had."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.adaptive.intervals import Interval, error_interval
from clrt.adaptive.moments import Moments
from clrt.adaptive.replicates import HALF, Grid

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]

_STEEP = 2.0  #: power of n by which what neighbours show at level 0 loses its say
_HALVES = np.arange(2)[:, None]
#: Variance of ((a + b) / 2 - mu)^2 about its estimate (u_a + u_b) / 4, in squares of u, the variance of one half's mean: the parts
#: ((a - mu)^2 - u_a) / 4, the same of b, and (a - mu) (b - mu) / 2 are uncorrelated and have 2 u^2 n / (n - 1) / 16 twice and u^2 / 4.
_BOTH = HALF / (HALF - 1.0) / 4.0 + 0.25
#: The same about u_a / 2, of half A alone, for normal replicates.
_ALONE = _BOTH + 2.0 / (HALF - 1.0) / 8.0


class Ledger:
    """Sums of tiles, level by level, and the picture that any choice of levels makes.

    At level l a tile has samples(l) samples of each replicate. `reached` : (tiles,) the highest level of each tile, -1 for none.
    Half A is 0, half B is 1.
    """

    def __init__(self, grid: Grid, first: int = 1) -> None:
        """first : samples of each replicate at level 0."""
        self.grid, self.first = grid, first
        self.reached = np.full(grid.count, -1, np.int64)
        self.noise: list[FloatArray] = []  #: (2, tiles) of each level; see Moments
        self.total: list[FloatArray] = []
        self.square: list[FloatArray] = []
        self.product: list[FloatArray] = []
        self.bad = np.zeros(grid.count, np.int64)
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
            self.product.append(np.zeros(self.grid.count))
            self._blocks.append([])
            self._block.append(np.full(self.grid.count, -1, np.int64))
            self._row.append(np.zeros(self.grid.count, np.int64))
        self.noise[level][:, tiles], self.total[level][:, tiles] = found.noise, found.total
        self.square[level][:, tiles], self.product[level][tiles] = found.square, found.product
        self._block[level][tiles], self._row[level][tiles] = len(self._blocks[level]), np.arange(len(tiles))
        self._blocks[level].append(found)
        self.reached[tiles], self.bad[tiles] = level, found.bad

    def at(self, sums: list[FloatArray], levels: IntArray) -> FloatArray:
        """(2, tiles) of sums, each tile and half at its level; levels : (2, tiles)."""
        return np.stack(sums)[levels, _HALVES, np.arange(self.grid.count)]

    def priority(self, half: int, levels: IntArray) -> FloatArray:
        """(tiles,): a half's variance of a pixel's mean over what that mean cost, a sample being 1: where a sample brings most."""
        noise = np.stack(self.noise)[levels, half, np.arange(self.grid.count)]
        noise = np.maximum(noise, self._around(half) * 2.0 ** (-_STEEP * levels))
        return np.where(self.closed, 0.0, noise / (self.grid.pixels * 3.0 * self.samples(levels)))

    def _around(self, half: int) -> FloatArray:
        """(tiles,): what is to be expected of a tile that showed less at level 0 than those around it: half their mean."""
        if half not in self._first:
            noise = np.pad((self.noise[0][half] / self.grid.pixels).reshape(self.grid.rows, self.grid.columns), 1, mode="edge")
            mean = sum(noise[j : j + self.grid.rows, i : i + self.grid.columns] for j in range(3) for i in range(3)) / 9.0
            self._first[half] = np.asarray(mean).ravel() * self.grid.pixels / 2.0
        return self._first[half]

    def half_error(self, half: int, levels: IntArray) -> Interval:
        """Relative error of the picture, were both halves sampled as this one, and judged by this one alone; levels : (tiles,)."""
        own = np.broadcast_to(levels, (2, self.grid.count))
        noise, total, square = (self.at(sums, own)[half].sum() for sums in (self.noise, self.total, self.square))
        return self._relative(noise / 2.0, total, _ALONE * square, HALF - 1)

    def error(self, levels: IntArray) -> Interval:
        """Relative error of the picture of these levels, (2, tiles): root mean square over pixels and channels over the picture's mean."""
        noise, total = (self.at(sums, levels).sum() for sums in (self.noise, self.total))
        product = self.at([np.broadcast_to(p, (2, self.grid.count)) for p in self.product], levels)
        return self._relative(noise / 4.0, total / 2.0, _BOTH * float(np.sqrt(product[0] * product[1]).sum()), 2 * HALF - 2)

    def _relative(self, noise: float, total: float, spread: float, spare: int) -> Interval:
        numbers = max(1, 3 * int((self.grid.pixels - self.bad).sum()))
        error, mean = error_interval(noise / numbers, spread / numbers**2, spare), abs(total) / numbers
        if mean == 0.0:
            return error if error.value == 0.0 else Interval(np.inf, 0.0, np.inf)
        return error.scaled(1.0 / mean)

    def picture(self, levels: IntArray) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Mean and standard error, (height, width, 3), with half A of tile t at levels[0, t] and half B at levels[1, t]."""
        shape = (self.grid.height, self.grid.width, 3)
        mean, variance = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        for level, blocks in enumerate(self._blocks):
            for half in (0, 1):
                for number, block in enumerate(blocks):
                    tiles = np.flatnonzero((levels[half] == level) & (self._block[level] == number))
                    rows, columns, inside = self.grid.places(tiles)
                    rows, columns = np.broadcast_arrays(rows, columns)
                    place, row = (rows[inside], columns[inside]), self._row[level][tiles]
                    mean[place] += block.mean[half][row][inside] / 2
                    variance[place] += block.variance[half][row][inside] / 4
        return mean, np.sqrt(variance)
