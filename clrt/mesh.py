"""Files of triangles through a well-kept loader (trimesh), and the check that every array of triangles passes.

The loader forgives much in silence: an index 0 in an OBJ becomes the last vertex, a face line of two corners is
dropped, a cut-off OFF or PLY yields the faces that were left. What it would guess is refused here, with the line.
Polygons are cut into triangles as fans from their first corner, which is exact for convex ones.
"""

from __future__ import annotations

import io
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clrt.errors import MeshError

#: extensions that are read
EXTENSIONS = (".obj", ".ply", ".stl", ".off")

_OBJ_ZERO_INDEX = re.compile(rb"^[ \t]*f[ \t](?:[^\n]*[ \t])?[-+]?0+(?=[/\s])", re.M)
_OBJ_SHORT_FACE = re.compile(rb"^[ \t]*f(?:[ \t]+[^\s]+){0,2}[ \t\r]*$", re.M)
_OBJ_RELATIVE = re.compile(rb"^[ \t]*f[ \t][^\n]*?[ \t/]-", re.M)
_OBJ_VERTEX = re.compile(rb"^[ \t]*v[ \t]+([^\n]*)", re.M)


def load_mesh(path: str | os.PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Read a mesh: vertices (n, 3) float64 in the file's units and axes, faces (m, 3) int64 into them.

    Geometry is as in the file: nothing is merged, moved or thrown away but vertices that no face uses.
    Raises MeshError, naming the file, the cause and the remedy.
    """
    data, extension = read_checked(Path(path))
    loaded = parsed(data, extension, str(path)).to_mesh()
    vertices, faces = check_mesh(loaded.vertices, loaded.faces, str(path))
    check_count(data, extension, len(faces), str(path))
    return vertices, faces


def read_checked(file: Path) -> tuple[bytes, str]:
    """A mesh file and its extension, once nothing is left in it that the loader would guess at. Raises MeshError."""
    extension = file.suffix.lower()
    data = _read(file, extension)
    if extension == ".obj":
        data = _check_obj(data, str(file))
    elif extension == ".stl":
        _check_ascii_stl(data, str(file))
    return data, extension


def check_mesh(
    vertices: ArrayLike, faces: ArrayLike, name: str = "mesh"
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Arrays of triangles as (n, 3) float64 and (m, 3) int64, or MeshError: no faces, a wrong shape, an index out
    of range, a vertex in use that is NaN or infinite. `name` stands at the front of the message."""
    points, corners = _as_array(vertices, "vertices", name), _as_array(faces, "faces", name)
    if corners.size == 0:
        raise MeshError(f"{name}: no faces; give at least one triangle (a cloud of points cannot be rendered)")
    for array, what in ((points, "vertices"), (corners, "faces")):
        if array.ndim != 2 or array.shape[1] != 3:
            raise MeshError(f"{name}: {what} have the shape {array.shape}; expected (n, 3)")
    if corners.dtype.kind not in "iu":
        raise MeshError(f"{name}: faces hold {corners.dtype} numbers; expected integers, the vertices' places from 0")
    if points.dtype.kind not in "iuf":
        raise MeshError(f"{name}: vertices hold {points.dtype} values; expected real numbers")
    wrong = np.argwhere((corners < 0) | (corners >= len(points)))
    if len(wrong):
        face, corner = wrong[0]
        raise MeshError(f"{name}: face {face} asks for vertex {corners[face, corner]}, but there are {len(points)} (0 to "
                        f"{len(points) - 1}), and {len(wrong) - 1} more such corners; export the mesh again")  # fmt: skip
    points, corners = points.astype(np.float64), corners.astype(np.int64)
    used = np.zeros(len(points), bool)
    used[corners.ravel()] = True
    bad = np.flatnonzero(used & ~np.isfinite(points).all(axis=1))
    if len(bad):
        face = int(np.flatnonzero((corners == bad[0]).any(axis=1))[0])
        raise MeshError(f"{name}: face {face} has vertex {bad[0]} at {points[bad[0]].tolist()}, and {len(bad) - 1} more vertices "
                        "are not finite; repair the mesh in the program that made it")  # fmt: skip
    return points, corners


def vertex_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Unit normals at the vertices, (n, 3): face normals weighted by the angle at the vertex (Thürmer and Wüthrich 1998).

    Vertices at bitwise equal places share their normal, so seams of the file do not show. Where the faces around
    a vertex cancel, or no face with an area touches it, the normal is that of one of its faces, or zero.
    """
    _, place = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    shared = np.ravel(place)[faces]
    corners = vertices[faces]
    ahead: NDArray[np.float64] = np.roll(corners, -1, axis=1) - corners
    face_normals = _unit(np.asarray(np.cross(ahead[:, 0], ahead[:, 1]), np.float64))
    along, back = _unit(ahead), -_unit(np.roll(ahead, 1, axis=1))
    angles = 2.0 * np.arctan2(np.linalg.norm(along - back, axis=-1), np.linalg.norm(along + back, axis=-1))
    weighted = angles[..., None] * face_normals[:, None, :]
    count = int(shared.max()) + 1
    sums = np.zeros((count, 3))
    np.add.at(sums, shared.ravel(), weighted.reshape(-1, 3))
    fallback = np.zeros((count, 3))
    fallback[shared.ravel()] = np.repeat(face_normals, 3, axis=0)
    smooth = np.where((np.linalg.norm(sums, axis=1) > 1e-9)[:, None], _unit(sums), fallback)
    normals: NDArray[np.float64] = np.zeros_like(vertices)
    normals[faces.ravel()] = smooth[shared.ravel()]
    return normals


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """The vectors at length 1; zero where they are zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: NDArray[np.float64] = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
    return unit


def _as_array(values: ArrayLike, what: str, name: str) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except (ValueError, TypeError) as error:
        raise MeshError(f"{name}: {what} are not a rectangular array ({error}); expected the shape (n, 3)") from error


def _read(file: Path, extension: str) -> bytes:
    if file.is_dir():
        raise MeshError(f"{file}: is a directory; name a mesh file in it ({', '.join(EXTENSIONS)})")
    if extension not in EXTENSIONS:
        found = f"the extension {extension!r}" if extension else "no extension"
        raise MeshError(f"{file}: {found} is not one that is read; convert the mesh to one of {', '.join(EXTENSIONS)}")
    try:
        data = file.read_bytes()
    except OSError as error:
        raise MeshError(f"{file}: cannot be read: {error.strerror or error}; check the path and its permissions") from error
    if not data.strip():
        raise MeshError(f"{file}: is empty; export the mesh again")
    return data


def parsed(data: bytes, extension: str, name: str, **options: Any) -> Any:
    """The trimesh scene of a file's bytes; `options` are those of the loader of its kind. Raises MeshError."""
    try:
        import trimesh
    except ImportError as error:
        raise MeshError(f"{name}: reading mesh files needs trimesh; install it: pip install 'clrt[mesh]'") from error
    kind = extension[1:]
    try:
        return trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, **options)
    # The loader's parsers raise whatever their parts raise, from IndexError to ModuleNotFoundError
    except Exception as error:
        cause = "it is cut off or not of this kind" if isinstance(error, ImportError) else str(error) or type(error).__name__
        raise MeshError(f"{name}: cannot be read as {kind.upper()}: {cause}; export it again, as triangles") from error


