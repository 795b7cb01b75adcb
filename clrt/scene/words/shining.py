"""Words of light that is sampled: arealight, indirect."""

from __future__ import annotations

import math
from dataclasses import replace

from clrt.scene.grammar import Field, color_fields
from clrt.scene.model import Indirect
from clrt.scene.words.word import Draft, Word, WordCall, color_of, material_above

_CLAMP = Field("clamp", low=0.0, low_open=True)


def _set_emission(draft: Draft, call: WordCall) -> None:
    i = material_above(draft, call)
    draft.materials[i] = replace(draft.materials[i], emission=color_of(call), emission_line=call.line)


def _set_indirect(draft: Draft, call: WordCall) -> None:
    clamp = call.values["clamp"]
    draft.fields["indirect"] = Indirect(math.inf if clamp == "none" else float(clamp), call.line)


WORDS: dict[str, Word] = {
    "arealight": Word(color_fields(), "arealight 4 4 3", _set_emission, of="material"),
    "indirect": Word((), "indirect", _set_indirect, ((_CLAMP, "none"),)),
}
