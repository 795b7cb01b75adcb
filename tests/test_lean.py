"""Programs without OpenCL's header: all kernels do without it, pictures are the same to the bit, and what needs it is compiled with it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt import renderer
from clrt.device import kernel_cache, lean, program
from clrt.device.context import POCL, Device
from clrt.errors import DeviceError
from clrt.features import Features
from clrt.forest import machine
from clrt.precision import rung
from clrt.scene.build import load_scene

SCENES = Path(__file__).parents[1] / "scenes"
_SHAPE = program.Shape(24, 2, block=16)
_attempts = lean.attempts


@pytest.fixture
def pocl(device: Device) -> Device:
    if device.info.platform != POCL:
        pytest.skip("the default device is not PoCL's")
    return device


def _without_header(folder: Path, source: str, *, pocl: bool) -> Iterator[tuple[str, tuple[str, ...]]]:
    """The first attempt alone."""
    yield next(_attempts(folder, source, pocl=pocl))


def _with_header(folder: Path, source: str, *, pocl: bool) -> Iterator[tuple[str, tuple[str, ...]]]:
    """The attempts of a device that is not PoCL's."""
    return _attempts(folder, source, pocl=False)


@pytest.mark.parametrize(
    ("ladder", "lanes", "entry"),
    [("exact", 1, "cast"), *(pytest.param(*case, marks=pytest.mark.slow) for case in (
        ("watertight", 16, "render"), ("fast", 1, "render"), ("fast", 4, "render"), ("exact", 8, "render"), ("double", 8, "render"),
        ("double", 1, "cast")))],
)  # fmt: skip
def test_program_of_all_effects_compiles_without_the_header(
    ladder: str, lanes: int, entry: str, pocl: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lean, "attempts", _without_header)
    features = Features(()) if entry == "cast" else Features(()).with_every()
    shape = replace(_SHAPE, block=8 if ladder == "double" else 16) if entry == "cast" else replace(_SHAPE, block=0)
    program.build(pocl, program.compose(features, rung(ladder), lanes, shape, counting=entry == "render", entry=entry))


def test_program_that_builds_trees_compiles_without_the_header(pocl: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lean, "attempts", _without_header)
    program.build(pocl, machine.source())


def _picture(name: str) -> NDArray[np.float32]:
    return renderer.render(load_scene(SCENES / f"{name}.txt"), size=(64, 48), samples=2 if name == "gloss" else None).pixels


@pytest.mark.parametrize(
    "name", ["phong", pytest.param("gloss", marks=pytest.mark.slow), pytest.param("normalmap", marks=pytest.mark.slow)]
)
@pytest.mark.usefixtures("pocl")
def test_picture_is_the_same_with_the_header(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lean, "attempts", _without_header)
    without = _picture(name)
    monkeypatch.setattr(lean, "attempts", _with_header)
    np.testing.assert_array_equal(_picture(name), without)
    assert np.ptp(without) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["phong", "gloss", "normalmap", "lens"])
@pytest.mark.usefixtures("pocl")
def test_code_is_the_same_with_the_header(name: str, tmp_path: Path) -> None:
    """Byte for byte what PoCL keeps of the program before it compiles kernels, but for the name of a temporary file."""
    code = """
import sys
from clrt.device import lean, program
from clrt.device.context import open_device
from clrt.features import Features
from clrt.precision import rung
from clrt.scene.build import load_scene
if sys.argv[2] == "full":
    attempts = lean.attempts
    lean.attempts = lambda folder, source, *, pocl: attempts(folder, source, pocl=False)
features, ladder = Features.of(load_scene(sys.argv[1])), rung("watertight")
program.build(open_device(), program.compose(features, ladder, 16, program.Shape(24, 2)))
"""
    kept = []
    for way in ("full", "lean"):  # names of one length: they are in the code
        environment = os.environ | {kernel_cache.VARIABLE: str(tmp_path / way)}
        subprocess.run([sys.executable, "-c", code, str(SCENES / f"{name}.txt"), way], env=environment, check=True)
        (file,) = (tmp_path / way).rglob("program.bc")
        kept.append(np.frombuffer(file.read_bytes(), np.uint8))
    assert len(kept[0]) == len(kept[1]) > 20_000
    assert np.count_nonzero(kept[0] != kept[1]) < 64


def test_function_that_is_not_declared_is_compiled_with_the_header(pocl: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    suspected: list[bool] = []
    monkeypatch.setattr(kernel_cache, "suspect", lambda: suspected.append(True))
    import pyopencl as cl

    built = program.build(pocl, "kernel void longest(global float *x) { x[0] = hypot(x[0], x[1]); }")
    numbers = np.array([3.0, 4.0], np.float32)
    buffer = cl.Buffer(pocl.context, cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=numbers)
    cl.Kernel(built, "longest")(pocl.queue, (1,), (1,), buffer)
    cl.enqueue_copy(pocl.queue, numbers, buffer)
    assert numbers[0] == 5.0
    assert suspected == []


def test_fault_of_a_program_is_told(pocl: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_cache, "suspect", lambda: None)  # which would empty the cache of the other tests
    with pytest.raises(DeviceError, match=r"nothing"):
        program.build(pocl, "kernel void wrong(global int *x) { x[0] = nothing; }")


def test_other_platforms_compile_what_they_are_given() -> None:
    assert next(_attempts(program.kernel_folder(), "kernel void k() {}", pocl=False)) == ("kernel void k() {}", ())
