"""Words of how the eye looks, and of time: lens, shutter, move."""

from __future__ import annotations

from clrt.scene.faults import Faults
from clrt.scene.grammar import Field, point_fields
from clrt.scene.model import Lens, Shutter
from clrt.scene.words.word import Choice, Draft, Word, WordCall, no_change

WIDEST_LENS = 1e6  #: a lens's radius over the distance of its sharp plane, at most: the slope of its rays stays an ordinary number
LATEST = 1e6  #: of times, and their opposite the earliest

_RADIUS, _FOCUS = "radius of the lens", "distance of the sharp plane"
_OPEN, _CLOSE = "time at which the shutter opens", "time at which it closes"
_RADII = f"at least 0 and at most {WIDEST_LENS:g} times the {_FOCUS}"
MOTION = "the motion"  #: the fields of `move` are "x of the motion" and so on


def _check_lens(call: WordCall, faults: Faults) -> None:
    radius, focus = call.number(_RADIUS), call.number(_FOCUS)
    if radius > WIDEST_LENS * focus:
        fault = f"the lens is more than {WIDEST_LENS:g} times as wide as its sharp plane is far; {_RADIUS} {radius:g}, {_FOCUS} {focus:g}"
        faults.add(call.line, call.columns[_RADIUS], fault)


def _set_lens(draft: Draft, call: WordCall) -> None:
    draft.fields["lens"] = Lens(call.number(_RADIUS), call.number(_FOCUS), call.line)


def _check_shutter(call: WordCall, faults: Faults) -> None:
    if call.number(_CLOSE) < call.number(_OPEN):
        fault = f"the shutter closes at {call.number(_CLOSE):g}, before it opens at {call.number(_OPEN):g}; exchange the two"
        faults.add(call.line, call.columns[_CLOSE], fault)


def _set_shutter(draft: Draft, call: WordCall) -> None:
    draft.fields["shutter"] = Shutter(call.number(_OPEN), call.number(_CLOSE), line=call.line)


WORDS: dict[str, Word] = {
    "lens": Word(
        (Field(_RADIUS, low=0.0, within=_RADII), Field(_FOCUS, low=0.0, low_open=True)), "lens 0.05 4", _set_lens, check=_check_lens
    ),
    "move": Word(point_fields(MOTION), "move 0.5 0 0", no_change, ((Choice("of", ("object", "eye")), "object"),), once=False),
    "shutter": Word((Field(_OPEN, -LATEST, LATEST), Field(_CLOSE, -LATEST, LATEST)), "shutter 0 1", _set_shutter, check=_check_shutter),
}
