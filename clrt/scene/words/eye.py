"""Words of how the eye looks: lens."""

from __future__ import annotations

from clrt.scene.faults import Faults
from clrt.scene.grammar import Field
from clrt.scene.model import Lens
from clrt.scene.words.word import Draft, Word, WordCall

WIDEST_LENS = 1e6  #: a lens's radius over the distance of its sharp plane, at most: the slope of its rays stays an ordinary number

_RADIUS, _FOCUS = "radius of the lens", "distance of the sharp plane"


def _check_lens(call: WordCall, faults: Faults) -> None:
    radius, focus = call.number(_RADIUS), call.number(_FOCUS)
    if radius > WIDEST_LENS * focus:
        fault = f"the lens is more than {WIDEST_LENS:g} times as wide as its sharp plane is far; {_RADIUS} {radius:g}, {_FOCUS} {focus:g}"
        faults.add(call.line, call.columns[_RADIUS], fault)


def _set_lens(draft: Draft, call: WordCall) -> None:
    draft.lens = Lens(call.number(_RADIUS), call.number(_FOCUS), call.line)


WORDS: dict[str, Word] = {
    "lens": Word((Field(_RADIUS, low=0.0), Field(_FOCUS, low=0.0, low_open=True)), "lens 0.05 4", _set_lens, check=_check_lens),
}
