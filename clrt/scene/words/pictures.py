"""Words whose lines scene/textures.py reads: texture, normalmap, uv, project. They hold for the material or the triangle above them."""

from __future__ import annotations

from clrt.scene.faults import Faults
from clrt.scene.grammar import Field
from clrt.scene.words.word import Choice, Text, Value, Word, WordCall, no_change

MOST_TILT = 1e3  #: strength of a normal map: its sideways parts times this

_TEXTURE_KEYS: tuple[tuple[Field | Text | Choice, Value], ...] = (
    (Choice("wrap", ("repeat", "clamp", "mirror")), "repeat"),
    (Choice("filter", ("linear", "nearest")), "linear"),
    (Choice("srgb", ("yes", "no")), "yes"),
    (Choice("alpha", ("no", "yes")), "no"),
    (Field("cutoff", low=0.0, high=1.0), 0.0),
)
_NORMAL_KEYS: tuple[tuple[Field | Text | Choice, Value], ...] = (
    (Field("strength", low=-MOST_TILT, high=MOST_TILT), 1.0),
    *((key, default) for key, default in _TEXTURE_KEYS if key.name in ("wrap", "filter")),
)
_UV = tuple(Field(f"{axis} of corner {corner}") for corner in (1, 2, 3) for axis in "uv")
_PROJECT_KEYS: tuple[tuple[Field | Text | Choice, Value], ...] = (
    (Choice("axis", ("x", "y", "z")), "y"),
    (Field("scale", low=0.0, low_open=True), 1.0),
)


def _check_cutoff(call: WordCall, faults: Faults) -> None:
    if call.number("cutoff") > 0.0 and call.text("alpha") == "no":
        faults.add(call.line, call.column, "cutoff has no effect without alpha=yes; add that, or leave it out")


WORDS: dict[str, Word] = {
    "texture": Word((Text("picture"),), "texture wood.png wrap=mirror", no_change, _TEXTURE_KEYS, once=False, check=_check_cutoff),
    "normalmap": Word((Text("picture"),), "normalmap bumps.png strength=0.5", no_change, _NORMAL_KEYS, once=False),
    "uv": Word(_UV, "uv 0 0 1 0 1 1", no_change, once=False),
    "project": Word((), "project axis=y scale=2", no_change, _PROJECT_KEYS, once=False),
}
