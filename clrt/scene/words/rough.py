"""Words of rough surfaces: gloss, material."""

from __future__ import annotations

from dataclasses import replace

from clrt.scene.grammar import Field
from clrt.scene.words.word import Draft, Word, WordCall, material_above

_ROUGHNESS = Field("roughness", low=0.0, high=1.0)


def _set_gloss(draft: Draft, call: WordCall) -> None:
    i = material_above(draft, call)
    draft.materials[i] = replace(draft.materials[i], gloss=call.number("roughness"), gloss_line=call.line)


def _set_metal_rough(draft: Draft, call: WordCall) -> None:
    i = material_above(draft, call)
    draft.materials[i] = replace(
        draft.materials[i].without_phong(), metal_rough=True, metallic=call.number("metallic"), roughness=call.number("roughness"),
        metal_rough_line=call.line,
    )  # fmt: skip


WORDS: dict[str, Word] = {
    "gloss": Word((_ROUGHNESS,), "gloss 0.3", _set_gloss, of="shiny"),
    "material": Word(
        (), "material metallic=1 roughness=0.3", _set_metal_rough,
        ((Field("metallic", low=0.0, high=1.0), 0.0), (Field("roughness", low=0.0, high=1.0), 0.5)), of="material",
    ),
}  # fmt: skip
