"""Where the program starts, and PoCL with it. Until it is loaded, Ctrl-C ends it at once; then interrupt.py takes over."""

from __future__ import annotations

import gc
import os
import signal
import sys
from types import FrameType
from typing import NoReturn


def main() -> None:
    """The console script and `python -m clrt`."""
    # NumPy's linear algebra starts a thread a core, which spins through the first 0.1 s; nothing here multiplies large matrices.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # The collector of cycles would look through all modules some twenty times while they are imported.
    gc.set_threshold(100_000)
    # Two threads take turns at Python: one that waits for it after each call into NumPy would else wait 5 ms each time.
    sys.setswitchinterval(2e-4)
    asked = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # else the caller had it ignored, as for background jobs
    if asked:
        signal.signal(signal.SIGINT, _leave)
    from clrt.cli import streams

    streams.hold_descriptors()
    if _renders(sys.argv[1:]):
        from clrt.device import early

        early.start()
    from clrt.cli.main import main as run

    if asked:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    run()


def _renders(words: list[str]) -> bool:
    """Whether a scene will surely be rendered, on what is kept: a file is named, with a suffix, which no command has."""
    return bool(words) and "." in words[0] and os.path.isfile(words[0]) and "--no-cache" not in words


def _leave(number: int, frame: FrameType | None) -> NoReturn:
    try:
        os.write(2, b"clrt: interrupted\n")
    finally:
        os._exit(128 + number)
