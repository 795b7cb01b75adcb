"""JSON of a glTF file with the place of each value: whatever is of the wrong kind is a fault that names it, never a crash."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NoReturn

from clrt.scene.models.model_file import ModelError

_KINDS: dict[type, str] = {dict: "an object", list: "a list", str: "a text", int: "a whole number", bool: "true or false"}


def parse(data: bytes, what: str) -> Item:
    """The root of a JSON text. Raises ModelError with line and column of what is broken; `what` names the text in messages."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        raise ModelError(f"{what} is not UTF-8 text; export the file again") from problem
    try:
        value = json.loads(text, parse_constant=_refuse)
    except json.JSONDecodeError as problem:
        raise ModelError(f"{what} is broken: {problem.msg}; export the file again", problem.lineno, problem.colno) from None
    except RecursionError:
        raise ModelError(f"{what} is nested too deeply; export the file again") from None
    if not isinstance(value, dict):
        raise ModelError(f"{what} is no JSON object; is this a glTF file?")
    return Item(value, "")


def _refuse(constant: str) -> NoReturn:
    raise ModelError(f"its JSON holds {constant}, which is no number of JSON; export the file again")


@dataclass(frozen=True)
class Item:
    """A JSON object and its path from the root, such as "meshes[0].primitives[1]". All methods raise ModelError for a wrong kind."""

    value: dict[str, Any]
    path: str
    _lists: dict[str, list[Item]] = field(default_factory=dict, repr=False, compare=False)

    def fault(self, message: str) -> ModelError:
        """The error to raise for something wrong here."""
        return ModelError(f"{self.path}: {message}" if self.path else message)

    def place(self, key: str) -> str:
        return f"{self.path}.{key}" if self.path else key

    def has(self, key: str) -> bool:
        return key in self.value

    def _of(self, key: str, kind: type) -> Any:
        found = self.value[key]
        if not isinstance(found, kind) or (kind is int and isinstance(found, bool)):
            raise ModelError(f"{self.place(key)}: expected {_KINDS[kind]}, found {json.dumps(found)[:40]}")
        return found

    def item(self, key: str) -> Item:
        """The object under `key`; an empty one where there is none."""
        return Item(self._of(key, dict) if key in self.value else {}, self.place(key))

    def items(self, key: str) -> list[Item]:
        """The objects of the list under `key`; none where there is no list."""
        if key in self._lists:
            return self._lists[key]
        found = self._of(key, list) if key in self.value else []
        for i, value in enumerate(found):
            if not isinstance(value, dict):
                raise ModelError(f"{self.place(key)}[{i}]: expected an object, found {json.dumps(value)[:40]}")
        self._lists[key] = [Item(value, f"{self.place(key)}[{i}]") for i, value in enumerate(found)]
        return self._lists[key]

    def text(self, key: str, default: str = "") -> str:
        return str(self._of(key, str)) if key in self.value else default

    def flag(self, key: str) -> bool:
        return bool(self._of(key, bool)) if key in self.value else False

    def texts(self, key: str) -> list[str]:
        return [value for value in (self._of(key, list) if key in self.value else []) if isinstance(value, str)]

    def number(self, key: str, default: float, low: float = -math.inf, high: float = math.inf) -> float:
        return self._numbers(key, [self.value[key]], low, high)[0] if key in self.value else default

    def vector(self, key: str, default: tuple[float, ...], low: float = -math.inf, high: float = math.inf) -> tuple[float, ...]:
        """As many numbers as the default has."""
        if key not in self.value:
            return default
        found = self._of(key, list)
        if len(found) != len(default):
            raise ModelError(f"{self.place(key)}: expected {len(default)} numbers, found {len(found)}")
        return self._numbers(key, found, low, high)

    def _numbers(self, key: str, values: list[Any], low: float, high: float) -> tuple[float, ...]:
        for value in values:
            real = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300 and math.isfinite(value)
            if not real:
                raise ModelError(f"{self.place(key)}: expected a number, found {json.dumps(value)[:40]}")
            if not low <= value <= high:
                raise ModelError(f"{self.place(key)}: expected a number from {low:g} to {high:g}, found {value:g}")
        return tuple(float(value) for value in values)

    def count(self, key: str, default: int = 0) -> int:
        """A whole number that is not negative."""
        value = int(self._of(key, int)) if key in self.value else default
        if value < 0:
            raise ModelError(f"{self.place(key)}: expected a whole number of at least 0, found {value}")
        return value

    def refer(self, key: str, among: list[Item], what: str) -> int:
        """The number under `key` of one of `among`."""
        if key not in self.value:
            raise self.fault(f"has no {key}; export the file again")
        return check_place(self._of(key, int), len(among), what, self.place(key))

    def places(self, key: str, count: int, what: str) -> Iterator[int]:
        """The numbers of the list under `key`, each of one of `count`."""
        for i, value in enumerate(self._of(key, list) if key in self.value else []):
            path = f"{self.place(key)}[{i}]"
            if not isinstance(value, int) or isinstance(value, bool):
                raise ModelError(f"{path}: expected a whole number, found {json.dumps(value)[:40]}")
            yield check_place(value, count, what, path)

    def extension(self, name: str) -> Item | None:
        """The extension of that name on this object."""
        extensions = self.item("extensions")
        return extensions.item(name) if extensions.has(name) else None


def check_place(value: int, count: int, what: str, path: str) -> int:
    """The number itself if there is such a thing."""
    if not 0 <= value < count:
        there = f"there are {count} (0 to {count - 1})" if count else "there are none"
        raise ModelError(f"{path}: asks for {what} {value}, but {there}; export the file again")
    return value
