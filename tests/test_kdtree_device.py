"""Trees that the device builds: those of the NumPy builder to the bit, however they are cut into pieces."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kdtree_meshes import F64, MESHES, lattice, needles, soup, sphere

import clrt
from clrt.device import kernel_cache, opencl, program
from clrt.device.context import POCL, Device
from clrt.errors import ClrtError, LimitError
from clrt.forest import build, choose, machine, pool, subtrees, top
from clrt.forest.machine import Machine, Store, compiled_before
from clrt.forest.ticker import LARGE
from clrt.kdtree import KdTree, build_tree, default_max_depth
from clrt.scene.build import load_scene

ARRAYS = ("lo", "hi", "split_axis", "split_pos", "child", "count", "indices", "depth", "builder")
SCENES = Path(__file__).parents[1] / "scenes"
FILLED = sorted(set(MESHES) - {"none"})


def forest(device: Device, meshes: list[F64], limit: int | None = None, **more: Callable[[float], None]) -> list[KdTree]:
    """Trees of meshes by the device, all at once."""
    counts = np.array([len(mesh) for mesh in meshes])
    limits = np.array([default_max_depth(len(mesh)) if limit is None else limit for mesh in meshes])
    return build.build_forest(Machine.of(device), np.ascontiguousarray(np.concatenate(meshes)), counts, limits, **more)


def assert_same(found: KdTree, expected: KdTree) -> None:
    assert [name for name in ARRAYS if not np.array_equal(getattr(found, name), getattr(expected, name))] == []


@pytest.mark.parametrize("mesh", FILLED)
def test_tree_of_any_mesh_is_that_of_numpy_and_proved_right(mesh: str, device: Device) -> None:
    vertices = MESHES[mesh]()
    (tree,) = forest(device, [vertices])
    assert tree.built_on == "device"
    assert_same(tree, build_tree(vertices))
    tree.validate(vertices, max_depth=default_max_depth(len(vertices)))


@pytest.mark.parametrize(("large", "chunk"), [(9, 7), (100, 64), (700, 1000)])
@pytest.mark.parametrize("mesh", FILLED)
def test_levels_and_chunks_of_any_size_give_the_same_tree(
    mesh: str, large: int, chunk: int, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(top, "LARGE", large)
    monkeypatch.setattr(top, "_CHUNK", chunk)
    vertices = MESHES[mesh]()
    assert_same(forest(device, [vertices])[0], build_tree(vertices))


def test_large_mesh_takes_levels_and_subtrees_as_they_come(device: Device) -> None:
    vertices = sphere(100)
    assert len(vertices) > 4 * LARGE
    assert_same(forest(device, [vertices])[0], build_tree(vertices))


@pytest.mark.parametrize("workers", [1, 2, 7])
def test_any_number_of_workers_gives_the_same_trees(workers: int, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(top, "LARGE", 50)
    monkeypatch.setattr(Machine, "workers", workers)
    assert_same(forest(device, [sphere()])[0], build_tree(sphere()))


def test_trees_built_together_are_those_built_alone(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(top, "LARGE", 300)
    meshes = [soup(1), sphere(), soup(40), lattice(), np.ones((50, 3, 3)), sphere(30) * 1e-20, needles(), soup(2, seed=4)]
    for tree, vertices in zip(forest(device, meshes), meshes, strict=True):
        assert_same(tree, build_tree(vertices))


@pytest.mark.parametrize("large", [20, 4096])
@pytest.mark.parametrize("limit", [0, 1, 5, 60])
def test_depth_limit_is_kept(limit: int, large: int, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(top, "LARGE", large)
    vertices = soup(2000, 0.05)
    (tree,) = forest(device, [vertices], limit)
    assert tree.depth <= limit
    assert_same(tree, build_tree(vertices, max_depth=limit))


def test_memory_that_is_too_small_at_first_grows_until_it_holds_the_tree(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[int] = []
    launch = subtrees.SubtreeBuilder._launch

    def spied(self: subtrees.SubtreeBuilder, table: subtrees.Words, cells: np.ndarray, store: Store, size: int, room: np.ndarray):  # type: ignore[no-untyped-def]
        sizes.append(size)
        return launch(self, table, cells, store, size, room // 8 if len(sizes) == 1 else room)

    monkeypatch.setattr(subtrees, "_ROOM", 1)
    monkeypatch.setattr(subtrees, "_SPARE", 0)
    monkeypatch.setattr(top, "LARGE", 200)
    monkeypatch.setattr(subtrees.SubtreeBuilder, "_launch", spied)
    vertices = soup(1500, 0.2)
    assert_same(forest(device, [vertices])[0], build_tree(vertices))
    assert len(sizes) > 3
    assert sizes[-1] > sizes[0]


def test_pool_that_holds_little_is_emptied_in_between(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    flushes: list[int] = []
    flush = pool.Pool.flush

    def spied(self: pool.Pool) -> None:
        flushes.append(self.used)
        flush(self)

    monkeypatch.setattr(build, "_POOL", 100)
    monkeypatch.setattr(pool, "_BATCH", 150)
    monkeypatch.setattr(top, "LARGE", 60)
    monkeypatch.setattr(pool.Pool, "flush", spied)
    meshes = [sphere(), soup(1000, 0.05)]
    for tree, vertices in zip(forest(device, meshes), meshes, strict=True):
        assert_same(tree, build_tree(vertices))
    assert sum(used > 0 for used in flushes) > 2


def test_progress_rises_to_one_and_can_end_the_build(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(top, "LARGE", 100)
    seen: list[float] = []
    forest(device, [sphere()], progress=seen.append)
    assert len(seen) > 3
    assert seen == sorted(seen)
    assert seen[-1] == 1.0

    def interrupt(fraction: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        forest(device, [sphere()], progress=interrupt)
    assert_same(forest(device, [sphere()])[0], build_tree(sphere()))


def test_input_is_not_changed(device: Device) -> None:
    vertices = soup()
    before = vertices.copy()
    forest(device, [vertices])
    assert np.array_equal(vertices, before)


def choice(device: Device | None, meshes: list[F64], builder: str = "sah") -> list[str]:
    """What built the trees, which are those of NumPy for meshes moved to their origins."""
    origins = np.arange(3.0 * len(meshes)).reshape(-1, 3)
    trees, seconds = choose.build_trees(meshes, origins, builder, device)
    for tree, mesh, origin in zip(trees, meshes, origins, strict=True):
        assert_same(tree, build_tree(mesh - origin, builder))
    assert len(seconds) == len(meshes)
    return [tree.built_on for tree in trees]


def test_environment_chooses_who_builds(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    meshes = [soup(30), np.zeros((0, 3, 3)), soup(9)]
    monkeypatch.setenv(choose.VARIABLE, "device")
    assert choice(device, meshes) == ["device", "numpy", "device"]
    assert choice(device, meshes, "median") == ["numpy"] * 3
    assert choice(None, meshes) == ["numpy"] * 3
    monkeypatch.setenv(choose.VARIABLE, "numpy")
    assert choice(device, meshes) == ["numpy"] * 3
    monkeypatch.setenv(choose.VARIABLE, "gpu")
    with pytest.raises(ClrtError, match="CLRT_TREES=gpu is not known; use one of auto, numpy, device"):
        choice(device, meshes)


@pytest.mark.parametrize("compiled", [False, True])
def test_size_decides_by_itself(compiled: bool, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(choose.VARIABLE, raising=False)
    monkeypatch.setattr(machine, "compiled_before", lambda device: compiled)
    assert not choose.on_device("sah", [choose.READY_FROM // 2], device)
    assert choose.on_device("sah", [10, choose.READY_FROM], device) == compiled
    assert choose.on_device("sah", [12] * (choose.READY_FROM // 100), device) == compiled
    assert choose.on_device("sah", [choose.FRESH_FROM], device)
    assert not choose.on_device("median", [choose.FRESH_FROM], device)
    assert not choose.on_device("sah", [0] * choose.FRESH_FROM, device)


def test_numpy_builds_with_a_note_where_the_device_fails(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise LimitError("there is too little memory")

    monkeypatch.setenv(choose.VARIABLE, "device")
    monkeypatch.setattr(Machine, "empty", fail)
    with pytest.warns(RuntimeWarning, match="built by NumPy, since the device could not: there is too little memory"):
        assert choice(device, [soup(30)]) == ["numpy"]


def test_error_of_opencl_is_told_as_one_of_the_device(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    import pyopencl as cl

    def fail(*_: object) -> None:
        raise cl.MemoryError("enqueue", -4, "")

    monkeypatch.setenv(choose.VARIABLE, "device")
    monkeypatch.setattr(Machine, "run", fail)
    with pytest.warns(RuntimeWarning, match="built by NumPy, since the device could not: .* failed"):
        assert choice(device, [soup(30)]) == ["numpy"]


def test_faulty_triangles_are_refused_alike(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(choose.VARIABLE, "device")
    vertices = soup(10)
    vertices[7, 2, 1] = np.nan
    with pytest.raises(clrt.MeshError, match="triangle 7 of 10"):
        choose.build_trees([soup(5), vertices], np.zeros((2, 3)), "sah", device)


def test_compiled_program_is_noted_until_the_cache_is_emptied(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))
    monkeypatch.setattr(machine, "_ready", set())
    assert not compiled_before(device)
    monkeypatch.setattr(top, "LARGE", 100)
    build.build_forest(Machine(device), sphere(), np.array([len(sphere())]), np.array([20]))
    assert compiled_before(device)
    kernel_cache.clear()
    assert compiled_before(device)  # this process has it still
    machine._ready.clear()  # as another process finds it
    assert not compiled_before(device)


def test_note_is_of_all_that_decides_what_is_in_the_cache(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """PoCL's cache may be shared: with another version of clrt or of PoCL, another environment, other options."""
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))
    notes = [machine._note(device)]
    kernels = tmp_path / "kernels"
    shutil.copytree(str(program.kernel_folder()), kernels)
    (kernels / "builtins.cl").write_text((kernels / "builtins.cl").read_text() + "// one more\n")
    others = {
        "builtins": lambda m: m.setattr(program, "kernel_folder", lambda: kernels),
        "options": lambda m: m.setenv("PYOPENCL_BUILD_OPTIONS", "-DOTHER"),
        "what PoCL is asked": lambda m: m.setenv("POCL_WORK_GROUP_METHOD", "cbs"),
        "another environment": lambda m: m.setattr(opencl, "extension_file", lambda: tmp_path / "pyopencl" / "_cl.so"),
    }
    for other in others.values():
        with monkeypatch.context() as context:
            other(context)
            notes.append(machine._note(device))
    notes.append(machine._note(replace(device, info=replace(device.info, driver="another PoCL"))))
    if device.info.platform != POCL:
        del notes[1]  # other compilers read their own header
    assert len(set(notes)) == len(notes)
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path / "elsewhere"))
    assert machine._note(device).name == notes[0].name


def test_pictures_and_figures_tell_the_same_but_for_who_built(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene(SCENES / "shadow.txt")
    found = {}
    for way in ("numpy", "device"):
        monkeypatch.setenv(choose.VARIABLE, way)
        image = clrt.render(scene, size=(40, 30))
        assert image.stats is not None
        assert {item["built_on"] for item in image.stats.to_json()["objects"]} == {way}
        found[way] = image.pixels
    assert np.array_equal(found["numpy"], found["device"])
