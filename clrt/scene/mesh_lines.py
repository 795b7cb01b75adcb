"""The word `mesh`: objects from files, put into a scene text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from clrt.scene.faults import Faults, shown
from clrt.scene.instances import turn
from clrt.scene.meshes import Meshes
from clrt.scene.model import FloatArray, Material, MeshObject
from clrt.scene.models.gltf import moved
from clrt.scene.models.load import read_model
from clrt.scene.models.model_file import Model, ModelError, joined, shifted
from clrt.scene.models.place import SCENE_FROM_FILE, Placing, flat_warnings, placed
from clrt.scene.picture import Folders, PictureError
from clrt.scene.text import Declarations
from clrt.scene.textures import PLANES
from clrt.scene.words.word import WordCall

_NEEDED = 'add a line above it, such as "M 1 1 1 0.1 0.9 0.3 20 0"'


@dataclass(frozen=True, eq=False)
class MeshLine:
    """One line and what its file holds. above : index of the material above the line, -1 for none."""

    call: WordCall
    model: Model
    above: int


def read_mesh_lines(found: Declarations, folders: Folders, faults: Faults) -> list[MeshLine]:
    """Read the files that mesh lines name, each once; what is wrong is noted."""
    models: dict[tuple[Path, bool], Model] = {}
    lines = [_read(call, found, folders, models, faults) for call in found.words if call.name == "mesh"]
    return [line for line in lines if line is not None]


def _read(
    call: WordCall, found: Declarations, folders: Folders, models: dict[tuple[Path, bool], Model], faults: Faults
) -> MeshLine | None:
    name, own = call.text("file"), call.text("materials") == "file"
    above = int(np.searchsorted(found.lines_of("M"), call.line)) - 1
    try:
        path = folders.find(name)
        if (path, own) not in models:
            models[path, own] = read_model(path, [folders.own, *folders.allowed], materials=own)
    except PictureError as problem:
        faults.add(call.line, call.columns["file"], str(problem))
        return None
    except ModelError as problem:
        faults.add(call.line, call.columns["file"], problem.at(name))
        return None
    model = models[path, own]
    if not own:
        model = replace(model, parts=tuple(replace(p, material_ids=np.full_like(p.material_ids, -1)) for p in model.parts), materials=())
    if above < 0 and any((part.material_ids < 0).any() for part in model.parts):
        what = "without materials of its own" if own else "with materials=above"
        faults.add(call.line, call.column, f"a mesh {what} before any material; {_NEEDED}")
    if call.text("hidden") == "yes" and not call.text("name"):
        faults.add(call.line, call.column, "hidden=yes without a name; add one for instances, such as name=rabbit")
    return MeshLine(call, model, above)


def place_mesh_lines(
    lines: Sequence[MeshLine], first_prim: int, first_object: int, materials: Sequence[Material], textures: int, found: Declarations,
    right_handed: bool, faults: Faults,
) -> Meshes:  # fmt: skip
    """The objects of mesh lines in the scene's axes; what is wrong is noted.

    first_prim, first_object, textures : how many triangles, objects and textures the text has itself; materials : its own
    """
    made = Meshes()
    for line in lines:
        call, before = line.call, len(materials) + len(made.materials)
        at = Placing(_scene_from_file(call, right_handed), call.text("smooth"), line.above, before, call.line)
        try:
            objects, instances = placed(_named(line), at, first_prim, first_object + len(made.objects))
        except ModelError as problem:
            faults.add(line.call.line, line.call.columns["file"], problem.at(line.call.text("file")))
            continue
        first_prim += sum(map(len, objects))
        made.materials += [shifted(material, textures + len(made.textures), call.line) for material in line.model.materials]
        made.textures += [replace(texture, line=call.line) for texture in line.model.textures] if line.model.materials else []
        made.warnings += _told(line, objects, found)
        if call.text("name"):
            made.named[call.line] = first_object + len(made.objects)
            objects = tuple(replace(item, hidden=call.text("hidden") == "yes") for item in objects)
        made.objects += [_projected(item, line, materials, found, faults) for item in objects]
        made.instances += instances
    return made


def _named(line: MeshLine) -> Model:
    """The model; where the line gives a name, all of it as one object, which instances can be of."""
    name, parts = line.call.text("name"), line.model.parts
    if not name:
        return line.model
    single = [moved(part, copy, part.name) for part in parts for copy in part.copies or (np.eye(4),)]
    return replace(line.model, parts=(replace(joined(single, name), name=name),))


def _scene_from_file(call: WordCall, right_handed: bool) -> FloatArray:
    """(4, 4): mirrored into the scene's hand, then scaled, turned about x, y and z, and shifted. A right-handed text is mirrored later."""
    linear = (np.eye(3) if right_handed else SCENE_FROM_FILE[:3, :3]) * call.number("scale")
    for axis in range(3):
        linear = turn(axis, call.number(f"turn_{'xyz'[axis]}")) @ linear
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, [call.number(axis) for axis in "xyz"]
    return matrix


def _told(line: MeshLine, objects: Sequence[MeshObject], found: Declarations) -> list[str]:
    """Warnings of one line, with its file's name in front."""
    model, told = line.model, [*line.model.warnings, *flat_warnings(objects)]
    lights = len(model.lights) + len(model.spots) + len(model.suns)
    counts = [(len(model.views), "camera"), (lights, "light")]
    left = [f"{count} {what}{'s' if count > 1 else ''}" for count, what in counts if count]
    if left:
        told.append(f"left out: {' and '.join(left)}; rendered by itself, the file shows them")
    return [f"{found.place(line.call.line)}: {line.call.text('file')}: {warning}" for warning in told]


def _projected(item: MeshObject, line: MeshLine, materials: Sequence[Material], found: Declarations, faults: Faults) -> MeshObject:
    """The object with texture coordinates: its file's, or those of the `project` line of a material above that has a picture."""
    above = materials[line.above] if line.above >= 0 else None
    uses = above is not None and (above.texture >= 0 or above.normal_map >= 0) and bool((item.material_ids == line.above).any())
    if not uses or item.uvs is not None:
        return item
    lines = found.lines_of("M")
    calls: Mapping[int, WordCall] = {int(np.searchsorted(lines, c.line)) - 1: c for c in found.words if c.name == "project"}
    call = calls.get(line.above)
    if call is None:
        name = shown(line.call.text("file"))
        what = f'{name} has no coordinates for the picture of the material above; add a line such as "project axis=y" below that'
        faults.add(line.call.line, line.call.columns["file"], what)
        return item
    return replace(item, uvs=item.vertices[:, :, PLANES[call.text("axis")]] / call.number("scale"))
