"""Pictures of the device for tests: in packets of any width, of scenes with files beside them, and against the float64 reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from clrt import renderer
from clrt.device import program
from clrt.device.context import Device
from clrt.device.prepare import prepare
from clrt.device.session import Tracer
from clrt.features import Features
from clrt.precision import rung
from clrt.reference import render as reference
from clrt.scene.build import load_scene
from clrt.scene.model import Scene

Write = Callable[..., Scene]


def in_packets(scene: Scene, device: Device, lanes: int, precision: str = "watertight") -> np.ndarray:
    """(h, w, 3): the picture by a program for a device of so many lanes."""
    narrow = replace(device, info=replace(device.info, lanes=lanes))
    prepared = renderer.build_trees(scene, "sah", _quiet)
    tracer = renderer.open_tracer(prepared, Features.of(scene), rung(precision), narrow, _quiet)[1]
    renderer.run_rows(tracer, "render", _quiet)
    return tracer.picture()


def ray_counts(
    scene: Scene, device: Device, precision: str = "watertight", features: Features | None = None, samples: int | None = None
) -> tuple[dict[str, int], list[int]]:
    """Rays by kind, and tests by object: by the counting program alone, where `render(count=True)` needs the other one, too."""
    features = Features.of(scene) if features is None else features
    scene = renderer.with_options(scene, None, None, samples, 0)
    prepared = renderer.build_trees(scene, "sah", _quiet)
    buffers, _, _ = renderer.fill_buffers(prepared, features, rung(precision), device)
    shape = renderer.program_shape(prepared, features, buffers.shared_lights, buffers.wide_stack, buffers.shared_suns)
    built = program.build(device, program.compose(features, buffers.precision, buffers.lanes, shape, counting=True))
    prepare(buffers, built)
    tracer = Tracer(buffers, built, counting=True)
    renderer.run_rows(tracer, "count", _quiet)
    kinds = features.ray_kinds
    return dict(zip(kinds, tracer.counts.tolist(), strict=False)), tracer.counts[len(kinds) :].tolist()


def writer(folder: Path) -> Write:
    """A function: text and options of `load_scene` -> the scene, from a file beside the pictures in `folder`."""

    def scene(text: str, **options: object) -> Scene:
        (folder / "scene.txt").write_text(text)
        return load_scene(folder / "scene.txt", **options)  # type: ignore[arg-type]

    return scene


def compare(scene: Scene, pixels: np.ndarray) -> None:
    """Within 1e-4 wherever the reference is sure, which is most of the picture."""
    expected = reference(scene)
    wrong = np.abs(pixels - expected.pixels).max(-1) > 1e-4
    sure = expected.margin > 2e-5
    assert not (wrong & sure).any()
    assert sure.mean() > 0.5
    assert expected.pixels.std() > 0.05


def _quiet(phase: str, fraction: float) -> None:
    """No progress is shown."""
