"""Words of surfaces that light passes straight through: opacity."""

from __future__ import annotations

from dataclasses import replace

from clrt.scene.grammar import Field
from clrt.scene.words.word import Choice, Draft, Word, WordCall, material_above

_OPACITY = Field("opacity", low=0.0, high=1.0)


def _set_opacity(draft: Draft, call: WordCall) -> None:
    i = material_above(draft, call)
    draft.materials[i] = replace(
        draft.materials[i], opacity=call.number("opacity"), opacity_of=call.text("of"), opacity_line=call.line
    )


WORDS: dict[str, Word] = {
    "opacity": Word((_OPACITY,), "opacity 0.5 of=shadow", _set_opacity, ((Choice("of", ("all", "shadow")), "all"),), of="material"),
}
