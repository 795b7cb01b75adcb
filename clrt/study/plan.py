"""How much a study measures."""

from __future__ import annotations

from dataclasses import dataclass

from clrt.precision import DEFAULT


@dataclass(frozen=True)
class Plan:
    """Sizes and numbers of a study.

    side : pixels of the longer side of its pictures, unless a size is given, or the scene's own is smaller
    seeds : independent seeds of each point of the samples part
    flip_seeds : those of them that FLIP is computed of, which takes longer than the pictures
    most_samples : of the largest point, where `reference_s` has room for it; least_samples : of the largest in any case
    reference_factor : samples of the reference over those of the largest point; reference_s : seconds that it may take
    batches : independent seeds of the reference
    rounds : of timings; part_s : seconds that the rounds of one comparison may take
    oracle_rays : primary rays that exact arithmetic decides at most; leak_rays : rays of the leak test
    compile_rounds : processes that compile each rung, cold and warm; compiled : those rungs, None for all
    count_brute : count the tests of brute force, which takes longer than all else of the trees
    brute_pairs : pixels times triangles beyond which brute force is left out
    depths : most depths of the depth part
    samples : of a pixel in the parts that do not vary them, where the scene is sampled; fewer where it asks for fewer
    """

    quick: bool
    side: int
    seeds: int
    flip_seeds: int
    most_samples: int
    least_samples: int
    reference_factor: int
    reference_s: float
    batches: int
    rounds: int
    part_s: float
    oracle_rays: int
    leak_rays: int
    compile_rounds: int
    compiled: tuple[str, ...] | None
    count_brute: bool
    brute_pairs: int
    depths: int
    samples: int


FULL = Plan(
    quick=False, side=256, seeds=12, flip_seeds=8, most_samples=64, least_samples=8, reference_factor=100, reference_s=90.0, batches=16,
    rounds=21, part_s=12.0, oracle_rays=2000, leak_rays=300_000, compile_rounds=6, compiled=None, count_brute=True,
    brute_pairs=10_000_000_000, depths=8, samples=8,
)  # fmt: skip
QUICK = Plan(
    quick=True, side=160, seeds=10, flip_seeds=3, most_samples=16, least_samples=8, reference_factor=16, reference_s=5.0, batches=16,
    rounds=9, part_s=2.5, oracle_rays=200, leak_rays=30_000, compile_rounds=2, compiled=(DEFAULT,), count_brute=False,
    brute_pairs=2_000_000_000, depths=3, samples=4,
)  # fmt: skip
