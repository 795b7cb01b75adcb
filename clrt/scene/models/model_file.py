"""What is read of a model file, in the file's own axes, before it becomes part of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from clrt.scene.model import FloatArray, IntArray, Material, PointLight, SpotLight, SunLight, Texture


class ModelError(Exception):
    """What is wrong with a model file. line, column : where in the file (0: its text has no lines, or the fault no place)."""

    def __init__(self, message: str, line: int = 0, column: int = 0) -> None:
        super().__init__(message)
        self.line, self.column = line, column

    def at(self, name: str) -> str:
        """`name:line:column: message`, without what is not known."""
        place = "".join(f":{number}" for number in (self.line, self.column) if number)
        return f"{name}{place}: {self}"


@dataclass(frozen=True, eq=False)
class Part:
    """One object of a file: triangles in right-handed axes, x to the right, y up, +z towards the viewer.

    vertices : (n, 3, 3) float64; material_ids : (n,) int32 into the model's materials, -1 where the file has none
    normals : (n, 3, 3) float64 at the corners as the file has them, zero where it has none; None without any
    uvs : (n, 3, 2) float64, v up, or None
    copies : where the part stands, each (4, 4) float64; none: once, as it is
    """

    vertices: FloatArray
    material_ids: IntArray
    normals: FloatArray | None = None
    uvs: FloatArray | None = None
    name: str = "mesh"
    copies: tuple[FloatArray, ...] = ()


def joined(parts: Sequence[Part], name: str) -> Part:
    """Parts without copies as one."""

    def merged(arrays: list[FloatArray | None], width: int) -> FloatArray | None:
        if all(array is None for array in arrays):
            return None
        counts = [len(part.vertices) for part in parts]
        return np.concatenate([np.zeros((n, 3, width)) if a is None else a for a, n in zip(arrays, counts, strict=True)])

    return Part(
        np.concatenate([part.vertices for part in parts]), np.concatenate([part.material_ids for part in parts]),
        merged([part.normals for part in parts], 3), merged([part.uvs for part in parts], 2), name,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class View:
    """A perspective camera of a file. world_from_camera : (4, 4) float64; it looks along -z, y up.

    yfov : whole vertical angle, radians; aspect : width / height, 0 where the file leaves it open
    """

    world_from_camera: FloatArray
    yfov: float
    aspect: float = 0.0
    name: str = "camera"


@dataclass(frozen=True, eq=False)
class Model:
    """Everything that is read of a file.

    views : its cameras in the order of its nodes; None for one that is not supported
    lights, spots, suns : in the file's axes
    warnings : what it holds and clrt leaves out, one line each
    """

    parts: tuple[Part, ...]
    materials: tuple[Material, ...] = ()
    textures: tuple[Texture, ...] = ()
    views: tuple[View | None, ...] = ()
    lights: tuple[PointLight, ...] = ()
    spots: tuple[SpotLight, ...] = ()
    suns: tuple[SunLight, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass
class Notes:
    """Warnings while a file is read, each said once."""

    told: list[str] = field(default_factory=list)

    def add(self, warning: str) -> None:
        if warning not in self.told:
            self.told.append(warning)


def shifted(material: Material, textures: int, line: int) -> Material:
    """The material with its pictures' places among the textures moved by `textures`, and `line` for the line of all that it asks for."""
    maps = {name: getattr(material, name) for name in ("texture", "normal_map", "metal_rough_map", "emission_map")}
    changes: dict[str, Any] = {f.name: line for f in fields(material) if f.name == "line" or f.name.endswith("_line")}
    return replace(material, **changes | {name: at + textures for name, at in maps.items() if at >= 0})
