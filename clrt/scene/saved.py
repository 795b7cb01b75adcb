"""Numbers of texts that earlier runs read: what the fast reader makes of a text is a function of its characters and of the reader's code.

What it leaves to the exact reader is kept as it stands, so that everything that is checked, is checked in every run, and faults are told
with the same words. Included texts are part of the text that is looked for.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt import __version__
from clrt.scene.bulk import Left, Read, Rows, read_bulk
from clrt.store import Arrays, Store, digest

LEAST_CHARACTERS = 1 << 18  #: texts of fewer are read as soon as found
LIMIT = 1 << 29  #: bytes of all that is kept
_READERS = ("bulk.py", "decimals.py", "grammar.py")  #: whose code says what a text means to the fast reader
_LINES, _VALUES, _LEFT_AT, _LEFT = "lines", "values", "left at", "left"


class SavedTexts:
    """Reads texts, or finds what was read of them. What was read anew is kept when told to: of a scene with faults, nothing is."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._new: dict[str, Read] = {}

    def read(self, text: str) -> Read:
        """As `read_bulk`; arrays may be read only."""
        if len(text) < LEAST_CHARACTERS:
            return read_bulk(text)
        key = text_key(text)
        arrays = self._store.get(key)
        found = None if arrays is None else _unpacked(arrays)
        if found is not None:
            return found
        rows, left = read_bulk(text)
        self._new[key] = dict(rows), left  # the exact reader adds to what it is given
        return rows, left

    def keep(self) -> None:
        """Keeps what was not found."""
        for key, (rows, left) in self._new.items():
            self._store.put(key, _packed(rows, left))
        self._new.clear()


@cache
def code_digest() -> str:
    """Of the version, and of the fast reader's code: another reader never meets numbers of its forerunners."""
    return digest(__version__.encode(), *((Path(__file__).parent / name).read_bytes() for name in _READERS))


def text_key(text: str) -> str:
    """The name of what is read of this text."""
    return digest(code_digest().encode(), text.encode("utf-8", "surrogatepass"))


def _packed(rows: dict[tuple[str, int], Rows], left: Left) -> Arrays:
    arrays: dict[str, NDArray[Any]] = {}
    for (letter, fields), of_form in rows.items():
        arrays |= {f"{letter} {fields} {_LINES}": of_form.lines, f"{letter} {fields} {_VALUES}": of_form.values}
    lines = "\n".join(line for _, line in left).encode("utf-8", "surrogatepass")
    arrays[_LEFT_AT] = np.array([index for index, _ in left], np.int64)
    return arrays | {_LEFT: np.frombuffer(lines, np.uint8)}


def _unpacked(arrays: dict[str, NDArray[Any]]) -> Read | None:
    """What was packed; None where it is something else."""
    try:
        at = arrays.pop(_LEFT_AT).tolist()
        lines = arrays.pop(_LEFT).tobytes().decode("utf-8", "surrogatepass").split("\n") if at else []
        rows = {}
        for name in [name for name in arrays if name.endswith(_LINES)]:
            letter, fields, _ = name.split(" ")
            rows[letter, int(fields)] = Rows(arrays[name], arrays[f"{letter} {fields} {_VALUES}"])
        return rows, list(zip(at, lines, strict=True))
    except (KeyError, ValueError):
        return None
