"""Numbers of many lines at once: the fast half of the reader of scene texts.

A line is taken in bulk if it is a known letter alone, followed by as many fields as the letter takes, all made of
the characters of decimal numbers. Anything else (comments, words, errors) is left to the exact reader, which gives
the same values; `tests/test_scene_text.py` compares the two, and both with Python's `float`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.scene import decimals
from clrt.scene.grammar import LETTERS
from clrt.scene.model import FloatArray

_BLOCK = 1 << 18  #: characters at a time, so that what is made of them stays in the cache

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


#: lines that are left to the exact reader, each with its index; what is read: (letter, fields) -> rows, and what is left
Left = list[tuple[int, str]]
Read = tuple[dict[tuple[str, int], Rows], Left]


@dataclass(frozen=True, eq=False)
class LineTable:
    """What the bytes of each line say.

    text : the bytes, after some line ends; one byte a character
    starts, ends : (t,) where each field begins, letters included, and the place behind its end
    first : (n,) the first field of each line
    letter : (n,) the code of the letter that the line starts with, 0 for none
    fields : (n,) how many fields follow; -1 for an empty line
    numeric : (n,) whether the line is made of blanks and the characters of numbers alone
    """

    text: bytes
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    first: NDArray[np.int64]
    letter: NDArray[np.uint8]
    fields: NDArray[np.int64]
    numeric: NDArray[np.bool_]


def scan_lines(text: str) -> LineTable:
    """Find letters and count fields in a text with `\\n` line ends, without looking at any line alone."""
    raw = b"\n" * decimals.WINDOW + text.encode("ascii", "replace") + b"\n"
    buffer = np.frombuffer(raw, np.uint8)
    classes = np.frombuffer(raw.translate(_CLASSES), np.uint8)
    solid = classes != _BLANK
    # Blank and solid take turns, blank first and last; a line's fields lie between its two line ends.
    turns = np.flatnonzero(solid[1:] != solid[:-1]) + 1
    starts, ends = turns[0::2], turns[1::2]
    line_ends = np.flatnonzero(buffer == ord("\n"))[decimals.WINDOW - 1 :]
    bounds = np.searchsorted(starts, line_ends)
    first, tokens = bounds[:-1], np.diff(bounds)

    letter = np.zeros(len(tokens), np.uint8)
    filled = np.flatnonzero(tokens)
    head = first[filled]
    letter[filled] = np.where(ends[head] - starts[head] > 1, 0, buffer[starts[head]])
    numeric = np.ones(len(tokens), np.bool_)
    numeric[np.searchsorted(line_ends, np.flatnonzero(classes == _OTHER)) - 1] = False
    return LineTable(raw, starts, ends, first, letter, tokens - 1, numeric)


def convert(lines: Sequence[str], fields: int) -> FloatArray | None:
    """The numbers after the letter of each line, (n, fields) float64; None where any is not a decimal number."""
    try:
        return np.loadtxt(lines, dtype=np.float64, comments=None, usecols=range(1, fields + 1), ndmin=2)
    except ValueError:
        return None


def _values(table: LineTable, chosen: NDArray[np.int64], fields: int, block: str) -> tuple[NDArray[np.int64], FloatArray]:
    """The lines of `chosen` that could be read, and their numbers, (n, fields) float64.

    Lines of short numbers are read at once, all others by NumPy's reader, or not at all where one of them is at fault.
    """
    if fields == 0:
        return chosen, np.zeros((len(chosen), 0))
    tokens = (table.first[chosen, None] + np.arange(1, fields + 1)).ravel()
    read, right = decimals.read_decimals(table.text, table.starts[tokens], table.ends[tokens])
    values, whole = read.reshape(-1, fields), right.reshape(-1, fields).all(axis=1)
    others = np.flatnonzero(~whole)
    if len(others):
        lines = block.replace(",", " ").split("\n")
        found = convert([lines[i] for i in chosen[others].tolist()], fields)
        if found is None:
            return chosen[whole], values[whole]
        values[others] = found
    return chosen, values


def read_bulk(text: str) -> Read:
    """Convert all plain lines: (letter, fields) -> rows, and the lines that are left, each with its index, empty ones aside."""
    found: dict[tuple[str, int], list[Rows]] = {}
    left: Left = []
    start = before = 0
    while start <= len(text):
        end = text.find("\n", start + _BLOCK)
        block = text[start : end if end >= 0 else None]
        table = scan_lines(block)
        remains = table.fields >= 0
        for form, chosen, values in _block_rows(table, block):
            found.setdefault(form, []).append(Rows(chosen + before + 1, values))
            remains[chosen] = False
        if remains.any():
            lines = block.split("\n")
            left += [(before + i, lines[i]) for i in np.flatnonzero(remains).tolist()]
        start, before = start + len(block) + 1, before + len(remains)
    rows = {
        form: Rows(np.concatenate([r.lines for r in parts]), np.concatenate([r.values for r in parts])) for form, parts in found.items()
    }
    return rows, left


def _block_rows(table: LineTable, block: str) -> Iterator[tuple[tuple[str, int], NDArray[np.int64], FloatArray]]:
    """Each form that occurs, the indices of its lines, and their numbers."""
    for letter, forms in LETTERS.items():
        of_letter = np.flatnonzero((table.letter == ord(letter)) & table.numeric)
        for fields in forms if len(of_letter) else ():
            chosen, values = _values(table, of_letter[table.fields[of_letter] == fields], fields, block)
            if len(chosen):
                yield (letter, fields), chosen, values
