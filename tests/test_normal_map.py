"""Normal maps: what a scene text may say of them, closed forms, and the kernels against the reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from device_pictures import Write, compare, in_packets, writer
from PIL import Image

import clrt
from clrt.device.context import Device
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS
from clrt.reference import render as reference
from clrt.scene.model import Scene

HEAD = "E 0 0.2 -1\nV 0 0 1\nF 45\nR 32 32\nbackground 0.2 0.3 0.5\nL 5 5 -5\nL -3 4 1 0.5 0.4 0.3\nsun 1 3 -1 intensity=0.4\n"
FLOOR = "T -9 -1 12 9 -1 12 9 -1 0.5\nT -9 -1 12 9 -1 0.5 -9 -1 0.5\nO\n"
TURNED = "T -1 -0.5 3 -0.2 0.8 3.3 0.1 -0.6 2.5\nuv -0.7 -0.3 1.4 0.2 0.5 1.9\n"
CURVED = "T 0.5 0.7 4  1.5 0.7 4  1.5 1.7 4.2  0.1 -0.3 -1 -0.3 0.2 -1 -0.1 0.1 -1\nuv 0 0 1.4 0.2 0.5 -1.9\n"
ROUND = "S 0.6 0.2 3 0.6\nS -0.8 0.5 3 0.4\n"
#: one triangle that faces the eye on the axis, lit from (3, 4, -2); the normal's y and x are seen apart
FACING = "E 0 0 0\nV 0 0 1\nF 20\nR 1 1\nL 3 4 -2\nM 1 1 1 0 1 0 1 0\n"
TRIANGLE = "T -1 -1 2 1 -1 2 0 2 2\n"
TO_LIGHT = np.array([3.0, 4.0, -4.0]) / np.sqrt(41.0)


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Normal maps: `soft.png`, 8 x 8 texels; `lean.png`, one that leans to the right and up; `canceled.png`, which mixes to none."""
    rng = np.random.default_rng(3)
    soft = rng.integers(90, 166, (8, 8, 3), dtype=np.uint8)
    soft[:, :, 2] = 240
    for name, texels in {"soft": soft, "lean": [[[180, 150, 220]]]}.items():
        Image.fromarray(np.asarray(texels, np.uint8)).save(tmp_path / f"{name}.png")
    Image.fromarray(np.array([[0, 255], [255, 0]], np.uint8)).save(tmp_path / "canceled.png")

    return writer(tmp_path)


MATERIAL = "M 0.9 0.8 1 0.3 0.6 0.2 20 0.1\n"
MAPPED = "normalmap soft.png strength=0.7\nproject axis=y scale=1.7\n"


@pytest.mark.matrix(keep=2)
@pytest.mark.parametrize(
    "scene",
    [
        MATERIAL + MAPPED + FLOOR + TURNED + ROUND,
        "L 0 1 0\n" + MATERIAL.replace("0.1", "0") + MAPPED + FLOOR + CURVED + "S 0 0 0 20\n",
        "M 0.9 0.8 1 0.1 0.2 0.2 20 0 0.8 1.5\nfresnel\nnormalmap soft.png strength=0.1\n" + ROUND + MATERIAL + FLOOR,
        MATERIAL + "texture soft.png\nnormalmap soft.png strength=-2 filter=nearest wrap=mirror\nproject axis=z scale=0.9\n"
        + FLOOR + CURVED + ROUND,
    ],
)  # fmt: skip
def test_picture_matches_reference(write: Write, scene: str) -> None:
    loaded = write(HEAD + scene)
    compare(loaded, clrt.render(loaded).pixels)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize(("precision", "lanes"), [*((name, 16) for name in sorted(RUNGS)), ("watertight", 8), ("exact", 4), ("double", 1)])
def test_every_rung_and_width_matches_reference(write: Write, device: Device, precision: str, lanes: int) -> None:
    scene = write(HEAD + MATERIAL + MAPPED + FLOOR + TURNED + CURVED + ROUND).with_size(16, 16)
    compare(scene, in_packets(scene, device, lanes, precision))


@pytest.mark.slow
def test_instances_match_reference(write: Write) -> None:
    things = "object piece\n" + TURNED + "O\n" + FLOOR + "instance piece 1.2 0.1 0.3 scale=1.3 turn_z=70\n"
    things += "instance piece 0.5 0.2 0.4 scale_x=0.4 turn_y=50\n"
    scene = write(HEAD + MATERIAL + MAPPED + things)
    compare(scene, clrt.render(scene).pixels)


def _seen(scene: Scene) -> float:
    return float(clrt.render(scene).pixels[0, 0, 0])


def _expected(x: float, y: float, z: float, strength: float = 1.0) -> float:
    """Kd N.L of a surface that faces -z, u along x, v along y."""
    normal = np.array([strength * x, strength * y, -z])
    return float(normal @ TO_LIGHT / np.linalg.norm(normal))


LEAN = (2 * 180 / 255 - 1, 2 * 150 / 255 - 1, 2 * 220 / 255 - 1)


@pytest.mark.parametrize("strength", [1.0, 0.5, 0.0, -1.0, 3.0])
def test_strength_scales_the_sideways_parts(write: Write, strength: float) -> None:
    scene = write(FACING + f"normalmap lean.png strength={strength}\n" + TRIANGLE + "uv 0 0 2 0 1 3\n")
    assert abs(_seen(scene) - max(_expected(*LEAN, strength), 0.0)) < 1e-6


