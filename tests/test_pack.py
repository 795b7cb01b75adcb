"""Scenes of many objects as the device has them: each triangle's own numbers, and work that hardly grows with the number of objects."""

from __future__ import annotations

import cProfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

from clrt.device import pack, prepare, program
from clrt.device.context import Device
from clrt.device.effect_arrays import PACKERS
from clrt.device.layout import triangle
from clrt.device.packed import Packed
from clrt.features import Features
from clrt.kdtree import build_tree
from clrt.precision import rung
from clrt.renderer import build_trees, fill_buffers
from clrt.scene.boxes import boxes_of
from clrt.scene.build import parse_scene
from clrt.scene.model import FloatArray, Instance, MeshObject, Scene
from clrt.scene.placed import object_origins


def silent(phase: str, fraction: float) -> None:
    """No progress."""


def unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def objects(counts: list[int], seed: int) -> tuple[MeshObject, ...]:
    """Objects of so many triangles, far from each other; every other one with normals at its corners, every third with coordinates."""
    random = np.random.default_rng(seed)
    made, first = [], 0
    for i, count in enumerate(counts):
        vertices = random.normal(0.0, 1.0, (count, 3, 3)) + random.uniform(-50.0, 50.0, 3)
        made.append(MeshObject(
            vertices, unit(random.normal(size=(count, 3))), random.integers(0, 2, count).astype(np.int32), first,
            vertex_normals=unit(random.normal(size=(count, 3, 3))) if i % 2 else None,
            uvs=random.random((count, 3, 2)) if i % 3 == 0 else None, name=f"object {i}",
        ))  # fmt: skip
        first += count
    return tuple(made)


def scene_of(items: tuple[MeshObject, ...], instances: tuple[Instance, ...] = ()) -> Scene:
    given = parse_scene("E 0 0 -100\nV 0 0 1\nF 60\nR 16 16\nM 1 1 1 0 1 0 1 0\nT 0 0 1 1 0 1 0 1 1\n")
    return replace(given, objects=items, instances=instances, materials=given.materials * 2)


def packed_of(scene: Scene, method: str = "sah") -> Packed:
    origins = pack.tree_origins(scene)
    trees = [build_tree(item.vertices - origin, method) for item, origin in zip(scene.objects, origins, strict=True)]
    return pack.pack(scene, trees, Features.of(scene), rung("fast"))


@pytest.mark.parametrize("counts", [[40], [0], [], [5, 0, 130, 1, 33, 2], [1] * 50])
def test_every_slot_has_the_numbers_of_its_triangle(counts: list[int]) -> None:
    scene = scene_of(objects(counts, seed=3))
    packed = packed_of(scene)
    assert sorted(packed.prim_ids.tolist()) == list(range(sum(counts)))
    corner_normals, corner_uvs = PACKERS["corner_normals"](packed), PACKERS["corner_uvs"](packed)
    for slot, prim in enumerate(packed.prim_ids.tolist()):
        number = next(i for i, item in enumerate(scene.objects) if item.first_prim <= prim < item.first_prim + len(item))
        item, record = scene.objects[number], packed.surfaces[slot]
        k = prim - item.first_prim
        a, b, c = item.vertices[k]
        np.testing.assert_array_equal(packed.vertices[slot], item.vertices[k])
        assert (record["prim"], record["object"], record["material"]) == (prim, number, item.material_ids[k])
        np.testing.assert_allclose(record["geometric"], unit(np.cross(b - a, c - a)), atol=1e-6)
        np.testing.assert_array_equal(record["normal"], item.normals[k].astype(np.float32))
        corners = item.normals[k] if item.vertex_normals is None else item.vertex_normals[k]
        np.testing.assert_array_equal(corner_normals[slot], np.broadcast_to(corners.astype(np.float32), (3, 3)))
        np.testing.assert_array_equal(corner_uvs[slot], np.zeros((3, 2)) if item.uvs is None else item.uvs[k])


