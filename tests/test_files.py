"""Files are written whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

import pytest

from clrt.files import atomic_write, check_writable, discard_unfinished


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def test_atomic_write_new_file_appears_only_at_the_end(tmp_path: Path) -> None:
    target = tmp_path / "a.bin"
    with atomic_write(target) as file:
        file.write(b"x" * 100_000)
        assert not target.exists()
    assert target.read_bytes() == b"x" * 100_000
    assert names(tmp_path) == ["a.bin"]


def stop_halfway(file: BinaryIO, error: type[BaseException]) -> None:
    file.write(b"new")
    raise error


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_atomic_write_any_exception_leaves_the_old_file(tmp_path: Path, error: type[BaseException]) -> None:
    target = tmp_path / "a.bin"
    target.write_bytes(b"old")
    with pytest.raises(error), atomic_write(target) as file:
        stop_halfway(file, error)
    assert target.read_bytes() == b"old"
    assert names(tmp_path) == ["a.bin"]


def test_atomic_write_full_disk_names_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", no_space)
    with pytest.raises(OSError, match=r"No space left on device: '.*a\.bin'") as caught, atomic_write(tmp_path / "a.bin") as file:
        file.write(b"new")
    assert caught.value.errno == errno.ENOSPC
    assert names(tmp_path) == []


def test_atomic_write_device_that_is_full_names_it() -> None:
    if not os.path.exists("/dev/full"):
        pytest.skip("no /dev/full here")
    with pytest.raises(OSError, match="/dev/full") as caught, atomic_write("/dev/full") as file:
        file.write(b"x")
    assert caught.value.errno == errno.ENOSPC
    assert stat.S_ISCHR(os.stat("/dev/full").st_mode)


def test_atomic_write_foreign_oserror_keeps_its_own_file(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as caught, atomic_write(tmp_path / "a.bin"):
        (tmp_path / "other").read_bytes()
    assert os.fspath(caught.value.filename) == str(tmp_path / "other")


def test_atomic_write_missing_folder_names_the_target(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as caught, atomic_write(tmp_path / "no" / "a.bin"):
        pass
    assert caught.value.filename == str(tmp_path / "no" / "a.bin")


def test_atomic_write_permissions_follow_umask_and_an_old_file(tmp_path: Path) -> None:
    old_umask = os.umask(0o027)
    try:
        with atomic_write(tmp_path / "new"):
            pass
        (tmp_path / "old").touch()
        (tmp_path / "old").chmod(0o604)
        with atomic_write(tmp_path / "old"):
            pass
    finally:
        os.umask(old_umask)
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o640
    assert stat.S_IMODE((tmp_path / "old").stat().st_mode) == 0o604


def test_atomic_write_follows_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").write_bytes(b"old")
    (tmp_path / "link").symlink_to("real")
    with atomic_write(tmp_path / "link") as file:
        file.write(b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_bytes() == b"new"


def test_discard_unfinished_removes_what_is_being_written(tmp_path: Path) -> None:
    with contextlib.suppress(FileNotFoundError), atomic_write(tmp_path / "a.bin") as file:  # its file has gone at the end
        file.write(b"x")
        assert len(names(tmp_path)) == 1
        discard_unfinished()
        assert names(tmp_path) == []
    assert names(tmp_path) == []


def test_check_writable_folder_missing_folder_and_no_permission(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        check_writable(tmp_path)
    with pytest.raises(FileNotFoundError, match="no folder"):
        check_writable(tmp_path / "no" / "a.png")
    check_writable(tmp_path / "a.png")
    assert names(tmp_path) == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_check_writable_without_permission_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(PermissionError, match="no permission"):
        check_writable(tmp_path / "a.png")


@pytest.mark.skipif(not os.path.isdir("/dev/fd"), reason="the system has no /dev/fd")
def test_pipe_that_has_no_path_is_written_to() -> None:
    reader, writer = os.pipe()
    try:
        path = f"/dev/fd/{writer}"
        check_writable(path)
        with atomic_write(path) as file:
            file.write(b"figures")
        assert os.read(reader, 100) == b"figures"
    finally:
        os.close(reader)
        os.close(writer)
