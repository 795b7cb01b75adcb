"""The scene of a study on a device, and programs of it that render any number of samples of any seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device.context import Device
from clrt.device.session import check_picture
from clrt.features import Features
from clrt.precision import DEFAULT, rung
from clrt.renderer import Prepared, build_trees, open_tracer, run_rows, with_options
from clrt.scene.model import Scene
from clrt.study.plan import Plan

Tell = Callable[[str, float], None]
Picture = NDArray[np.float32]

FIRST_SEED = 0  #: of what is judged: seeds count up from here
REFERENCE_SEED = 1 << 31  #: of what judges: no seed is on both sides


@dataclass(frozen=True, eq=False)
class Subject:
    """What is studied.

    path : of the scene text; loaded : as read, for a phase that reads it again; prepared : its trees, at the study's size and samples
    folder : where the study goes; tell : told the part under way and how much of it is done, 0 to 1
    """

    path: Path
    read: Callable[[], Scene]
    prepared: Prepared
    device: Device
    plan: Plan
    folder: Path
    tell: Tell

    @property
    def scene(self) -> Scene:
        return self.prepared.scene

    @property
    def size(self) -> tuple[int, int]:
        return self.scene.camera.width, self.scene.camera.height

    @property
    def sampled_effects(self) -> tuple[str, ...]:
        """Effects that draw random numbers, but for antialiasing."""
        return tuple(f.name for f in Features.of(self.scene).active if f.sampled and f.name != "samples")

    @property
    def samples(self) -> int:
        """Of a pixel, in the parts that do not vary them."""
        return self.scene.samples

    def with_samples(self, samples: int) -> Prepared:
        return replace(self.prepared, scene=replace(self.scene, samples=samples))

    def shot(self, precision: str = DEFAULT, *, samples: int | None = None, without: tuple[str, ...] = ()) -> Shot:
        """A program at a rung; `samples` above 1 ask for places spread over the pixel."""
        prepared = self.prepared if samples is None else self.with_samples(samples)
        return Shot(prepared, Features.of(prepared.scene, without), precision, self.device)

    def shot_of(self, prepared: Prepared) -> Shot:
        """A program over other trees of the same scene."""
        return Shot(prepared, Features.of(prepared.scene), DEFAULT, self.device)


class Shot:
    """A program with its buffers. `upload_s`: seconds of packing, uploading and preparing these."""

    def __init__(self, prepared: Prepared, features: Features, precision: str, device: Device) -> None:
        self.buffers, self.tracer, self.source, self.upload_s = open_tracer(prepared, features, rung(precision), device, silent)

    def run(self, samples: int | None = None, seed: int | None = None) -> None:
        """Traces the picture; as the scene says, unless other samples or another seed are given."""
        packed = self.buffers.packed
        if samples is not None:
            self.buffers.packed = replace(packed, scene=replace(packed.scene, samples=samples))
        if seed is not None:
            self._reseed(seed)
        run_rows(self.tracer, "study", silent)

    def picture(self, samples: int | None = None, seed: int | None = None) -> Picture:
        """`run`, and what it made: (height, width, 3) float32."""
        self.run(samples, seed)
        return self.tracer.picture()

    def _reseed(self, seed: int) -> None:
        import pyopencl as cl

        frame: NDArray[Any] = self.buffers.packed.frame.copy()
        if "seed" in (frame.dtype.names or ()):
            frame["seed"] = np.uint32(seed).astype(np.int32)
            cl.enqueue_copy(self.buffers.device.queue, self.buffers.frame, frame)


def silent(phase: str, fraction: float) -> None:
    """No progress."""


def sized(scene: Scene, side: int) -> tuple[int, int]:
    """The scene's own size, or the one of its shape with `side` pixels on the longer side, whichever is smaller."""
    width, height = scene.camera.width, scene.camera.height
    scale = min(1.0, side / max(width, height))
    return max(1, round(scale * width)), max(1, round(scale * height))


def open_subject(
    path: Path, read: Callable[[], Scene], device: Device, plan: Plan, folder: Path, size: tuple[int, int] | None, tell: Tell
) -> Subject:
    """Reads the scene and builds its trees. Raises SceneError, ClrtError, LimitError, OSError; writes nothing."""
    tell("reading the scene", 0.0)
    scene = read()
    scene = with_options(scene, size or sized(scene, plan.side), None, None, FIRST_SEED)
    if scene.samples > plan.samples:
        scene = replace(scene, samples=plan.samples)
    check_picture(device, scene.camera.width, scene.camera.height)
    return Subject(path, read, build_trees(scene, "sah", silent, device), device, plan, folder, tell)
