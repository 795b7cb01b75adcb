"""Words whose lines scene/textures.py reads: texture, uv, project. They hold for the material or the triangle above them."""

from __future__ import annotations

from clrt.scene.grammar import Field
from clrt.scene.words.word import Choice, Text, Value, Word, no_change

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

WORDS: dict[str, Word] = {
    "texture": Word((Text("picture"),), "texture wood.png wrap=mirror", no_change, _TEXTURE_KEYS, once=False),
    "uv": Word(_UV, "uv 0 0 1 0 1 1", no_change, once=False),
    "project": Word((), "project axis=y scale=2", no_change, _PROJECT_KEYS, once=False),
}
