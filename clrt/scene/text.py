"""Scene text -> declarations: every line checked by itself, with the place of every fault.

Numbers are read in bulk (`clrt.scene.bulk`); the exact reader here takes the lines that are left: comments, words,
and whatever is wrong, which it reports. What lines mean together is `clrt.scene.build`'s concern.
"""

from __future__ import annotations

import stat
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from clrt.errors import SceneError
from clrt.scene.bulk import Rows, read_bulk
from clrt.scene.faults import Faults, nearest, shown
from clrt.scene.grammar import LETTERS, counts_taken
from clrt.scene.model import FloatArray
from clrt.scene.tokens import Token, read_number, report_range, tokenise
from clrt.scene.words import WORDS, WordCall, read_word

if TYPE_CHECKING:
    from clrt.scene.saved import SavedTexts


_MARK = b"\xef\xbb\xbf"  #: of byte order, which some editors put before UTF-8


@dataclass(eq=False)
class Declarations:
    """The lines of one scene text.

    text : all of it, with line feeds for line ends
    rows : (letter, count of fields) -> the lines of that form; forms that do not occur are absent
    broken : letter or word -> numbers of the lines that start with it, or nearly so, and could not be read
    words : the lines that start with a word, in their order
    """

    source: str
    text: str
    rows: dict[tuple[str, int], Rows] = field(default_factory=dict)
    broken: dict[str, list[int]] = field(default_factory=dict)
    words: list[WordCall] = field(default_factory=list)

    @cached_property
    def text_lines(self) -> list[str]:
        """The lines as written, for the columns of faults found later."""
        return self.text.split("\n")

    def get(self, letter: str, fields: int) -> Rows:
        """The lines of one form; none where it does not occur."""
        return self.rows.get((letter, fields), Rows(np.zeros(0, np.int64), np.zeros((0, fields))))

    def lines_of(self, letter: str, *forms: int) -> NDArray[np.int64]:
        """Ascending numbers of the lines of these forms (default: all), those that could not be read included."""
        read = [self.get(letter, fields).lines for fields in forms or LETTERS[letter]]
        return np.sort(np.concatenate([*read, np.array(self.broken.get(letter, []), np.int64)]))

    def place(self, line: int) -> str:
        """A line in words, for warnings."""
        return f"line {line}"

    def token(self, line: int, index: int) -> Token:
        """Token `index` of a line, 0 being its letter or word."""
        return tokenise(self.text_lines[line - 1])[index]


def read_file(path: Path) -> str:
    """The text of a UTF-8 file. Raises SceneError for what is not there, not a file, or not text."""
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise SceneError(f"{path}: error: this is a folder; name a scene file in it")
        if not (stat.S_ISREG(mode) or stat.S_ISFIFO(mode)):
            raise SceneError(f"{path}: error: this is a device, not a scene file")
        data = path.read_bytes()
    except FileNotFoundError:
        raise SceneError(f"{path}: error: there is no such file{_nearby(path)}") from None
    except (OSError, ValueError) as problem:
        raise SceneError(f"{path}: error: cannot be read: {problem}") from None
    return decode(data, str(path))


def _nearby(path: Path) -> str:
    """A hint at the file of the same folder with the nearest name."""
    try:
        names = [entry.name for entry in path.parent.iterdir()]
    except OSError:
        return ""
    import difflib  # for faults alone

    near = difflib.get_close_matches(path.name, names, n=1)
    return f'; did you mean "{path.parent / near[0]}"?' if near else ""


