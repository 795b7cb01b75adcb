"""Files that are written whole or not at all."""

from __future__ import annotations

import atexit
import contextlib
import errno
import os
import stat
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import BinaryIO

_unfinished: set[str] = set()
_folders: set[str] = set()  #: temporary ones, which go with the process


@contextlib.contextmanager
def atomic_write(path: str | PathLike[str]) -> Iterator[BinaryIO]:
    """A binary file to write to, which takes the name `path` only when the block ends without an exception.

    The bytes go to a hidden file in the same folder, which is then renamed; on any exception, Ctrl-C included, it is removed and a
    file of that name stays as it was. A link is followed. What is no regular file, such as /dev/stdout, is written to directly.

    Raises OSError; where writing itself fails, as on a full disk, with `path` in it.
    """
    target = _target(path)
    in_place = os.path.exists(target) and not os.path.isfile(target)
    part = target if in_place else os.path.join(os.path.dirname(target), f".clrt-{os.urandom(6).hex()}.part")
    try:
        # Not tempfile: the file gets the permissions that the user's umask gives, not 0600.
        with (
            contextlib.nullcontext() if in_place else _replacing(target, part),
            open(part, "wb" if in_place else "xb") as file,
        ):
            yield file
    except OSError as error:
        if error.errno is None or error.filename not in (None, part):
            raise
        raise OSError(error.errno, os.strerror(error.errno), os.fspath(path)) from error


def _target(path: str | PathLike[str]) -> str:
    """Where links lead, but not those to open pipes, as /dev/stdout may be one: a pipe has no path."""
    name = os.fspath(path)
    return os.path.realpath(name) if os.path.isfile(name) or not os.path.exists(name) else name


@contextlib.contextmanager
def _replacing(target: str, part: str) -> Iterator[None]:
    """Put the file `part` in the place of `target` when the block ends well; remove it in any case."""
    note_unfinished(part)
    try:
        yield
        if os.path.exists(target):
            os.chmod(part, stat.S_IMODE(os.stat(target).st_mode))
        os.replace(part, target)
    finally:
        discard(part)


def note_unfinished(part: str) -> None:
    """From now on, until `discard`, this file goes with the process, however that ends but by a crash."""
    _unfinished.add(part)


def discard(part: str) -> None:
    """Remove the file, if it is there."""
    with contextlib.suppress(OSError):
        os.unlink(part)
    _unfinished.discard(part)


def temporary_folder() -> str:
    """A new folder that goes when the process ends."""
    import tempfile  # slow to import, and seldom needed

    folder = tempfile.mkdtemp(prefix="clrt-")
    _folders.add(folder)
    return folder


@atexit.register
def discard_unfinished() -> None:
    """Remove what is being written, and temporary folders: for a process that is about to end without unwinding its stack."""
    for folder in tuple(_folders):
        import shutil  # slow to import, and seldom needed

        shutil.rmtree(folder, ignore_errors=True)
        _folders.discard(folder)
    for part in tuple(_unfinished):
        discard(part)


def check_writable(path: str | PathLike[str]) -> None:
    """Raise OSError, with the path in it, where `path` cannot be written: to be said before a long run, not after it."""
    name, target = os.fspath(path), Path(_target(path))
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, "this is a folder; give the name of a file", name)
    if not target.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, f"there is no folder {target.parent}", name)
    needed = target if target.exists() and not target.is_file() else target.parent
    if not os.access(needed, os.W_OK):
        raise PermissionError(errno.EACCES, f"no permission to write to {needed}", name)
