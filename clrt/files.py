"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import BinaryIO

_unfinished: set[str] = set()


@contextlib.contextmanager
def atomic_write(path: str | PathLike[str]) -> Iterator[BinaryIO]:
    """A binary file to write to, which takes the name `path` only when the block ends without an exception.

    The bytes go to a hidden file in the same folder, which is then renamed; on any exception, Ctrl-C included, it is removed and a
    file of that name stays as it was. A link is followed. What is no regular file, such as /dev/stdout, is written to directly.

    Raises OSError, always with `path` in it.
    """
    target = os.path.realpath(path)
    try:
        if os.path.exists(target) and not os.path.isfile(target):
            with open(target, "wb") as file:
                yield file
        else:
            with _beside(target) as file:
                yield file
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, os.strerror(error.errno), os.fspath(path)) from error


@contextlib.contextmanager
def _beside(target: str) -> Iterator[BinaryIO]:
    """A new file in the folder of `target` that replaces it when the block ends well."""
    part = os.path.join(os.path.dirname(target), f".clrt-{secrets.token_hex(6)}.part")
    _unfinished.add(part)
    try:
        # Mode "x" and not tempfile: the file gets the permissions that the user's umask gives, not 0600.
        with open(part, "xb") as file:
            yield file
        if os.path.exists(target):
            shutil.copymode(target, part)
        os.replace(part, target)
    finally:
        discard(part)


def discard(part: str) -> None:
    """Remove an unfinished file, if it is still there."""
    with contextlib.suppress(OSError):
        os.unlink(part)
    _unfinished.discard(part)


def discard_unfinished() -> None:
    """Remove what is being written: for a process that is about to end without unwinding its stack."""
    for part in tuple(_unfinished):
        discard(part)


def check_writable(path: str | PathLike[str]) -> None:
    """Raise OSError, with the path in it, where `path` cannot be written: said before a long run, not after it."""
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(21, "is a folder, not a file", os.fspath(path))
    if not target.parent.is_dir():
        raise FileNotFoundError(2, f"there is no folder {os.fspath(Path(path).parent)}", os.fspath(path))
    needed = target if target.exists() and not target.is_file() else target.parent
    if not os.access(needed, os.W_OK):
        raise PermissionError(13, "no permission to write there", os.fspath(path))
