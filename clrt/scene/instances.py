"""The words `object` and `instance` together: which object a name stands for, and where it stands once more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from clrt.scene.faults import Faults, did_you_mean, shown
from clrt.scene.model import FloatArray, Instance, MeshObject
from clrt.scene.text import Declarations
from clrt.scene.words import WordCall
from clrt.scene.words.instances import MOST_SCALE

_SAME_SCALE = 1e-9  #: relative difference of the scales along two axes that counts as none


def object_at(found: Declarations, line: int) -> int | None:
    """Index of the object that a line stands in: that of the T lines which the next O line closes. None where there are none.

    For scenes that are not split (see `build_objects`), whose objects come in the order of the text.
    """
    closing = found.get("O", 0).lines
    groups = np.unique(np.searchsorted(closing, found.lines_of("T")))
    at = int(np.searchsorted(groups, group := np.searchsorted(closing, line)))
    return at if at < len(groups) and groups[at] == group else None


def splits(found: Declarations, split: bool, warnings: list[str]) -> bool:
    """Whether the triangles are to be split: asked for, and no object has a name, which would stand for several then."""
    naming = [c.line for c in found.words if c.name == "object"]
    if split and naming and not len(found.get("O", 0).lines):
        warnings.append(f"line {naming[0]}: an object with a name stays whole; this scene is not split")
        return False
    return split


def name_objects(objects: tuple[MeshObject, ...], found: Declarations, faults: Faults) -> tuple[MeshObject, ...]:
    """The objects with the names that `object` lines give them; faults are noted."""
    named = list(objects)
    lines: dict[int, int] = {}
    for call in (c for c in found.words if c.name == "object"):
        at = object_at(found, call.line)
        if at is None:
            what = "object names triangles, and there are none; put it among the T lines that the next O closes"
            faults.add(call.line, call.column, what)
        elif at in lines:
            faults.add(call.line, call.column, f"a second name of one object; the first is line {lines[at]}, or is an O missing between?")
        else:
            lines[at] = call.line
            named[at] = replace(named[at], name=call.text("name"), hidden=call.text("hidden") == "yes")
    return tuple(named)


@dataclass(frozen=True, eq=False)
class _Places:
    """What instances may be of: names of objects with their numbers, and `instance` lines with a name.

    refused : names of objects whose own line is at fault
    """

    objects: dict[str, int]
    calls: dict[str, WordCall]
    refused: frozenset[str]


def build_instances(
    objects: Sequence[MeshObject], found: Declarations, faults: Faults, meshes: Mapping[int, int] | None = None
) -> tuple[tuple[MeshObject, ...], tuple[Instance, ...]]:
    """Named objects and the instances of the text's `instance` lines; instances of instances have their transforms put together.

    meshes : number of a line with the word `mesh` -> index of the object that it names

    Faults: names that are unknown or stand for two things, instances of themselves, scales that are too great or do not
    fit smooth triangles, nothing to be seen.
    """
    named = name_objects(tuple(objects), found, faults)
    calls = [c for c in found.words if c.name == "instance"]
    places = _places(meshes or {}, found, calls, faults)
    made = [instance for call in calls if (instance := _instance(call, named, places, faults)) is not None]
    shown_ones = tuple(i for i, call in made if call.text("hidden") == "no")
    hidden = [c for c in found.words if c.name in ("object", "instance", "mesh") and c.text("hidden") == "yes"]
    anything = shown_ones or not all(o.hidden for o in named) or len(found.lines_of("S"))
    if hidden and not anything and not any(faults.on_line(c.line) for c in (*calls, *hidden)):
        faults.add(hidden[0].line, hidden[0].column, "everything is hidden; place an instance of it, or leave out hidden=yes")
    return named, shown_ones


def _places(meshes: Mapping[int, int], found: Declarations, calls: list[WordCall], faults: Faults) -> _Places:
    lines: dict[str, int] = {}
    objects: dict[str, int] = {}
    refused: set[str] = set()
    for call in (c for c in found.words if c.name == "object" or (c.name in ("instance", "mesh") and c.text("name"))):
        name = call.text("name")
        if name in lines:
            what = f"a second {shown(name)}; the first is line {lines[name]}, give one another name"
            faults.add(call.line, call.columns.get("name", call.column), what)
            continue
        lines[name] = call.line
        at = object_at(found, call.line) if call.name == "object" else meshes.get(call.line)
        if at is not None:
            objects[name] = at
        elif call.name != "instance":
            refused.add(name)
    chained = {c.text("name"): c for c in calls if c.text("name") and lines[c.text("name")] == c.line}
    return _Places(objects, chained, frozenset(refused))


def _instance(
    call: WordCall, named: Sequence[MeshObject], places: _Places, faults: Faults
) -> tuple[Instance, WordCall] | None:
    """The instance of one line, with its line; None with a fault noted, where what it is of is not there."""
    matrix, seen, at = _transform(call), {call.line}, call
    while (of := at.text("of")) not in places.objects:
        inner = places.calls.get(of)
        if inner is None:
            if at is call and of not in places.refused:
                faults.add(call.line, call.columns["of"], f"no object is called {shown(of)}{_names_there_are(of, places)}")
            return None
        if inner.line in seen:
            if inner is call:
                way = "" if at is call else f", by way of line {at.line}"
                faults.add(call.line, call.columns["of"], f"an instance of itself{way}; name an object")
            return None
        seen.add(inner.line)
        matrix, at = _then(_transform(inner), matrix), inner
    item = named[places.objects[of]]
    if _check_scale(call, matrix, item, faults):
        return Instance(places.objects[of], matrix, call.line, call.text("name") or f"instance of line {call.line}"), call
    return None


def _names_there_are(name: str, places: _Places) -> str:
    known = [*places.objects, *places.calls]
    if not known:
        return '; name an object by a line such as "object rabbit"'
    return f"{did_you_mean(name, known)} (the names: {', '.join(known[:10])}{', ...' if len(known) > 10 else ''})"


def _check_scale(call: WordCall, matrix: FloatArray, item: MeshObject, faults: Faults) -> bool:
    scales = np.linalg.svd(matrix[:, :3], compute_uv=False)
    if scales.max() > MOST_SCALE or scales.min() < 1.0 / MOST_SCALE:
        odd = scales.max() if scales.max() > MOST_SCALE else scales.min()
        what = f"the instance is {odd:g} times as large as its object; between {1.0 / MOST_SCALE:g} and {MOST_SCALE:g} is possible"
        faults.add(call.line, call.column, what)
        return False
    if item.vertex_normals is not None and scales.max() > scales.min() * (1.0 + _SAME_SCALE):
        what = f"{shown(item.name)} has normals at its corners, which need one scale for all axes; leave scale_x, scale_y, scale_z out"
        faults.add(call.line, call.column, what)
        return False
    return True


def _transform(call: WordCall) -> FloatArray:
    """(3, 4): scaled along the axes, then turned about x, y and z, then shifted. A turn takes y to z, z to x, x to y."""
    linear = np.diag([call.number("scale") * call.number(f"scale_{axis}") for axis in "xyz"])
    for axis in range(3):
        linear = turn(axis, call.number(f"turn_{'xyz'[axis]}")) @ linear
    return np.column_stack([linear, [call.number(f"{axis} of the instance") for axis in "xyz"]])


def turn(axis: int, degrees: float) -> FloatArray:
    """(3, 3), the turn about an axis that takes the next axis to the one after it, at 90 degrees; exact at multiples of 90."""
    quarter, rest = divmod(degrees % 360.0, 90.0)
    c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarter) % 4]
    if rest:
        c, s = np.cos(np.radians(degrees % 360.0)), np.sin(np.radians(degrees % 360.0))
    matrix = np.eye(3)
    b, d = (axis + 1) % 3, (axis + 2) % 3
    matrix[b, b], matrix[b, d], matrix[d, b], matrix[d, d] = c, -s, s, c
    return matrix


def _then(first: FloatArray, second: FloatArray) -> FloatArray:
    """`first`, then `second`: (3, 4) each."""
    return np.column_stack([second[:, :3] @ first[:, :3], second[:, :3] @ first[:, 3] + second[:, 3]])
