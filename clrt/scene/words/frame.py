"""Words of the whole picture: background, depth, samples."""

from __future__ import annotations

from clrt.scene.grammar import Field, color_fields
from clrt.scene.words.word import Draft, Word, WordCall, color_of

MOST_SAMPLES = 1 << 16  #: of a pixel
GREATEST_DEPTH = 128  #: reflections and refractions in a row; bounds the stacks of every renderer

_SAMPLES = Field("samples", low=1.0, high=float(MOST_SAMPLES), whole=True)
_DEPTH = Field("depth", low=0.0, high=float(GREATEST_DEPTH), whole=True)


def _set_background(draft: Draft, call: WordCall) -> None:
    draft.background = color_of(call)


def _set_samples(draft: Draft, call: WordCall) -> None:
    draft.samples, draft.samples_line = int(call.number("samples")), call.line


def _set_depth(draft: Draft, call: WordCall) -> None:
    draft.depth = int(call.number("depth"))


WORDS: dict[str, Word] = {
    "background": Word(color_fields(), "background 0.2 0.3 0.5", _set_background),
    "depth": Word((_DEPTH,), "depth 5", _set_depth),
    "samples": Word((_SAMPLES,), "samples 64", _set_samples),
}
