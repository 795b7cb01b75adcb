"""The words of a scene text: `word positional... key=value...`, and the one registry where they plug in.

To add a word, write its grammar and what it does to the draft of the scene in a module of its effect, and enter that module here.
"""

from __future__ import annotations

from collections.abc import Sequence

from clrt.scene.faults import Faults
from clrt.scene.tokens import Token
from clrt.scene.words import eye, frame, glass, instances, lamps, meshes, pictures, reader, rough, shining, surface, surroundings
from clrt.scene.words.word import Choice, Draft, Text, Word, WordCall

__all__ = ["WORDS", "Choice", "Draft", "Text", "Word", "WordCall", "read_word"]

WORDS: dict[str, Word] = {
    **frame.WORDS, **eye.WORDS, **lamps.WORDS, **pictures.WORDS, **glass.WORDS, **instances.WORDS,
    **meshes.WORDS, **rough.WORDS, **shining.WORDS, **surface.WORDS, **surroundings.WORDS,
}  # fmt: skip


def read_word(tokens: Sequence[Token], line: int, faults: Faults) -> WordCall | None:
    """Check a line against the grammar of its word. None, with the faults noted, where it does not fit."""
    return reader.read_word(WORDS, tokens, line, faults)
