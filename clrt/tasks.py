"""Work that another core does meanwhile."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from typing_extensions import Self

T = TypeVar("T")


class Task(Generic[T]):
    """A call that runs in a thread of its own from now on. It pays where the call waits, or is long in a library that lets Python go on.

    The thread does not keep the program from ending.
    """

    def __init__(self, call: Callable[[], T]) -> None:
        self._call = call
        self._value: list[T] = []
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="clrt-task", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        if hasattr(signal, "pthread_sigmask"):
            # Ctrl-C is the main thread's: a compiler that it interrupts while it reads a file says that there is an error.
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._value.append(self._call())
        except BaseException as error:
            self._error = error

    def result(self) -> T:
        """What the call gave, waited for; raises what it raised."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._value[0]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Nothing goes on behind the back of who handles an error; who interrupts does not wait."""
        if isinstance(error, Exception):
            self._thread.join()
