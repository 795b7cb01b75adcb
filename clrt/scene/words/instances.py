"""Words of objects: names, and placing an object once more. What they mean together is `clrt.scene.instances`' concern."""

from __future__ import annotations

from clrt.scene.grammar import Field, point_fields
from clrt.scene.words.word import Choice, Text, Value, Word, no_change

MOST_SCALE = 1e4  #: of an instance, and its inverse the least: products of three lengths then stay within float32 in either space

HIDDEN = Choice("hidden", ("no", "yes"))
_TURNS = tuple(Field(f"turn_{axis}") for axis in "xyz")
_BETWEEN = f"between {1.0 / MOST_SCALE:g} and {MOST_SCALE:g}"  #: for all the scales together: one may be beyond if others make up for it
_SCALES = tuple(Field(name, low=0.0, low_open=True, within=_BETWEEN) for name in ("scale", "scale_x", "scale_y", "scale_z"))
_KEYS: tuple[tuple[Field | Text | Choice, Value], ...] = (
    *((turn, 0.0) for turn in _TURNS), *((scale, 1.0) for scale in _SCALES), (Text("name"), ""), (HIDDEN, "no"),
)  # fmt: skip

WORDS: dict[str, Word] = {
    "object": Word((Text("name"),), "object rabbit hidden=yes", no_change, ((HIDDEN, "no"),), once=False),
    "instance": Word((Text("of"), *point_fields("the instance")), "instance rabbit 0 0 2 turn_y=90", no_change, _KEYS, once=False),
}
