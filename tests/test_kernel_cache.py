"""A broken entry of PoCL's cache costs at most one run, and says so or heals itself."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import pytest

from clrt.device import kernel_cache
from clrt.device.context import POCL, list_devices

SCENE = "E 0 0 -1\nV 0 0 1\nF 45\nR 16 16\nL 5 5 -5\nM 1 0.5 0.2 0.2 0.8 0 1 0\nT -1 -1 2 1 -1 2 0 1 2\n"


def _render(folder: Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {kernel_cache.VARIABLE: str(folder / "cache")}
    command = [sys.executable, "-m", "clrt", str(folder / "scene.txt"), "-o", str(folder / "picture.ppm"), "--quiet"]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene, its picture, and the cache that it left."""
    folder = tmp_path_factory.mktemp("rendered")
    (folder / "scene.txt").write_text(SCENE)
    assert _render(folder).returncode == 0
    return folder


@pytest.mark.parametrize(
    ("damaged", "size"),
    [("render.so", 3000), ("program.bc", 0), pytest.param("render.so", 0, marks=pytest.mark.slow),
     pytest.param("program.bc", 3000, marks=pytest.mark.slow)],
)  # fmt: skip
def test_broken_entry_is_dropped_at_the_latest_by_the_next_run(tmp_path: Path, rendered: Path, damaged: str, size: int) -> None:
    if list_devices()[0].platform != POCL:
        pytest.skip("the default device is not PoCL's")
    shutil.copytree(rendered, tmp_path, dirs_exist_ok=True)
    good = (tmp_path / "picture.ppm").read_bytes()
    files = [f for f in (tmp_path / "cache").rglob(damaged) if f.stat().st_size > 3000]
    assert files, "the cache is laid out in another way than this test knows"
    for file in files:
        os.truncate(file, size)
    (tmp_path / "picture.ppm").unlink()
    if _render(tmp_path).returncode != 0:  # a broken library kills the process that loads it
        assert _render(tmp_path).returncode == 0
    assert (tmp_path / "picture.ppm").read_bytes() == good
    assert not list((tmp_path / "cache").glob("clrt-loading-*"))


def test_mark_of_a_dead_process_empties_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))
    (tmp_path / "AB").mkdir()
    (tmp_path / "AB" / "render.so").write_bytes(b"cut off")
    (tmp_path / "clrt-loading-999999999").touch()
    with kernel_cache.loading():
        assert [p.name for p in tmp_path.iterdir()] == [f"clrt-loading-{os.getpid()}"]
    assert not list(tmp_path.iterdir())


def test_only_what_pocl_made_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))
    for name in ("AB", "mine", "OPUS"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").touch()
    for name in ("tempfile_0FDQes", "thesis.tex", "clrt-loading-999999999"):
        (tmp_path / name).touch()
    (tmp_path / "CD").symlink_to(tmp_path / "mine")
    assert kernel_cache.clear_if_one_died()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["CD", "OPUS", "mine", "thesis.tex"]
    assert (tmp_path / "mine" / "file").exists()


def test_folder_stays_while_another_process_loads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))
    (tmp_path / "AB").mkdir()
    (tmp_path / "clrt-loading-999999999").touch()
    (tmp_path / f"clrt-loading-{os.getppid()}").touch()
    with kernel_cache.loading():
        assert (tmp_path / "AB").is_dir()


def test_folder_is_the_users_or_a_temporary_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(kernel_cache.VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "mine"))
    assert kernel_cache.choose_folder() == tmp_path / "mine" / "clrt" / "pocl"
    monkeypatch.delenv(kernel_cache.VARIABLE)
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path / "temporary"))
    assert str(kernel_cache.choose_folder()).startswith(str(tmp_path / "temporary"))
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path / "chosen"))
    assert kernel_cache.choose_folder() == tmp_path / "chosen"


def test_full_disk_calls_for_a_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told = list(os.statvfs(tmp_path))
    told[4] = (1 << 20) // told[1]  # free blocks that the user may fill, bytes a block
    monkeypatch.setattr(os, "statvfs", lambda folder: os.statvfs_result(told))
    monkeypatch.delenv(kernel_cache.VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "mine"))
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path / "temporary"))
    assert str(kernel_cache.choose_folder()).startswith(str(tmp_path / "temporary"))


@pytest.mark.parametrize("end", ["interrupt.leave()", "sys.exit()"])
def test_temporary_folder_goes_with_the_process(tmp_path: Path, end: str) -> None:
    program = "import os, sys\nfrom clrt.cli import interrupt\nfrom clrt.device import kernel_cache\n"
    program += f"kernel_cache.use_temporary_folder()\nprint(os.path.isdir(os.environ['{kernel_cache.VARIABLE}']), flush=True)\n{end}\n"
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("True\n", "")
    assert not list(tmp_path.iterdir())


