"""Decimal numbers read many at once, against Python's own reader."""

from __future__ import annotations

import re

import numpy as np
import pytest

from clrt.scene.bulk import read_bulk
from clrt.scene.decimals import WINDOW, read_decimals

TAKEN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")


def read(tokens: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """The tokens side by side in one text, as the reader of scenes has them."""
    lengths = np.array([len(token) for token in tokens])
    starts = WINDOW + np.cumsum(lengths + 1) - lengths - 1
    return read_decimals(b"\n" * WINDOW + " ".join(tokens).encode("ascii") + b"\n", starts, starts + lengths)


def check(tokens: list[str]) -> int:
    """Each token that is right has the value that Python gives it, sign of zero included; the number of those."""
    values, right = read(tokens)
    for token, value, taken in zip(tokens, values.tolist(), right.tolist(), strict=True):
        simple = TAKEN.fullmatch(token) is not None and len(token) <= 16 and sum(c.isdigit() for c in token) <= 15
        assert taken == simple, token
        if taken:
            assert value == float(token), token
            assert np.signbit(value) == token.startswith("-"), token
    return int(right.sum())


def test_decimals_are_those_of_python() -> None:
    rng = np.random.default_rng(20)
    tokens = []
    for size, place, sign in zip(rng.integers(1, 17, 20_000), rng.random(20_000), rng.integers(0, 3, 20_000), strict=True):
        digits = "".join(rng.choice(list("0123456789"), size))
        dot = int(place * 1.2 * (size + 1))
        number = digits if dot > size else f"{digits[:dot]}.{digits[dot:]}"
        tokens.append(("", "-", "+")[sign] + number)
    assert check(tokens) > 15_000


def test_decimals_at_the_edges_are_those_of_python() -> None:
    words = ["0", "-0", "-0.0", "+.5", "5.", "-123456.7", "1234567.", "12345678", "12345678.", "12345678.9", "1234567.8", ".1234567",
             ".12345678", "-.1234567890123", "0.00000000000001", "9" * 15, "123456789012.345"]  # fmt: skip
    assert check(words) == len(words)


@pytest.mark.parametrize(
    "token",
    [".", "-", "+", "-.", "+-1", "--1", "1.2.3", "1-2", "1..2", "1e5", "1E-5", "E", "T", "12345678T", "." * 8, "9" * 16, "-" * 9, "1" * 40],
)
def test_decimals_of_another_form_are_left(token: str) -> None:
    assert not read(["1.5", token, "2.5"])[1][1]
    assert read(["1.5", token, "2.5"])[1][[0, 2]].all()


def test_lines_of_another_form_leave_the_others_alone() -> None:
    """A number at fault leaves its own line, and those of other forms, to the exact reader."""
    lines = ["L 1 2 3", "L 0.12345678901234567 1e-5 3", "L 1,2,x", "L 4 5 6.5", "", "L 1 2 3e"]
    rows, left = read_bulk("\n".join(lines))
    assert left == [(1, lines[1]), (2, lines[2]), (5, lines[5])]
    assert rows["L", 3].lines.tolist() == [1, 4]
    lines[5] = "# L 1 2 3e"
    rows, left = read_bulk("\n".join(lines))
    assert left == [(2, lines[2]), (5, lines[5])]
    assert rows["L", 3].lines.tolist() == [1, 2, 4]
    assert rows["L", 3].values.tolist() == [[1, 2, 3], [0.12345678901234567, 1e-5, 3], [4, 5, 6.5]]


def test_long_texts_are_read_like_short_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cut into blocks at any line, a text gives the same rows and the same lines left."""
    rng = np.random.default_rng(21)
    forms = ["T " + " ".join(["{:.6f}"] * 9), "L {:.3f} {:.3f} {:.3f}", "", "# {:.2f}", "S {:.1f},{:.1f},{:.1f},{:.1e}", "  O"]
    lines = [str(rng.choice(forms)).format(*rng.normal(size=9)) for _ in range(300)]
    text = "\n".join(lines)
    whole, left = read_bulk(text)
    assert len(whole["S", 4]) > 20
    for size in (1, 7, 100, 1000):
        monkeypatch.setattr("clrt.scene.bulk._BLOCK", size)
        rows, remain = read_bulk(text)
        assert remain == left
        assert rows.keys() == whole.keys()
        for form, part in rows.items():
            assert part.lines.tolist() == whole[form].lines.tolist()
            assert part.values.tolist() == whole[form].values.tolist()
