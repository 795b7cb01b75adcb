"""Words of glass: fresnel, absorb."""

from __future__ import annotations

from dataclasses import replace

from clrt.scene.grammar import color_fields
from clrt.scene.words.word import Draft, Word, WordCall, color_of, material_above


def _set_fresnel(draft: Draft, call: WordCall) -> None:
    i = material_above(draft, call)
    total = draft.materials[i].reflect + draft.materials[i].refract
    draft.materials[i] = replace(draft.materials[i], reflect=0.0, refract=total, fresnel=True, fresnel_line=call.line)


def _set_absorb(draft: Draft, call: WordCall) -> None:
    i = material_above(draft, call)
    draft.materials[i] = replace(draft.materials[i], absorb=color_of(call), absorb_line=call.line)


WORDS: dict[str, Word] = {
    "absorb": Word(color_fields(), "absorb 0.8 0.2 0.1", _set_absorb, of="glass"),
    "fresnel": Word((), "fresnel", _set_fresnel, of="glass"),
}
