"""Words of other files: mesh, whose lines scene/mesh_lines.py reads, and include, which scene/include.py follows."""

from __future__ import annotations

from clrt.scene.grammar import Field
from clrt.scene.words.instances import HIDDEN
from clrt.scene.words.word import Choice, Text, Value, Word, no_change

_KEYS: tuple[tuple[Field | Text | Choice, Value], ...] = (
    *((Field(axis), 0.0) for axis in "xyz"), *((Field(f"turn_{axis}"), 0.0) for axis in "xyz"),
    (Field("scale", low=0.0, low_open=True), 1.0), (Choice("smooth", ("file", "yes", "no")), "file"),
    (Choice("materials", ("file", "above")), "file"), (Text("name"), ""), (HIDDEN, "no"),
)  # fmt: skip

WORDS: dict[str, Word] = {
    "include": Word((Text("file"),), "include lamps.txt", no_change, once=False),
    "mesh": Word((Text("file"),), "mesh bunny.obj scale=0.5 turn_y=90", no_change, _KEYS, once=False),
}
