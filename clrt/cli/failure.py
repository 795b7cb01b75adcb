"""What went wrong, as text on standard error and an exit code.

    0    done
    1    a fault of clrt: the traceback, and a line that asks for a report
    2    something the user can mend: one line, no traceback
    130  interrupted

With CLRT_DEBUG=1 in the environment every failure shows its traceback.
"""

from __future__ import annotations

import errno
import os
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import click

from clrt.cli import interrupt, streams
from clrt.errors import ClrtError, SceneError

FAULT = 1
USER = 2
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EIO}  #: files say their names, so without one it is the stream that click writes its help to


def report(error: BaseException) -> int:
    """Print `error` and return the exit code."""
    # click turns KeyboardInterrupt into Abort, and EOFError, too, which would be a fault.
    if isinstance(error, KeyboardInterrupt | click.Abort) and not isinstance(error.__cause__, EOFError):
        streams.complain(interrupt.message())
        return interrupt.EXIT_CODE
    message = _message(error)
    if message is None or os.environ.get("CLRT_DEBUG") == "1":
        streams.complain("".join(traceback.format_exception(error)))
    if message is None:
        streams.complain("clrt: this is a fault of clrt, not of the scene; please report it with the lines above and the scene\n")
        return FAULT
    streams.complain(f"{message}\n")
    return USER


def warn(message: str) -> None:
    streams.complain(f"clrt: warning: {message}\n")


@contextmanager
def warnings_told() -> Iterator[None]:
    """What is warned of within is printed after it, a line each."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RuntimeWarning)
        yield
    for warning in caught:
        warn(str(warning.message))


def _message(error: BaseException) -> str | None:
    """The text for something the user can mend, or None for a fault."""
    if isinstance(error, SceneError) and ": error: " in str(error):
        return str(error)  # each of its lines starts with file:line:column: error
    if isinstance(error, ClrtError):
        return f"clrt: error: {error}"
    if isinstance(error, click.UsageError):
        command = error.ctx.command_path if error.ctx else "clrt"
        return f"clrt: error: {error.format_message()} (see {command.removesuffix(' render')} --help)"
    if isinstance(error, click.ClickException):
        return f"clrt: error: {error.format_message()}"
    if isinstance(error, OSError) and error.filename is None and error.errno in _FULL:
        return f"clrt: error: {streams.NAME}: {error.strerror}"
    # Any other OSError without a file is none of input or output: a fault.
    if isinstance(error, OSError) and error.filename is not None:
        return f"clrt: error: {click.format_filename(error.filename)}: {error.strerror}"
    if isinstance(error, MemoryError):
        return "clrt: error: not enough memory; a smaller picture (--size) or a smaller scene takes less"
    return None
