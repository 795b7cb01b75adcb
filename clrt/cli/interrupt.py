"""Ctrl-C ends the program within a second, even inside a long call into a library.

Python raises KeyboardInterrupt only between its own instructions, so a call into OpenCL delays it until the call returns. The interpreter's
C-level signal handler writes to a pipe at once; a thread waits at the pipe and, where the main thread has not ended the program
after a grace time, removes unfinished files and ends the process.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import NoReturn

from clrt.cli import streams
from clrt.files import discard_unfinished

EXIT_CODE = 130  #: 128 + SIGINT, what a shell reports for an interrupted program

_GRACE_S = 0.6  #: for the orderly way; with the time to notice well under a second
_SHOW_CURSOR = "\x1b[?25h"  # ANSI; the progress display hides it
_advice: Callable[[], str] = str  #: what more to say, asked at that time


def advise(advice: Callable[[], str]) -> None:
    """What `message` is to end with; "" for nothing."""
    global _advice
    _advice = advice


def message() -> str:
    """The one line that is said of Ctrl-C."""
    advice = _advice()
    return f"clrt: interrupted{'; ' if advice else ''}{advice}\n"


def watch() -> None:
    """Start the thread. Call it from the main thread."""
    sys.unraisablehook = _unraisable
    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)
    signal.set_wakeup_fd(write_end, warn_on_full_buffer=False)
    threading.Thread(target=_wait, args=(read_end,), name="clrt-interrupt", daemon=True).start()


def leave() -> NoReturn:
    """End the process now. Not by way of the interpreter's tidying, which waits for kernels that still run."""
    streams.settle()
    discard_unfinished()
    os._exit(EXIT_CODE)


def _unraisable(fault: sys.UnraisableHookArgs) -> None:
    """Ctrl-C in a callback of the interpreter's own, as there are many in imports, is lost there with a traceback; the thread ends the
    program all the same."""
    if not issubclass(fault.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(fault)


def _wait(read_end: int) -> None:
    while signal.SIGINT not in os.read(read_end, 16):
        pass
    time.sleep(_GRACE_S)
    discard_unfinished()
    try:
        os.write(2, f"{_SHOW_CURSOR if streams.is_terminal(sys.stderr) else ''}{message()}".encode())
    finally:
        os._exit(EXIT_CODE)
