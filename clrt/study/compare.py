"""Two studies side by side. A difference is claimed where the intervals part, nowhere else."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from clrt.study.schema import LONE, ROWS

#: of the header: what tells how two studies differ
_TOLD = ("scene", "scene_sha256", "clrt", "size", "quick", "samples", "machine", "opencl")


@dataclass(frozen=True)
class Pair:
    """One number of two studies. part, row, quantity : its place; a, b : the numbers, or None where only the other study has it."""

    part: str
    row: str
    quantity: str
    a: dict[str, Any] | None
    b: dict[str, Any] | None

    @property
    def verdict(self) -> str:
        """"a is less", "b is less", "no difference", or "not in a", "not in b"; "other units" where nothing can be said."""
        if self.a is None or self.b is None:
            return "not in a" if self.a is None else "not in b"
        if self.a["unit"] != self.b["unit"]:
            return "other units"
        if self.a["high"] < self.b["low"]:
            return "a is less"
        return "b is less" if self.b["high"] < self.a["low"] else "no difference"

    @property
    def ratio(self) -> tuple[float, float, float] | None:
        """b over a: of the medians, and its extremes within both intervals; None where one is not positive."""
        if self.a is None or self.b is None or self.a["unit"] != self.b["unit"] or min(self.a["low"], self.b["low"]) <= 0.0:
            return None
        return self.b["median"] / self.a["median"], self.b["low"] / self.a["high"], self.b["high"] / self.a["low"]

    def to_json(self) -> dict[str, Any]:
        return {"part": self.part, "row": self.row, "quantity": self.quantity, "a": self.a, "b": self.b,
                "ratio": list(self.ratio) if self.ratio else None, "verdict": self.verdict}  # fmt: skip


@dataclass(frozen=True)
class Comparison:
    """differing : what the headers differ in, name -> (a, b)."""

    differing: dict[str, tuple[Any, Any]]
    pairs: tuple[Pair, ...]

    @property
    def agreeing(self) -> int:
        """Numbers of both studies whose intervals do not part."""
        return sum(pair.verdict == "no difference" for pair in self.pairs)

    @property
    def shared(self) -> int:
        """Numbers that both studies have, in the same unit."""
        return sum(pair.verdict in ("no difference", "a is less", "b is less") for pair in self.pairs)

    def to_json(self) -> dict[str, Any]:
        return {"format": 1, "differing": {name: list(both) for name, both in self.differing.items()}, "shared": self.shared,
                "agreeing": self.agreeing, "rows": [pair.to_json() for pair in self.pairs]}  # fmt: skip


def compare(a: dict[str, Any], b: dict[str, Any]) -> Comparison:
    """Number by number; a and b as `store.read` gives them."""
    heads = ((key, a["header"].get(key), b["header"].get(key)) for key in _TOLD)
    mine, theirs = dict(_numbers(a)), dict(_numbers(b))
    places = [*mine, *(place for place in theirs if place not in mine)]
    pairs = (Pair(*place, mine.get(place), theirs.get(place)) for place in places)
    return Comparison({key: (x, y) for key, x, y in heads if x != y}, tuple(pairs))


def _numbers(study: dict[str, Any]) -> Iterator[tuple[tuple[str, str, str], dict[str, Any]]]:
    for part, (name, quantities) in ROWS.items():
        found = study[part]
        if found is None:
            continue
        yield from (((part, "", key), found[key]) for key in LONE.get(part, ()) if found.get(key))
        for row in found["rows"]:
            yield from (((part, str(row[name]), key), row[key]) for key in quantities if row.get(key))
