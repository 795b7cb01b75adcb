"""What a word of a scene text is: its grammar, a line that uses it, and the draft of the scene that lines change."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from clrt.scene.faults import Faults
from clrt.scene.grammar import Field, color_fields
from clrt.scene.model import Material, PointLight, SpotLight, SunLight

Value = float | str

@dataclass(frozen=True)
class Text:
    """A field that is not a number, such as a path. In double quotes it may hold blanks, commas, `#` and `//`."""

    name: str


@dataclass(frozen=True)
class Choice:
    """A field that takes one of a few texts."""

    name: str
    options: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class WordCall:
    """One line with a word, checked against its grammar: field name -> value, left-out keys with their defaults.

    columns : field name -> column of its value, of the fields that are written
    """

    name: str
    line: int
    column: int
    values: Mapping[str, Value]
    columns: Mapping[str, int] = field(default_factory=dict)

    def number(self, name: str) -> float:
        """The value of a numeric field."""
        return float(self.values[name])

    def text(self, name: str) -> str:
        """The value of a text field."""
        return str(self.values[name])


@dataclass
class Draft:
    """What a word may change of a scene; filled from the letters first, then changed by the words in their order."""

    materials: list[Material] = field(default_factory=list)
    lights: list[PointLight] = field(default_factory=list)
    spots: list[SpotLight] = field(default_factory=list)
    suns: list[SunLight] = field(default_factory=list)
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    depth: int = 5
    samples: int = 1
    samples_line: int = 0
    fields: dict[str, Any] = field(default_factory=dict)  #: of the Scene, by name, that words set as a whole


@dataclass(frozen=True)
class Word:
    """The grammar of one word, and its effect.

    positional : required, in this order
    example : a line that is right, for messages
    apply : what the line does to the draft
    keys : written key=value in any order, each with the default of a line that leaves it out
    once : a second line with the word is an error
    of : "material": belongs to the material above it; "glass": that has to have Refract > 0, too; "shiny": Reflect or Refract > 0.
        `once` then means once a material
    check : notes what is wrong with a line beyond its fields
    """

    positional: tuple[Field | Text | Choice, ...]
    example: str
    apply: Callable[[Draft, WordCall], None]
    keys: tuple[tuple[Field | Text | Choice, Value], ...] = ()
    once: bool = True
    of: Literal["", "material", "glass", "shiny"] = ""
    check: Callable[[WordCall, Faults], None] | None = None


def no_change(draft: Draft, call: WordCall) -> None:
    """For words whose lines are read elsewhere, since they need more than the draft."""


def material_above(draft: Draft, call: WordCall) -> int:
    """Index of the material that a line belongs to: the last above it."""
    return max(i for i, material in enumerate(draft.materials) if material.line < call.line)


def color_of(call: WordCall) -> tuple[float, float, float]:
    """The values of the fields red, green, blue."""
    return call.number("red"), call.number("green"), call.number("blue")


#: keys of lamps: a colour, and what multiplies it
LAMP_COLOR: tuple[tuple[Field | Text | Choice, Value], ...] = (
    *((channel, 1.0) for channel in color_fields()), (Field("intensity", low=0.0, high=1e6), 1.0),
)  # fmt: skip


def lamp_color(call: WordCall) -> tuple[float, float, float]:
    """The colour of a line with LAMP_COLOR's keys."""
    red, green, blue = (call.number("intensity") * call.number(channel) for channel in ("red", "green", "blue"))
    return red, green, blue


def unit_vector(call: WordCall, what: str) -> tuple[float, float, float]:
    """The vector of the fields x, y, z of `what`, which is not zero, at length 1. Scaled first, lest its square over- or underflow."""
    vector = [call.number(f"{axis} of {what}") for axis in "xyz"]
    scaled = [value / max(map(abs, vector)) for value in vector]
    x, y, z = (value / math.hypot(*scaled) for value in scaled)
    return x, y, z


def check_vector(what: str, example: str) -> Callable[[WordCall, Faults], None]:
    """A check that the vector of the fields x, y, z of `what` is not zero."""

    def check(call: WordCall, faults: Faults) -> None:
        if not any(call.number(f"{axis} of {what}") for axis in "xyz"):
            faults.add(call.line, call.columns[f"x of {what}"], f'{what} is zero; give it a length, as in "{example}"')

    return check
