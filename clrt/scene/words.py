"""The words of a scene text: `word positional... key=value...`, and the one registry where they plug in.

To add a word, write its grammar and what it does to the draft of the scene, and enter it in `WORDS`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from clrt.scene.faults import Faults, did_you_mean, shown
from clrt.scene.grammar import Field, color_fields, point_fields
from clrt.scene.model import Material, PointLight, SpotLight, SunLight
from clrt.scene.tokens import Token, read_in_range

MOST_SAMPLES = 1 << 16  #: of a pixel
GREATEST_DEPTH = 128  #: reflections and refractions in a row; bounds the stacks of every renderer

Value = float | str

_KEY = re.compile(r"([a-z][a-z_]*)=(.*)")


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


@dataclass(frozen=True)
class Word:
    """The grammar of one word, and its effect.

    positional : required, in this order
    example : a line that is right, for messages
    apply : what the line does to the draft
    keys : written key=value in any order, each with the default of a line that leaves it out
    once : a second line with the word is an error
    of_glass : belongs to the material above it, which has to have Refract > 0; `once` then means once a material
    """

    positional: tuple[Field | Text | Choice, ...]
    example: str
    apply: Callable[[Draft, WordCall], None]
    keys: tuple[tuple[Field | Text | Choice, Value], ...] = ()
    once: bool = True
    of_glass: bool = False

_BACKGROUND = color_fields()
_TEXTURE_KEYS: tuple[tuple[Field | Text | Choice, Value], ...] = (
    (Choice("wrap", ("repeat", "clamp", "mirror")), "repeat"),
    (Choice("filter", ("linear", "nearest")), "linear"),
    (Choice("srgb", ("yes", "no")), "yes"),
)
_UV = tuple(Field(f"{axis} of corner {corner}") for corner in (1, 2, 3) for axis in "uv")
_PROJECT_KEYS: tuple[tuple[Field | Text | Choice, Value], ...] = (
    (Choice("axis", ("x", "y", "z")), "y"),
    (Field("scale", low=0.0, low_open=True), 1.0),
)
SUN_DIRECTION, SPOT_DIRECTION = "the direction to the sun", "the spot's direction"
_LAMP_COLOR = (*((channel, 1.0) for channel in color_fields()), (Field("intensity", low=0.0, high=1e6), 1.0))
_SPOT = (
    *point_fields("the spot"), *point_fields(SPOT_DIRECTION),
    Field("cone angle in degrees", low=0.0, high=180.0, low_open=True),
)  # fmt: skip
_SAMPLES = Field("samples", low=1.0, high=float(MOST_SAMPLES), whole=True)
_DEPTH = Field("depth", low=0.0, high=float(GREATEST_DEPTH), whole=True)


def _set_background(draft: Draft, call: WordCall) -> None:
    draft.background = (call.number("red"), call.number("green"), call.number("blue"))


def _lamp_color(call: WordCall) -> tuple[float, float, float]:
    red, green, blue = (call.number("intensity") * call.number(channel) for channel in ("red", "green", "blue"))
    return red, green, blue


def _unit(call: WordCall, what: str) -> tuple[float, float, float]:
    """The vector of the fields x, y, z of `what`, which is not zero, at length 1. Scaled first, lest its square over- or underflow."""
    vector = [call.number(f"{axis} of {what}") for axis in "xyz"]
    scaled = [value / max(map(abs, vector)) for value in vector]
    x, y, z = (value / math.hypot(*scaled) for value in scaled)
    return x, y, z


def _add_sun(draft: Draft, call: WordCall) -> None:
    draft.suns.append(SunLight(_unit(call, SUN_DIRECTION), _lamp_color(call), call.line))


def _add_spot(draft: Draft, call: WordCall) -> None:
    x, y, z = (call.number(f"{axis} of the spot") for axis in "xyz")
    outer = math.radians(call.number("cone angle in degrees")) / 2.0
    inner = outer * (1.0 - call.number("softness"))
    draft.spots.append(SpotLight((x, y, z), _unit(call, SPOT_DIRECTION), outer, inner, _lamp_color(call), call.line))


def _set_samples(draft: Draft, call: WordCall) -> None:
    draft.samples, draft.samples_line = int(call.number("samples")), call.line


def _set_depth(draft: Draft, call: WordCall) -> None:
    draft.depth = int(call.number("depth"))


def _material_above(draft: Draft, call: WordCall) -> int:
    """Index of the material that a line belongs to: the last above it."""
    return max(i for i, material in enumerate(draft.materials) if material.line < call.line)


def _set_fresnel(draft: Draft, call: WordCall) -> None:
    i = _material_above(draft, call)
    total = draft.materials[i].reflect + draft.materials[i].refract
    draft.materials[i] = replace(draft.materials[i], reflect=0.0, refract=total, fresnel=True, fresnel_line=call.line)


def _no_change(draft: Draft, call: WordCall) -> None:
    """For words whose lines scene/textures.py reads: they hold for the material or the triangle above them."""


def _set_absorb(draft: Draft, call: WordCall) -> None:
    i = _material_above(draft, call)
    absorb = (call.number("red"), call.number("green"), call.number("blue"))
    draft.materials[i] = replace(draft.materials[i], absorb=absorb, absorb_line=call.line)


WORDS: dict[str, Word] = {
    "absorb": Word(color_fields(), "absorb 0.8 0.2 0.1", _set_absorb, of_glass=True),
    "background": Word(_BACKGROUND, "background 0.2 0.3 0.5", _set_background),
    "depth": Word((_DEPTH,), "depth 5", _set_depth),
    "samples": Word((_SAMPLES,), "samples 64", _set_samples),
    "spot": Word(
        _SPOT, "spot 0 5 0 0 -1 0 40 softness=0.2", _add_spot, ((Field("softness", low=0.0, high=1.0), 0.0), *_LAMP_COLOR), once=False
    ),
    "sun": Word(point_fields(SUN_DIRECTION), "sun 1 2 -1 intensity=0.8", _add_sun, _LAMP_COLOR, once=False),
    "texture": Word((Text("picture"),), "texture wood.png wrap=mirror", _no_change, _TEXTURE_KEYS, once=False),
    "uv": Word(_UV, "uv 0 0 1 0 1 1", _no_change, once=False),
    "project": Word((), "project axis=y scale=2", _no_change, _PROJECT_KEYS, once=False),
    "fresnel": Word((), "fresnel", _set_fresnel, of_glass=True),
}


def read_word(tokens: Sequence[Token], line: int, faults: Faults) -> WordCall | None:
    """Check a line against the grammar of its word. None, with the faults noted, where it does not fit."""
    name = tokens[0].text
    word = WORDS.get(name)
    if word is None:
        known = ", ".join(sorted(WORDS))
        faults.add(line, tokens[0].column, f"unknown word {shown(name)}{did_you_mean(name, WORDS)} (the words: {known})")
        return None
    plain = [token for token in tokens[1:] if not _KEY.fullmatch(token.text)]
    if len(plain) != len(word.positional):
        place = plain[0] if plain else tokens[0]
        number = "1 value" if len(word.positional) == 1 else f"{len(word.positional)} values"
        faults.add(line, place.column, f'{name} takes {number}, as in "{word.example}", found {len(plain)}')
        return None
    values: dict[str, Value | None] = {f.name: default for f, default in word.keys}
    for declared, token in zip(word.positional, plain, strict=True):
        values[declared.name] = _read_value(declared, token, line, faults)
    values |= _read_keys(name, word, tokens[1:], line, faults)
    read = {key: value for key, value in values.items() if value is not None}
    columns = {declared.name: token.column for declared, token in zip(word.positional, plain, strict=True)}
    return WordCall(name, line, tokens[0].column, read, columns) if len(read) == len(values) else None


def _read_keys(name: str, word: Word, tokens: Sequence[Token], line: int, faults: Faults) -> dict[str, Value | None]:
    """The values of the line's key=value tokens; None under each key that is at fault."""
    declared = {f.name: f for f, _ in word.keys}
    values: dict[str, Value | None] = {}
    for token in tokens:
        match = _KEY.fullmatch(token.text)
        if match is None:
            continue
        key, rest = match[1], Token(match[2], token.column + match.start(2))
        if key in values:
            values[key] = None
            faults.add(line, token.column, f"the key {shown(key)} stands twice on this line")
        elif key in declared:
            values[key] = _read_value(declared[key], rest, line, faults)
        else:
            values[key] = None
            listed = ", ".join(declared) or "none"
            faults.add(line, token.column, f"{name} has no key {shown(key)}{did_you_mean(key, declared)} (its keys: {listed})")
    return values


def _read_value(declared: Field | Text | Choice, token: Token, line: int, faults: Faults) -> Value | None:
    if isinstance(declared, Field):
        return read_in_range(token, declared, line, faults)
    if isinstance(declared, Choice):
        return _read_choice(declared, token, line, faults)
    if token.left_open:
        faults.add(line, token.column, f'expected a second double quote after {shown(token.text)} ({declared.name})')
        return None
    if not token.unquoted:
        faults.add(line, token.column, f"expected a text ({declared.name}), found nothing")
        return None
    return token.unquoted


def _read_choice(declared: Choice, token: Token, line: int, faults: Faults) -> str | None:
    if token.text in declared.options:
        return token.text
    listed = ", ".join(declared.options[:-1]) + f" or {declared.options[-1]}"
    hint = did_you_mean(token.text, declared.options)
    faults.add(line, token.column, f"{declared.name} must be {listed}, found {shown(token.text)}{hint}")
    return None
