"""What the rungs of the precision ladder cost: the same pictures on each, in turns."""

from __future__ import annotations

from functools import partial
from typing import Any

from clrt.bench.scenes import BenchScene, straight
from clrt.device.context import Device
from clrt.features import Features
from clrt.precision import RUNGS, rung
from clrt.renderer import build_trees, open_tracer
from clrt.scene.model import Scene
from clrt.timing import interleave, paired

BASE = "fast"  #: what the others are compared with


def measure_ladder(bench: BenchScene, size: int, rounds: int, device: Device) -> list[dict[str, Any]]:
    """A row a rung, of the scene with shadows alone and of the scene as it is. Times are of the launches."""
    scenes = {"shadows alone": straight(bench.scene), "as it is": bench.scene}
    return [
        {"scene": bench.name, "effects": words, "size": size, **row}
        for words, scene in scenes.items()
        for row in _rows(scene.with_size(size, size), rounds, device)
    ]


def _rows(scene: Scene, rounds: int, device: Device) -> list[dict[str, Any]]:
    prepared, features = build_trees(scene, "sah", _silent, device), Features.of(scene)
    tracers = {name: open_tracer(prepared, features, rung(name), device, _silent)[1] for name in RUNGS}
    series = interleave({name: partial(tracer.run, 0, tracer.height) for name, tracer in tracers.items()}, rounds)
    base, rows = series[BASE], []
    for name, tracer in tracers.items():
        rows.append({
            "rung": name, "render_s": series[name].to_json(), "ratio": paired(series[name].seconds, base.seconds).to_json(),
            "decided": _per_launch(tracer.stages.read(), rounds + 1) if tracer.stages is not None else None,
        })  # fmt: skip
    return rows


def _per_launch(decided: dict[str, int], launches: int) -> dict[str, int]:
    return {stage: lanes // launches for stage, lanes in decided.items()}


def _silent(phase: str, fraction: float) -> None:
    """No progress."""
