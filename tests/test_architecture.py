"""docs/architecture.md against the code: every module has its row, and imports only from its row and those above."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
OUTSIDE = {"__init__", "__main__"}  #: the public interface imports whatever is asked for


def rows() -> dict[str, int]:
    """Top module or package -> number of its row in the table."""
    firsts = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \|", TEXT, re.M)
    return {name: number for number, row in enumerate(firsts) for name in re.findall(r"`(\w+)`", row)}


def top(path: Path) -> str:
    return path.relative_to(ROOT / "clrt").parts[0].removesuffix(".py")


def modules() -> list[Path]:
    return sorted(path for path in (ROOT / "clrt").rglob("*.py") if top(path) not in OUTSIDE)


def imported(path: Path) -> set[str]:
    """Dotted names of clrt's modules that a file imports, wherever in it; of `from clrt.device import pack` both parts."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return {name for name in names if name.startswith("clrt.")}


def test_every_module_has_a_row() -> None:
    assert set(rows()) == {top(path) for path in modules()}


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_come_from_above(path: Path) -> None:
    place = rows()
    used = {name.split(".")[1] for name in imported(path)}
    assert sorted(name for name in used if place.get(name, -1) > place[top(path)]) == []


def test_reference_shares_no_code_with_what_it_judges() -> None:
    files = (ROOT / "clrt" / "reference").glob("*.py")
    assert {name.split(".")[1] for path in files for name in imported(path)} <= {"errors", "scene", "reference"}


def test_every_file_that_the_page_names_is_there() -> None:
    kernels = re.findall(r"`(\w+\.cl)`", TEXT)
    assert kernels
    assert [name for name in kernels if not (ROOT / "kernels" / name).is_file()] == []
    assert [link for link in re.findall(r"\]\(([\w./]+)\)", TEXT) if not (ROOT / "docs" / link).exists()] == []
