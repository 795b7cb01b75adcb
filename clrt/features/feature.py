"""What an effect is to a program: what calls for it, its kernel file, what it adds to structs, arguments and rays."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from clrt.scene.model import Material, Scene

REAL = "real"  #: stands for the rung's number type in `Feature.material` and `Feature.frame`

Caller = Callable[[Scene], "int | None"]


@dataclass(frozen=True)
class Feature:
    """One effect.

    name : as the figures of a run tell it
    called_by : scene -> number of the first line that calls for it (0: no text), None where none does
    kernel : its file in kernels/
    early : its file stands before the scene's traversal, which calls it
    material : members it adds to the Material struct; each is an attribute of `scene.model.Material`
    light : members it adds to the Light struct: name, type, shape if it is no scalar
    frame : members it adds to the Frame struct, with their values
    parameters : kernel arguments it adds: name of the packer in device/pack.py -> C declaration
    rays : kinds of rays it spawns, as the counters name them
    branches : packets of rays that it may send on from one hit
    sampled : it draws random numbers: what is seen is a mean of samples
    helper : a part that effects share; no effect of its own
    """

    name: str
    called_by: Caller
    kernel: str
    early: bool = False
    material: tuple[tuple[str, Any], ...] = ()
    light: tuple[tuple[Any, ...], ...] = ()
    frame: tuple[tuple[str, Any, Callable[[Scene], Any]], ...] = ()
    parameters: tuple[tuple[str, str], ...] = ()
    rays: tuple[str, ...] = ()
    branches: int = 0
    sampled: bool = False
    helper: bool = False


def used_materials(scene: Scene) -> Iterator[Material]:
    """The materials of a scene that some primitive has."""
    used: set[int] = set(np.unique(scene.spheres.material_ids).tolist())
    for item in scene.objects:
        used |= set(np.unique(item.material_ids).tolist())
    return (scene.materials[i] for i in sorted(used))


def first_line(*callers: Caller) -> Caller:
    """Calls for an effect where any of `callers` does; the first line of all."""

    def called_by(scene: Scene) -> int | None:
        return min((line for caller in callers if (line := caller(scene)) is not None), default=None)

    return called_by


def material_caller(attribute: str) -> Caller:
    """The first used material with a positive `attribute`, where rays may go on at all."""

    def called_by(scene: Scene) -> int | None:
        lines = [m.line for m in used_materials(scene) if getattr(m, attribute) > 0.0]
        return min(lines) if lines and scene.depth > 0 else None

    return called_by
