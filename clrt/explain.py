"""What each effect of a scene is there for: the line that calls for it, what it adds to program and buffers, what it costs and changes.

An effect is judged by leaving it out (`Features.of(scene, without)`), with all that needs it and all helpers that nothing needs any more.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt import __version__
from clrt.device.context import Device
from clrt.device.session import Tracer
from clrt.features import Features
from clrt.features.choice import EFFECTS
from clrt.precision import Precision
from clrt.renderer import Prepared, fill_buffers, open_tracer, run_rows
from clrt.scene.model import Scene
from clrt.timing import FEWEST, interleave, median_interval

BUDGET_S = 10.0  #: of seconds that the rounds of one effect are to take, where that leaves FEWEST of them
_LONGEST_LINE = 1 << 12  #: characters of a line that are read

Tell = Callable[[str, float], None]


@dataclass(frozen=True)
class Difference:
    """Two pictures: greatest, mean and root mean square of their channels' differences, and the part of pixels that differ at all."""

    greatest: float
    mean: float
    pixels: float
    rms: float

    @classmethod
    def of(cls, a: NDArray[np.float32], b: NDArray[np.float32]) -> Difference:
        """a, b : (h, w, 3). A channel that is no number in both is no difference; in one alone, an infinite one."""
        differs = (a != b) & ~(np.isnan(a) & np.isnan(b))
        with np.errstate(invalid="ignore"):
            apart = np.where(differs, np.abs(a.astype(np.float64) - b), 0.0)
        apart = np.where(np.isnan(apart), np.inf, apart)
        return cls(float(apart.max()), float(apart.mean()), float(differs.any(-1).mean()), float(np.sqrt(np.mean(apart**2))))


@dataclass(frozen=True)
class Cost:
    """Seconds of the whole picture with and without an effect, round by round, and how the picture differs."""

    with_s: tuple[float, ...]
    without_s: tuple[float, ...]
    difference: Difference

    @property
    def cost_s(self) -> float:
        """The median over rounds of what the effect takes."""
        return statistics.median(self._rounds)

    @property
    def interval_s(self) -> tuple[float, float]:
        """Holds that median with a probability of at least 95%."""
        return median_interval(self._rounds)

    @property
    def _rounds(self) -> list[float]:
        return [a - b for a, b in zip(self.with_s, self.without_s, strict=True)]

    def to_json(self) -> dict[str, Any]:
        return {
            "rounds": len(self.with_s), "with_s": list(self.with_s), "without_s": list(self.without_s), "cost_s": self.cost_s,
            "cost_interval_s": list(self.interval_s), "difference": asdict(self.difference),
        }  # fmt: skip


@dataclass(frozen=True)
class Explained:
    """One effect that the scene calls for.

    line, text : the first line that calls for it, and what it says; 0 and empty where it came from no text
    brings : what else is left out with it: effects that need it, helpers that it alone needs
    source_bytes, buffer_bytes : what all of that adds to the composed program and to the device's buffers
    cost : None unless measured
    """

    name: str
    line: int
    text: str
    brings: tuple[str, ...]
    source_bytes: int
    buffer_bytes: int
    cost: Cost | None = None

    def to_json(self) -> dict[str, Any]:
        shown = {name: getattr(self, name) for name in ("name", "line", "text", "source_bytes", "buffer_bytes")}
        return {**shown, "on": True, "brings": list(self.brings), "measured": self.cost.to_json() if self.cost is not None else None}


@dataclass(frozen=True)
class Explanation:
    """All effects of a scene; `off`: names of those that nothing in it calls for. Sizes in bytes are of the whole."""

    scene: Scene
    device: str
    precision: str
    source_bytes: int
    buffer_bytes: int
    effects: tuple[Explained, ...]

    @property
    def off(self) -> tuple[str, ...]:
        on = {effect.name for effect in self.effects}
        return tuple(name for name in EFFECTS if name not in on)

    def to_json(self) -> dict[str, Any]:
        camera = self.scene.camera
        return {
            "clrt": __version__, "scene": self.scene.source, "width": camera.width, "height": camera.height, "device": self.device,
            "precision": self.precision, "samples": self.scene.samples, "seed": self.scene.seed, "source_bytes": self.source_bytes,
            "buffer_bytes": self.buffer_bytes,
            "effects": [*(e.to_json() for e in self.effects), *({"name": name, "on": False} for name in self.off)],
        }  # fmt: skip


def explain(prepared: Prepared, precision: Precision, device: Device, tell: Tell) -> Explanation:
    """The effects of a scene, without what they cost. Raises DeviceError, LimitError, OSError where the scene's text is gone."""
    scene, features = prepared.scene, Features.of(prepared.scene)
    source_bytes, buffer_bytes = _sizes(prepared, features, precision, device)
    lines = dict(features.lines)
    texts = _texts(scene.source, {lines[name] for name in features.effects} - {0})
    effects = []
    for number, name in enumerate(features.effects):
        tell("explain", number / len(features.effects))
        left = Features.of(scene, (name,))
        source, buffers = _sizes(prepared, left, precision, device)
        brings = tuple(f.name for f in features.active if f not in left.active and f.name != name)
        text = texts.get(lines[name], "")
        effects.append(Explained(name, lines[name], text, brings, source_bytes - source, buffer_bytes - buffers))
    return Explanation(scene, device.info.name, precision.name, source_bytes, buffer_bytes, tuple(effects))


def _sizes(prepared: Prepared, features: Features, precision: Precision, device: Device) -> tuple[int, int]:
    """Bytes of the composed program and of the buffers."""
    buffers, source, _ = fill_buffers(prepared, features, precision, device)
    return len(source.encode()), buffers.size


def _texts(source: str, numbers: set[int]) -> dict[int, str]:
    """The lines of these numbers, blanks at their ends and long tails left out; none where the scene is no file."""
    if not numbers or not Path(source).is_file():
        return {}
    with Path(source).open(encoding="utf-8-sig", errors="replace") as file:
        return {number: line[:_LONGEST_LINE].strip() for number, line in enumerate(islice(file, max(numbers)), 1) if number in numbers}


def measure(found: Explanation, prepared: Prepared, precision: Precision, device: Device, rounds: int, tell: Tell) -> Explanation:
    """`found` with the cost of each effect: whole pictures with and without it, in turns, `rounds` times or as BUDGET_S allows.

    Raises DeviceError, LimitError, ValueError for fewer rounds than FEWEST.
    """
    if rounds < FEWEST:
        raise ValueError(f"{rounds} rounds do not bound a median; take {FEWEST} or more")
    silent = _silent
    whole = open_tracer(prepared, Features.of(prepared.scene), precision, device, silent)[1]
    effects = []
    for number, effect in enumerate(found.effects):
        tell("measure", number / len(found.effects))
        left = open_tracer(prepared, Features.of(prepared.scene, (effect.name,)), precision, device, silent)[1]
        effects.append(replace(effect, cost=_cost(whole, left, rounds)))
    tell("measure", 1.0)
    return replace(found, effects=tuple(effects))


def _cost(whole: Tracer, left: Tracer, rounds: int) -> Cost:
    turns = {name: partial(run_rows, tracer, "measure", _silent) for name, tracer in (("with", whole), ("without", left))}
    trial = interleave(turns, 1)
    affordable = int(BUDGET_S / max(1e-9, sum(series.best for series in trial.values())))
    series = interleave(turns, max(FEWEST, min(rounds, affordable)), warm_ups=0)
    return Cost(series["with"].seconds, series["without"].seconds, Difference.of(whole.picture(), left.picture()))


def _silent(phase: str, fraction: float) -> None:
    """No progress."""
