"""Composed programs hold what a scene calls for and nothing else, and refuse options that break their bounds."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from feature_sets import NAMES, all_but, mixed_sets, own_names, traces, with_needs

from clrt.device import kernel_cache, program
from clrt.device.context import Device
from clrt.device.program import Shape
from clrt.errors import ClrtError, DeviceError, LimitError
from clrt.features import FEATURES, Feature, Features
from clrt.precision import RUNGS, rung

SHAPE = Shape(stack=16, depth=5)
ALL = Features(tuple((f.name, 0) for f in FEATURES))


@pytest.mark.parametrize("feature", FEATURES, ids=lambda f: f.name)
def test_source_without_an_effect_holds_none_of_its_names(feature: Feature) -> None:
    assert own_names(feature) <= set(traces(feature, program.compose(ALL, rung("watertight"), 16, SHAPE))), "they occur where it is on"
    assert traces(feature, program.compose(all_but(feature), rung("watertight"), 16, SHAPE)) == []


def test_plain_source_holds_no_effect_and_no_mark() -> None:
    source = program.compose(Features(()), rung("watertight"), 16, SHAPE)
    for feature in FEATURES:
        assert traces(feature, source) == []
    assert "//@" not in source
    assert "count_rays" not in source


def test_counting_build_differs_only_by_what_counts() -> None:
    plain = program.compose(ALL, rung("watertight"), 16, SHAPE)
    counting = program.compose(ALL, rung("watertight"), 16, SHAPE, counting=True)
    assert "counters" not in plain
    assert counting.count("count_rays(") >= 5


def test_every_chunk_names_its_file() -> None:
    source = program.compose(ALL, rung("watertight"), 16, SHAPE)
    for name in ("lanes.cl", "kdtree.cl", "render.cl", "sphere.cl"):
        assert f'#line 1 "{name}"' in source


def test_line_directives_are_true(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A fault planted behind all hooks is reported at its line of the file that a person would open."""
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))  # the folder that is emptied, as a broken entry may be the reason
    source = program.compose(ALL, rung("watertight"), 16, SHAPE)
    text = program.kernel_source("render.cl")[0]
    line = 1 + text[: text.index("real out[3][LANES];")].count("\n")
    broken = source.replace("real out[3][LANES];", "real out[3][LANES]; planted_fault;")
    with pytest.raises(DeviceError, match=rf"render\.cl:{line}:\d+: .*planted_fault"):
        program.build(device, broken)


WIDTHS = (16, 8, 4, 1)
MIXED = mixed_sets(16)


@pytest.mark.matrix(keep=13)
@pytest.mark.parametrize("name", [f.name for f in FEATURES])
def test_each_effect_with_what_it_needs_compiles_for_any_width(device: Device, name: str) -> None:
    features = with_needs([name])
    assert name in {f.name for f in features.active}
    program.build(device, program.compose(features, rung("watertight"), WIDTHS[sum(map(ord, name)) % 4], SHAPE))


def test_all_pairs_of_effects_meet_in_some_mixed_set() -> None:
    sets = [{f.name for f in features.active} for features in MIXED]
    assert [pair for pair in itertools.combinations(NAMES, 2) if not any({*pair} <= names for names in sets)] == []


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(MIXED)))
def test_mixed_sets_of_effects_compile(device: Device, number: int) -> None:
    program.build(device, program.compose(MIXED[number], rung("watertight"), WIDTHS[number % 4], SHAPE))


def test_stack_size_covers_the_depth() -> None:
    for depth in range(100):
        assert depth < program.stack_size(depth) <= max(8, depth + 8)


def test_private_memory_beyond_a_thread_is_refused() -> None:
    with pytest.raises(LimitError, match="--depth"):
        program.check_limits(rung("watertight"), 16, Shape(stack=64, depth=2000), ALL)
    mirrors = Features.named(("spheres", "shadows", "direct light", "mirror", "refraction"))
    program.check_limits(rung("watertight"), 16, Shape(stack=64, depth=64), mirrors)


@pytest.mark.parametrize("option", ["-cl-fast-relaxed-math", "-cl-unsafe-math-optimizations", "-cl-finite-math-only", "-cl-mad-enable"])
def test_unsafe_build_options_are_refused(device: Device, option: str) -> None:
    with pytest.raises(DeviceError, match=re.escape(option)):
        program.build(device, "kernel void f() {}", (option,))


def test_unsafe_options_of_the_environment_are_refused(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYOPENCL_BUILD_OPTIONS", "-cl-fast-relaxed-math")
    with pytest.raises(DeviceError, match="fast-relaxed-math"):
        program.build(device, "kernel void f() {}")


def test_unknown_precision_names_the_rungs() -> None:
    with pytest.raises(ClrtError, match=", ".join(RUNGS)):
        rung("sloppy")


def test_lanes_of_a_rung_fill_the_same_vector() -> None:
    assert [rung("watertight").lanes(n) for n in (16, 8, 4, 1)] == [16, 8, 4, 1]
    assert np.dtype(rung("watertight").real).itemsize * 8 == rung("watertight").bits


def test_every_rung_has_packets_for_every_device() -> None:
    # Two doubles fill what four floats do, and there is no packet of two rays.
    assert [rung("double").lanes(n) for n in (16, 8, 4, 1)] == [8, 4, 1, 1]
    assert all(ladder.lanes(n) in program.PACKETS for ladder in RUNGS.values() for n in (16, 8, 4, 1))