def test_objects_have_their_boxes_and_reach() -> None:
    scene = scene_of(objects([5, 0, 130, 1], seed=4))
    packed = packed_of(scene, "median")
    for item, record, order in zip(scene.objects, packed.objects, packed.orders, strict=True):
        assert sorted(order.tolist()) == list(range(len(item)))
        points = (item.vertices - packed.origin).reshape(-1, 3)
        if len(points):
            np.testing.assert_allclose([record["lo"], record["hi"]], [points.min(0), points.max(0)], rtol=1e-6)
        assert record["extent"] >= np.abs(points).sum(1).max(initial=0.0)
        for a, b, c in item.vertices:
            assert record["extent"] >= np.abs(points).sum(1).max() + max(np.abs(e).sum() for e in (b - a, c - b, a - c)) * (1 - 1e-12)


def test_boxes_of_objects_hold_their_triangles_small_or_large() -> None:
    items = objects([3, 0, 1001, 1000, 7], seed=5)
    lo, hi = boxes_of(items)
    for i, item in enumerate(items):
        points = item.vertices.reshape(-1, 3) if len(item) else np.zeros((1, 3))
        np.testing.assert_array_equal([lo[i], hi[i]], [points.min(0), points.max(0)])


def test_blocks_stay_within_their_objects() -> None:
    counts = [5, 0, 130, 1, 33]
    packed = packed_of(scene_of(objects(counts, seed=6)))
    owners = packed.surfaces["object"]
    first, size = packed.blocks.T
    assert (owners[first] == owners[first + size - 1]).all()
    np.testing.assert_array_equal(first, np.cumsum(size) - size)
    assert size.sum() == sum(counts)


def calls(run: Callable[[], Any]) -> int:
    """How many functions are called, those of NumPy counted."""
    profile = cProfile.Profile()
    profile.runcall(run)
    return sum(entry.callcount for entry in profile.getstats())


def test_each_object_more_costs_few_calls(device: Device) -> None:
    taken = []
    for count in (100, 400, 800):  # the first imports
        items = tuple(replace(item, vertex_normals=None, uvs=None) for item in objects([4] * count, seed=7))
        prepared = build_trees(scene_of(items), "median", silent)
        prepared = replace(prepared, scene=replace(prepared.scene, source="again"))  # nothing is known of its boxes
        taken.append(calls(partial(fill_buffers, prepared, Features.of(prepared.scene), rung("fast"), device)))
    assert (taken[2] - taken[1]) / 400 < 80  # mostly of `len`; packing tree by tree took 250


def test_normals_are_computed_once(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[int] = []
    compute = pack.unit_normals
    monkeypatch.setattr(pack, "unit_normals", lambda vertices: (found.append(len(vertices)), compute(vertices))[1])
    scene = scene_of(objects([4, 9, 30], seed=8))
    fill_buffers(build_trees(scene, "sah", silent), Features.of(scene), rung("fast"), device)
    assert found == [43]


@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_objects_with_origins_of_their_own_are_prepared_at_once(device: Device, monkeypatch: pytest.MonkeyPatch, every: bool) -> None:
    launched: list[int] = []
    launch = prepare._Launches._launch

    def counted(self: Any, what: np.int32, items: int, *rest: Any, **options: Any) -> None:
        launched.append(items)
        launch(self, what, items, *rest, **options)

    monkeypatch.setattr(prepare._Launches, "_launch", counted)
    items = tuple(replace(item, hidden=True, vertex_normals=None, uvs=None) for item in objects([7, 3] * 40, seed=9))
    shown = objects([12], seed=10)[0]
    placed = tuple(Instance(i, np.eye(3, 4)) for i in range(len(items)))
    scene = scene_of((*items, replace(shown, vertex_normals=None, uvs=None, first_prim=400)), placed)
    features = Features.of(scene).with_every() if every else Features.of(scene)
    buffers, source, _ = fill_buffers(build_trees(scene, "sah", silent), features, rung("fast"), device)
    prepare.prepare(buffers, program.build(device, source))
    assert launched == [412, 412]  # triangles, planes of the eye
    records = np.zeros(412, triangle(np.float32))
    cl.enqueue_copy(device.queue, records, buffers.triangles)
    origins = object_origins(scene, pack.local_origin(scene))
    assert len(np.unique(origins, axis=0)) == 81
    relative = buffers.packed.vertices - origins[buffers.packed.surfaces["object"]][:, None]
    np.testing.assert_array_equal(records["v0"], relative[:, 0].astype(np.float32))
    np.testing.assert_allclose(records["e1"], relative[:, 1] - relative[:, 0], rtol=1e-5, atol=1e-6)
