"""The words `texture`, `normalmap`, `uv` and `project`: pictures on materials, and where on them the corners of triangles lie.

`texture`, `normalmap` and `project` hold for the material (M) above them, `uv` for the triangle (T) above it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.scene.faults import Faults
from clrt.scene.model import FloatArray, Material, MeshObject, Picture, Texture
from clrt.scene.objects import gather, material_of
from clrt.scene.picture import Folders, PictureError, read_picture
from clrt.scene.text import Declarations
from clrt.scene.words.word import WordCall

LEAST_TURN = 2.0**-40  #: sine of the angle between two sides on the picture up to which they lie on a line
#: axis that is looked along -> the axes that u and v follow
PLANES = {"x": (2, 1), "y": (0, 2), "z": (0, 1)}


@dataclass(frozen=True, eq=False)
class Textured:
    """What the words add: the textures; what of each material they set, by its index; uvs (n, 3, 2) of all triangles in the order of their
    lines."""

    textures: tuple[Texture, ...]
    of_material: dict[int, dict[str, Any]]
    uvs: FloatArray | None

    def materials(self, plain: Sequence[Material]) -> list[Material]:
        """The materials with their pictures."""
        return [replace(m, **self.of_material.get(i, {})) for i, m in enumerate(plain)]


def read_textures(found: Declarations, folders: Folders, faults: Faults) -> Textured:
    """Check the lines of these words, and read the pictures; what is wrong is noted."""
    if not any(call.name in ("texture", "normalmap", "uv", "project") for call in found.words):
        return Textured((), {}, None)
    colors, normals = _by_material(found, "texture", faults), _by_material(found, "normalmap", faults)
    projections = _by_material(found, "project", faults)
    pictured = {*colors, *normals, *_unread(found, "texture", "normalmap")}
    for material, call in projections.items():
        if material not in pictured:
            faults.add(call.line, call.column, "project has no effect on a material without a texture; add a line texture above it")
    textures: list[Texture] = []
    pictures: dict[Path, Picture | None] = {}
    of_material: dict[int, dict[str, Any]] = {}
    for material, call in (*colors.items(), *normals.items()):
        picture = _picture(call, folders, pictures, faults)
        if picture is not None:
            of_material.setdefault(material, {}).update(_looks(call, len(textures)))
            srgb = call.name == "texture" and call.text("srgb") == "yes"
            textures.append(Texture(picture, call.text("wrap"), call.text("filter") == "linear", srgb, call.line))
    calls = {**normals, **colors}
    uvs = _coordinates(found, calls, projections, faults)
    return Textured(tuple(textures), of_material, uvs if calls else None)


def _looks(call: WordCall, texture: int) -> dict[str, Any]:
    """What a line with a picture sets of its material."""
    if call.name == "normalmap":
        return {"normal_map": texture, "normal_strength": call.number("strength")}
    return {"texture": texture, "alpha": call.text("alpha") == "yes", "alpha_cutoff": call.number("cutoff")}


def untilted(objects: Sequence[MeshObject], materials: Sequence[Material]) -> list[str]:
    """The warning of triangles with a normal map whose places on it lie on a line: their normals are not tilted."""
    mapped = np.array([m.normal_map >= 0 for m in materials], np.bool_)
    count, first = 0, -1
    for item in objects:
        if item.uvs is None:
            continue
        a, b = item.uvs[:, 1] - item.uvs[:, 0], item.uvs[:, 2] - item.uvs[:, 0]
        area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        rows = np.flatnonzero(mapped[item.material_ids] & ~(area > LEAST_TURN * np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)))
        first = item.first_prim + int(rows[0]) if len(rows) and first < 0 else first
        count += len(rows)
    if not count:
        return []
    which = f"triangle {first}" if count == 1 else f"{count} triangles (the first: triangle {first})"
    return [f"{which}: the corners lie on a line of the normal map; normals are not tilted there"]


def _by_material(found: Declarations, word: str, faults: Faults) -> dict[int, WordCall]:
    """Material index -> the line of `word` that holds for it."""
    calls: dict[int, WordCall] = {}
    lines = found.lines_of("M")
    for call in found.words:
        if call.name != word:
            continue
        material = int(np.searchsorted(lines, call.line)) - 1
        if material < 0:
            faults.add(call.line, call.column, f"{word} before any material; put it after the M line that it is for")
        elif material in calls:
            already = f"the material of line {lines[material]}; the first is line {calls[material].line}"
            faults.add(call.line, call.column, f"a second {word} line for {already}")
        else:
            calls[material] = call
    return calls


def _unread(found: Declarations, *words: str) -> set[int]:
    """Indices of the materials with a line of these words that could not be read."""
    lines = [line for word in words for line in found.broken.get(word, [])]
    return set((np.searchsorted(found.lines_of("M"), lines) - 1).tolist())


def _picture(call: WordCall, folders: Folders, read: dict[Path, Picture | None], faults: Faults) -> Picture | None:
    """The picture that a line names; each file is read once."""
    name = call.text("picture")
    try:
        path = folders.find(name)
        if path not in read:
            read[path] = None
            read[path] = read_picture(path, name)
        return read[path]
    except (PictureError, OSError) as problem:
        faults.add(call.line, call.columns["picture"], str(problem))
        return None


def _by_triangle(found: Declarations, lines: NDArray[np.int64], faults: Faults) -> dict[int, WordCall]:
    """Place of a triangle among all -> its uv line. lines : (n,) of the triangles."""
    calls: dict[int, WordCall] = {}
    for call in found.words:
        if call.name != "uv":
            continue
        triangle = int(np.searchsorted(lines, call.line)) - 1
        if triangle < 0:
            faults.add(call.line, call.column, "uv before any triangle; put it after the T line that it is for")
        elif triangle in calls:
            already = f"the triangle of line {lines[triangle]}; the first is line {calls[triangle].line}"
            faults.add(call.line, call.column, f"a second uv line for {already}")
        else:
            calls[triangle] = call
    return calls


def _coordinates(
    found: Declarations, calls: dict[int, WordCall], projections: dict[int, WordCall], faults: Faults
) -> FloatArray | None:
    """Texture coordinates (n, 3, 2) of all triangles in the order of their lines; zero for those of other materials."""
    if found.broken.get("T"):
        return None  # places among the triangles that could be read mean nothing
    soup = gather(found)
    material = material_of(found, soup.lines)
    uvs = np.zeros((len(soup), 3, 2))
    for number, call in projections.items():
        rows = np.flatnonzero(material == number)
        uvs[rows] = soup.vertices[rows][:, :, PLANES[call.text("axis")]] / call.number("scale")
    given = _by_triangle(found, soup.lines, faults)
    for triangle, call in given.items():
        uvs[triangle] = np.array(list(call.values.values()), np.float64).reshape(3, 2)
    without = np.isin(material, [m for m in calls if m not in {*projections, *_unread(found, "project")}])
    unread = np.searchsorted(soup.lines, found.broken.get("uv", [])) - 1
    without[[*given, *unread[unread >= 0].tolist()]] = False
    for number in np.unique(material[without]).tolist():
        line = soup.lines[without & (material == number)][0]
        faults.add(
            calls[number].line, calls[number].column,
            f'the triangle of line {line} has no place on the picture; add a line such as "uv 0 0 1 0 1 1" after it, '
            'or one such as "project axis=y" after this',
        )  # fmt: skip
    return uvs