def test_temporary_folder_that_is_not_the_users_alone_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(kernel_cache.VARIABLE, raising=False)
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    planted = tmp_path / f"clrt-{os.getuid()}"
    planted.mkdir()
    planted.chmod(0o777)
    chosen = kernel_cache.choose_folder()
    assert tmp_path in chosen.parents
    assert planted not in chosen.parents
    assert not list(planted.iterdir())


@pytest.mark.parametrize("variable", ["HOME", "XDG_CACHE_HOME"])
def test_unwritable_cache_folder_is_no_obstacle(tmp_path: Path, variable: str) -> None:
    # A folder below a file can be made by nobody, not even by root.
    (tmp_path / "file").write_text("no folder")
    unset = {kernel_cache.VARIABLE, "XDG_CACHE_HOME"}
    environment = {k: v for k, v in os.environ.items() if k not in unset} | {variable: str(tmp_path / "file"), "TMPDIR": str(tmp_path)}
    command = [sys.executable, "-m", "clrt", "devices"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / f"clrt-{os.getuid()}" / "clrt" / "pocl").is_dir()


def test_unwritable_folder_of_the_variable_is_named(tmp_path: Path) -> None:
    if any(d.platform != POCL for d in list_devices()):
        pytest.skip("another platform has a device without this folder")
    (tmp_path / "file").write_text("no folder")
    folder = tmp_path / "file" / "cache"
    command = [sys.executable, "-m", "clrt", "devices"]
    done = subprocess.run(command, env=os.environ | {kernel_cache.VARIABLE: str(folder)}, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert f"PoCL cannot write to POCL_CACHE_DIR={folder}" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_files_that_pocl_left_go_after_an_hour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))
    old = (("tempfile_old001", 0), ("tempfile_full01", 5), ("tempfile_a1B2c3.so.o", 5), ("tempfile_a1B2c3.preproc.cl", 0), ("notes", 0))
    for name, size, age in (*((name, size, 4000) for name, size in old), ("tempfile_new001", 0, 10), ("tempfile_d4E5f6.so", 5, 10)):
        (tmp_path / name).write_bytes(bytes(size))
        os.utime(tmp_path / name, (time.time() - age,) * 2)
    kernel_cache.choose_folder()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["notes", "tempfile_d4E5f6.so", "tempfile_full01", "tempfile_new001"]


def test_mark_stays_while_any_thread_loads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))
    mark = tmp_path / f"clrt-loading-{os.getpid()}"
    with kernel_cache.loading():
        thread = threading.Thread(target=_load_nothing)
        thread.start()
        thread.join()
        assert mark.exists()
    assert not mark.exists()


@pytest.mark.parametrize(
    "end", ["interrupt.leave()", "threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()\ncompile()", "sys.exit(130)"]
)
def test_mark_goes_with_a_process_that_ctrl_c_ends(tmp_path: Path, end: str) -> None:
    """Whether the main thread ends the process while another one loads, or is itself in a call that no signal ends."""
    program = "import hashlib, os, signal, sys, threading\nfrom clrt.cli import interrupt\nfrom clrt.device import kernel_cache\n"
    program += "inside = threading.Event()\ndef compile():\n    with kernel_cache.loading():\n        inside.set()\n"
    program += "        hashlib.pbkdf2_hmac('sha512', b'x', b'y', 60_000_000)\n"
    program += "interrupt.watch()\nthreading.Thread(target=compile, daemon=True).start()\ninside.wait()\n"
    program += f"print(len(os.listdir(os.environ['{kernel_cache.VARIABLE}'])), flush=True)\n"
    program += "try:\n    " + end.replace("\n", "\n    ") + "\nexcept KeyboardInterrupt:\n    interrupt.leave()\n"
    environment = os.environ | {kernel_cache.VARIABLE: str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False, timeout=600)
    assert (done.returncode, done.stdout) == (130, "1\n")
    assert not list(tmp_path.iterdir())


def _load_nothing() -> None:
    with kernel_cache.loading():
        pass


def test_cache_folder_that_is_a_file_is_named_in_the_error(tmp_path: Path) -> None:
    (tmp_path / "scene.txt").write_text("E 0 0 -3\nV 0 0 1\nF 40\nR 8 8\nM 1 1 1 0.1 0.9 0.3 20 0\nT -1 -1 0 1 -1 0 0 1 0\n")
    (tmp_path / "file").touch()
    given = {**os.environ, "POCL_CACHE_DIR": str(tmp_path / "file")}
    told = subprocess.run([sys.executable, "-m", "clrt", "scene.txt"], cwd=tmp_path, env=given, capture_output=True, text=True, check=False)
    assert told.returncode == 2
    assert "cannot write to POCL_CACHE_DIR=" in told.stderr
    assert not (tmp_path / "scene.png").exists()
