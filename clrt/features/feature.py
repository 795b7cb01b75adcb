"""What an effect is to a program: what calls for it, its kernel file, what it adds to structs, arguments and rays."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

from clrt.scene.model import Material, Scene, numbers_in

REAL = "real"  #: stands for the rung's number type in `Feature.material` and `Feature.frame`

Caller = Callable[[Scene], "int | None"]


@dataclass(frozen=True)
class Feature:
    """One effect.

    name : as the figures of a run tell it
    called_by : scene -> number of the first line that calls for it (0: no text), None where none does
    kernel : its file in kernels/
    early : its file stands before the scene's traversal, which calls it
    material : members it adds to the Material struct: name, type, shape if it is no scalar; each is an attribute of `scene.model.Material`
    light : members it adds to the Light struct: name, type, shape if it is no scalar
    frame : members it adds to the Frame struct: name, type, shape if it is no scalar, and the function of the scene that gives the value
    parameters : kernel arguments it adds: name of the packer in device/effect_arrays.py -> C declaration
    rays : kinds of rays it spawns, as the counters name them
    branches : packets of rays that it may send on from one hit
    sampled : it draws random numbers: what is seen is a mean of samples
    needs : what must be in the program for this one to be: without one of these there is nothing that it could change
    replaces : the file that its own stands in for, at the same place in the program
    helper : a part that effects share; no effect of its own
    switch : it acts though no data ask for it, so its code asks HAVE_<NAME> in a program of all effects; 1 in any other
    """

    name: str
    called_by: Caller
    kernel: str
    early: bool = False
    material: tuple[tuple[Any, ...], ...] = ()
    light: tuple[tuple[Any, ...], ...] = ()
    frame: tuple[tuple[Any, ...], ...] = ()
    parameters: tuple[tuple[str, str], ...] = ()
    rays: tuple[str, ...] = ()
    branches: int = 0
    sampled: bool = False
    needs: tuple[Feature, ...] = ()
    replaces: str = ""
    helper: bool = False
    switch: bool = False

    @property
    def switch_name(self) -> str:
        """The member of the frame that a program of all effects reads; in capitals, the macro that the code asks."""
        return "have_" + self.name.replace(" ", "_")

    def line(self, calls: Calls) -> int | None:
        """The line that calls for it where `calls` tells that of each effect; None where nothing does, or what it needs is not there."""
        if any(needed.line(calls) is None for needed in self.needs):
            return None
        return self.called_by.line(calls) if isinstance(self.called_by, Joint) else calls(self)


Calls = Callable[[Feature], "int | None"]  #: an effect -> the line that calls for it, None where it is not to be


@dataclass(frozen=True)
class Joint:
    """Calls for a part that others share: where any of `parts` is in the program, or, with `every`, where all are."""

    parts: tuple[Feature | Joint, ...]
    every: bool = False

    def __call__(self, scene: Scene) -> int | None:
        return self.line(lambda feature: feature.called_by(scene))

    def line(self, calls: Calls) -> int | None:
        """The first of the parts' lines; with `every` the last, at which all are called for."""
        lines = [part.line(calls) for part in self.parts]
        there = [line for line in lines if line is not None]
        if self.every:
            return max(there, default=None) if len(there) == len(lines) else None
        return min(there, default=None)


_USED: WeakKeyDictionary[Scene, tuple[Material, ...]] = WeakKeyDictionary()  #: nearly every effect asks, of all triangles


def used_materials(scene: Scene) -> Iterator[Material]:
    """The materials of a scene that some primitive has."""
    if scene not in _USED:
        used: set[int] = set(numbers_in(scene.spheres.material_ids))
        for item in scene.objects:
            used |= set(item.used_materials)
        _USED[scene] = tuple(scene.materials[i] for i in sorted(used))
    return iter(_USED[scene])


def material_caller(attribute: str) -> Caller:
    """The first used material with a positive `attribute`, where rays may go on at all."""

    def called_by(scene: Scene) -> int | None:
        lines = [m.line for m in used_materials(scene) if getattr(m, attribute) > 0.0]
        return min(lines) if lines and scene.depth > 0 else None

    return called_by
