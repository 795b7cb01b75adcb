"""Only what the scene calls for: smallest scenes without traces of other effects, beside programs that hold all effects, and a new one."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from feature_sets import traces
from numpy.typing import NDArray

import clrt.features
from clrt.device import program
from clrt.device.context import Device
from clrt.device.session import Tracer
from clrt.features import FEATURES, Feature, Features
from clrt.precision import rung
from clrt.renderer import Prepared, build_trees, open_tracer, program_shape, run_rows, with_options
from clrt.scene.build import load_scene

SCENES = sorted((Path(__file__).parents[1] / "scenes").glob("*.txt"))
LADDER = rung("watertight")
DEPTH, SAMPLES, LARGEST = 5, 2, 100  #: one program of all effects serves most scenes
BOUND = 2.0**-19  #: of a channel: other code around it lets the compiler order the same float32 sums of a pixel otherwise

every_scene = pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)


def _silent(phase: str, fraction: float) -> None:
    """No progress."""


@cache
def prepared(path: Path) -> Prepared:
    """A smallest scene at a small size, with few bounces and samples."""
    scene = load_scene(path)
    width, height = scene.camera.width, scene.camera.height
    size = (width, height) if max(width, height) <= LARGEST else (LARGEST, LARGEST * height // width)
    return build_trees(with_options(scene, size, min(scene.depth, DEPTH), min(scene.samples, SAMPLES), 0), "sah", _silent)


def composed(path: Path, *, counting: bool = False) -> str:
    scene = prepared(path)
    features = Features.of(scene.scene)
    return program.compose(features, LADDER, 16, program_shape(scene, features, True), counting=counting)


@every_scene
def test_smallest_scene_holds_no_trace_of_any_effect_that_it_does_not_call_for(path: Path) -> None:
    source, active = composed(path), Features.of(prepared(path).scene).active
    assert {f.name: traces(f, source) for f in FEATURES if f not in active} == {f.name: [] for f in FEATURES if f not in active}
    assert all(traces(f, source) for f in active)


@pytest.fixture
def dummy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Feature]:
    """An effect that no scene calls for, with code at every place that there is."""
    texts = [path.read_text() for path in program.kernel_folder().glob("*.cl")]
    places = sorted({place for text in texts for place in re.findall(r"^ *//@ (\w+)$", text, re.M)})
    file = tmp_path / "dummy_effect.cl"
    file.write_text("HOT int dummy_effect(int n) { return n; }\n" + "".join(f"//@hook {p}\n    dummy_effect(0);\n//@end\n" for p in places))
    kernels = program.kernel_folder()
    monkeypatch.setattr(program, "kernel_folder", lambda: _Folder(kernels, file))
    program.kernel_source.cache_clear()
    yield Feature(
        "dummy effect", lambda scene: None, file.name, material=(("dummy_member", np.int32),), light=(("dummy_light", np.int32),),
        frame=(("dummy_frame", np.int32, lambda scene: 1),), parameters=(("dummy_array", "global const int *dummy_array"),),
        rays=("dummy",), branches=1,
    )  # fmt: skip
    program.kernel_source.cache_clear()


class _Folder:
    """The kernels' folder, and one file more."""

    def __init__(self, folder: Path, more: Path) -> None:
        self.folder, self.more = folder, more

    def __truediv__(self, name: str) -> Path:
        return self.more if name == self.more.name else self.folder / name


@pytest.mark.parametrize("place", [0, len(FEATURES) // 2, len(FEATURES)])
def test_registering_an_effect_leaves_every_source_byte_for_byte(dummy: Feature, place: int, monkeypatch: pytest.MonkeyPatch) -> None:
    before = {(path, counting): composed(path, counting=counting) for path in SCENES for counting in (False, True)}
    monkeypatch.setattr(clrt.features, "FEATURES", (*FEATURES[:place], dummy, *FEATURES[place:]))
    assert {key: composed(key[0], counting=key[1]) for key in before} == before


def test_the_registered_effect_would_have_been_seen(dummy: Feature, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clrt.features, "FEATURES", (*FEATURES, dummy))
    asked = Features((*Features.of(prepared(SCENES[0]).scene).lines, (dummy.name, 0)))
    source = program.compose(asked, LADDER, 16, program.Shape(16))
    assert all(word in source for word in ("dummy_effect.cl", "dummy_effect(0)", "dummy_member", "dummy_frame", "dummy_array"))


def _run(path: Path, features: Features, device: Device, *, counting: bool = False) -> Tracer:
    scene = prepared(path)
    buffers, tracer = open_tracer(scene, features, LADDER, device, _silent)[:2]
    if counting:
        shape = program_shape(scene, features, buffers.shared_lights)
        source = program.compose(features, LADDER, LADDER.lanes(device.info.lanes), shape, counting=True)
        tracer = Tracer(buffers, program.build(device, source), counting=True)
    run_rows(tracer, "render", _silent)
    return tracer


def _picture(path: Path, features: Features, device: Device) -> NDArray[np.float32]:
    return _run(path, features, device).picture()


@pytest.mark.slow
@every_scene
def test_program_of_all_effects_makes_the_same_picture(path: Path, device: Device) -> None:
    features = Features.of(prepared(path).scene)
    own, every = (_picture(path, f, device) for f in (features, features.with_every()))
    np.testing.assert_allclose(every, own, rtol=BOUND, atol=BOUND)


@pytest.mark.slow
@every_scene
def test_no_ray_is_traced_for_an_effect_that_is_not_called_for(path: Path, device: Device) -> None:
    """Where the code of all effects is there, the counters tell that what is not called for still sends no ray."""
    features = Features.of(prepared(path).scene)
    counts = {}
    for each in (features, features.with_every()):
        tracer = _run(path, each, device, counting=True)
        counts[each.every] = dict(zip(each.ray_kinds, tracer.counts.tolist(), strict=False))
    absent = set(counts[True]) - set(counts[False])
    assert len(absent) > 3
    assert {kind: counts[True][kind] for kind in absent} == dict.fromkeys(absent, 0)
    assert {kind: counts[True][kind] for kind in counts[False]} == counts[False]
