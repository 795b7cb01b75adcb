"""PoCL's cache of compiled kernels: a folder of clrt's own, and what to do when an entry in it is broken.

PoCL trusts its cache: an entry that was cut off (a full disk, a machine that went down) crashes each later process that loads it,
without a word. So a mark stands in the folder while a program is loaded and launched for the first time; a mark left by a
process that is gone means that it died there, and the folder is emptied before anything is loaded again. A process that Ctrl-C
ends takes its mark along: PoCL renames whole files, so what it was compiling is missing, not broken.
"""

from __future__ import annotations

import os
import re
import stat
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from clrt.files import discard, note_unfinished, temporary_folder

VARIABLE = "POCL_CACHE_DIR"
_lock = threading.Lock()
_loading = 0  #: threads that are in `loading`
_LEFT_S = 3600.0  #: seconds after which a temporary file of PoCL's is left over
_ROOM = 16 << 20  #: bytes that a few programs and their kernels take; libraries raise errors of their own where a disk is full
_MARK = "clrt-loading-"
_COMPILED = "clrt-compiled-"
_PART = re.compile(r"tempfile_\w{6}\.(cl|preproc\.cl|so|so\.o)")  #: what PoCL's compiler is at work on
#: entries of PoCL, and notes of them; POCL_CACHE_DIR may name a folder with files of the user's
_POCLS = re.compile(rf"[A-P]{{2}}|tempfile_\w+|{_COMPILED}\w+")


def choose_folder() -> Path:
    """The folder that PoCL will use, made if need be; to be called before pyopencl is imported.

    POCL_CACHE_DIR where it is set; else `clrt/pocl` in the user's cache folder, or, where that cannot be written or is full, in a
    temporary one that all processes of the user share. In that case XDG_CACHE_HOME becomes the temporary one, too:
    pyopencl cannot be imported where it cannot keep files of its own.
    """
    home = _home()
    if not (_writable(home / "clrt" / "pocl") and _writable(home / "pytools") and _roomy(home)):
        home = _temporary_home()
        os.environ["XDG_CACHE_HOME"] = str(home)
    if not os.environ.get(VARIABLE):
        os.environ[VARIABLE] = str(home / "clrt" / "pocl")
    folder = Path(os.environ[VARIABLE])
    if _writable(folder):
        _sweep(folder)
    return folder


def is_new(folder: Path) -> bool:
    """Whether PoCL has compiled nothing into this folder yet."""
    try:
        # A build that failed, as that which has PoCL read its library does, leaves a folder without a program.
        return folder.is_dir() and not any(folder.glob("[A-P][A-P]/*/program.bc"))
    except OSError:
        return False


@cache
def was_new(folder: Path) -> bool:
    """Whether it was new when this process first asked."""
    return is_new(folder)


def remove_failed(word: str) -> None:
    """Removes what PoCL notes about programs that it could not build for a reason with this word in it."""
    for log in Path(os.environ.get(VARIABLE, "")).glob("??/*/build.log"):
        with suppress(OSError, UnicodeDecodeError):
            if word in log.read_text() and not (log.parent / "program.bc").exists():
                log.unlink()
                log.parent.rmdir()
                log.parent.parent.rmdir()


def _sweep(folder: Path) -> None:
    """Removes what PoCL leaves behind: an empty file a process, more at Ctrl-C; those of the last hour may be in use."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith("tempfile_"):
                with suppress(OSError):
                    found = entry.stat(follow_symlinks=False)
                    left = not found.st_size or _PART.fullmatch(entry.name)
                    if left and stat.S_ISREG(found.st_mode) and found.st_mtime < time.time() - _LEFT_S:
                        os.unlink(entry.path)


def use_temporary_folder() -> None:
    """Has PoCL keep its kernels in a folder that goes when the process ends; to be called before pyopencl is imported."""
    os.environ[VARIABLE] = temporary_folder()


def own_folder(name: str) -> Path:
    """A folder of clrt's in the user's cache folder, which need not be there; to be called after `choose_folder`."""
    return _home() / "clrt" / name


def _home() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))


def unwritable_folder() -> str | None:
    """What is wrong where PoCL cannot write to POCL_CACHE_DIR, and so has no device, or compiles nothing."""
    folder = os.environ.get(VARIABLE)
    if not folder or _writable(Path(folder)):
        return None
    return f"PoCL cannot write to {VARIABLE}={folder}; name another folder there, or unset it"


def _temporary_home() -> Path:
    """The user's own folder for temporary caches: libraries are loaded from it, so it is never one that somebody else made."""
    shared = Path(_temporary()) / f"clrt-{os.getuid()}"
    with suppress(OSError):
        shared.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = shared.lstat()
        if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022:
            return shared
    return Path(temporary_folder())


