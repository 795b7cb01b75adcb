"""What the values of arguments may be; a wrong one is said in one line. Each function is the `type` of a click parameter."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import click

_NUMBER = r"[+-]?(?:[0-9]{1,18}(?:\.[0-9]{0,18})?|\.[0-9]{1,18})(?:[eE][+-]?[0-9]{1,3})?"
_UNITS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}

STDOUT = Path("-")  #: what `file_or_stdout` gives for `-`, to be told by identity: `./-` is a file


def file(value: str) -> Path:
    """A path that is no standard stream. Raises click.BadParameter."""
    if value == "-":
        raise click.BadParameter("'-': this is a file only, no standard input or output; ./- is a file of that name")
    return file_or_stdout(value)


def file_or_stdout(value: str) -> Path:
    """A path, or `-` for standard output. Raises click.BadParameter for an empty one."""
    if not value:
        raise click.BadParameter("the name of the file is empty")
    return STDOUT if value == "-" else Path(value)


def whole(low: int, high: int | None = None) -> Callable[[str | int], int]:
    """A whole number from `low` to `high`, or without end. What it returns raises click.BadParameter."""
    wanted = f"of at least {low}" if high is None else f"from {low} to {high}"

    def number(value: str | int) -> int:
        text = str(value)
        if re.fullmatch(r"[+-]?[0-9]{1,18}", text) and low <= int(text) and (high is None or int(text) <= high):
            return int(text)
        raise click.BadParameter(f"'{text}': this is a whole number {wanted}")

    return number


def size(value: str) -> tuple[int, int]:
    """WIDTHxHEIGHT -> (width, height), each within the limits of a scene's R. Raises click.BadParameter."""
    from clrt.scene.grammar import LARGEST_SIDE

    match = re.fullmatch(r"([0-9]{1,9})x([0-9]{1,9})", value.lower())
    if match is None:
        raise click.BadParameter(f"{value!r} is no size; write width x height in pixels, such as 640x480")
    width, height = int(match[1]), int(match[2])
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE):
        raise click.BadParameter(f"{value!r}: width and height go from 1 to {LARGEST_SIDE}")
    return width, height


def fraction(value: str | float) -> float:
    """A relative error such as 0.01 or 1%. Raises click.BadParameter; its range is checked where it is used."""
    match = re.fullmatch(rf"({_NUMBER})(%?)", str(value))
    if match is None:
        raise click.BadParameter(f"'{value}': this is a relative error, such as 0.01 or 1%")
    return float(match[1]) / (100.0 if match[2] else 1.0)


def duration(value: str | float) -> float:
    """Seconds, from such as 5, 5s, 300ms, 2min or 1h. Raises click.BadParameter; its range is checked where it is used."""
    match = re.fullmatch(rf"({_NUMBER}) ?({'|'.join(_UNITS)})?", str(value))
    if match is None:
        raise click.BadParameter(f"'{value}': this is a time, such as 5s, 2min or plain seconds")
    return float(match[1]) * _UNITS[match[2] or "s"]
