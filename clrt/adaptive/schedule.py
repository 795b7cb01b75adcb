"""Where to sample next, so that what decides is independent of what is averaged.

The sides of a tile, its pixels of even and of odd row + column, walk each by themselves: at step k a side raises its level of a tile as
long as its own priority there is above threshold(k), a fixed sequence. A side's walk decides how many samples the *other* side's pixels
have in the picture. All of a tile's pixels are traced to the higher of the two levels, so that each side can always see its own data; what
a side has beyond the other's decision is not averaged. Given one side's samples, the numbers of samples of the other side's means are
fixed, so that these means, and the estimates of their variance, are unbiased.

The greatest decrease of the picture's squared error for one more sample is where a tile's variance over its number of samples is
greatest: levels of equal priority cost the least time for the error they reach (Lagrange's condition for a variance that falls as a
power of n).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from clrt.adaptive.ledger import Ledger

IntArray = NDArray[np.int64]

STEPS = 2  #: a factor 2 of the threshold in so many steps


def threshold(step: int) -> float:
    return float(2.0 ** (-step / STEPS))


class Walk:
    """The levels of both sides' walks. `levels` : (2, tiles); `swapped` : the levels of the picture, each side's by the other.

    A side without pixels (pictures of one pixel) has nothing to say: there the other one decides for itself.
    """

    def __init__(self, ledger: Ledger, most: int) -> None:
        """All tiles are at level 0; most : samples of a replicate that are not exceeded."""
        self.ledger, self.most = ledger, most
        self.levels = np.zeros((2, ledger.grid.count), np.int64)
        self.done = np.zeros(2, bool)
        self.step = self._first_step()

    @property
    def swapped(self) -> IntArray:
        order = [1, 0] if self.ledger.pixels.any(1).all() else [int(self.ledger.pixels[1].any())] * 2
        return np.asarray(self.levels[order])

    def _first_step(self) -> int:
        """The last step at which no tile is above the threshold."""
        greatest = max(float(self.ledger.priority(side, self.levels[side]).max()) for side in (0, 1))
        return int(np.floor(-STEPS * np.log2(greatest))) if greatest > 0.0 else 0

    def wanting(self, side: int, step: int) -> IntArray:
        """Tiles that the side wants at a higher level, at this step."""
        levels = self.levels[side]
        room = 2 * self.ledger.samples(levels) <= self.most
        return np.flatnonzero((self.ledger.priority(side, levels) > threshold(step)) & room)

    def advance(self, step: int) -> IntArray:
        """Raises levels as far as what was sampled tells; the tiles that must be sampled further before the step is done."""
        missing: list[IntArray] = []
        for side in np.flatnonzero(~self.done).tolist():
            while True:
                wanted = self.wanting(side, step)
                there = self.ledger.reached[wanted] > self.levels[side][wanted]
                if not there.any():
                    break
                self.levels[side][wanted[there]] += 1
            missing.append(wanted)
        return np.unique(np.concatenate(missing)) if missing else np.zeros(0, np.int64)

    def exhausted(self) -> bool:
        """No side that goes on could: its tiles are without noise, or have the most samples."""
        return all(self.wanting(side, STEPS * 10_000).size == 0 for side in np.flatnonzero(~self.done).tolist())

    def run(self, extend: Callable[[IntArray], bool], met: Callable[[int], bool]) -> bool:
        """Steps until `met` of each side; whether that was reached.

        extend : samples tiles to their next level and puts them into the ledger; False where time is up
        met : whether a side's own walk is far enough for the other side's mean
        """
        while True:
            for side in np.flatnonzero(~self.done).tolist():
                self.done[side] = met(side)
            if self.done.all() or self.exhausted():
                return bool(self.done.all())
            self.step += 1
            while (missing := self.advance(self.step)).size:
                if not extend(missing):
                    self.advance(self.step)
                    return False
