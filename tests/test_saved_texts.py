"""Numbers of texts that earlier runs read: the same scene to the bit, the same faults, never those of another text or reader."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.scene import saved
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.faults import Faults
from clrt.scene.saved import SavedTexts, text_key
from clrt.scene.text import Declarations, read_declarations
from clrt.store import Arrays, Store

ROOT = Path(__file__).parents[1]
SCENES = sorted((ROOT / "scenes").glob("*.txt"))
MALFORMED = sorted((Path(__file__).parent / "data" / "malformed").glob("*.txt"))
HEAD = "E 0 0 -1\nV 0 0 1\nF 45\nR 32 24\nL 5 5 -5\nM 1 0.5 0.2 0.2 0.8 0 1 0\n"
#: plain lines, blanks, a comment behind numbers, an exponent, 17 digits, a word, no end of line; characters of more than one byte
MIXED = (
    HEAD + "T -1 -1 2 1 -1 2 0 1 2 # größer\n\nT -1,-1,3 1e0 -1 3 0 1.0000000000000002 3\nS 0 0 3 1\n  # π\ndepth 3\nT 0 0 4 1 0 4 0 1 4"
)


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Store:
    """An empty one, for texts of any length."""
    monkeypatch.setattr(saved, "LEAST_CHARACTERS", 0)
    return Store(tmp_path / "texts")


def read(text: str, texts: SavedTexts | None) -> Declarations:
    faults = Faults("scene.txt")
    found = read_declarations(text, "scene.txt", faults, saved=texts)
    faults.raise_if_any()
    return found


def keep(text: str, store: Store) -> None:
    """As a run does that reads this text."""
    texts = SavedTexts(store)
    read(text, texts)
    texts.keep()


def found(store: Store, monkeypatch: pytest.MonkeyPatch) -> SavedTexts:
    """Texts of earlier runs alone."""
    monkeypatch.setattr(saved, "read_bulk", lambda text: pytest.fail("the text was read"))
    return SavedTexts(store)


def assert_same(one: object, other: object, place: str = "scene") -> None:
    """Equal in every field, arrays to the bit."""
    assert type(one) is type(other), place
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes()), place
    elif is_dataclass(one):
        for field in fields(one):
            assert_same(getattr(one, field.name), getattr(other, field.name), f"{place}.{field.name}")
    elif isinstance(one, tuple | list) and isinstance(other, tuple | list):
        assert len(one) == len(other), place
        for number, pair in enumerate(zip(one, other, strict=True)):
            assert_same(*pair, f"{place}[{number}]")
    else:
        assert one == other, place


def test_lines_come_back_to_the_bit_and_in_order(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    keep(MIXED, store)
    plain = read(MIXED, None)
    again = read(MIXED, found(store, monkeypatch))
    assert list(plain.rows) == list(again.rows)
    for form, rows in plain.rows.items():
        assert_same(again.rows[form].lines, rows.lines)
        assert_same(again.rows[form].values, rows.values)
    assert len(again.get("T", 9)) == 3  # and none twice
    assert_same(again.words, plain.words)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scene_is_the_same(path: Path, store: Store) -> None:
    plain = load_scene(path)
    for _ in range(2):
        texts = SavedTexts(store)
        assert_same(load_scene(path, saved=texts), plain)
        texts.keep()
    assert len(list(store.folder.iterdir())) == 1


@pytest.mark.parametrize("path", MALFORMED, ids=lambda path: path.stem)
def test_faults_are_the_same(path: Path, store: Store) -> None:
    text = path.read_text(encoding="utf-8")
    said: list[str] = []
    for _ in range(3):
        texts = SavedTexts(store) if said else None
        with pytest.raises(SceneError) as caught:
            parse_scene(text, "scene.txt", saved=texts)
        said.append(str(caught.value))
        if texts is not None:
            texts.keep()
    assert said[0] == said[1] == said[2]


def test_nothing_is_kept_before_it_is_asked_for(store: Store) -> None:
    read(MIXED, SavedTexts(store))
    assert not store.folder.exists()


def test_short_texts_are_not_kept(tmp_path: Path) -> None:
    store = Store(tmp_path)
    keep(MIXED, store)
    assert list(tmp_path.iterdir()) == []


def test_changed_number_is_read(store: Store) -> None:
    keep(MIXED, store)
    assert read(MIXED.replace("1.0000000000000002", "1.0000000000000004"), SavedTexts(store)).get("T", 9).values[1, 7] == 1 + 2**-51


def test_changed_text_that_is_included_is_read(tmp_path: Path, store: Store) -> None:
    (tmp_path / "part.txt").write_text("T -1 -1 2 1 -1 2 0 1 2\n")
    (tmp_path / "scene.txt").write_text(HEAD + 'include "part.txt"\n')
    for height in (1.0, 7.5):
        (tmp_path / "part.txt").write_text(f"T -1 -1 2 1 -1 2 0 {height} 2\n")
        texts = SavedTexts(store)
        assert load_scene(tmp_path / "scene.txt", saved=texts).objects[0].vertices[0, 2, 1] == height
        texts.keep()


def test_another_reader_has_other_names(monkeypatch: pytest.MonkeyPatch) -> None:
    before = text_key(MIXED)
    monkeypatch.setattr(saved, "code_digest", lambda: "of other code")
    assert text_key(MIXED) != before


def test_name_covers_all_code_of_the_reader() -> None:
    """What the files of the fast reader import from clrt is of them, or types alone."""
    folder = Path(saved.__file__).parent
    imported = set()
    for name in saved._READERS:
        for node in ast.walk(ast.parse((folder / name).read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("clrt"):
                imported |= {f"{node.module}.{alias.name}" for alias in node.names}
    own = {f"clrt.scene.{Path(name).stem}" for name in saved._READERS} | {"clrt.scene.decimals"}
    assert {name for name in imported if name not in own and name.rpartition(".")[0] not in own} == {"clrt.scene.model.FloatArray"}


def test_entry_of_another_kind_is_not_taken(store: Store) -> None:
    others: list[Arrays] = [{"lines": np.zeros(3)}, {"left at": np.arange(2), "left": np.zeros(0, np.uint8)}]
    for arrays in others:
        store.put(text_key(MIXED), arrays)
        assert_same(read(MIXED, SavedTexts(store)).get("T", 9).values, read(MIXED, None).get("T", 9).values)


def test_command_takes_what_it_kept(tmp_path: Path) -> None:
    corners = np.random.default_rng(3).random((3500, 9)).round(6) + np.tile([-0.5, -0.5, 2.0], 3)
    text = HEAD + "".join("T " + " ".join(f"{x:.6f}" for x in corner) + "\n" for corner in corners)
    assert len(text) > saved.LEAST_CHARACTERS
    (tmp_path / "scene.txt").write_text(text)
    pictures = []
    for _ in range(2):
        command = [sys.executable, "-m", "clrt", "scene.txt", "-q"]
        subprocess.run(command, cwd=tmp_path, env=os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")}, check=True)
        pictures.append((tmp_path / "scene.png").read_bytes())
        (kept,) = (tmp_path / "cache" / "clrt" / "texts").iterdir()
        assert kept.stem == text_key(text)
    assert pictures[0] == pictures[1]