@pytest.mark.parametrize(
    ("corners", "signs"), [("0 0 2 0 1 3", (1, 1)), ("2 0 0 0 1 3", (-1, 1)), ("0 3 2 3 1 0", (1, -1)), ("2 3 0 3 1 0", (-1, -1))]
)
def test_turned_and_mirrored_coordinates_turn_the_tilt(write: Write, corners: str, signs: tuple[int, int]) -> None:
    scene = write(FACING + "normalmap lean.png\n" + TRIANGLE + f"uv {corners}\n")
    assert abs(_seen(scene) - _expected(signs[0] * LEAN[0], signs[1] * LEAN[1], LEAN[2])) < 1e-6


def test_skew_coordinates_keep_the_frame_upright(write: Write) -> None:
    """u alone sets x; y is perpendicular to it, however v runs."""
    scene = write(FACING + "normalmap lean.png\n" + TRIANGLE + "uv 0 0 2 1 1 3\n")
    # u grows along the direction in which v stays: (2, 1) of (u, v) a 2 in x, (1, 3) a 1 in x and 3 in y.
    along = np.linalg.solve(np.array([[2.0, 1.0], [1.0, 3.0]]), np.array([[2.0, 0.0], [1.0, 3.0]]))[0]
    along /= np.linalg.norm(along)
    x, y = LEAN[0] * along + LEAN[1] * np.array([-along[1], along[0]])
    assert abs(_seen(scene) - _expected(x, y, LEAN[2])) < 1e-6


def test_sphere_has_longitude_to_the_right_and_latitude_upwards(write: Write) -> None:
    """At the point towards -z: the frame of a square seen there."""
    scene = write(FACING + "normalmap lean.png\nS 0 0 3 1\n")
    assert abs(_seen(scene) - _expected(*LEAN)) < 1e-6


@pytest.mark.parametrize("corners", ["0 0 0 0 0 0", "0 0 1 1 2 2", "0.1 0.1 0.2 0.2 0.3 0.3"])
def test_coordinates_on_a_line_tilt_nothing_and_are_told(write: Write, corners: str) -> None:
    scene = write(FACING + "normalmap lean.png\n" + TRIANGLE + f"uv {corners}\n" + TRIANGLE.replace(" 2", " 9") + f"uv {corners}\n")
    told = "2 triangles (the first: triangle 0): the corners lie on a line of the normal map; normals are not tilted there"
    assert scene.warnings == (told,)
    assert abs(_seen(scene) - _expected(0, 0, 1)) < 1e-6
    assert reference(scene).pixels[0, 0, 0] == pytest.approx(_expected(0, 0, 1), abs=1e-12)


def test_texels_that_cancel_tilt_nothing(write: Write) -> None:
    """Between 0 and 255, mixed half and half, there is no direction."""
    scene = write(FACING + "normalmap canceled.png\n" + TRIANGLE + "uv 0 0 2 0 1 1.5\n")
    assert abs(_seen(scene) - _expected(0, 0, 1)) < 1e-6


def test_maps_are_not_decoded_as_colours(write: Write) -> None:
    scene = write(FACING + "texture lean.png\nnormalmap lean.png\n" + TRIANGLE + "uv 0 0 2 0 1 3\n")
    assert [t.srgb for t in scene.textures] == [True, False]
    assert scene.textures[0].picture is scene.textures[1].picture


def test_unused_map_calls_for_nothing(write: Write) -> None:
    scene = write(FACING + TRIANGLE + "M 1 1 1 0 1 0 1 0\nnormalmap lean.png\n")
    assert "normal map" not in Features.of(scene).effects


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("normalmap", '7:1: error: normalmap takes 1 value, as in "normalmap bumps.png strength=0.5", found 0'),
        ("normalmap none.png", "7:11: error: there is no file none.png"),
        ("normalmap scene.txt", "7:11: error: scene.txt is no picture"),
        ("normalmap ../lean.png", "7:11: error: ../lean.png leads out of the scene's folder"),
        ("normalmap lean.png strength=nan", '7:29: error: expected a finite number (strength), found "nan"'),
        ("normalmap lean.png strength=1e4", '7:29: error: strength must be from -1000 to 1000, found "1e4"'),
        ("normalmap lean.png srgb=yes", '7:20: error: normalmap has no key "srgb" (its keys: strength, wrap, filter)'),
        ("normalmap lean.png\nnormalmap lean.png", "8:1: error: a second normalmap line for the material of line 6; the first is line 7"),
    ],
)
def test_malformed_line_is_told_with_its_place(write: Write, lines: str, message: str) -> None:
    with pytest.raises(SceneError) as refused:
        write(FACING + lines + "\n" + TRIANGLE)
    assert message in str(refused.value)


def test_triangle_without_a_place_on_the_map_is_told(write: Write) -> None:
    with pytest.raises(SceneError, match="7:1: error: the triangle of line 8 has no place on the picture"):
        write(FACING + "normalmap lean.png\n" + TRIANGLE)


def test_normalmap_before_any_material_is_told(write: Write) -> None:
    with pytest.raises(SceneError, match="1:1: error: normalmap before any material"):
        write("normalmap lean.png\n" + FACING + TRIANGLE)
