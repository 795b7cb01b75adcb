"""The arrays of effects' kernel arguments, each made by the function of its name in `PACKERS`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device import arrays_environment, arrays_placed, arrays_rough, arrays_wide, layout, texels
from clrt.device.arrays_emitters import emitters
from clrt.device.packed import FloatArray, Packed
from clrt.device.program import MEDIA_DEPTH, light_dtype
from clrt.kdtree.joined import in_a_row
from clrt.scene.media import around_eye, ranks, refracting_materials

STEEPEST_EDGE = 1e30  #: slope of a spot's hard edge: any rounding error times it is past the whole step

Packer = Callable[[Packed], NDArray[Any]]


def _lights(packed: Packed) -> NDArray[np.void]:
    """Point lights, then spots; where the program knows of spots, each with its cone (spot.cl), a point light's all around it."""
    scene = packed.scene
    records = np.zeros(len(scene.lights_with_position), light_dtype(packed.features, packed.real))
    for i, light in enumerate(scene.lights_with_position):
        records["given"][i], records["color"][i] = light.position, light.color
        records["position"][i] = np.asarray(light.position) - packed.origin
    if "falloff" in (records.dtype.names or ()):
        records["falloff"] = [light.falloff for light in scene.lights_with_position]
    if "edge" in (records.dtype.names or ()):
        records["edge"], records["slope"] = 3.0, STEEPEST_EDGE
    if scene.spots:
        cones = records[len(scene.lights) :]
        outer, inner = np.array([(spot.outer, spot.inner) for spot in scene.spots]).T
        # 1 - cos; and cos b - cos a as a product, which keeps the digits of narrow rims.
        rim = 2.0 * np.sin((outer + inner) / 2.0) * np.sin((outer - inner) / 2.0)
        cones["axis"], cones["edge"] = [spot.direction for spot in scene.spots], 2.0 * np.sin(outer / 2.0) ** 2
        cones["slope"] = 1.0 / np.maximum(rim, 1.0 / STEEPEST_EDGE)
        cones["edge"][(inner >= np.pi)] = 3.0  # a whole turn, with a hard edge: no edge at all
    return records


def _suns(packed: Packed) -> NDArray[np.void]:
    records = np.zeros(len(packed.scene.suns), layout.sun(packed.real))
    for i, sun in enumerate(packed.scene.suns):
        records["direction"][i], records["color"][i] = sun.direction, sun.color
    return records


def _spheres(packed: Packed) -> NDArray[np.void]:
    spheres = packed.scene.spheres
    records = np.zeros(len(spheres), layout.sphere(packed.real))
    records["given"] = np.column_stack([spheres.centers - packed.origin, spheres.radii])
    records["center"], records["radius"] = records["given"][:, :3], records["given"][:, 3]
    records["material"] = spheres.material_ids
    return records


def _corner_normals(packed: Packed) -> NDArray[Any]:
    """(s, 3, 3): the normals at the corners; an object without any has its face normals there."""
    records = np.repeat(packed.surfaces["normal"][:, None], 3, 1)
    return _of_corners(packed, [item.vertex_normals for item in packed.scene.objects], records)


def _of_corners(packed: Packed, given: Sequence[FloatArray | None], records: NDArray[Any]) -> NDArray[Any]:
    """records : (s, 3, k), filled with what objects have of each corner; those that have none keep what is there."""
    having = np.array([values is not None for values in given], np.bool_)
    if not having.any():
        return records
    owners = packed.surfaces["object"]
    rows = having[owners]
    counts = np.array([len(item) for item in packed.scene.objects], np.int64)
    absent = np.cumsum(np.where(having, 0, counts)) - np.where(having, 0, counts)  # triangles before each object without any
    values = in_a_row([values for values in given if values is not None], np.float64, records.shape[1:])
    records[rows] = values[packed.order[rows] - absent[owners[rows]]]
    return records


def _media(packed: Packed) -> NDArray[np.int32]:
    """What refraction.cl asks of objects: see there. Of objects around the eye the highest ranks are kept."""
    scene, rank, material = packed.scene, ranks(packed.scene), refracting_materials(packed.scene)
    around = around_eye(scene)[-MEDIA_DEPTH:]
    pairs = np.zeros((MEDIA_DEPTH, 2), np.int32)
    pairs[: len(around)] = [(i, material[i]) for i in around] or np.zeros((0, 2))
    meshes = np.count_nonzero(rank[: len(scene.objects)] >= 0)
    return np.concatenate([[meshes, len(around)], pairs.ravel(), rank]).astype(np.int32)


def _sample_range(packed: Packed) -> NDArray[np.int32]:
    """The first sample, the one behind the last, and no tiles: see sampling.cl."""
    return np.array([0, 1, 0], np.int32)


def _sample_sums(packed: Packed) -> NDArray[np.float64]:
    """(h, w, 3) of the samples so far."""
    camera = packed.scene.camera
    return np.zeros((camera.height, camera.width, 3))


def _corner_uvs(packed: Packed) -> FloatArray:
    """(s, 3, 2) float64, the texture coordinates of the corners; zero where a triangle has none."""
    return _of_corners(packed, [item.uvs for item in packed.scene.objects], np.zeros((packed.slots, 3, 2)))


def _absorption(packed: Packed) -> NDArray[Any]:
    """(objects + spheres, 3): the coefficients of each one's medium, 0 where it lets no light through."""
    materials = packed.scene.materials
    rows = [materials[i].absorb if i >= 0 else (0.0, 0.0, 0.0) for i in refracting_materials(packed.scene).tolist()]
    # No more than what a number holds: an infinite one would make a way of no length no number.
    bounded = np.minimum(np.array(rows).reshape(-1, 3), np.finfo(packed.real).max)
    return np.asarray(bounded, packed.real)


PACKERS: dict[str, Packer] = {
    "wide_nodes": arrays_wide.nodes, "wide_blocks": arrays_wide.blocks, "wide_roots": arrays_wide.roots,
    "placements": arrays_placed.placements, "object_origins": arrays_placed.object_origins, "object_tree": arrays_placed.object_tree,
    "emitters": emitters,
    "facet_albedos": arrays_rough.facet_albedos, "glass_albedos": arrays_rough.glass_albedos,
    "diffuse_shares": arrays_rough.diffuse_shares,
    "lights": _lights, "suns": _suns, "spheres": _spheres, "corner_normals": _corner_normals, "media": _media, "absorption": _absorption,
    "sample_range": _sample_range, "sample_sums": _sample_sums,
    "environment_cells": arrays_environment.cells, "environment_rows": arrays_environment.rows,
    "environment_columns": arrays_environment.columns,
    "textures": lambda packed: texels.records(packed.scene.textures, packed.real), "corner_uvs": _corner_uvs,
    "texels": lambda packed: texels.codes(packed.scene.textures),
    "texel_values": lambda packed: texels.values(packed.scene.textures, packed.real),
}  # fmt: skip
