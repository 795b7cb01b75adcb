"""One fault, one error: nothing that only follows from it is told on top, lists stand once, and advice fits what is at fault."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from gltf_files import triangle
from PIL import Image

from clrt.errors import SceneError
from clrt.scene import radiance
from clrt.scene.build import load_scene
from clrt.scene.words import WORDS

DOCS = Path(__file__).parents[1] / "docs" / "scene-format.md"
HEAD = "E 0 0 0\nV 0 0 1\nF 90\nR 8 8\nL 0 0 0\n"
GREY = "M 1 1 1 1 0 0 1 0\n"
FACE = "T -1 -1 2 1 -1 2 0 1 2\n"
BALL = "S 0 0 3 1\n"


def errors(folder: Path, text: str) -> list[str]:
    """The errors of a scene text in this folder, without its path."""
    (folder / "scene.txt").write_text(text)
    with pytest.raises(SceneError) as caught:
        load_scene(folder / "scene.txt")
    return [line.removeprefix(f"{folder / 'scene.txt'}:") for line in str(caught.value).split("\n")]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a picture, a text that is none, and a picture of numbers that no picture on a surface has."""
    Image.new("RGB", (4, 4), "white").save(tmp_path / "a.png")
    Image.new("F", (2, 2)).save(tmp_path / "float.tiff")
    (tmp_path / "notes.txt").write_text("no picture\n")
    return tmp_path


# What follows from a fault


@pytest.mark.parametrize(
    ("lines", "error"),
    [
        ('texture "a.png\nproject\n' + FACE, '7:9: error: expected a second double quote after ""a.png" (picture)'),
        ("texture a.png alpha=maybe\nproject\n" + FACE, '7:21: error: alpha must be no or yes, found "maybe"'),
        ("normalmap a.png strength=1e9\nproject\n" + FACE, '7:26: error: strength must be from -1000 to 1000, found "1e9"'),
        ("txture a.png\nproject\n" + FACE, '7:1: error: unknown word "txture"; did you mean "texture"?'),
        ("Texture a.png\nproject\n" + FACE, '7:1: error: unknown start of a line "Texture"; did you mean "texture"?'),
        ("texture a.png\nproject axis=w\n" + FACE, '8:14: error: axis must be x, y or z, found "w"'),
        ("texture a.png\n" + FACE + "uv 0 0 1 0 1\n", '9:4: error: uv takes 6 values, as in "uv 0 0 1 0 1 1", found 5'),
    ],
)
def test_unread_line_of_a_picture_is_not_told_as_missing(folder: Path, lines: str, error: str) -> None:
    (found,) = errors(folder, HEAD + GREY + lines)
    assert re.sub(r" \(the (words|letters): .*\)", "", found) == error


def test_picture_that_another_material_lacks_is_still_told(folder: Path) -> None:
    text = HEAD + GREY + "texture a.png alpha=maybe\n" + GREY + "project\n" + FACE
    assert [found.partition(" error: ")[0] for found in errors(folder, text)] == ["7:21:", "9:1:"]
    text = HEAD + GREY + "texture a.png\n" + FACE + FACE + "uv 0 0 1 0 1\n"
    assert [found.partition(" error: ")[0] for found in errors(folder, text)] == ["7:1:", "10:4:"]


@pytest.mark.parametrize("line", ["include ../s.txt", "include gone.txt", "include", "inclde body.txt", "include scene.txt"])
@pytest.mark.parametrize("rest", ["", FACE, HEAD + FACE + "instance a 0 0 0\n", HEAD + GREY + "project\n" + FACE])
def test_text_that_is_not_included_may_hold_what_is_missing(folder: Path, line: str, rest: str) -> None:
    """Nothing to render, no eye, no material, no such object: none of it is known."""
    (found,) = errors(folder, f"{line}\n{rest}")
    assert re.match(r"1:\d: error: ", found)


def test_lines_beside_a_refused_include_tell_their_own_faults(folder: Path) -> None:
    found = errors(folder, "include gone.txt\nF 200\nfog 1 2\n")
    assert [error.partition(" error: ")[0] for error in found] == ["1:9:", "2:3:", "3:5:"]


def test_mesh_line_that_was_meant_is_something_to_render(folder: Path) -> None:
    for line in ("mesh", "\tmesh\ta.obj scale=0", "mseh a.obj"):
        assert len(errors(folder, HEAD + GREY + line)) == 1
    assert errors(folder, HEAD + GREY + "# mesh a.obj")[0].startswith("1:1: error: there is nothing to render")


@pytest.mark.parametrize("hidden", ["", " hidden=yes"])
@pytest.mark.parametrize("rest", [BALL + "O\ninstance a 0 0 0\n", BALL + "O\ninstance a 0 0 0 name=b\ninstance b 0 0 1\n"])
def test_object_without_triangles_is_told_without_its_instances(folder: Path, hidden: str, rest: str) -> None:
    (found,) = errors(folder, f"{HEAD}{GREY}object a{hidden}\n{rest}")
    assert found.startswith("7:1: error: object names triangles, and there are none")


def test_mesh_that_cannot_be_placed_is_told_without_its_instances(folder: Path) -> None:
    (folder / "a.glb").write_bytes(triangle().glb())
    (found,) = errors(folder, HEAD + GREY + "mesh a.glb name=a hidden=yes x=1e30 scale=1e30\ninstance a 0 0 0\n")
    assert re.fullmatch(r"7:6: error: a\.glb: .*a vertex lies beyond 1e\+30; .*", found)


