"""Numbers of many lines at once: the fast half of the reader of scene texts.

A line is taken in bulk if it is a known letter alone, followed by as many fields as the letter takes, all made of
the characters of decimal numbers. Anything else (comments, words, errors) is left to the exact reader, which gives
the same values; `tests/test_scene_text.py` compares the two, and both with Python's `float`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.scene.grammar import LETTERS
from clrt.scene.model import FloatArray

_BLANK, _NUMERIC, _OTHER = 0, 1, 2


def _class_table() -> bytes:
    """Byte -> class. The letters count as numeric: where they do not belong, converting the number fails."""
    table = bytearray([_OTHER]) * 256
    for byte in b" \t\v\f\n,":
        table[byte] = _BLANK
    for byte in b"0123456789+-.eE" + "".join(LETTERS).encode():
        table[byte] = _NUMERIC
    return bytes(table)


_CLASSES = _class_table()


@dataclass(frozen=True, eq=False)
class Rows:
    """All lines of one letter and one count of fields, in the order of the text.

    lines : (n,) int64, line numbers from 1
    values : (n, fields) float64, the correctly rounded values of the text
    """

    lines: NDArray[np.int64]
    values: FloatArray

    def __len__(self) -> int:
        return len(self.lines)


@dataclass(frozen=True, eq=False)
class LineTable:
    """What the bytes of each line say, all (n,): the code of the letter it starts with (0: none), how many fields
    follow, and whether it is made of blanks and the characters of numbers alone. `fields` is -1 for an empty line."""

    letter: NDArray[np.uint8]
    fields: NDArray[np.int64]
    numeric: NDArray[np.bool_]


def scan_lines(text: str) -> LineTable:
    """Find letters and count fields in a text with `\\n` line ends, without looking at any line alone."""
    raw = b"\n" + text.encode("ascii", "replace") + b"\n"
    buffer = np.frombuffer(raw, np.uint8)
    classes = np.frombuffer(raw.translate(_CLASSES), np.uint8)
    solid = classes != _BLANK
    # Fields start where something follows a blank; a line's fields lie between its two line ends.
    starts = np.flatnonzero(solid[1:] > solid[:-1]) + 1
    ends = np.flatnonzero(buffer == ord("\n"))
    first = np.searchsorted(starts, ends[:-1])
    tokens = np.searchsorted(starts, ends[1:]) - first

    letter = np.zeros(len(tokens), np.uint8)
    filled = np.flatnonzero(tokens)
    head = starts[first[filled]]
    letter[filled] = np.where(solid[head + 1], 0, buffer[head])
    numeric = np.ones(len(tokens), np.bool_)
    numeric[np.searchsorted(ends, np.flatnonzero(classes == _OTHER)) - 1] = False
    return LineTable(letter, tokens - 1, numeric)


def convert(lines: Sequence[str], fields: int) -> FloatArray | None:
    """The numbers after the letter of each line, (n, fields) float64; None where any is not a decimal number."""
    if fields == 0:
        return np.zeros((len(lines), 0))
    try:
        return np.loadtxt(lines, dtype=np.float64, comments=None, usecols=range(1, fields + 1), ndmin=2)
    except ValueError:
        return None


def read_bulk(text: str, lines: Sequence[str]) -> tuple[dict[tuple[str, int], Rows], NDArray[np.int64]]:
    """Convert all plain lines: (letter, fields) -> rows, and the indices of the lines that are left, empty ones aside."""
    table = scan_lines(text)
    plain = text.replace(",", " ").split("\n") if "," in text else lines
    left = table.fields >= 0
    rows: dict[tuple[str, int], Rows] = {}
    for letter, forms in LETTERS.items():
        of_letter = np.flatnonzero((table.letter == ord(letter)) & table.numeric)
        for fields in forms:
            chosen = of_letter[table.fields[of_letter] == fields]
            values = convert([plain[i] for i in chosen.tolist()], fields) if len(chosen) else None
            if values is not None:
                rows[letter, fields] = Rows(chosen + 1, values)
                left[chosen] = False
    return rows, np.flatnonzero(left)
