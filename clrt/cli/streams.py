"""Standard output and error, which may be closed, full, or a pipe whose reader is gone."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from typing import TextIO

NAME = "standard output"


def hold_descriptors() -> None:
    """Put the null device in the place of closed standard streams, lest a file that is opened next gets the number of one."""
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free: this one


def is_terminal(stream: TextIO | None) -> bool:
    """False for a closed stream, too, which Python has as None."""
    return stream is not None and stream.isatty()


def write(text: str) -> None:
    """Write to standard output. A reader that is gone has read what it wanted: that is no error.

    Raises OSError with NAME in it where standard output is closed, or cannot be written to.
    """
    if sys.stdout is None:
        raise OSError(errno.EBADF, "it is closed", NAME)
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        settle()
    except OSError as error:
        settle()
        raise OSError(error.errno, os.strerror(error.errno or 0), NAME) from error


def complain(text: str) -> None:
    """Write to standard error, if that can be."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError):
            sys.stderr.write(text)
            sys.stderr.flush()


def settle() -> None:
    """What cannot be written out is dropped: Python would try again at its end, and call that an error."""
    for stream in (sys.stdout, sys.stderr):
        if stream is None:
            continue
        try:
            stream.flush()
        except OSError:
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, stream.fileno())
            os.close(null)
