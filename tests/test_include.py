"""include: lines of other texts as if they stood there; places, paths and lines of what is made of them; what is wrong."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clrt.errors import SceneError
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.model import Scene

CAMERA = "E 0 0 -3\nV 0 0 1\nF 45\nR 32 24\n"
LAMPS = "L 5 5 -5\nsun 0 1 -1 intensity=0.5\n"
BODY = "M 1 1 1 0.1 0.9 0.3 20 0\nT 0 0 0 1 0 0 0 1 0\nO\nS 0 0 2 1\n"


def scene(folder: Path, **files: str) -> Scene:
    """The scene of main.txt among these texts, `__` in a name for a folder."""
    for name, text in files.items():
        path = folder / (name.replace("__", "/") + ".txt")
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return load_scene(folder / "main.txt")


def same(one: Scene, other: Scene) -> None:
    np.testing.assert_array_equal(one.objects[0].vertices, other.objects[0].vertices)
    np.testing.assert_array_equal(one.objects[0].material_ids, other.objects[0].material_ids)
    np.testing.assert_array_equal(one.camera.corners, other.camera.corners)
    assert [m.color for m in one.materials] == [m.color for m in other.materials]
    assert [light.position for light in one.lights] == [light.position for light in other.lights]
    assert len(one.suns) == len(other.suns)


@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
def test_included_lines_stand_where_the_line_is(tmp_path: Path, ends: str) -> None:
    materials = "M 0 1 0 0 1 0 1 0"
    text = f'{CAMERA}M 1 0 0 0 1 0 1 0\nT 0 0 0 1 0 0 0 1 0\n include "green.txt" # and then\nT 0 0 1 1 0 1 0 1 1\n{LAMPS}'
    found = scene(tmp_path, main=text.replace("\n", ends), green=f"\ufeff# a material{ends}{materials}")
    same(found, parse_scene(text.replace(' include "green.txt" # and then', materials)))
    assert found.objects[0].material_ids.tolist() == [0, 1]


def test_texts_include_texts_relative_to_themselves(tmp_path: Path) -> None:
    found = scene(tmp_path, main=CAMERA + "include parts/all.txt\n", parts__all="include lamps.txt\ninclude ../body.txt\n",
                  parts__lamps=LAMPS, body=BODY)  # fmt: skip
    same(found, parse_scene(CAMERA + LAMPS + BODY))


def test_pictures_of_an_included_text_are_found_beside_it(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    Image.fromarray(np.full((2, 2, 3), 9, np.uint8)).save(tmp_path / "parts" / "a.png")
    found = scene(tmp_path, main=CAMERA + LAMPS + "include parts/body.txt\n", parts__body="M 1 1 1 0 1 0 1 0\ntexture a.png\nS 0 0 2 1\n")
    assert found.textures[0].picture.texels[0, 0, 0] == 9


def test_fault_has_the_place_in_its_file(tmp_path: Path) -> None:
    body = "M 1 1 1 0.1 0.9 0.3 20 0\ninclude b.txt\nS 0 0 x 1\n"
    with pytest.raises(SceneError) as caught:
        scene(tmp_path, main="# scene\n" + CAMERA + "include parts/a.txt\nL 1 2\n", parts__a=body, parts__b="\n  V 0 0 1\n")
    assert str(caught.value).replace(str(tmp_path), "").splitlines() == [
        "/parts/b.txt:2:3: error: a second V line; the first is line 3, remove one of the two",
        '/parts/a.txt:3:7: error: expected a number (z of the centre), found "x"',
        "/main.txt:7:3: error: L takes 3 or 6 numbers, found 2",
    ]


def test_message_names_the_file_of_another_line(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"main\.txt:6:1: error: a second E line; the first is line 1 of .*eye\.txt"):
        scene(tmp_path, main="include eye.txt\nV 0 0 1\nF 45\nR 8 8\n" + "S 0 0 2 1\nE 0 0 0\n", eye="E 0 0 -3\nM 1 1 1 0 1 0 1 0\n")


def test_warning_names_the_file_of_its_line(tmp_path: Path) -> None:
    found = scene(tmp_path, main=CAMERA + LAMPS + "include flat.txt\nS 0 0 2 1\nO\nO\n", flat="M 1 1 1 0 1 0 1 0\nT 0 0 0 1 0 0 2 0 0\n")
    assert [warning.replace(str(tmp_path), "") for warning in found.warnings] == [
        "line 10: O closes no triangles and is left out",
        "line 2 of /flat.txt: the triangle has zero area and is never hit",
    ]


def test_lines_of_the_scene_are_those_of_its_own_text(tmp_path: Path) -> None:
    """What an included text asks for stands on the line that includes it; what follows keeps its own number."""
    found = scene(tmp_path, main="# 1\ninclude a.txt\n" + CAMERA + "L 1 1 1\n" + BODY, a="include b.txt\nsamples 4\n", b="\n\nsun 0 1 0\n")
    assert (found.suns[0].line, found.samples_line, found.lights[0].line, found.materials[0].line, found.spheres.line) == (2, 2, 7, 8, 11)


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"main": "E 0 0 0\n  include gone.txt"}, r"main\.txt:2:11: error: there is no file gone\.txt"),
        ({"main": "include mian.txt"}, r'main\.txt:1:9: error: there is no file mian\.txt; did you mean "main\.txt"\?'),
        ({"main": "include main.txt"}, r"main\.txt:1:9: error: main\.txt includes itself: main\.txt -> main\.txt"),
        ({"main": "include a.txt", "a": "\n include b.txt", "b": "include a.txt"},
         r"b\.txt:1:9: error: a\.txt includes itself: a\.txt -> b\.txt -> a\.txt"),
        ({"main": "include ../other.txt"}, r"main\.txt:1:9: error: \.\./other\.txt leads out of the scene's folder; permit"),
        ({"main": "include"}, r'main\.txt:1:1: error: include takes 1 value, as in "include lamps\.txt", found 0'),
        ({"main": 'include "a.txt'}, r"main\.txt:1:9: error: expected a second double quote"),
        ({"main": "include sub", "sub__x": ""}, r"main\.txt:1:9: error: sub is a folder; name a file in it"),
    ],
)  # fmt: skip
def test_fault_of_an_include_line(tmp_path: Path, files: dict[str, str], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        scene(tmp_path, **files)


def test_too_deep_and_too_many_are_refused(tmp_path: Path) -> None:
    chain = {f"t{i}": f"include t{i + 1}.txt\n" for i in range(20)} | {"t20": ""}
    with pytest.raises(SceneError, match="more than 16 texts include each other in a row"):
        scene(tmp_path, main="include t0.txt\n", **chain)
    doubled = {f"d{i}": f"include d{i + 1}.txt\n" * 9 for i in range(12)} | {"d12": ""}
    start = time.perf_counter()
    with pytest.raises(SceneError, match="more than 1000 include lines"):
        scene(tmp_path, main="include d0.txt\n", **doubled)
    assert time.perf_counter() - start < 20.0


def test_binary_file_is_told_by_its_own_name(tmp_path: Path) -> None:
    (tmp_path / "b.txt").write_bytes(b"E 0 0 0\nL \xff\n")
    with pytest.raises(SceneError, match=r"b\.txt:2:3: error: found the byte 0xff"):
        scene(tmp_path, main="include b.txt\n")


def test_word_within_a_comment_or_a_name_includes_nothing(tmp_path: Path) -> None:
    found = scene(tmp_path, main=CAMERA + LAMPS + BODY + "# include gone.txt\n")
    assert len(found.lights) == 1
    with pytest.raises(SceneError, match=r'unknown word "includes"; did you mean "include"'):
        scene(tmp_path, main=CAMERA + LAMPS + BODY + "includes gone.txt\n")
