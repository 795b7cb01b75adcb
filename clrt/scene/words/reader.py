"""A line with a word, read against the grammar of its word."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from clrt.scene.faults import Faults, did_you_mean, shown
from clrt.scene.grammar import Field
from clrt.scene.tokens import Token, read_in_range
from clrt.scene.words.word import Choice, Text, Value, Word, WordCall

_KEY = re.compile(r"([a-z][a-z_]*)=(.*)")
_KEY_ALONE = re.compile(r"[a-z][a-z_]*=?")


def read_word(words: Mapping[str, Word], tokens: Sequence[Token], line: int, faults: Faults) -> WordCall | None:
    """Check a line against the grammar of its word. None, with the faults noted, where it does not fit."""
    name = tokens[0].text
    word = words.get(name)
    if word is None:
        known = faults.once(f" (the words: {', '.join(sorted(words))})")
        faults.add(line, tokens[0].column, f"unknown word {shown(name)}{did_you_mean(name, words)}{known}")
        return None
    plain = [token for token in tokens[1:] if not _KEY.fullmatch(token.text)]
    if len(plain) != len(word.positional):
        _report_count(name, word, tokens, plain, line, faults)
        return None
    values: dict[str, Value | None] = {f.name: default for f, default in word.keys}
    for declared, token in zip(word.positional, plain, strict=True):
        values[declared.name] = _read_value(declared, token, line, faults)
    values |= _read_keys(name, word, tokens[1:], line, faults)
    read = {key: value for key, value in values.items() if value is not None}
    columns = {declared.name: token.column for declared, token in zip(word.positional, plain, strict=True)}
    return WordCall(name, line, tokens[0].column, read, columns) if len(read) == len(values) else None


def _report_count(name: str, word: Word, tokens: Sequence[Token], plain: Sequence[Token], line: int, faults: Faults) -> None:
    """Note that a line has too few or too many positional values, or that blanks tear a key=value apart, which makes them too many."""
    torn = _torn_key(tokens[1:])
    if torn is not None:
        faults.add(line, torn.column, f'no blank may stand beside "="; write {shown(torn.text)}')
        return
    place = plain[0] if plain else tokens[0]
    number = "1 value" if len(word.positional) == 1 else f"{len(word.positional)} values"
    faults.add(line, place.column, f'{name} takes {number}, as in "{word.example}", found {len(plain)}')


def _torn_key(tokens: Sequence[Token]) -> Token | None:
    """The first key=value with a blank beside its `=`, without the blank; None where there is none."""
    for token, *rest in (tokens[i : i + 3] for i in range(len(tokens) - 1)):
        if not _KEY_ALONE.fullmatch(token.text) or token.text.endswith("=") == rest[0].text.startswith("="):
            continue
        parts = [token.text, *(part.text for part in (rest if rest[0].text == "=" else rest[:1]))]
        if parts[-1] != "=" and not any(_KEY.fullmatch(part) for part in parts[1:]):
            return Token("".join(parts), token.column)
    return None


def _read_keys(name: str, word: Word, tokens: Sequence[Token], line: int, faults: Faults) -> dict[str, Value | None]:
    """The values of the line's key=value tokens; None under each key that is at fault."""
    declared = {f.name: f for f, _ in word.keys}
    values: dict[str, Value | None] = {}
    for token in tokens:
        match = _KEY.fullmatch(token.text)
        if match is None:
            continue
        key, rest = match[1], Token(match[2], token.column + match.start(2))
        if key in values:
            values[key] = None
            faults.add(line, token.column, f"the key {shown(key)} stands twice on this line")
        elif key in declared:
            values[key] = _read_value(declared[key], rest, line, faults)
        else:
            values[key] = None
            listed = ", ".join(declared) or "none"
            faults.add(line, token.column, f"{name} has no key {shown(key)}{did_you_mean(key, declared)} (its keys: {listed})")
    return values


def _read_value(declared: Field | Text | Choice, token: Token, line: int, faults: Faults) -> Value | None:
    if isinstance(declared, Field):
        return read_in_range(token, declared, line, faults)
    if isinstance(declared, Choice):
        return _read_choice(declared, token, line, faults)
    if token.left_open:
        faults.add(line, token.column, f'expected a second double quote after {shown(token.text)} ({declared.name})')
        return None
    if not token.unquoted:
        faults.add(line, token.column, f"expected a text ({declared.name}), found nothing")
        return None
    return token.unquoted


def _read_choice(declared: Choice, token: Token, line: int, faults: Faults) -> str | None:
    if token.text in declared.options:
        return token.text
    listed = ", ".join(declared.options[:-1]) + f" or {declared.options[-1]}"
    hint = did_you_mean(token.text, declared.options)
    faults.add(line, token.column, f"{declared.name} must be {listed}, found {shown(token.text)}{hint}")
    return None
