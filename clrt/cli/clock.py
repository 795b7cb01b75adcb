"""When the command began, for limits of time that count as the user sees it."""

from __future__ import annotations

import contextlib
import os
import time
from pathlib import Path

_begin: float | None = None


def begin() -> None:
    """This process runs the command and nothing else: its start is the command's. Call it from the main program alone."""
    global _begin
    _begin = time.perf_counter() - _age()


def begun() -> float:
    """time.perf_counter() at which the command began: now, where another program runs it."""
    return time.perf_counter() if _begin is None else _begin


def _age() -> float:
    """Seconds that this process has run, to a hundredth; 0 where the system does not tell as Linux does (man 5 proc: starttime)."""
    with contextlib.suppress(OSError, ValueError, IndexError, AttributeError):
        ticks = int(Path("/proc/self/stat").read_text().rpartition(")")[2].split()[19])
        return max(0.0, time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK"))
    return 0.0
