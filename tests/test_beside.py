"""Another process compiles kernels into the cache; without it, or where it is late, pictures are the same and nothing is left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from clrt.device import beside, kernel_cache
from clrt.device.context import POCL, Device

SCENE = "E 0 0 -1\nV 0 0 1\nF 45\nR 16 16\nL 5 5 -5\nM 1 0.5 0.2 0.2 0.8 0 1 0\nT -1 -1 2 1 -1 2 0 1 2\n"
HEAD = """
import os, sys
from clrt.device import ahead, beside, kernel_cache
beside.spare_core = lambda: True
"""
COMMAND = "sys.argv = ['clrt', 'scene.txt', '-q']\nfrom clrt.cli.entry import main\nmain()\n"


@pytest.fixture(autouse=True)
def _pocl(device: Device) -> None:
    if device.info.platform != POCL or not hasattr(os, "posix_spawn"):
        pytest.skip("the default device is not PoCL's, or processes cannot be started")


def run(code: str, folder: Path) -> str:
    (folder / "scene.txt").write_text(SCENE)
    environment = os.environ | {kernel_cache.VARIABLE: str(folder / "pocl"), "XDG_CACHE_HOME": str(folder / "cache")}
    done = subprocess.run([sys.executable, "-c", HEAD + code], cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def kernels(folder: Path) -> list[str]:
    return sorted(file.name for file in (folder / "pocl").rglob("*.so"))


def marks(folder: Path) -> list[Path]:
    return list((folder / "pocl").glob(f"{kernel_cache._MARK}*"))


def test_kernels_are_compiled_by_the_other_process_alone(tmp_path: Path) -> None:
    code = """
from clrt.device import program
from clrt.device.context import open_device
source = "kernel void render(global int *x) { x[0] = 1; }\\nkernel void prepare(global int *x) { x[0] = 2; }\\n"
kernel_cache.choose_folder()
beside._PATIENCE_S = 60
device = open_device()
with beside.Helper(device.info.name, True) as helper:
    program.build(device, source)
    helper.compile(source, {"prepare": ((64,), (64,))})
"""
    run(code, tmp_path)
    assert kernels(tmp_path) == ["prepare.so"]
    assert marks(tmp_path) == []


@pytest.mark.parametrize("change", ["", "beside._PATIENCE_S = -1", "sys.executable = '/nowhere'", "beside._CODE = 'no python: {path}'"])
def test_picture_is_the_same_however_the_other_process_fares(tmp_path: Path, change: str) -> None:
    telling = "started = beside._start\nbeside._start = lambda device: (print('begun', flush=True), started(device))[1]\n"
    told = run(f"{change}\n{telling}{COMMAND}", tmp_path)
    assert told == "begun\n"
    assert kernels(tmp_path) == ["prepare.so", "render.so"]
    assert marks(tmp_path) == []
    first = (tmp_path / "scene.png").read_bytes()
    again = run(f"beside._start = lambda device: print('begun', flush=True)\n{COMMAND}", tmp_path)
    assert again == ""  # what is in the cache needs nobody
    assert (tmp_path / "scene.png").read_bytes() == first


def test_no_process_where_none_is_wanted_or_no_core_is_spare(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(beside, "_start", lambda device: pytest.fail("a process was begun"))
    monkeypatch.setattr(beside, "spare_core", lambda: False)
    with beside.Helper("any", True) as helper:
        helper.compile("", {})
    monkeypatch.setattr(beside, "spare_core", lambda: True)
    with beside.Helper("any", False) as helper:
        helper.compile("", {})


@pytest.mark.parametrize(("told", "cores", "spare"), [("0 0 0 1/99 7", 2, True), ("0 0 0 3/99 7", 2, True), ("0 0 0 4/99 7", 2, False),
                                                      ("0 0 0 1/99 7", 1, False), ("", 2, True), (None, 2, True)])  # fmt: skip
def test_core_is_spare_where_few_things_run(monkeypatch: pytest.MonkeyPatch, told: str | None, cores: int, spare: bool) -> None:
    def read(path: Path) -> str:
        assert str(path) == "/proc/loadavg"
        if told is None:
            raise FileNotFoundError(path)
        return told

    monkeypatch.setattr(Path, "read_text", read)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(cores)), raising=False)
    assert beside.spare_core() == spare


def test_pictures_of_a_program_start_no_process(tmp_path: Path) -> None:
    """Who calls clrt as a library has not asked for one."""
    code = "import clrt\nbeside._start = lambda device: print('begun')\nclrt.render('scene.txt')\n"
    assert run(code, tmp_path) == ""


def test_process_ends_with_the_one_it_works_for(tmp_path: Path) -> None:
    code = HEAD + "process, pipe = beside._start('any')\nprint(process, flush=True)\nsys.stdin.read()\n"
    environment = os.environ | {kernel_cache.VARIABLE: str(tmp_path / "pocl"), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    owner = subprocess.Popen([sys.executable, "-c", code], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert owner.stdout is not None
    process = Path("/proc", owner.stdout.readline().strip())
    assert process.exists()
    owner.send_signal(signal.SIGKILL)
    owner.communicate()
    end = time.monotonic() + 10
    while process.exists() and time.monotonic() < end:
        time.sleep(0.01)
    assert not process.exists()
