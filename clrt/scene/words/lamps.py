"""Words of lights without a size: sun, spot."""

from __future__ import annotations

import math

from clrt.scene.grammar import Field, point_fields
from clrt.scene.model import SpotLight, SunLight
from clrt.scene.words.word import LAMP_COLOR, Choice, Draft, Text, Value, Word, WordCall, check_vector, lamp_color, unit_vector

_SUN_DIRECTION, _SPOT_DIRECTION = "the direction to the sun", "the spot's direction"
_SUN_EXAMPLE, _SPOT_EXAMPLE = "sun 1 2 -1 intensity=0.8", "spot 0 5 0 0 -1 0 40 softness=0.2"
_SPOT = (
    *point_fields("the spot"), *point_fields(_SPOT_DIRECTION),
    Field("cone angle in degrees", low=0.0, high=360.0, low_open=True),
)  # fmt: skip

_SPOT_KEYS: tuple[tuple[Field | Text | Choice, Value], ...] = (
    (Field("softness", low=0.0, high=1.0), 0.0), (Choice("falloff", ("yes", "no")), "no"), *LAMP_COLOR,
)  # fmt: skip


def _add_sun(draft: Draft, call: WordCall) -> None:
    draft.suns.append(SunLight(unit_vector(call, _SUN_DIRECTION), lamp_color(call), call.line))


def _add_spot(draft: Draft, call: WordCall) -> None:
    x, y, z = (call.number(f"{axis} of the spot") for axis in "xyz")
    outer = math.radians(call.number("cone angle in degrees")) / 2.0
    inner = outer * (1.0 - call.number("softness"))
    falloff = call.text("falloff") == "yes"
    draft.spots.append(SpotLight((x, y, z), unit_vector(call, _SPOT_DIRECTION), outer, inner, lamp_color(call), call.line, falloff))


WORDS: dict[str, Word] = {
    "spot": Word(
        _SPOT, _SPOT_EXAMPLE, _add_spot, _SPOT_KEYS, once=False,
        check=check_vector(_SPOT_DIRECTION, _SPOT_EXAMPLE),
    ),
    "sun": Word(
        point_fields(_SUN_DIRECTION), _SUN_EXAMPLE, _add_sun, LAMP_COLOR, once=False, check=check_vector(_SUN_DIRECTION, _SUN_EXAMPLE)
    ),
}  # fmt: skip
