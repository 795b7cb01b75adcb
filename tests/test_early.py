"""PoCL's library is read once, before the scene is there, in the context that the program is compiled in; of that nothing is kept."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from clrt.device import context, early, kernel_cache, opencl
from clrt.device.context import POCL, Device

SCENE = "E 0 0 -1\nV 0 0 1\nF 45\nR 16 16\nL 5 5 -5\nM 1 0.5 0.2 0.2 0.8 0 1 0\nT -1 -1 2 1 -1 2 0 1 2\n"
_READ = "as the built-in lib"  #: what PoCL notes, with POCL_DEBUG, where it reads its library
_BUILT = "building program with options"


@pytest.fixture(autouse=True)
def _pocl(device: Device) -> None:
    if device.info.platform != POCL:
        pytest.skip("the default device is not PoCL's")


def _run(code: str, folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {kernel_cache.VARIABLE: str(folder / "pocl"), "XDG_CACHE_HOME": str(folder / "cache")} | more
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done


def test_context_is_open_before_anything_is_imported_and_is_the_one_that_is_used(tmp_path: Path) -> None:
    code = """
import sys
from clrt.device import context, early
begun = early.begin()
print({"numpy", "pyopencl", "pyopencl._cl"} & set(sys.modules))
device = context.open_device(None, begun)
((handle, opened),) = begun.items()
print(device.handle.int_ptr == handle, device.context.int_ptr == opened)
from clrt.device import program
program.build(device, "kernel void one(global int *x) { x[0] = 1; }")
print("pyopencl" in sys.modules)
"""
    assert _run(code, tmp_path).stdout.split() == ["set()", "True", "True", "False"]


def test_library_is_read_once_and_first(tmp_path: Path) -> None:
    (tmp_path / "scene.txt").write_text(SCENE)
    code = "import sys\nsys.argv = ['clrt', 'scene.txt', '-q']\nfrom clrt.cli.entry import main\nmain()"
    told = _run(code, tmp_path, POCL_DEBUG="llvm").stderr
    notes = re.findall(rf"{_READ}|{_BUILT}(?= -cl-std=CL1.2 -D_OPENCL_H_ -I)", told)
    assert notes.count(_READ) == 1
    assert len(notes) == 2  # the other is the program of the scene
    assert not [log for log in (tmp_path / "pocl").rglob("build.log") if early._SYMBOL in log.read_text()]
    again = _run(code, tmp_path, POCL_DEBUG="llvm").stderr
    assert _BUILT in again
    assert _READ not in again


def test_nothing_is_begun_where_a_program_is_compiled_already(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))
    monkeypatch.setattr(early, "_read_library", lambda *_: pytest.fail("something was begun"))
    (tmp_path / "AB" / "CDE").mkdir(parents=True)  # what a build that failed leaves
    assert kernel_cache.is_new(tmp_path)
    (tmp_path / "AB" / "CDE" / "program.bc").touch()
    kernel_cache.was_new.cache_clear()
    assert early.begin() == {}


@pytest.mark.parametrize("words", [["scene.txt"], ["scene.txt", "--no-cache"], ["nothing.txt"], ["render", "scene.txt"]])
def test_command_begins_with_the_device_where_a_scene_is_named_that_is_there(tmp_path: Path, words: list[str]) -> None:
    """Before the words are read: so not where they may say that nothing is kept."""
    (tmp_path / "scene.txt").write_text(SCENE)
    code = f"import sys\nsys.argv = {['clrt', *words, '-q']!r}\nfrom clrt.cli import entry\n"
    code += "import clrt.device.early as early\nearly.start = lambda: print('begun', sorted({'numpy', 'click'} & set(sys.modules)))\n"
    code += "entry.main()"
    environment = os.environ | {kernel_cache.VARIABLE: str(tmp_path / "pocl"), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.startswith("begun []") == (words == ["scene.txt"])
    assert (tmp_path / "scene.png").exists() == ("scene.txt" in words)


def test_device_opens_where_the_library_is_not_as_expected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))

    def other() -> None:
        raise AttributeError("clGetPlatformIDs")

    monkeypatch.setattr(opencl, "functions", other)
    assert early.open_device().info == context.open_device().info


def test_what_a_failure_leaves_goes_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))
    logs = {"AB/ONE": "cannot find symbol wanted", "CD/TWO": "cannot find symbol wanted", "EF/THREE": "another fault"}
    for folder, text in logs.items():
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "build.log").write_text(text)
    (tmp_path / "CD" / "TWO" / "program.bc").touch()
    kernel_cache.remove_failed("wanted")
    assert sorted(str(log.parent.relative_to(tmp_path)) for log in tmp_path.rglob("build.log")) == ["CD/TWO", "EF/THREE"]
    assert not (tmp_path / "AB").exists()
