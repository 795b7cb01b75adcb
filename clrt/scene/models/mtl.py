"""Material files (MTL) of OBJ meshes, as Phong materials: an approximation, since MTL's light is another (docs/models.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from clrt.scene.model import Material, Picture, Texture
from clrt.scene.models.model_file import ModelError, Notes
from clrt.scene.picture import Folders, PictureError, read_picture

_AMBIENT = 0.1  #: Ka of the homework's materials; MTL leaves the light from all sides to the program
_GREY = (0.8, 0.8, 0.8)  #: colour of a material that names none
#: statement -> numbers that it takes
_NUMBERS = {"Kd": 3, "Ks": 3, "Ke": 3, "Ns": 1, "d": 1, "Tr": 1}
#: statements that change nothing here
_SILENT = ("Ka", "illum", "Ni", "Tf", "sharpness")
#: option of a picture -> the values that follow it
_OPTIONS = {"-blendu": 1, "-blendv": 1, "-boost": 1, "-mm": 2, "-texres": 1, "-clamp": 1, "-bm": 1, "-imfchan": 1, "-type": 1, "-cc": 1}


@dataclass
class Library:
    """Materials by name, as files bring them, and their pictures."""

    folders: Folders
    notes: Notes
    places: dict[str, int] = field(default_factory=dict)
    materials: list[Material] = field(default_factory=list)
    textures: list[Texture] = field(default_factory=list)
    _pictures: dict[Path, Picture] = field(default_factory=dict)

    def read(self, name: str) -> None:
        """Add the materials of a file. Raises ModelError, with the line."""
        try:
            data = self.folders.find(name).read_bytes()
        except (PictureError, OSError) as problem:
            raise ModelError(f"{problem}; with materials=above the mesh needs none") from None
        text = data.decode("utf-8", "replace").replace("\\\r\n", " ").replace("\\\n", " ")
        values: dict[str, tuple[float, ...]] = {}
        for number, line in enumerate(text.splitlines(), 1):
            tokens = line.split("#", 1)[0].split()
            if not tokens:
                continue
            if tokens[0] == "newmtl":
                values = {}
                self.places[" ".join(tokens[1:])] = len(self.materials)
                self.materials.append(phong(values))
            elif self.materials:
                try:
                    self._statement(tokens, values)
                except PictureError as problem:
                    raise ModelError(f"{name}:{number}: {problem}") from None

    def _statement(self, tokens: Sequence[str], values: dict[str, tuple[float, ...]]) -> None:
        kind, material = tokens[0], self.materials[-1]
        if kind in _NUMBERS:
            values[kind] = _numbers(tokens, _NUMBERS[kind])
            self.materials[-1] = replace(phong(values), texture=material.texture, normal_map=material.normal_map)
        elif kind == "map_Kd":
            self.materials[-1] = replace(material, texture=self._texture(tokens, srgb=True))
        elif kind == "norm":
            self.materials[-1] = replace(material, normal_map=self._texture(tokens, srgb=False))
        elif kind not in _SILENT:
            self.notes.add(f"left out, not supported: {kind} of its materials")

    def _texture(self, tokens: Sequence[str], srgb: bool) -> int:
        at, clamp = 1, False
        while at < len(tokens) and tokens[at].startswith("-"):
            option = tokens[at]
            clamp = clamp or (option == "-clamp" and tokens[at + 1 : at + 2] == ["on"])
            at += 1 + (_OPTIONS[option] if option in _OPTIONS else _count_numbers(tokens[at + 1 :]))
            if option != "-clamp":
                self.notes.add(f"left out, not supported: the option {option} of pictures")
        name = " ".join(tokens[at:]).replace("\\", "/")
        if not name:
            raise PictureError(f"{tokens[0]} names no picture; export the mesh again")
        path = self.folders.find(name)
        if path not in self._pictures:
            self._pictures[path] = read_picture(path, name)
        self.textures.append(Texture(self._pictures[path], "clamp" if clamp else "repeat", True, srgb))
        return len(self.textures) - 1


def phong(values: dict[str, tuple[float, ...]]) -> Material:
    """The material of MTL's numbers. C is the diffuse colour, or where that is black the highlight's: here one colour is in both."""
    diffuse, highlight = values.get("Kd", _GREY), values.get("Ks", (0.0, 0.0, 0.0))
    color = diffuse if any(diffuse) else highlight
    strength = max(highlight) / max(color) if any(color) else 0.0
    emission, exponent = values.get("Ke", (0.0, 0.0, 0.0)), values.get("Ns", (1.0,))[0]
    opacity = values["d"][0] if "d" in values else 1.0 - values.get("Tr", (0.0,))[0]
    return Material(
        (color[0], color[1], color[2]), _AMBIENT, 1.0 if any(diffuse) else 0.0, strength, exponent,
        emission=(emission[0], emission[1], emission[2]), opacity=min(max(opacity, 0.0), 1.0),
    )  # fmt: skip


def _numbers(tokens: Sequence[str], count: int) -> tuple[float, ...]:
    """The numbers of a statement: one stands for all three of a colour; a factor word such as `-halo` is passed over."""
    given = [token for token in tokens[1:] if token != "-halo"]
    if count == 3 and len(given) == 1:
        given = given * 3
    try:
        numbers = tuple(float(token) for token in given[:count])
    except ValueError:
        raise PictureError(f"{tokens[0]} takes numbers, found {' '.join(given)[:40]!r}") from None
    if len(numbers) != count or not all(0.0 <= value <= 1e30 for value in numbers):
        raise PictureError(f"{tokens[0]} takes {count} number{'s' if count > 1 else ''} of at least 0, found {' '.join(given)[:40]!r}")
    return numbers


def _count_numbers(tokens: Sequence[str]) -> int:
    """How many numbers an option such as -o or -s is followed by: up to 3."""
    count = 0
    while count < min(3, len(tokens) - 1) and tokens[count].lstrip("+-").replace(".", "", 1).isdigit():
        count += 1
    return count
