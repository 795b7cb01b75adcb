"""PoCL's library is read once, before the scene is there, in the context that the program is compiled in; of that nothing is kept."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from clrt.device import context, early, kernel_cache
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


def test_context_is_open_before_pyopencl_is_imported_and_is_the_one_that_is_used(tmp_path: Path) -> None:
    code = """
import sys
from clrt.device import context, early, program
begun = early.begin()
print("pyopencl" in sys.modules, "pyopencl._cl" in sys.modules)
device = context.open_device(None, begun)
(opened,) = begun.values()
print(device.context is opened, device.queue.context == opened)
program.build(device, "kernel void one(global int *x) { x[0] = 1; }")
"""
    assert _run(code, tmp_path).stdout.split() == ["False", "True", "True", "True"]


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
    monkeypatch.setattr(early, "_extension", lambda: pytest.fail("something was begun"))
    (tmp_path / "AB").mkdir()
    assert early.begin() == {}


def test_device_opens_where_the_extension_is_not_as_expected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))

    def other() -> None:
        raise AttributeError("get_platforms")

    monkeypatch.setattr(early, "_extension", other)
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
