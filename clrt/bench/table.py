"""A table of text, and numbers as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Table:
    """The first `words` columns are words, the others numbers. `note`: what was compared with what; `image`: its plot in docs/images."""

    title: str
    headings: list[str]
    rows: list[list[str]]
    words: int = 1
    note: str = ""
    image: str = ""


def times(ratio: float | None) -> str:
    return "-" if ratio is None else f"{ratio:.1f}" if ratio >= 10.0 else f"{ratio:.2f}"


def interval(ratio: Mapping[str, Any], digits: int = 2) -> str:
    """A `timing.Ratio` as it lies in the JSON: the median, and from where to where it may lie."""
    return f"{ratio['median']:.{digits}f} ({ratio['low']:.2f} to {ratio['high']:.2f})"


def left_out(missing: list[dict[str, str]]) -> str:
    """A sentence a peer that was not there."""
    return "".join(f" Not measured: {one['name']}; {one['reason']}." for one in missing)


def size(count: float) -> str:
    """Bytes in the unit that leaves few digits."""
    return f"{count / 2**30:.2f} GiB" if count >= 2**30 else f"{count / 2**20:.1f} MiB"