def decode(data: bytes, source: str) -> str:
    """UTF-8 bytes, with or without a byte order mark, as text. Raises SceneError with the place of the first other byte."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise SceneError(f"{source}:1:1: error: this is UTF-16 text; save it as UTF-8")
    end = data.find(b"\0")
    if end < 0:
        try:
            return data.removeprefix(_MARK).decode()
        except UnicodeDecodeError as problem:
            end = problem.start
    before = data[:end].decode("utf-8", "replace")
    line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
    what = "expected UTF-8 text; is this a binary file, or text in another encoding?"
    raise SceneError(f"{source}:{line}:{column}: error: found the byte 0x{data[end]:02x}, {what}")


def plain_lines(text: str) -> list[str]:
    """The lines of a text with any line ends, without a byte order mark."""
    return _unix(text).split("\n")


def _unix(text: str) -> str:
    """A text with line feeds for line ends, without a byte order mark."""
    text = text.removeprefix("\ufeff")
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def read_declarations(text: str, source: str, faults: Faults, *, bulk: bool = True, saved: SavedTexts | None = None) -> Declarations:
    """Read all lines; faults are noted, and the lines that have them kept apart.

    `bulk=False` takes every line through the exact reader: the same values, slowly. saved : what earlier runs read in bulk
    """
    text = _unix(text)
    found = Declarations(source, text)
    left: Iterable[tuple[int, str]] = enumerate(found.text_lines) if not bulk else ()
    if bulk:
        found.rows, left = read_bulk(text) if saved is None else saved.read(text)
    _ExactReader(found, faults).read(left)
    _check_ranges(found, faults)
    return found


class _ExactReader:
    """Line after line, token after token."""

    def __init__(self, found: Declarations, faults: Faults) -> None:
        self._found = found
        self._faults = faults
        self._rows: dict[tuple[str, int], tuple[list[int], list[list[float]]]] = {}

    def read(self, given: Iterable[tuple[int, str]]) -> None:
        """Read lines, each with its index, and merge them with what `rows` holds."""
        for index, line in given:
            tokens = tokenise(line)
            if tokens:
                self._read_line(tokens, index + 1)
        for (letter, fields), (lines, values) in self._rows.items():
            before = self._found.get(letter, fields)
            all_lines = np.concatenate([before.lines, np.array(lines, np.int64)])
            all_values: FloatArray = np.concatenate([before.values, np.array(values, np.float64).reshape(len(lines), fields)])
            order = np.argsort(all_lines)
            self._found.rows[letter, fields] = Rows(all_lines[order], all_values[order])

    def _read_line(self, tokens: list[Token], line: int) -> None:
        name = tokens[0].text
        if name in LETTERS:
            self._read_letter(tokens, line)
        elif len(name) > 1 and name.isascii() and name.isalpha() and name.islower():
            call = read_word(tokens, line, self._faults)
            if call is not None:
                self._found.words.append(call)
            else:
                self._note_broken(name if name in WORDS else nearest(name, WORDS), line)
        else:
            self._report_name(tokens[0], line)

    def _read_letter(self, tokens: list[Token], line: int) -> None:
        letter, fields = tokens[0].text, len(tokens) - 1
        names = [f.name for f in LETTERS[letter].get(fields, ())] or [f"{letter} takes {counts_taken(letter)}"] * fields
        values = [read_number(token, name, line, self._faults) for token, name in zip(tokens[1:], names, strict=True)]
        numbers = [value for value in values if value is not None]
        if len(numbers) == fields and fields in LETTERS[letter]:
            lines, rows = self._rows.setdefault((letter, fields), ([], []))
            lines.append(line)
            rows.append(numbers)
            return
        if len(numbers) == fields:
            place = tokens[1] if fields else tokens[0]
            self._faults.add(line, place.column, f"{letter} takes {counts_taken(letter)}, found {fields}")
        self._note_broken(letter, line)

    def _note_broken(self, meant: str, line: int) -> None:
        """Take the line as one of what was meant, if that is known, or its absence would be reported on top."""
        if meant:
            self._found.broken.setdefault(meant, []).append(line)

    def _report_name(self, token: Token, line: int) -> None:
        name, letters = token.text, ", ".join(sorted(LETTERS))
        meant = name.upper() if name.upper() in LETTERS else name[0] if name[0] in LETTERS and name[1:2].isdigit() else ""
        missing_blank = bool(meant) and name.upper() != meant
        meant = meant or nearest(name, WORDS)
        self._note_broken(meant, line)
        hint = f'; is a blank missing after "{meant}"?' if missing_blank else f'; did you mean "{meant}"?' if meant else ""
        kind = "letter" if len(name) == 1 and name.isalpha() else "start of a line"
        self._faults.add(line, token.column, f"unknown {kind} {shown(name)}{hint} (the letters: {letters})")


def _check_ranges(found: Declarations, faults: Faults) -> None:
    """Note every number outside what its field takes; such lines stay in `rows`."""
    for (letter, count), rows in found.rows.items():
        for index, declared in enumerate(LETTERS[letter][count]):
            for line in rows.lines[declared.rejects(rows.values[:, index])].tolist():
                report_range(found.token(line, index + 1), declared, line, faults)
