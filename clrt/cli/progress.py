"""A progress bar on standard error, for a person who waits."""

from __future__ import annotations

import sys
import threading
import time
from types import TracebackType
from typing import TYPE_CHECKING

from clrt.cli import streams

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.live import Live

_PATIENCE_S = 1.0  #: what is done sooner shows nothing
_READY_S, _READY_AT_ONCE_S = 0.5, 0.1  #: what is done sooner does not even import what draws: of all, and of a phase that is shown at once

_WORDS = {
    "read": "reading the scene", "trees": "building the trees", "compile": "compiling the kernels", "render": "rendering",
    "count": "counting rays and tests", "write": "writing the picture", "convert": "converting", "make": "making",
    "explain": "composing without each effect", "measure": "measuring each effect",
}  # fmt: skip
_AT_ONCE = {"compile"}


class PhaseProgress:
    """A context manager to be called with (phase, fraction 0 to 1). Shows nothing where standard error is no terminal.

    The display is drawn by a thread of its own several times a second, so that a phase that reports only its start is seen to run.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._live: Live | None = None
        self._lock = threading.Lock()
        self._timers: list[threading.Timer] = []
        self._quiet = quiet
        self._phase = ""
        self._fraction = 0.0
        self._start = self._phase_start = time.monotonic()

    def __call__(self, phase: str, fraction: float) -> None:
        if phase != self._phase:
            self._phase, self._phase_start = phase, time.monotonic()
            if phase in _AT_ONCE and self._timers:
                self._show_in(_READY_AT_ONCE_S)
        self._fraction = min(max(fraction, 0.0), 1.0)

    def say(self, text: str) -> None:
        """A line that stays, on standard error."""
        if self._live is not None:
            self._live.console.print(text, highlight=False, markup=False)
        elif not self._quiet:
            streams.complain(text + "\n")

    def __enter__(self) -> PhaseProgress:
        if not self._quiet and streams.is_terminal(sys.stderr):
            self._show_in(_READY_S)
        return self

    def _show_in(self, seconds: float) -> None:
        timer = threading.Timer(seconds, self._show)
        timer.daemon = True
        self._timers.append(timer)
        timer.start()

    def _show(self) -> None:
        """Start to draw, unless all is done by now."""
        from rich.console import Console
        from rich.live import Live

        with self._lock:
            if self._timers and self._live is None:
                self._live = Live(console=Console(stderr=True), get_renderable=self._draw, transient=True, refresh_per_second=8)
                self._live.start()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        with self._lock:
            for timer in self._timers:
                timer.cancel()
            self._timers = []
            if self._live is not None:
                self._live.stop()

    def _draw(self) -> RenderableType:
        """One line: a status while no fraction is known, else a bar, per cent and what remains. No line in the first second."""
        from rich.console import Group
        from rich.progress_bar import ProgressBar
        from rich.table import Table

        now = time.monotonic()
        elapsed = now - self._phase_start
        if not self._phase or (now - self._start < _PATIENCE_S and self._phase not in _AT_ONCE):
            return Group()
        words = _WORDS.get(self._phase, self._phase)
        line = Table.grid(padding=(0, 1))
        if self._fraction > 0.0:
            left = elapsed * (1.0 - self._fraction) / self._fraction
            bar = ProgressBar(total=1.0, completed=self._fraction, width=32)
            line.add_row(words, bar, f"{self._fraction:4.0%}", f"{left:.0f} s left")
        else:
            bar = ProgressBar(total=None, pulse=True, width=32)
            line.add_row(words, bar, f"{elapsed:.0f} s")
        return line
