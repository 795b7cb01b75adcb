"""The word of light from all around, environment, whose line scene/environment.py reads."""

from __future__ import annotations

from clrt.scene.grammar import Field
from clrt.scene.words.word import Text, Word, no_change

_KEYS = ((Field("rotate", low=-360.0, high=360.0), 0.0), (Field("intensity", low=0.0, high=1e6), 1.0))

WORDS: dict[str, Word] = {"environment": Word((Text("picture"),), "environment sky.hdr rotate=90 intensity=0.5", no_change, _KEYS)}
