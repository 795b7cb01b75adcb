"""The errors of one scene text: collected while it is read, then told all at once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from clrt.errors import SceneError

if TYPE_CHECKING:
    from clrt.scene.include import Origins

MOST_TOLD = 20  #: errors written out before the rest is only counted
LONGEST_SHOWN = 40  #: characters of an offending token that a message repeats


def shown(token: str) -> str:
    """The token in quotes, shortened, with control characters made visible."""
    cut = token if len(token) <= LONGEST_SHOWN else token[:LONGEST_SHOWN] + "..."
    return '"' + "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in cut) + '"'


def did_you_mean(token: str, valid: Iterable[str]) -> str:
    """`; did you mean "depth"?` for the nearest valid word, or nothing where none is near."""
    near = nearest(token, valid)
    return f'; did you mean "{near}"?' if near else ""


def nearest(token: str, valid: Iterable[str]) -> str:
    """The valid word that was probably meant; nothing where none is near."""
    import difflib  # for faults alone

    near = difflib.get_close_matches(token.lower(), list(valid), n=1) if len(token) <= LONGEST_SHOWN else []
    return near[0] if near else ""


class Faults:
    """Errors with their places, of one source. Lines and columns count from 1; `origins` knows which lines are of other files."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.origins: Origins | None = None
        self._found: list[tuple[int, int, str]] = []
        self._lines: set[int] = set()
        self._listed: set[str] = set()

    def add(self, line: int, column: int, message: str) -> None:
        self._found.append((line, column, message))
        self._lines.add(line)

    def on_line(self, line: int) -> bool:
        """Whether a fault of this line has been noted."""
        return line in self._lines

    def once(self, listing: str) -> str:
        """A list for a message: whole the first time, nothing after that."""
        told = listing in self._listed
        self._listed.add(listing)
        return "" if told else listing

    def raise_if_any(self) -> None:
        """Raise a SceneError that holds the first 20 errors in the order of the text, and how many more there are."""
        if not self._found:
            return
        found = sorted(self._found, key=lambda fault: fault[:2])
        told = [self._told(*fault) for fault in found[:MOST_TOLD]]
        more = len(found) - len(told)
        if more:
            told.append(f"{self.source}: {more} more error{'s' if more > 1 else ''} not shown")
        raise SceneError("\n".join(told))

    def _told(self, line: int, column: int, message: str) -> str:
        if self.origins is None:
            return f"{self.source}:{line}:{column}: error: {message}"
        source, number = self.origins.place(line)
        return f"{source}:{number}:{column}: error: {self.origins.told(message)}"
