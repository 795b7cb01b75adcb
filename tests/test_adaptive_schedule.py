"""Where samples go must not bias the mean: counted over many trials of rare events, with a naive schedule that fails."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.adaptive.ledger import Ledger
from clrt.adaptive.moments import moments
from clrt.adaptive.replicates import HALVES, Grid
from clrt.adaptive.schedule import Walk, threshold

CHANCE = 0.02
MOST = 64


def _walk(seed: int, width: int = 2, height: int = 2, error: float = 0.5) -> tuple[Walk, Ledger, dict[int, int]]:
    """A picture whose samples are 1 with a small chance, else 0, walked to an error; also how often each tile was extended."""
    generator = np.random.default_rng(seed)
    grid = Grid(width, height)
    ledger, sums, extended = Ledger(grid, HALVES), np.zeros((HALVES, grid.count, 8, 16, 3)), dict.fromkeys(range(grid.count), 0)

    def take(tiles: NDArray[np.int64], samples: int, level: int) -> None:
        inside = grid.inside[tiles]
        drawn = generator.binomial(samples, CHANCE, (HALVES, len(tiles), 8, 16, 1)).astype(float)
        sums[:, tiles] += drawn * inside[None, ..., None]
        ledger.put(tiles, level, moments(sums[:, tiles] / int(ledger.samples(level)), inside, grid.sides))

    def extend(tiles: NDArray[np.int64]) -> bool:
        for tile in tiles.tolist():
            level = int(ledger.reached[tile])
            take(np.array([tile]), int(ledger.samples(level)), level + 1)
            extended[tile] += 1
        return True

    take(np.arange(grid.count), 1, 0)
    walk = Walk(ledger, MOST)
    walk.run(extend, lambda side: ledger.side_error(side, walk.levels[side]).value <= error and ledger.noise[0][side].sum() > 0.0)
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
    for side in (0, 1):
        levels = walk.levels[side]
        step = walk.step
        full = 2 * ledger.samples(levels) > MOST
        assert ((ledger.priority(side, levels) <= threshold(step)) | full).all()
    assert (ledger.reached == walk.levels.max(axis=0)).all()
    assert [extended[tile] for tile in range(ledger.grid.count)] == ledger.reached.tolist()  # each level was sampled once


def test_tile_without_noise_is_left_at_its_first_level() -> None:
    grid = Grid(96, 24)
    ledger = Ledger(grid, HALVES)
    generator, everywhere = np.random.default_rng(1), np.arange(grid.count)
    noisy = everywhere % grid.columns >= 4

    def values(tiles: NDArray[np.int64], level: int) -> NDArray[np.float64]:
        spread = np.where(noisy[tiles], 0.5 / np.sqrt(ledger.samples(level)), 0.0)[None, :, None, None, None]
        return 1.0 + spread * generator.normal(size=(HALVES, len(tiles), 8, 16, 3))

    def extend(tiles: NDArray[np.int64]) -> bool:
        for tile in tiles.tolist():
            level = int(ledger.reached[tile]) + 1
            ledger.put(np.array([tile]), level, moments(values(np.array([tile]), level), np.ones((1, 8, 16), bool), grid.sides))
        return True

    ledger.put(everywhere, 0, moments(values(everywhere, 0), np.ones((grid.count, 8, 16), bool), grid.sides))
    walk = Walk(ledger, 1 << 12)
    assert walk.run(extend, lambda side: ledger.side_error(side, walk.levels[side]).high <= 0.02)
    far = everywhere % grid.columns < 3  # not even beside noise
    assert (ledger.reached[far] == 0).all()
    assert (ledger.reached[noisy] > 3).all()


def test_partial_tiles_at_the_edge_cover_the_picture_once() -> None:
    grid = Grid(37, 13)
    numbers = np.arange(13 * 37 * 3).reshape(13, 37, 3)
    assert (grid.picture(grid.tilewise(numbers)) == numbers).all()
    seen = np.zeros((13, 37), int)
    for tile, (column, row) in enumerate(grid.corners(np.arange(grid.count)).tolist()):
        y, x = np.nonzero(grid.inside[tile])
        np.add.at(seen, (row + y, column + x), 1)
    assert (seen == 1).all()
    assert grid.pixels.sum() == 37 * 13


def test_sides_are_a_checkerboard_over_the_whole_picture() -> None:
    grid = Grid(37, 13)
    odd = grid.picture(np.broadcast_to(grid.sides[1], grid.inside.shape))
    y, x = np.indices((13, 37))
    assert (odd == (x + y) % 2).all()
    assert grid.side_pixels.sum(1).tolist() == [int(((x + y) % 2 == 0).sum()), int(((x + y) % 2 == 1).sum())]


def test_picture_of_one_pixel_decides_for_itself() -> None:
    walk, ledger, _ = _walk(1, 1, 1, 0.1)
    assert (walk.swapped == walk.levels[0]).all()
    assert ledger.picture(walk.swapped)[0].shape == (1, 1, 3)
