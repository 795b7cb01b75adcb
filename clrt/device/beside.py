"""Another process that compiles kernels for this one, into PoCL's cache, where this one then finds them.

It is begun while the program is compiled, opens the device for itself, finds the program in the cache, launches kernels over nothing, and
ends. Where it fails or is late, nothing is lost but its time: whoever launches a kernel that is not in the cache compiles it. It ends
with the process that it works for.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import sys
import time
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from clrt.device import kernel_cache
from clrt.tasks import Task

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self

    from clrt.device.ahead import Sizes

_CODE = "import sys; sys.path[:] = {path!r}; from clrt.device import beside; beside.serve({parent}, {device!r})"
_END_WITH_PARENT = 1  #: PR_SET_PDEATHSIG, man 2 prctl
_PATIENCE_S = 0.1  #: about what it takes to compile what it has not compiled by then


class Helper:
    """The process, for the length of a block: begun where `wanted`, the device is PoCL's and there is a core to spare."""

    def __init__(self, device: str, wanted: bool) -> None:
        self._block = ExitStack()
        self._process = self._pipe = None
        if wanted and spare_core():
            with suppress(OSError, AttributeError):
                self._process, self._pipe = _start(device)

    def compile(self, source: str, sizes: Sizes) -> None:
        """Has it compile kernels of a program that is in the cache; to be called once at most."""
        if self._process is not None and self._pipe is not None:
            self._block.enter_context(kernel_cache.helped_by(self._process))
            Task(partial(_give, self._pipe, json.dumps([source, sizes]).encode()))  # a pipe holds less than a program
            self._pipe = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Waits for it, or ends it where it is late or was given nothing to do."""
        if self._process is None:
            return
        late = time.monotonic() + _PATIENCE_S if self._pipe is None else 0.0
        with self._block, suppress(OSError):
            while os.waitpid(self._process, os.WNOHANG) == (0, 0):
                if time.monotonic() > late:
                    os.kill(self._process, signal.SIGKILL)
                    os.waitpid(self._process, 0)
                    break
                time.sleep(0.002)
        if self._pipe is not None:
            os.close(self._pipe)


def spare_core() -> bool:
    """Whether a core of those that this process may use waits for work, or soon will: building trees takes less time than compiling."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    running = cores
    with suppress(OSError, ValueError, IndexError):
        running = int(Path("/proc/loadavg").read_text().split()[3].partition("/")[0])  # man 5 proc: entities that run now
    return cores > 1 and running <= cores + 1


def _start(device: str) -> tuple[int, int]:
    """The process, and the pipe that it reads. Raises OSError."""
    code = _CODE.format(path=sys.path, parent=os.getpid(), device=device)
    # It heeds no variables of Python's, but does with compiled modules as this process.
    bytecode = ["-B"] * sys.dont_write_bytecode + ["-X", f"pycache_prefix={sys.pycache_prefix}"] * bool(sys.pycache_prefix)
    read, write = os.pipe()
    silent = [(os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_WRONLY, 0) for number in (1, 2)]
    try:
        words = [sys.executable, "-I", *bytecode, "-c", code]
        return os.posix_spawn(sys.executable, words, os.environ, file_actions=[(os.POSIX_SPAWN_DUP2, read, 0), *silent]), write
    except OSError:
        os.close(write)
        raise
    finally:
        os.close(read)


def _give(pipe: int, task: bytes) -> None:
    with suppress(OSError), open(pipe, "wb") as file:
        file.write(task)


def serve(parent: int, name: str) -> None:
    """What the process does."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_END_WITH_PARENT, signal.SIGKILL)
    if os.getppid() == parent:
        from clrt.device import ahead, program
        from clrt.device.context import open_device

        device = open_device(name)
        source, sizes = json.load(sys.stdin.buffer)
        ahead.launch(device, program.build(device, source), source, {kernel: (tuple(a), tuple(b)) for kernel, (a, b) in sizes.items()})
    os._exit(0)  # freeing what a compiler has in memory takes a while