def test_object_that_no_line_names_is_still_told(folder: Path) -> None:
    found = errors(folder, HEAD + GREY + FACE + "O\nobject a\n" + BALL + "instance b 0 0 0\n")
    assert [error.partition(";")[0] for error in found] == [
        "9:1: error: object names triangles, and there are none", '11:10: error: no object is called "b"',
    ]  # fmt: skip


# Keys and lists


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("spot 0 0 0 0 1 0 30 red= 3", '26: error: no blank may stand beside "="; write "red=3"'),
        ("spot 0 0 0 0 1 0 30 red =3", '26: error: no blank may stand beside "="; write "red=3"'),
        ("spot 0 0 0 0 1 0 30 red  =  3 green=1", '26: error: no blank may stand beside "="; write "red=3"'),
        ("fog blue=1 red = 0.5 2", '17: error: no blank may stand beside "="; write "red=0.5"'),
        ("indirect clamp= 5", '15: error: no blank may stand beside "="; write "clamp=5"'),
        ("spot 0 0 0 0 1 0 30 red=", '30: error: expected a number (red), found ""'),
        ("spot 0 0 0 0 1 0 red= green=3", '11: error: spot takes 7 values, as in "spot 0 5 0 0 -1 0 40 softness=0.2", found 6'),
        ("spot 0 0 0 0 1 0 30 red =", '11: error: spot takes 7 values, as in "spot 0 5 0 0 -1 0 40 softness=0.2", found 9'),
        ("spot 0 0 0 0 1 0 30 red 3", '11: error: spot takes 7 values, as in "spot 0 5 0 0 -1 0 40 softness=0.2", found 9'),
    ],
)
def test_blank_beside_an_equals_sign_is_named(folder: Path, line: str, error: str) -> None:
    assert errors(folder, HEAD + GREY + BALL + "     " + line) == [f"8:{error}"]


def test_words_are_listed_once(folder: Path) -> None:
    found = errors(folder, HEAD + "foo\n" + GREY + "qqqqq\nfoo\nfoo\n" + BALL)
    listed = f" (the words: {', '.join(sorted(WORDS))})"
    fog, none = 'error: unknown word "foo"; did you mean "fog"?', 'error: unknown word "qqqqq"'
    assert found == [f"6:1: {fog}{listed}", f"8:1: {none}", f"9:1: {fog}", f"10:1: {fog}"]
    assert errors(folder, HEAD + GREY + "foo\n" + BALL) == [f"7:1: {fog}{listed}"]


# Advice and limits


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("notes.txt", "notes.txt is no picture that can be read, or has no pixels; save it as .hdr, .exr or PNG"),
        ("float.tiff", "float.tiff has pixels of the kind F; save it as .hdr or .exr"),
        ("a.png", "a.png has 4 x 4 pixels; an environment has at most 10"),
    ],
)
def test_environment_is_told_what_suits_one(folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, error: str) -> None:
    monkeypatch.setattr(radiance, "MOST_TEXELS", 10)
    assert errors(folder, f"{HEAD}{GREY}environment {name}\n{BALL}") == [f"7:13: error: {error}"]


def test_limits_that_fields_set_together_are_told(folder: Path) -> None:
    found = errors(folder, HEAD + GREY + "lens -1 4\nobject a\n" + FACE + "O\ninstance a 0 0 0 scale=0 scale_x=-1\n")
    assert found == [
        '7:6: error: radius of the lens must be at least 0 and at most 1e+06 times the distance of the sharp plane, found "-1"',
        '11:24: error: scale must be between 0.0001 and 10000, found "0"',
        '11:34: error: scale_x must be between 0.0001 and 10000, found "-1"',
    ]


def test_scales_may_make_up_for_each_other(folder: Path) -> None:
    text = HEAD + GREY + "object a\n" + FACE + "O\ninstance a 0 0 0 scale=1e5 scale_x=1e-5 scale_y=1e-5 scale_z=1e-5\n"
    (folder / "scene.txt").write_text(text)
    (instance,) = load_scene(folder / "scene.txt").instances
    np.testing.assert_allclose(instance.world_from_object[:, :3], np.eye(3), rtol=1e-15)


# The documentation


def test_errors_of_the_documentation_are_those_that_are_told(folder: Path) -> None:
    """A text with the faults of its sample, on their lines; the list of words is cut short there."""
    lines = {1: "E 0 0 0", 2: "V 0 0 1", 3: "F 90", 4: "R 8 8", 11: GREY, 12: "M 0.5 0.5 1 0.1 0.9 0.3 20 0 0", 15: "T 0.5 0 x 1 0 0 0 1 0",
             20: "S 0 0.5 0  0", 31: "backgroud 1 1 1"}  # fmt: skip
    found = errors(folder, "\n".join(lines.get(number, "").rstrip() for number in range(1, 32)))
    sample = DOCS.read_text(encoding="utf-8").partition("\n## Errors\n")[2].split("```\n")[1].splitlines()
    patterns = [re.escape(line.removeprefix("scene.txt:")).replace(r",\ \.\.\.", "(, [a-z]+)+") for line in sample]
    assert len(found) == len(patterns) == 4
    assert all(map(re.fullmatch, patterns, found))
