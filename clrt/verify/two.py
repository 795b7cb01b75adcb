"""The catalogue by two processes: compilers, which take most of its time, use one core each.

This process takes cases from the first on, the other one from the last on, until they meet: neighbours share programs.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict
from queue import SimpleQueue
from typing import Any

from clrt.files import discard_unfinished
from clrt.machine import cores
from clrt.tasks import Task
from clrt.verify.case import Case, Context, Outcome, Result
from clrt.verify.run import Progress, chosen, run, run_case

WORTH = 8  #: cases from which on a second process pays, which takes half a second to start
_SETTINGS = ("rays", "full", "seed", "device", "rungs")


def run_in_two(cases: Sequence[Case], context: Context, progress: Progress | None = None) -> list[Result]:
    """As `run`, in half the time where there are two cores. A case that the other process cannot finish is run in this one."""
    if len(cases) < WORTH or cores() < 2:
        return run(cases, context, progress)
    left, results = deque(cases), dict[int, Result]()

    def here() -> None:
        for case in _taken(left.popleft):
            if progress is not None:
                progress(f"case {case.number}: {case.title}", len(results) / len(cases))
            results[case.number] = run_case(case, context)

    with _Other(context) as other:
        there = Task(lambda: other.take(left, results))
        here()
        there.result()
    here()
    if progress is not None:
        progress("done", 1.0)
    return [results[case.number] for case in cases]


def _taken(take: Callable[[], Case]) -> Iterator[Case]:
    """The cases that two threads take from one list, until there is none."""
    with suppress(IndexError):
        while True:
            yield take()


class _Other:
    """A process that is told numbers of cases, a line each, and answers each with a line of JSON; it ends with its standard input."""

    def __init__(self, context: Context) -> None:
        settings = json.dumps({name: getattr(context, name) for name in _SETTINGS})
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__, settings], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )

    def take(self, left: deque[Case], results: dict[int, Result]) -> None:
        """Has cases run from the end of `left` on; one that it dies of goes back there."""
        for case in _taken(left.pop):
            try:
                results[case.number] = self._asked(case)
            except (OSError, ValueError, LookupError):
                left.append(case)
                return

    def _asked(self, case: Case) -> Result:
        """Raises OSError, ValueError or LookupError where there is no right answer."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{case.number}\n")
        answer = json.loads(self._process.stdout.readline())
        outcome = None if answer["outcome"] is None else Outcome(**answer["outcome"])
        return Result(case, outcome, answer["seconds"], answer["error"])

    def __enter__(self) -> _Other:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Who is interrupted does not wait."""
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        if kind is None:
            self._process.wait()


def main() -> None:
    """The other process: ends, whatever it is at, as soon as its standard input does; so Ctrl-C need not reach it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    settings: dict[str, Any] = json.loads(sys.argv[1])
    context = Context(**{**settings, "rungs": tuple(settings["rungs"])})
    numbers: SimpleQueue[int] = SimpleQueue()
    threading.Thread(target=_read, args=(numbers,), daemon=True).start()
    while True:
        result = run_case(chosen([numbers.get()])[0], context)
        outcome = None if result.outcome is None else asdict(result.outcome)
        print(json.dumps({"outcome": outcome, "seconds": result.seconds, "error": result.error}, default=int), flush=True)


def _read(numbers: SimpleQueue[int]) -> None:
    for line in sys.stdin:
        numbers.put(int(line))
    discard_unfinished()
    os._exit(0)


if __name__ == "__main__":
    main()
