"""The words `texture`, `uv` and `project`: pictures on materials, and where on them the corners of triangles lie.

`texture` and `project` hold for the material (M) above them, `uv` for the triangle (T) above it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from clrt.scene.faults import Faults
from clrt.scene.model import FloatArray, Material, Picture, Texture
from clrt.scene.objects import gather, material_of
from clrt.scene.picture import Folders, PictureError, read_picture
from clrt.scene.text import Declarations
from clrt.scene.words.word import WordCall

#: axis that is looked along -> the axes that u and v follow
_PLANES = {"x": (2, 1), "y": (0, 2), "z": (0, 1)}


@dataclass(frozen=True, eq=False)
class Textured:
    """What the three words add: the textures, material index -> texture, and uvs (n, 3, 2) of all triangles in the order of their lines."""

    textures: tuple[Texture, ...]
    of_material: dict[int, int]
    uvs: FloatArray | None

    def materials(self, plain: Sequence[Material]) -> list[Material]:
        """The materials with their textures."""
        return [replace(m, texture=self.of_material.get(i, -1)) for i, m in enumerate(plain)]


def read_textures(found: Declarations, folders: Folders, faults: Faults) -> Textured:
    """Check the lines of the three words, and read the pictures; what is wrong is noted."""
    if not any(call.name in ("texture", "uv", "project") for call in found.words):
        return Textured((), {}, None)
    calls = _by_material(found, "texture", faults)
    projections = _by_material(found, "project", faults)
    for material, call in projections.items():
        if material not in calls:
            faults.add(call.line, call.column, "project has no effect on a material without a texture; add a line texture above it")
    textures, pictures = [], dict[Path, "Picture | None"]()
    for call in calls.values():
        picture = _picture(call, folders, pictures, faults)
        if picture is not None:
            textures.append(Texture(picture, call.text("wrap"), call.text("filter") == "linear", call.text("srgb") == "yes", call.line))
    uvs = _coordinates(found, calls, projections, faults)
    return Textured(tuple(textures), {material: i for i, material in enumerate(calls)}, uvs if calls else None)


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
        uvs[rows] = soup.vertices[rows][:, :, _PLANES[call.text("axis")]] / call.number("scale")
    given = _by_triangle(found, soup.lines, faults)
    for triangle, call in given.items():
        uvs[triangle] = np.array(list(call.values.values()), np.float64).reshape(3, 2)
    without = np.isin(material, [m for m in calls if m not in projections])
    without[list(given)] = False
    for number in np.unique(material[without]).tolist():
        line = soup.lines[without & (material == number)][0]
        faults.add(
            calls[number].line, calls[number].column,
            f'the triangle of line {line} has no place on the picture; add a line such as "uv 0 0 1 0 1 1" after it, '
            'or one such as "project axis=y" after this',
        )  # fmt: skip
    return uvs
