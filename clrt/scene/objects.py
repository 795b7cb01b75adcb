"""The triangles of a scene text, in the order of its lines, as objects with checked normals."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.scene.model import FloatArray, IntArray, MeshObject
from clrt.scene.text import Declarations
from clrt.scene.triangles import AGREEING_ANGLE, agreeing, components, face_normals, unit


@dataclass(frozen=True, eq=False)
class Soup:
    """All triangles of a text, still in one piece, in the order of their lines.

    lines : (n,) int64
    vertices : (n, 3, 3) float64
    given : (n, 3) float64, face normals as written; zero where the line has none
    with_normal : (n,) bool, lines of 12 numbers
    smooth : (n,) bool, lines of 18 numbers
    corner_normals : (n, 3, 3) float64 as written, zero where the line has none; None where no line has
    """

    lines: NDArray[np.int64]
    vertices: FloatArray
    given: FloatArray
    with_normal: NDArray[np.bool_]
    smooth: NDArray[np.bool_]
    corner_normals: FloatArray | None

    def __len__(self) -> int:
        return len(self.lines)


def gather(found: Declarations) -> Soup:
    """Merge the three forms of T lines."""
    plain, faced, smooth = found.get("T", 9), found.get("T", 12), found.get("T", 18)
    lines = np.sort(np.concatenate([plain.lines, faced.lines, smooth.lines]))
    n = len(lines)
    if len(plain) == n:  # with lines and numbers as they stand, those of other runs among them, which are read only
        return Soup(lines, plain.values.reshape(-1, 3, 3).copy(), np.zeros((n, 3)), np.zeros(n, np.bool_), np.zeros(n, np.bool_), None)
    soup = Soup(
        lines, np.empty((n, 3, 3)), np.zeros((n, 3)), np.isin(lines, faced.lines), np.isin(lines, smooth.lines),
        np.zeros((n, 3, 3)) if len(smooth) else None,
    )  # fmt: skip
    for rows in (plain, faced, smooth):
        soup.vertices[np.searchsorted(lines, rows.lines)] = rows.values[:, :9].reshape(-1, 3, 3)
    soup.given[soup.with_normal] = faced.values[:, 9:]
    if soup.corner_normals is not None:
        soup.corner_normals[soup.smooth] = smooth.values[:, 9:].reshape(-1, 3, 3)
    return soup


def note(warnings: list[str], lines: Iterable[int], one: str, many: str) -> None:
    """Add a warning that counts the lines and names the first; `many` follows the number. None for no lines."""
    listed = list(lines)
    if len(listed) == 1:
        warnings.append(f"line {listed[0]}: {one}")
    elif listed:
        warnings.append(f"{len(listed)} {many} (the first: line {listed[0]})")


def checked_face_normals(soup: Soup, warnings: list[str]) -> FloatArray:
    """Unit normals (n, 3): the given ones where they agree with the geometry, else the geometric ones."""
    geometric = face_normals(soup.vertices)
    flat = ~geometric.any(axis=1)
    note(warnings, soup.lines[flat].tolist(), "the triangle has zero area and is never hit",
         "triangles have zero area and are never hit")  # fmt: skip
    if not soup.with_normal.any():
        return geometric
    given = unit(soup.given)
    fits = agreeing(given, geometric)
    wrong = soup.with_normal & ~fits & ~flat
    off = f"zero or more than {AGREEING_ANGLE:g} degrees off the triangle's plane normal, which is used instead"
    note(warnings, soup.lines[wrong].tolist(), f"the face normal is {off}", f"face normals are {off}")
    return np.where(fits[:, None], given, geometric)


def checked_vertex_normals(soup: Soup, normals: FloatArray, warnings: list[str]) -> FloatArray | None:
    """Unit normals (n, 3, 3) a corner, or None where no triangle is smooth; others repeat their face normal.

    A zero normal becomes the face normal, on the side that the triangle's other normals are on.
    """
    if soup.corner_normals is None:
        return None
    given = unit(soup.corner_normals)
    zero = np.logical_not(given.any(axis=2))
    note(warnings, soup.lines[(zero & soup.smooth[:, None]).any(axis=1)].tolist(),
         "a vertex normal is zero; the plane's normal is used instead",
         "triangles have a vertex normal of zero; the plane's normal is used instead")  # fmt: skip
    behind = np.einsum("ij,ij->i", given.sum(axis=1), normals) < 0.0
    facing = np.where(behind[:, None], 0.0 - normals, normals)
    return np.where(zero[:, :, None], facing[:, None, :], given)


def build_objects(
    found: Declarations, split: bool, warnings: list[str], uvs: FloatArray | None = None
) -> tuple[MeshObject, ...]:
    """All triangles as objects; primitive ids run through them in the order of the text.

    uvs : (n, 3, 2) float64, texture coordinates of all triangles in the order of their lines
    split : make each connected component an object where no O line closes one. Ids then run through the
        components, in the order of their first triangles.
    """
    soup = gather(found)
    closing = found.get("O", 0).lines
    group = np.searchsorted(closing, soup.lines)
    spheres = np.searchsorted(closing, found.get("S", 4).lines)  # an O below spheres alone is habit, no sign of missing triangles
    closed = np.zeros(len(closing) + 1, np.bool_)
    closed[group] = closed[spheres] = True
    empty = np.flatnonzero(~closed[:-1])
    note(warnings, closing[empty].tolist(), "O closes no triangles and is left out", "O lines close no triangles and are left out")
    normals = checked_face_normals(soup, warnings)
    vertex_normals = checked_vertex_normals(soup, normals, warnings)
    material_ids = material_of(found, soup.lines)
    if split and len(closing):
        warnings.append(f"line {closing[0]}: O lines mark the objects of this scene; it is not split any further")
    elif split:
        group = components(soup.vertices)
        parts = len(np.unique(group))
        warnings.append(f"the triangles are split by shared vertices into {parts} object{'' if parts == 1 else 's'}")
    order = np.argsort(group, kind="stable")
    starts = np.flatnonzero(np.diff(group[order], prepend=-1)).tolist()
    return tuple(
        _object(soup, normals, vertex_normals, material_ids, order[start:stop], start, number, uvs)
        for number, (start, stop) in enumerate(zip(starts, [*starts[1:], len(soup)], strict=False), 1)
    )


def material_of(found: Declarations, lines: NDArray[np.int64]) -> IntArray:
    """Index (n,) of the last material above each line; -1 where there is none."""
    return (np.searchsorted(found.lines_of("M"), lines) - 1).astype(np.int32)


def _object(
    soup: Soup, normals: FloatArray, vertex_normals: FloatArray | None, material_ids: IntArray,
    rows: NDArray[np.int64], first_prim: int, number: int, uvs: FloatArray | None,
) -> MeshObject:  # fmt: skip
    """One object of the ascending triangles `rows`: a part of the soup, or copied out of it."""
    in_a_row = int(rows[-1]) - int(rows[0]) == len(rows) - 1
    part = slice(int(rows[0]), int(rows[-1]) + 1) if in_a_row else rows
    smooth_lines = soup.lines[part][soup.smooth[part]]
    return MeshObject(
        vertices=soup.vertices[part],
        normals=normals[part],
        material_ids=material_ids[part],
        first_prim=first_prim,
        vertex_normals=vertex_normals[part] if vertex_normals is not None and len(smooth_lines) else None,
        name=f"object {number}",
        line=int(smooth_lines[0]) if len(smooth_lines) else 0,
        uvs=uvs[part] if uvs is not None else None,
    )
