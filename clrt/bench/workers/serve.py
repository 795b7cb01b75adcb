"""What all of these processes do: read lines, run, answer with the seconds that it took.

    load NAME FILE     rays (n, 6) float32, or (n, 7) with lengths: only whether anything is nearer    -> their number
    run NAME           trace them                                                                      -> seconds, processor seconds
    build              the search structure anew                                                       -> seconds, processor seconds
    hits NAME          trace them                                                                      -> how many meet anything
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


class Tracer:
    """A peer: `build` a structure, `prepare` rays in its own form, `trace` them to whatever it gives, `met` counts what was met."""

    version = ""

    def build(self) -> None:
        raise NotImplementedError

    def prepare(self, rays: Floats) -> Any:
        raise NotImplementedError

    def trace(self, prepared: Any) -> Any:
        raise NotImplementedError

    def met(self, traced: Any) -> int:
        raise NotImplementedError


def serve(make: Callable[[Floats, int], Tracer]) -> None:
    """Answer standard input until it ends. The first line out is the version; what libraries print goes to standard error."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    tracer = make(np.load(sys.argv[1]), int(sys.argv[2]))
    tracer.build()
    rays: dict[str, Any] = {}
    _say(out, tracer.version)
    for line in sys.stdin:
        what, *words = line.split()
        if what == "load":
            given = np.load(words[1])
            rays[words[0]] = tracer.prepare(given)
            _say(out, len(given))
        elif what == "hits":
            _say(out, tracer.met(tracer.trace(rays[words[0]])))
        else:
            _say(out, *_timed(tracer.build if what == "build" else partial(tracer.trace, rays[words[0]])))


def _timed(run: Callable[[], object]) -> tuple[float, float]:
    cpu, wall = time.process_time(), time.perf_counter()
    run()
    return time.perf_counter() - wall, time.process_time() - cpu


def _say(out: TextIO, *words: object) -> None:
    print(*words, file=out, flush=True)
