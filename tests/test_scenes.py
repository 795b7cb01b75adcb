"""The scenes of the project: each loads without a warning, and its comment holds for the float64 reference and on the device."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import clrt
from clrt.reference import ReferencePicture, render
from clrt.scene.build import load_scene
from clrt.scene.model import Scene

SCENES = Path(__file__).parents[1] / "scenes"
ALL = sorted(SCENES.rglob("*.txt"))
EXPECTED = re.compile(r"^# pixel \((\d+),(\d+)\) is (\S+) (\S+) (\S+)$", re.MULTILINE)
EFFECTS = (
    "absorb", "corners", "falloff", "fresnel", "glass", "include", "instance", "mesh", "mirror", "normalmap", "opacity", "phong", "shadow",
    "smooth", "sphere", "spot", "sun", "texture",
)  # fmt: skip

#: the comments have six decimals
ROUNDING = 0.5e-6
#: what numerics promise of single precision on the device, after up to six surfaces
DEVICE_ERROR = 1e-4


def expectations(name: str) -> list[tuple[int, int, list[float]]]:
    """(column, row, colour) of each `# pixel` line."""
    text = (SCENES / f"{name}.txt").read_text()
    return [(int(m[1]), int(m[2]), [float(m[3]), float(m[4]), float(m[5])]) for m in EXPECTED.finditer(text)]


@cache
def picture(name: str) -> tuple[Scene, ReferencePicture]:
    scene = load_scene(SCENES / f"{name}.txt")
    return scene, render(scene)


@pytest.mark.parametrize("path", ALL, ids=lambda p: p.stem)
def test_scene_loads_without_a_warning(path: Path) -> None:
    scene = load_scene(path)
    assert not scene.warnings
    assert scene.triangle_count + len(scene.spheres) > 0


@pytest.mark.parametrize("path", ALL, ids=lambda p: p.stem)
def test_scene_says_first_what_it_is(path: Path) -> None:
    assert path.read_text(encoding="ascii").startswith("# ")


def test_each_effect_has_its_scene() -> None:
    assert {p.stem for p in SCENES.glob("*.txt")} >= {*EFFECTS, "first"}


@pytest.mark.parametrize("name", EFFECTS)
def test_comment_holds_in_the_reference(name: str) -> None:
    _, seen = picture(name)
    found = expectations(name)
    assert len(found) >= 4
    for column, row, color in found:
        np.testing.assert_allclose(seen.pixels[row, column], color, rtol=0, atol=1.01 * ROUNDING, err_msg=f"pixel ({column},{row})")


@pytest.mark.parametrize("name", EFFECTS)
def test_comment_names_every_pixel_it_gives(name: str) -> None:
    text = (SCENES / f"{name}.txt").read_text()
    assert text.count("# pixel") == len(expectations(name)), "a line that the pattern does not read"


@pytest.mark.matrix(keep=9)
@pytest.mark.parametrize("name", EFFECTS)
def test_comment_holds_on_the_device(name: str) -> None:
    pytest.importorskip("pyopencl")
    try:
        clrt.devices()
    except clrt.DeviceError as error:
        pytest.skip(str(error))
    pixels = clrt.render(picture(name)[0]).pixels
    for column, row, color in expectations(name):
        np.testing.assert_allclose(pixels[row, column], color, rtol=0, atol=DEVICE_ERROR, err_msg=f"pixel ({column},{row})")


def test_scenes_show_their_effect_and_not_another() -> None:
    rays = {name: picture(name)[1].rays for name in EFFECTS}
    for name in ("corners", "phong", "shadow", "smooth", "sphere", "texture"):
        assert rays[name].get("reflected", 0) == rays[name].get("refracted", 0) == 0, name
    assert rays["mirror"]["reflected"] > 0
    assert rays["mirror"].get("refracted", 0) == 0
    assert rays["glass"]["refracted"] > 0
    assert rays["glass"]["reflected"] > 0, "by total internal reflection: no material of glass.txt reflects"
    scene, _ = picture("glass")
    assert all(material.reflect == 0.0 for material in scene.materials)


def test_first_picture_is_small_and_shows_what_it_should() -> None:
    path = SCENES / "first.txt"
    scene = load_scene(path)
    assert path.stat().st_size < 200_000
    assert (scene.camera.width, scene.camera.height) == (640, 480)
    assert len(scene.lights) == 2
    assert scene.objects[0].vertex_normals is not None
    assert any(m.refract > 0.0 for m in scene.materials)
    assert any(m.reflect > 0.5 for m in scene.materials)
    pixels = render(scene.with_size(16, 12)).pixels
    assert 0.2 < pixels.mean() < 0.6, "neither too dark nor burnt out"
    assert (pixels > 1.0).all(axis=2).mean() < 0.05