def _temporary() -> str:
    import tempfile  # slow to import, and seldom needed

    return tempfile.gettempdir()


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _roomy(folder: Path) -> bool:
    """Whether the disk has room for what is kept, and the user may fill it: a quota shows only as one writes."""
    trial = folder / f".clrt-{os.urandom(6).hex()}.part"
    try:
        disk = os.statvfs(folder)
        if disk.f_bavail * disk.f_frsize < _ROOM:
            return False
        with open(trial, "xb") as file:
            trial.unlink()
            file.write(bytes(1 << 16))
    except OSError:
        return False
    return True


def clear() -> None:
    """Removes what PoCL made in its folder; what cannot be removed stays, and so does whatever else lies there."""
    folder = Path(os.environ.get(VARIABLE, ""))
    if VARIABLE in os.environ and folder.is_dir():
        for entry in folder.iterdir():
            if not _POCLS.fullmatch(entry.name) or entry.is_symlink():
                continue
            if entry.is_dir():
                import shutil  # slow to import, and seldom needed

                shutil.rmtree(entry, ignore_errors=True)
            else:
                with suppress(OSError):
                    entry.unlink()


def clear_if_one_died() -> bool:
    """Empties the folder if a process died while it loaded from it and no other is loading now; whether it did."""
    folder = Path(os.environ.get(VARIABLE, ""))
    if VARIABLE not in os.environ or not folder.is_dir():
        return False
    marks = list(folder.glob(f"{_MARK}*"))
    dead = [mark for mark in marks if not _alive(mark.name.removeprefix(_MARK))]
    if not dead or len(dead) < len(marks):
        return False
    clear()
    for mark in dead:
        mark.unlink(missing_ok=True)
    return True


def compiled_note(name: str) -> Path:
    """The file that notes that the program of this name is compiled, kernels and all; it goes when the cache is emptied."""
    return Path(os.environ.get(VARIABLE) or _temporary()) / f"{_COMPILED}{name}"


def suspect() -> None:
    """An entry is broken: the folder is emptied as if a process had died, once no other process is loading from it."""
    with suppress(OSError):
        Path(os.environ.get(VARIABLE) or _temporary(), f"{_MARK}0").touch()


def _alive(process: str) -> bool:
    return process.isdigit() and Path("/proc", process).exists()


def _mark(process: int) -> str:
    return str(Path(os.environ.get(VARIABLE) or _temporary()) / f"{_MARK}{process}")


@contextmanager
def helped_by(process: int) -> Iterator[None]:
    """While another process compiles for this one: it ends with this one, or is ended, and its mark says nothing of the cache then."""
    mark = _mark(process)
    note_unfinished(mark)
    try:
        yield
    finally:
        discard(mark)


@contextmanager
def loading() -> Iterator[None]:
    """While programs are loaded and launched for the first time: leaves a mark behind if the process dies in it; in any thread."""
    global _loading
    with _lock:
        if not _loading:
            clear_if_one_died()
        _loading += 1
        mark = _mark(os.getpid())
        note_unfinished(mark)
        with suppress(OSError):
            Path(mark).touch()
    try:
        yield
    finally:
        with _lock:
            _loading -= 1
            if not _loading:
                discard(mark)
