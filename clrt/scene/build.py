"""Declarations -> checked Scene: what the lines of a scene text mean together."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clrt.errors import SceneError
from clrt.scene.camera import build_camera
from clrt.scene.environment import read_environment
from clrt.scene.faults import Faults
from clrt.scene.grammar import LETTERS
from clrt.scene.include import expand
from clrt.scene.instances import build_instances, splits
from clrt.scene.meshes import Meshes
from clrt.scene.model import Environment, Instance, Material, MeshObject, PointLight, Scene, Spheres
from clrt.scene.models import is_model
from clrt.scene.motion import with_motion
from clrt.scene.objects import build_objects, material_of
from clrt.scene.picture import Folders
from clrt.scene.text import Declarations, read_declarations, read_file
from clrt.scene.textures import read_textures, untilted
from clrt.scene.triangles import flip_x
from clrt.scene.words import WORDS, Draft, Word

if TYPE_CHECKING:
    from clrt.scene.mesh_lines import MeshLine
    from clrt.scene.saved import SavedTexts

_ANYTHING = re.compile(r"[^\s\ufeff]")


def load_scene(
    path: str | PathLike[str], *, right_handed: bool = False, split_objects: bool = False,
    allow_paths: Sequence[str | PathLike[str]] = (), camera: int | None = None, saved: SavedTexts | None = None,
) -> Scene:  # fmt: skip
    """Read and check the scene text of a file, or the scene of a glTF or GLB file.

    right_handed : mirror x, for files made in right-handed axes
    split_objects : make each connected component of triangles an object, where no O line closes one
    allow_paths : folders, besides the scene's own, that the files it names may be in
    camera : which of the cameras of a glTF file, from 1; the first without it
    saved : numbers of texts that earlier runs read

    Raises SceneError with one `file:line:column: error: ...` line a fault, also where the file cannot be read.
    """
    if is_model(Path(path)):
        for given, option in ((right_handed, "--right-handed"), (split_objects, "--split-objects")):
            if given:
                raise SceneError(f"{path}: error: {option} is for scene texts; axes and objects of a glTF file are known, leave it out")
        from clrt.scene.models.direct import load_model_scene

        return load_model_scene(Path(path), camera=camera, allow_paths=[Path(p) for p in allow_paths])
    if camera is not None:
        raise SceneError(f"{path}: error: --camera chooses among the cameras of a glTF file; a scene text has one, leave it out")
    folders = Folders(Path(path).parent, [Path(p) for p in allow_paths])
    text = read_file(Path(path))
    return parse_scene(text, str(path), right_handed=right_handed, split_objects=split_objects, folders=folders, saved=saved)


def parse_scene(
    text: str, source: str = "<text>", *, right_handed: bool = False, split_objects: bool = False, folders: Folders | None = None,
    saved: SavedTexts | None = None,
) -> Scene:  # fmt: skip
    """Check a scene text that is in memory; `source` stands for the file's name in messages. Otherwise as `load_scene`.

    folders : where files that the scene names may be; without it, the current folder
    """
    faults = Faults(source)
    if not _ANYTHING.search(text):
        faults.add(1, 1, "the text is empty; a scene has at least the lines E, V, F, R, M and a T or an S")
        faults.raise_if_any()
    folders = folders or Folders(Path())
    text, origins = expand(text, source, folders, faults)
    found = read_declarations(text, source, faults, saved=saved)
    if origins:
        found.words = [origins.relocated(call, folders) for call in found.words]
    if _lacks_lines(found, faults):
        faults.raise_if_any()
    _check_primitives(found, faults)
    _check_materials(found, faults)
    _check_words(found, faults)
    textured = read_textures(found, folders, faults)
    environment = read_environment(found, folders, faults)
    mesh_lines = _mesh_lines(found, folders, faults)
    camera = build_camera(found, right_handed, faults)
    faults.raise_if_any()
    assert camera is not None  # a camera that cannot be built is a fault

    warnings: list[str] = []
    objects = build_objects(found, splits(found, split_objects, warnings), warnings, textured.uvs)
    draft = Draft(textured.materials(_materials(found)), _lights(found))
    for call in found.words:
        WORDS[call.name].apply(draft, call)
    triangles, own = sum(map(len, objects)), len(textured.textures)
    meshes = Meshes()
    if mesh_lines:
        from clrt.scene.mesh_lines import place_mesh_lines

        meshes = place_mesh_lines(mesh_lines, triangles, len(objects), draft.materials, own, found, right_handed, faults)
    draft.materials += meshes.materials
    warnings += meshes.warnings
    objects, instances = build_instances((*objects, *meshes.objects), found, faults, meshes.named)
    instances = (*meshes.instances, *instances)
    _check_absorption(objects, draft.materials, found, faults)
    faults.raise_if_any()
    warnings += [*_light_warnings(draft, environment), *untilted(objects, draft.materials)]
    scene = Scene(
        camera, tuple(draft.lights), tuple(draft.materials), objects, _spheres(found), draft.background, draft.depth,
        source, tuple(warnings), textures=(*textured.textures, *meshes.textures), spots=tuple(draft.spots), suns=tuple(draft.suns),
    )  # fmt: skip
    scene = replace(scene, samples=draft.samples, samples_line=draft.samples_line, environment=environment, **draft.fields)
    scene = replace(scene, instances=instances)
    scene = with_motion(scene, found, faults)
    faults.raise_if_any()
    if origins:
        scene = origins.relined(replace(scene, warnings=tuple(map(origins.told, scene.warnings))))
    return _mirrored(scene) if right_handed else scene


def _mesh_lines(found: Declarations, folders: Folders, faults: Faults) -> list[MeshLine]:
    """The files that mesh lines name, read; their readers are imported where there is one."""
    if not any(call.name == "mesh" for call in found.words):
        return []
    from clrt.scene.mesh_lines import read_mesh_lines

    return read_mesh_lines(found, folders, faults)


def _light_warnings(draft: Draft, environment: Environment | None) -> list[str]:
    """Of a scene that nothing lights, and of light that fog keeps out."""
    warnings = []
    lamps = draft.lights or draft.spots or draft.suns or any(max(m.emission) > 0.0 for m in draft.materials)
    around = any(draft.background) and "indirect" in draft.fields
    if not (lamps or environment or around):
        warnings.append("there is no light (L); only the ambient part of the materials is seen")
    fog = draft.fields.get("fog")
    if fog is not None and fog.density > 0.0 and (draft.suns or environment or any(draft.background)):
        warnings.append("nothing comes through endless fog: suns, environment and background bring no light")
    return warnings


def _lacks_lines(found: Declarations, faults: Faults) -> bool:
    """Whether another text could not be included: whatever else is missing may stand there."""
    return "include" in found.broken or any(call.name == "include" and faults.on_line(call.line) for call in found.words)


def _check_primitives(found: Declarations, faults: Faults) -> None:
    """There is something to render, and a material above the first of it."""
    first = {letter: int(lines[0]) for letter in "TSM" if len(lines := found.lines_of(letter))}
    if "T" not in first and "S" not in first:
        if "mesh" in found.broken or any(call.name == "mesh" for call in found.words):
            return
        faults.add(1, 1, 'there is nothing to render; add a triangle, such as "T 0 0 1 1 0 1 0 1 1", or a sphere, such as "S 0 0 2 1"')
        return
    line, letter = min((first[letter], letter) for letter in "TS" if letter in first)
    if line < first.get("M", line + 1):
        what = "a triangle" if letter == "T" else "a sphere"
        column = found.token(line, 0).column
        faults.add(line, column, f'{what} before any material; add a line above it, such as "M 1 1 1 0.1 0.9 0.3 20 0"')


def _check_materials(found: Declarations, faults: Faults) -> None:
    """An index of refraction of 0 is only what files write where nothing is refracted."""
    rows = found.get("M", 10)
    for line in rows.lines[(rows.values[:, 8] > 0.0) & (rows.values[:, 9] == 0.0)].tolist():
        faults.add(line, found.token(line, 10).column, "Nr must be greater than 0 where Refract is; glass has 1.5, found 0")


def _check_words(found: Declarations, faults: Faults) -> None:
    first: dict[str, int] = {}
    _check_material_words(found, faults)
    for call in found.words:
        word = WORDS[call.name]
        if word.check:
            word.check(call, faults)
        if word.of:
            continue
        if call.name in first and word.once:
            faults.add(call.line, call.column, f"a second {call.name} line; the first is line {first[call.name]}, remove one of the two")
        first.setdefault(call.name, call.line)


def _check_material_words(found: Declarations, faults: Faults) -> None:
    """Words of a material stand below one, each once a material; those of glass below one with Refract > 0."""
    materials, glass = found.lines_of("M").tolist(), found.get("M", 10)
    refract = dict(zip(glass.lines.tolist(), glass.values[:, 8].tolist(), strict=True)) | dict.fromkeys(found.broken.get("M", []), 1.0)
    shiny = {line for line, values in _in_order(found, "M") if max(values[7:9]) > 0.0} | {*found.broken.get("M", [])}
    first: dict[tuple[str, int], int] = {}
    for call in (c for c in found.words if WORDS[c.name].of):
        word = WORDS[call.name]
        above = bisect_left(materials, call.line)
        material = materials[above - 1] if above else 0
        if not above:
            what, such = ("a line of glass", "M 1 1 1 0 0 0.5 60 0 1 1.5") if word.of == "glass" else ("one", "M 1 1 1 0.1 0.7 0.3 20 0")
            fault = f'{call.name} before any material; add {what} above it, such as "{such}"'
        elif word.of == "glass" and not refract.get(material, 0.0) > 0.0:
            fault = f"{call.name} needs a material that light passes through; give the M of line {material} 10 numbers, Refract above 0"
        elif word.of == "shiny" and material not in shiny:
            fault = f"{call.name} needs a mirror or glass to make rough; give the M of line {material} a Reflect or a Refract above 0"
        elif word.once and (call.name, material) in first:
            fault = f"a second {call.name} of one material; the first is line {first[call.name, material]}, remove one of the two"
        elif rival := _rival(word, call.name, material, first):
            line = first[rival, material]
            fault = f"{call.name} and {rival} (line {line}) do not go together: a metal-rough material is no mirror or glass; remove one"
        else:
            first[call.name, material] = call.line
            continue
        faults.add(call.line, call.column, fault)


def _rival(word: Word, name: str, material: int, first: dict[tuple[str, int], int]) -> str:
    """The word above, of the same material, that does not go with this one: words of mirrors or glass, and `material`."""
    polished = [n for n, other in WORDS.items() if other.of in ("glass", "shiny")]
    rivals = polished if name == "material" else ["material"] if word.of in ("glass", "shiny") else []
    return next((n for n in rivals if (n, material) in first), "")


def _check_absorption(objects: tuple[MeshObject, ...], materials: list[Material], found: Declarations, faults: Faults) -> None:
    """A medium fills its object whole: all glass of an object absorbs alike."""
    for item in objects:
        glass = [materials[i] for i in item.used_materials if materials[i].refract > 0.0]
        if len({m.absorb for m in glass}) < 2:
            continue
        line = min(m.absorb_line for m in glass if m.absorb_line)
        what = f"the glass of {item.name} absorbs differently from face to face; close its parts with O lines, or give all of it one absorb"
        faults.add(line, found.token(line, 0).column, what)


def _in_order(found: Declarations, letter: str) -> list[tuple[int, list[float]]]:
    """Line number and numbers of each line of a letter with several forms."""
    forms = [found.get(letter, fields) for fields in LETTERS[letter]]
    return sorted(pair for rows in forms for pair in zip(rows.lines.tolist(), rows.values.tolist(), strict=True))


def _materials(found: Declarations) -> list[Material]:
    """The materials in the order of their lines; 8 numbers leave Refract 0 and Nr 1."""
    rows = [(line, [*values, 0.0, 1.0][:10]) for line, values in _in_order(found, "M")]
    return [Material((v[0], v[1], v[2]), v[3], v[4], v[5], v[6], v[7], v[8], v[9], line) for line, v in rows]


def _lights(found: Declarations) -> list[PointLight]:
    """The lights in the order of their lines; 3 numbers leave them white."""
    rows = [(line, [*values, 1.0, 1.0, 1.0]) for line, values in _in_order(found, "L")]
    return [PointLight((v[0], v[1], v[2]), (v[3], v[4], v[5]), line) for line, v in rows]


def _spheres(found: Declarations) -> Spheres:
    rows = found.get("S", 4)
    if not len(rows):
        return Spheres()
    return Spheres(rows.values[:, :3].copy(), rows.values[:, 3].copy(), material_of(found, rows.lines), int(rows.lines[0]))


def _mirrored(scene: Scene) -> Scene:
    """The same scene with x turned round, but for the camera, which is built from turned lines."""
    spheres = replace(scene.spheres, centers=flip_x(scene.spheres.centers))
    lights = tuple(replace(light, position=_turned(light.position)) for light in scene.lights)
    spots = tuple(replace(spot, position=_turned(spot.position), direction=_turned(spot.direction)) for spot in scene.spots)
    suns = tuple(replace(sun, direction=_turned(sun.direction)) for sun in scene.suns)
    # Its picture is never seen mirrored: only the way round in which it is turned changes.
    around = scene.environment and replace(scene.environment, rotation=-scene.environment.rotation)
    scene = replace(scene, environment=around)
    shutter = scene.shutter and replace(scene.shutter, eye_motion=_turned(scene.shutter.eye_motion))
    scene = replace(scene, shutter=shutter)
    instances = tuple(map(_mirrored_instance, scene.instances))
    scene = replace(scene, instances=instances)
    return replace(scene, lights=lights, spots=spots, suns=suns, objects=tuple(map(_mirrored_object, scene.objects)), spheres=spheres)


def _turned(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    return 0.0 - vector[0], vector[1], vector[2]


def _mirrored_object(mesh: MeshObject) -> MeshObject:
    smooth = None if mesh.vertex_normals is None else flip_x(mesh.vertex_normals)
    return replace(mesh, vertices=flip_x(mesh.vertices), normals=flip_x(mesh.normals), vertex_normals=smooth, motion=_turned(mesh.motion))


def _mirrored_instance(instance: Instance) -> Instance:
    """What mirrors the object before and the world after: x turned round in both."""
    turned = instance.world_from_object * np.array([[1.0, -1.0, -1.0, -1.0], [-1.0, 1.0, 1.0, 1.0], [-1.0, 1.0, 1.0, 1.0]])
    return replace(instance, world_from_object=turned + 0.0)
