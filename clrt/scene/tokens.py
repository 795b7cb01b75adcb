"""One line of a scene text, exactly: its tokens with their columns, and the number that a token stands for."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from clrt.scene.faults import Faults, shown
from clrt.scene.grammar import Field

# A comment runs from # or // to the end of the line, unless within double quotes; a quote left open runs to the end.
_TOKEN = re.compile(r'(?P<comment>#|//)|(?:"[^"]*(?:"|$)|(?!//)[^\s,"#])+')
_DECIMAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)


@dataclass(frozen=True)
class Token:
    """Characters between blanks or commas, quotes included; `column` counts characters from 1."""

    text: str
    column: int

    @property
    def unquoted(self) -> str:
        return self.text.replace('"', "")

    @property
    def left_open(self) -> bool:
        return self.text.count('"') % 2 == 1


def tokenise(line: str) -> list[Token]:
    """The tokens of a line, comments left out."""
    found: list[Token] = []
    for match in _TOKEN.finditer(line):
        if match["comment"]:
            break
        found.append(Token(match[0], match.start() + 1))
    return found


def read_number(token: Token, wanted: str, line: int, faults: Faults) -> float | None:
    """The correctly rounded value of a decimal number. None, with the fault noted, if the token is not one."""
    if _DECIMAL.fullmatch(token.text):
        return float(token.text)
    kind = "a finite number" if _NOT_FINITE.fullmatch(token.text) else "a number"
    faults.add(line, token.column, f"expected {kind} ({wanted}), found {shown(token.text)}")
    return None


def read_in_range(token: Token, declared: Field, line: int, faults: Faults) -> float | None:
    """The number of a token if it is one that the field takes; else None, with the fault noted."""
    value = read_number(token, declared.name, line, faults)
    if value is not None and declared.rejects(np.array([value]))[0]:
        report_range(token, declared, line, faults)
        return None
    return value


def report_range(token: Token, declared: Field, line: int, faults: Faults) -> None:
    """Note that the token's number lies outside what the field takes."""
    faults.add(line, token.column, f"{declared.name} must be {declared.accepted()}, found {shown(token.text)}")