def _check_obj(data: bytes, name: str) -> bytes:
    """The text with tabs and continued lines resolved, once nothing is left in it that the loader would guess at."""
    data = data.replace(b"\t", b" ").replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    zero = _OBJ_ZERO_INDEX.search(data)
    if zero:
        raise MeshError(f"{name}:{_line_of(data, zero)}: error: a face asks for vertex 0; OBJ counts from 1; export the mesh again")
    short = _OBJ_SHORT_FACE.search(data)
    if short:
        raise MeshError(f"{name}:{_line_of(data, short)}: error: {short[0].decode(errors='replace').strip()!r} has fewer than 3 corners; "
                        "the file is cut off or wrong; export the mesh again")  # fmt: skip
    relative = _OBJ_RELATIVE.search(data)
    if relative and _OBJ_VERTEX.search(data, relative.end()):
        raise MeshError(f"{name}:{_line_of(data, relative)}: error: a face counts vertices backwards (negative indices) and more vertices "
                        "follow it, which the loader cannot resolve; export the mesh with positive indices")  # fmt: skip
    _check_obj_columns(data, name)
    return data


def _check_obj_columns(data: bytes, name: str) -> None:
    """Every `v` line has as many numbers as the first, 3 (or 4 with w, 6 or 7 with a colour): the loader cuts them evenly."""
    first = _OBJ_VERTEX.search(data)
    if first is None:
        return
    columns = len(first[1].split())
    uneven = re.compile(rb"^ *v +(?!(?:[^\s]+ +){%d}[^\s]+ *\r?$)[^\n]*" % (columns - 1), re.M).search(data)
    if columns not in (3, 4, 6, 7) or uneven:
        where = uneven if columns in (3, 4, 6, 7) and uneven else first
        raise MeshError(f"{name}:{_line_of(data, where)}: error: {where[0].decode(errors='replace').strip()!r}: a vertex has "
                        "3 numbers (4 with w, 6 or 7 with a colour), the same number on all lines; export the mesh again")  # fmt: skip


def _check_ascii_stl(data: bytes, name: str) -> None:
    """A text STL ends in `endsolid`; a binary one may begin with `solid`, but then it has no `facet` near its start."""
    text = data.lstrip()[:5].lower() == b"solid" and b"facet" in data[:1000].lower()
    if text and b"endsolid" not in data[-1000:].lower():
        raise MeshError(f"{name}: has no `endsolid` at its end: the file is cut off; export the mesh again")


def check_count(data: bytes, extension: str, faces: int, name: str) -> None:
    """The header of OFF and PLY says how many faces follow; the loader takes fewer in silence."""
    told = _told_faces(data, extension)
    if told > faces:
        raise MeshError(f"{name}: its header tells of {told} faces, only {faces} are there: the file is cut off; export the mesh again")


def _told_faces(data: bytes, extension: str) -> int:
    if extension == ".ply":
        found = re.search(rb"^element[ \t]+face[ \t]+(\d+)", data, re.M)
        return int(found[1]) if found else 0
    if extension == ".off":
        counts = re.sub(rb"#[^\n]*", b"", data[:10_000]).split(b"OFF", 1)[-1].split()[:2]
        return int(counts[1]) if len(counts) == 2 and counts[1].isdigit() else 0
    return 0


def _line_of(data: bytes, found: re.Match[bytes]) -> int:
    return data.count(b"\n", 0, found.start()) + 1
