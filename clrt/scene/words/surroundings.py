"""Words of what is around: environment, whose line scene/environment.py reads, and fog."""

from __future__ import annotations

from clrt.scene.grammar import Field
from clrt.scene.model import Fog
from clrt.scene.words.word import Draft, Text, Word, WordCall, no_change

_KEYS = ((Field("rotate", low=-360.0, high=360.0), 0.0), (Field("intensity", low=0.0, high=1e6), 1.0))

_FOG_KEYS = (
    *((Field(channel, low=0.0, high=1.0), 1.0) for channel in ("red", "green", "blue")),
    (Field("asymmetry", low=-1.0, high=1.0, low_open=True, high_open=True), 0.0),
)


def _set_fog(draft: Draft, call: WordCall) -> None:
    albedo = (call.number("red"), call.number("green"), call.number("blue"))
    draft.fields["fog"] = Fog(call.number("density"), albedo, call.number("asymmetry"), call.line)


WORDS: dict[str, Word] = {
    "environment": Word((Text("picture"),), "environment sky.hdr rotate=90 intensity=0.5", no_change, _KEYS),
    "fog": Word((Field("density", low=0.0),), "fog 0.05 red=0.9 green=0.95", _set_fog, _FOG_KEYS),
}
