"""Where samples go must not bias the mean: counted over many trials of rare events, with a naive schedule that fails."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.adaptive.ledger import Ledger
from clrt.adaptive.moments import moments
from clrt.adaptive.replicates import HALF, REPLICATES, Grid
from clrt.adaptive.schedule import Walk, threshold

CHANCE = 0.02
MOST = 64


def _walk(seed: int, width: int = 2, height: int = 2, error: float = 0.5) -> tuple[Walk, Ledger, dict[int, int]]:
    """A picture whose samples are 1 with a small chance, else 0, walked to an error; also how often each tile was extended."""
    generator = np.random.default_rng(seed)
    grid = Grid(width, height)
    ledger, sums, extended = Ledger(grid), np.zeros((REPLICATES, grid.count, 8, 16, 3)), dict.fromkeys(range(grid.count), 0)

    def take(tiles: NDArray[np.int64], samples: int, level: int) -> None:
        inside = grid.places(tiles)[2]
        drawn = generator.binomial(samples, CHANCE, (REPLICATES, len(tiles), 8, 16, 1)).astype(float)
        sums[:, tiles] += drawn * inside[None, ..., None]
        ledger.put(tiles, level, moments(sums[:, tiles] / int(ledger.samples(level)), inside))

    def extend(tiles: NDArray[np.int64]) -> bool:
        for tile in tiles.tolist():
            level = int(ledger.reached[tile])
            take(np.array([tile]), int(ledger.samples(level)), level + 1)
            extended[tile] += 1
        return True

    take(np.arange(grid.count), 1, 0)
    walk = Walk(ledger, MOST)
    walk.run(extend, lambda half: ledger.half_error(half, walk.levels[half]).value <= error and ledger.noise[0][half].sum() > 0.0)
    return walk, ledger, extended


@pytest.fixture(scope="module")
def trials() -> list[tuple[Walk, Ledger]]:
    return [_walk(seed)[:2] for seed in range(400)]


def test_mean_is_unbiased_and_a_naive_choice_is_not(trials: list[tuple[Walk, Ledger]]) -> None:
    z = []
    for choose in (lambda walk: walk.swapped, lambda walk: walk.levels):
        means = [float(ledger.picture(choose(walk))[0].mean()) for walk, ledger in trials]
        z.append((np.mean(means) - CHANCE) / (np.std(means, ddof=1) / np.sqrt(len(means))))
    assert abs(z[0]) < 3.3
    assert abs(z[1]) > 5.0


def test_stated_error_is_unbiased_too(trials: list[tuple[Walk, Ledger]]) -> None:
    """The stated squared error over trials is the true one's, within what chance allows their difference."""
    difference = []
    for walk, ledger in trials:
        mean, error = ledger.picture(walk.swapped)
        difference.append(float(((mean - CHANCE) ** 2).mean() - (error.astype(float) ** 2).mean()))
    assert abs(np.mean(difference)) < 3.3 * np.std(difference, ddof=1) / np.sqrt(len(difference))


def test_tiles_end_at_or_below_the_threshold_and_one_level_before_above_it() -> None:
    walk, ledger, extended = _walk(3, 64, 24, 0.1)
    for half in (0, 1):
        levels = walk.levels[half]
        step = walk.step
        full = 2 * ledger.samples(levels) > MOST
        assert ((ledger.priority(half, levels) <= threshold(step)) | full).all()
    assert (ledger.reached == walk.levels.max(axis=0)).all()
    assert [extended[tile] for tile in range(ledger.grid.count)] == ledger.reached.tolist()  # each level was sampled once


def test_tile_without_noise_is_left_at_its_first_level() -> None:
    grid = Grid(96, 24)
    ledger = Ledger(grid)
    generator, everywhere = np.random.default_rng(1), np.arange(grid.count)
    noisy = everywhere % grid.columns >= 4

    def values(tiles: NDArray[np.int64], level: int) -> NDArray[np.float64]:
        spread = np.where(noisy[tiles], 0.5 / np.sqrt(ledger.samples(level)), 0.0)[None, :, None, None, None]
        return 1.0 + spread * generator.normal(size=(REPLICATES, len(tiles), 8, 16, 3))

    def extend(tiles: NDArray[np.int64]) -> bool:
        for tile in tiles.tolist():
            level = int(ledger.reached[tile]) + 1
            ledger.put(np.array([tile]), level, moments(values(np.array([tile]), level), np.ones((1, 8, 16), bool)))
        return True

    ledger.put(everywhere, 0, moments(values(everywhere, 0), np.ones((grid.count, 8, 16), bool)))
    walk = Walk(ledger, 1 << 12)
    assert walk.run(extend, lambda half: ledger.half_error(half, walk.levels[half]).high <= 0.02)
    far = everywhere % grid.columns < 3  # not even beside noise
    assert (ledger.reached[far] == 0).all()
    assert (ledger.reached[noisy] > 3).all()


def test_partial_tiles_at_the_edge_cover_the_picture_once() -> None:
    grid = Grid(37, 13)
    seen = np.zeros((13, 37), int)
    rows, columns, inside = grid.places(np.arange(grid.count))
    rows, columns = np.broadcast_arrays(rows, columns)
    np.add.at(seen, (rows[inside], columns[inside]), 1)
    assert (seen == 1).all()
    assert grid.pixels.sum() == 37 * 13
    assert HALF * 2 == REPLICATES
