"""How far the building of trees has come, told after each launch; an exception in the listener ends the build."""

from __future__ import annotations

import math

from clrt.kdtree.common import Progress

LARGE = 4096  #: nodes of more references are split level by level, those of fewer in one piece by one work-item
_TOP_SHARE = 0.2  #: of the time that large nodes take, roughly
_GROWTH = 1.4  #: references in the pool for a triangle, roughly


class Ticker:
    """Levels of large nodes and references of small ones, as one fraction that rises to 1."""

    def __init__(self, triangles: int, progress: Progress | None) -> None:
        self._progress = progress
        self._levels, self._level = max(1.0, math.log2(max(2.0, triangles / LARGE)) + 1), 0
        self._references, self._grown = _GROWTH * max(triangles, 1), 0

    def level_done(self) -> None:
        """One level of large nodes was split."""
        self._level += 1
        self._tell()

    def grew(self, references: int) -> None:
        """Subtrees over so many references were built."""
        self._grown += references
        self._tell()

    def finish(self) -> None:
        """All is done."""
        if self._progress is not None:
            self._progress(1.0)

    def _tell(self) -> None:
        if self._progress is not None:
            top, below = min(1.0, self._level / self._levels), min(1.0, self._grown / self._references)
            self._progress(_TOP_SHARE * top + (0.99 - _TOP_SHARE) * below)
