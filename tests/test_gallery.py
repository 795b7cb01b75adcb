"""The gallery of the README: each scene renders without a warning, its command is there, and its picture has its size."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import clrt
from clrt.scene.build import load_scene

ROOT = Path(__file__).parents[1]
GALLERY = ROOT / "scenes" / "gallery"
NAMES = ("room", "balls", "tulips", "chapel", "stilllife", "planes")
#: what the pictures of the README may weigh, bytes
HEAVIEST = 350_000


def needs(name: str) -> None:
    """Skip where the scene's environment cannot be read."""
    if "environment" in (GALLERY / f"{name}.txt").read_text():
        pytest.importorskip("OpenImageIO")


@pytest.mark.parametrize("name", NAMES)
def test_scene_loads_without_a_warning(name: str) -> None:
    needs(name)
    assert not load_scene(GALLERY / f"{name}.txt").warnings


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_scene_renders_to_something(name: str) -> None:
    needs(name)
    pytest.importorskip("pyopencl")
    image = clrt.render(GALLERY / f"{name}.txt", size=(56, 35), samples=4)
    assert np.isfinite(image.pixels).all()
    assert image.pixels.std() > 0.05, "a picture of one colour"


@pytest.mark.parametrize("name", NAMES)
def test_picture_has_the_size_of_its_scene(name: str) -> None:
    path = ROOT / "docs" / "images" / f"{name}.png"
    size = re.search(r"^R (\d+) (\d+)$", (GALLERY / f"{name}.txt").read_text(), re.MULTILINE)
    assert size is not None
    assert path.stat().st_size < HEAVIEST
    with Image.open(path) as picture:
        assert picture.size == (int(size[1]), int(size[2]))


def test_readme_shows_each_picture_with_its_command() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"\(docs/images/(\w+)\.png\)", text.partition("## Gallery")[2].partition("\n## ")[0]) == list(NAMES)
    commands = re.findall(r"`clrt scenes/gallery/(\w+)\.txt --srgb`", text)
    assert commands == list(NAMES)


def test_parts_are_those_that_the_script_makes(tmp_path: Path) -> None:
    """Made again elsewhere, meshes and placements are the same bytes, pictures the same texels."""
    pytest.importorskip("OpenImageIO")
    script = tmp_path / "make_parts.py"
    script.write_bytes((GALLERY / "parts" / "make_parts.py").read_bytes())
    subprocess.run([sys.executable, str(script)], check=True, timeout=600)
    made = sorted(p.name for p in tmp_path.iterdir() if p.suffix != ".py")
    assert made == sorted(p.name for p in (GALLERY / "parts").iterdir() if p.suffix != ".py")
    for name in made:
        if name.endswith(".png"):
            ours, theirs = (np.asarray(Image.open(folder / name).convert("RGBA"), int) for folder in (tmp_path, GALLERY / "parts"))
            assert abs(ours - theirs).max() <= 1, name
        elif name.endswith(".inc"):
            assert (tmp_path / name).read_text() == (GALLERY / "parts" / name).read_text(), name
