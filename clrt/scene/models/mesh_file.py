"""OBJ, PLY, STL and OFF through trimesh, as a Model: objects, normals, coordinates and materials of the file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.errors import MeshError
from clrt.mesh import check_count, check_mesh, parsed, read_checked
from clrt.scene.model import FloatArray
from clrt.scene.models.model_file import Model, ModelError, Notes, Part, joined
from clrt.scene.models.mtl import Library
from clrt.scene.picture import Folders

_OBJECT = re.compile(rb"^ *o +([^\r\n]*)", re.M)
_USE = re.compile(rb"^ *usemtl +([^\r\n]*)", re.M)
_LIBRARY = re.compile(rb"^ *mtllib +([^\r\n]*)", re.M)
_NUMBERED = re.compile(r"clrt(\d+)")


def read_mesh_file(path: Path, folders: Folders, materials: bool) -> Model:
    """The parts of a mesh file; `materials` : whether its own are asked for. folders : where the files that it names may be.

    Raises ModelError.
    """
    try:
        return _read(path, folders, materials)
    except MeshError as problem:
        found = re.fullmatch(re.escape(str(path)) + r"(?::(\d+))?:? (?:error: )?(.*)", str(problem), re.S)
        line, message = (int(found[1] or 0), found[2]) if found else (0, str(problem))
        raise ModelError(message, line) from problem


def _read(path: Path, folders: Folders, materials: bool) -> Model:
    data, extension = read_checked(path)
    notes = Notes()
    library, options, names = Library(folders, notes), dict[str, Any](), list[str]()
    if extension == ".obj":
        names = [match[1].decode("utf-8", "replace").strip() for match in _OBJECT.finditer(data)]
        uses = {match[1].decode("utf-8", "replace").strip() for match in _USE.finditer(data)}
        if materials:
            _read_libraries(data, uses, library)
        data = _numbered(data)
        options = {"split_objects": True, "resolver": _Names(uses)}
    loaded = parsed(data, extension, str(path), **options)
    parts = [_part(mesh, library, str(path), notes) for mesh in loaded.geometry.values() if len(getattr(mesh, "faces", ()))]
    if not parts:
        raise ModelError("no faces; give at least one triangle (a cloud of points cannot be rendered)")
    check_count(data, extension, sum(len(part.vertices) for part in parts), str(path))
    grouped = tuple(joined(group, name) for name, group in _objects(list(loaded.geometry), parts, names, path.stem))
    return Model(grouped, tuple(library.materials), tuple(library.textures), warnings=tuple(notes.told))


def _read_libraries(data: bytes, uses: set[str], library: Library) -> None:
    libraries = [match[1].decode("utf-8", "replace").strip() for match in _LIBRARY.finditer(data)]
    for name in dict.fromkeys(libraries):
        library.read(name)
    missing = sorted(uses - set(library.places)) if libraries else []
    if missing:
        where = ", ".join(libraries)
        raise ModelError(f'the material "{missing[0]}" is used, but {where} does not define it; with materials=above the mesh needs none')


def _numbered(data: bytes) -> bytes:
    """Objects by numbers for names: the loader joins names of objects and materials with `_`, which names hold, too. All materials are
    named, by a library of its own (`_Names`)."""
    count = iter(range(1 << 30))
    return b"mtllib names\n" + _OBJECT.sub(lambda _: b"o clrt%d" % next(count), _LIBRARY.sub(b"", data))


class _Names:
    """What the loader reads in place of material files: the names that are used, without their pictures, which it would drop in silence."""

    def __init__(self, uses: set[str]) -> None:
        self._text = "".join(f"newmtl {name}\n" for name in sorted(uses)).encode()

    def get(self, name: str) -> bytes:
        return self._text

    def __getitem__(self, name: str) -> bytes:
        return self._text

    def keys(self) -> list[str]:
        return []


def _objects(keys: list[str], parts: list[Part], names: list[str], stem: str) -> Iterator[tuple[str, list[Part]]]:
    """The parts of each `o` of an OBJ, in their order, with its name; of other files all as one."""
    groups: dict[int, list[Part]] = {}
    for key, part in zip(keys, parts, strict=False):
        found = _NUMBERED.match(key)
        groups.setdefault(int(found[1]) if found else -1, []).append(part)
    for number in sorted(groups):
        yield names[number] if 0 <= number < len(names) else stem, groups[number]


def _part(mesh: Any, library: Library, name: str, notes: Notes) -> Part:
    """One mesh of the loader's."""
    points, faces = check_mesh(mesh.vertices, mesh.faces, name)
    # The loader keeps normals that the file has in its cache; the property would compute others.
    normals = _corners(mesh._cache.cache.get("vertex_normals"), faces, 3, "normals", name)
    visual = mesh.visual
    uvs = _corners(getattr(visual, "uv", None), faces, 2, "texture coordinates", name)
    used = getattr(getattr(visual, "material", None), "name", None)
    if visual.kind in ("vertex", "face") and visual.defined:
        notes.add("left out, not supported: colours of vertices and faces")
    ids = np.full(len(faces), library.places.get(str(used), -1), np.int32)
    return Part(points[faces], ids, normals, uvs, Path(name).stem)


def _corners(values: Any, faces: NDArray[np.int64], width: int, what: str, name: str) -> FloatArray | None:
    """(n, 3, width) of values at the vertices; None without any. Raises MeshError where one in use is not finite."""
    if values is None or np.ndim(values) != 2 or np.shape(values)[1] < width:
        return None
    corners: FloatArray = np.asarray(values, np.float64)[:, :width][faces]
    bad = np.flatnonzero(~np.isfinite(corners).all(axis=(1, 2)))
    if len(bad):
        raise MeshError(f"{name}: face {bad[0]} has {what} that are not finite; repair the mesh in the program that made it")
    return corners
