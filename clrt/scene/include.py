"""The word `include`: the lines of other scene texts, as if they stood there, and where each line came from."""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from clrt.scene.faults import Faults
from clrt.scene.picture import Folders, PictureError
from clrt.scene.text import plain_lines, read_file
from clrt.scene.tokens import tokenise
from clrt.scene.words import WordCall, read_word

DEEPEST = 16  #: texts that include each other in a row
MOST = 1000  #: include lines that are followed

_INCLUDE = re.compile(r"^[\s,]*include(?=[\s,\"]|$)")
_NUMBERED = re.compile(r"\b(lines?) (\d+)\b")
_PATHS = ("picture", "file")  #: fields of words that name files


@dataclass(frozen=True)
class _Segment:
    """Lines in a row from one text. first : of them, in the whole; line : the same in their text; caller : of the outermost include."""

    first: int
    source: str
    folder: Path
    line: int
    caller: int


@dataclass
class Origins:
    """Where each line of a whole text came from: all of them from the text itself, but for those of included ones."""

    segments: list[_Segment] = field(default_factory=list)

    def place(self, line: int) -> tuple[str, int]:
        """The file of a line of the whole, and its number there."""
        at = self._segment(line)
        return at.source, at.line + line - at.first

    def caller(self, line: int) -> int:
        """The line of the text itself that a line of the whole stands on or for; 0 stays 0."""
        at = self._segment(max(line, 1))
        return line and (at.caller or at.line + line - at.first)

    def _segment(self, line: int) -> _Segment:
        return self.segments[max(bisect_right(self.segments, line, key=lambda segment: segment.first) - 1, 0)]

    def told(self, message: str) -> str:
        """A message with the numbers of its lines as readers of the files count them."""

        def place(match: re.Match[str]) -> str:
            source, line = self.place(int(match[2]))
            return f"{match[1]} {line}" + (f" of {source}" if source != self.segments[0].source else "")

        return _NUMBERED.sub(place, message)

    def relocated(self, call: WordCall, folders: Folders) -> WordCall:
        """The call with the paths of its files relative to the folder of the whole."""
        folder = self._segment(call.line).folder
        names = [name for name in _PATHS if name in call.values] if folder != folders.own else []
        return replace(call, values={**call.values, **{name: os.path.relpath(folder / call.text(name), folders.own) for name in names}})

    def relined(self, value: Any) -> Any:
        """A dataclass, or a tuple of them, with the lines of the text itself in all fields that hold a line."""
        if isinstance(value, tuple):
            return tuple(map(self.relined, value))
        if not is_dataclass(value) or isinstance(value, type):
            return value
        found = {f.name: getattr(value, f.name) for f in fields(value)}
        changed = {name: self.caller(old) if _is_line(name) else self.relined(old) for name, old in found.items()}
        return replace(value, **{name: new for name, new in changed.items() if new is not found[name]})


def _is_line(name: str) -> bool:
    return name == "line" or name.endswith("_line")


def expand(text: str, source: str, folders: Folders, faults: Faults) -> tuple[str, Origins | None]:
    """The text with the lines of the texts it includes below its include lines, which stay; None where it includes nothing.

    Files that cannot be read, circles and too many of them are noted, in `faults`, which then tells all places by file.
    """
    lines = plain_lines(text) if "include" in text else []
    if not any(map(_INCLUDE.match, lines)):
        return text, None
    reader = _Reader(folders, faults)
    reader.add(lines, source, folders.own, [(folders.own / Path(source).name).resolve()])
    faults.origins = reader.origins
    return "\n".join(reader.lines), reader.origins


class _Reader:
    """Collects the lines of a text and of those it includes."""

    def __init__(self, folders: Folders, faults: Faults) -> None:
        self._folders, self._faults = folders, faults
        self._count = 0
        self.lines: list[str] = []
        self.origins = Origins()

    def add(self, lines: list[str], source: str, folder: Path, open_ones: list[Path], caller: int = 0) -> None:
        """Append the lines of one text. open_ones : the included texts that it stands in; caller : line of the outermost include."""
        start = 0
        for number, line in enumerate(lines, 1):
            if not _INCLUDE.match(line):
                continue
            self._append(lines[start:number], source, folder, start + 1, caller)
            start = number
            self._include(line, source, folder, open_ones, caller or number)
        self._append(lines[start:], source, folder, start + 1, caller)

    def _append(self, lines: list[str], source: str, folder: Path, line: int, caller: int) -> None:
        if lines:
            self.origins.segments.append(_Segment(len(self.lines) + 1, source, folder, line, caller))
            self.lines += lines

    def _include(self, line: str, source: str, folder: Path, open_ones: list[Path], caller: int) -> None:
        """Add the text that a line names; it is the last of `self.lines`. A line that is wrong is noted when all lines are read."""
        here = len(self.lines)
        call = read_word(tokenise(line), here, Faults(source))
        if call is None:
            return
        name, column = call.text("file"), call.columns["file"]
        self._count += 1
        try:
            path = self._folders.find(os.path.relpath(folder / name, self._folders.own))
        except PictureError as problem:
            self._faults.add(here, column, str(problem))
            return
        if path in open_ones:
            names = " -> ".join(part.name for part in [*open_ones[open_ones.index(path) :], path])
            self._faults.add(here, column, f"{name} includes itself: {names}; take one of these lines out")
        elif len(open_ones) >= DEEPEST:
            self._faults.add(here, column, f"more than {DEEPEST} texts include each other in a row; put some of them together")
        elif self._count > MOST:
            self._faults.add(here, column, f"more than {MOST} include lines; put some of the texts together")
        else:
            shown = str(Path(source).parent / name) if not source.startswith("<") else name
            self.add(plain_lines(read_file(path)), shown, path.parent, [*open_ones, path], caller)
