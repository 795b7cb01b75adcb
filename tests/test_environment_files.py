"""The word environment: pictures of radiance as their files have them, and what is refused, with its place."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PillowImage

from clrt.errors import SceneError
from clrt.scene import radiance
from clrt.scene.build import load_scene
from clrt.scene.model import Scene

SCENES = Path(__file__).parents[1] / "scenes"
TEXT = "E 0 0 0\nV 0 0 1\nF 90\nR 8 8\nM 1 1 1 0 1 0 1 0\nS 0 0 5 1\n"

oiio = pytest.importorskip("OpenImageIO")


def rgbe(values: np.ndarray, lines: str = "", size: str = "") -> bytes:
    """A Radiance file without run lengths, by Ward's (1991) format: r, g, b, e stand for (r, g, b) 2^(e - 136)."""
    height, width = values.shape[:2]
    header = f"#?RADIANCE\n{lines}FORMAT=32-bit_rle_rgbe\n\n{size or f'-Y {height} +X {width}'}\n"
    out = bytearray(header.encode())
    for color in values.reshape(-1, 3).tolist():
        most = max(color)
        exponent = math.frexp(most)[1] if most > 0.0 else -128
        out += bytes([*(int(c * 2.0 ** (8 - exponent)) if most > 0.0 else 0 for c in color), exponent + 128])
    return bytes(out)


def exact_values(height: int = 3, width: int = 5) -> np.ndarray:
    """(h, w, 3) float64 that RGBE holds exactly: 8 bits below a common power of two."""
    rng = np.random.default_rng(8)
    mantissa = rng.integers(0, 256, (height, width, 3))
    mantissa[..., 1] |= 128
    return mantissa * 2.0 ** rng.integers(-12, 6, (height, width, 1))


def write_exr(path: Path, values: np.ndarray, channels: tuple[str, ...] = ("R", "G", "B"), kind: str = "float", **attributes: int) -> None:
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], len(channels), kind)
    spec.channelnames = channels
    for name, value in attributes.items():
        setattr(spec, name, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(np.ascontiguousarray(values, np.float32))
    assert out.close()


def load(folder: Path, line: str) -> Scene:
    (folder / "scene.txt").write_text(TEXT + line + "\n")
    return load_scene(folder / "scene.txt")


def read(folder: Path, name: str) -> np.ndarray:
    environment = load(folder, f"environment {name}").environment
    assert environment is not None
    assert environment.radiance.dtype == np.float64
    return environment.radiance


def refusal(folder: Path, line: str) -> str:
    with pytest.raises(SceneError) as caught:
        load(folder, line)
    text = str(caught.value)
    assert text.startswith(f"{folder / 'scene.txt'}:7:")
    return text.partition("scene.txt:7:")[2]


# What is read


@pytest.mark.parametrize("width", [5, 8, 300])
def test_hdr_gives_its_very_numbers(tmp_path: Path, width: int) -> None:
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values(3, width)))
    np.testing.assert_array_equal(read(tmp_path, "a.hdr"), exact_values(3, width))


def test_hdr_with_run_lengths_gives_its_numbers_to_the_format_s_precision(tmp_path: Path) -> None:
    values = np.repeat(np.random.default_rng(1).uniform(0.0, 50.0, (4, 5, 3)), 9, axis=1)
    write_exr(tmp_path / "a.hdr", values)
    found = read(tmp_path, "a.hdr")
    assert (np.abs(found - values) <= values.max(axis=-1, keepdims=True) / 128).all()


def test_exposure_of_hdr_is_taken_back(tmp_path: Path) -> None:
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values(), "EXPOSURE=4.0\n"))
    np.testing.assert_array_equal(read(tmp_path, "a.hdr"), exact_values() / 4.0)


@pytest.mark.parametrize("kind", ["float", "half"])
def test_exr_gives_its_very_numbers(tmp_path: Path, kind: str) -> None:
    values = np.random.default_rng(2).uniform(0.0, 900.0, (7, 4, 3)).astype(np.float16 if kind == "half" else np.float32)
    write_exr(tmp_path / "a.exr", values, kind=kind)
    np.testing.assert_array_equal(read(tmp_path, "a.exr"), values.astype(np.float64))


def test_exr_written_by_its_own_library_is_read(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    values = np.random.default_rng(3).uniform(0.0, 9.0, (3, 6, 3)).astype(np.float32)
    openexr.File({"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}, {"RGB": values}).write(str(tmp_path / "a.exr"))
    np.testing.assert_array_equal(read(tmp_path, "a.exr"), values.astype(np.float64))


def test_exr_channels_are_taken_by_name(tmp_path: Path) -> None:
    values = np.random.default_rng(4).uniform(0.0, 9.0, (3, 6, 4)).astype(np.float32)
    write_exr(tmp_path / "a.exr", values, ("B", "G", "R", "A"))
    np.testing.assert_array_equal(read(tmp_path, "a.exr"), values[..., [2, 1, 0]])
    write_exr(tmp_path / "y.exr", values[..., :1], ("Y",))
    np.testing.assert_array_equal(read(tmp_path, "y.exr"), np.repeat(values[..., :1], 3, axis=-1))


def test_png_is_decoded_from_srgb(tmp_path: Path) -> None:
    """By the formula of IEC 61966-2-1: 188 is 0.5029; 10 lies below the bend, 10 / 255 / 12.92."""
    PillowImage.fromarray(np.array([[[188, 10, 255]]], np.uint8)).save(tmp_path / "a.png")
    np.testing.assert_allclose(read(tmp_path, "a.png"), [[[0.502886, 0.00303527, 1.0]]], rtol=1e-5)


def test_file_is_known_by_how_it_begins(tmp_path: Path) -> None:
    (tmp_path / "sky").write_bytes(rgbe(exact_values()))
    np.testing.assert_array_equal(read(tmp_path, "sky"), exact_values())


def test_keys_turn_and_brighten(tmp_path: Path) -> None:
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values()))
    environment = load(tmp_path, "environment intensity=0.25 a.hdr rotate=-90").environment
    assert environment is not None
    np.testing.assert_array_equal(environment.radiance, exact_values() / 4.0)
    assert (environment.rotation, environment.name, environment.line) == (-math.pi / 2, "a.hdr", 7)


def test_scene_with_an_environment_alone_has_no_warning(tmp_path: Path) -> None:
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values()))
    assert load(tmp_path, "environment a.hdr").warnings == ()


def test_right_handed_scene_turns_the_other_way_round(tmp_path: Path) -> None:
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values()))
    (tmp_path / "scene.txt").write_text(TEXT + "environment a.hdr rotate=30\n")
    environment = load_scene(tmp_path / "scene.txt", right_handed=True).environment
    assert environment is not None
    assert environment.rotation == -math.radians(30)
    np.testing.assert_array_equal(environment.radiance, exact_values())


def test_picture_of_the_smallest_scene_is_what_its_comment_says() -> None:
    texels = [(2, 0.5, 0.25), (0.5, 1, 0.25), (0.25, 0.5, 2), (2, 1, 0.25), *[(0.25, 0.25, 0.25)] * 4]
    assert (SCENES / "quarters.hdr").read_bytes() == rgbe(np.array(texels).reshape(2, 4, 3))


# What is refused


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("environment", '1: error: environment takes 1 value, as in "environment sky.hdr rotate=90 intensity=0.5", found 0'),
        ("environment b.hdr", '13: error: there is no file b.hdr; did you mean "a.hdr"?'),
        ("environment ../a.hdr", "13: error: ../a.hdr leads out of the scene's folder"),
        ("environment a.hdr rotate=361", '26: error: rotate must be from -360 to 360, found "361"'),
        ("environment a.hdr rotate=nan", '26: error: expected a finite number (rotate), found "nan"'),
        ("environment a.hdr intensity=-1", '29: error: intensity must be from 0 to 1e+06, found "-1"'),
        ("environment a.hdr turn=3", '19: error: environment has no key "turn" (its keys: rotate, intensity)'),
        ("environment text.hdr", "13: error: text.hdr is no Radiance HDR picture, as its ending says; save it again"),
        ("environment text.exr", "13: error: text.exr is no OpenEXR picture, as its ending says; save it again"),
        ("environment text.png", "13: error: text.png is no picture that can be read"),
    ],
)
def test_malformed_line_is_refused_at_its_place(tmp_path: Path, line: str, expected: str) -> None:
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values()))
    for ending in ("hdr", "exr", "png"):
        (tmp_path / f"text.{ending}").write_text("no picture at all\n")
    assert refusal(tmp_path, line).startswith(expected)


def test_second_environment_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values()))
    with pytest.raises(SceneError, match=r"scene\.txt:8:1: error: a second environment line; the first is line 7"):
        load(tmp_path, "environment a.hdr\nenvironment a.hdr")


@pytest.mark.parametrize("lines", ["environment a.hdr\nbackground 1 1 1", "background 1 1 1\nenvironment a.hdr"])
def test_background_beside_an_environment_is_refused(tmp_path: Path, lines: str) -> None:
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values()))
    place = 7 + lines.startswith("background")
    with pytest.raises(SceneError, match=rf"scene\.txt:{place}:1: error: environment beside the background of line {15 - place}:"):
        load(tmp_path, lines)


@pytest.mark.parametrize("ending", ["hdr", "exr"])
def test_picture_that_is_cut_off_is_refused_wherever_it_is_cut(tmp_path: Path, ending: str) -> None:
    write_exr(tmp_path / f"whole.{ending}", np.random.default_rng(5).uniform(0.0, 9.0, (20, 30, 3)))
    whole = (tmp_path / f"whole.{ending}").read_bytes()
    for size in (0, 2, 4, 30, 60, 300, len(whole) // 2, len(whole) - 4):
        (tmp_path / f"a.{ending}").write_bytes(whole[:size])
        assert refusal(tmp_path, f"environment a.{ending}").startswith(f"13: error: a.{ending} is "), size


@pytest.mark.parametrize("wrong", [-0.25, np.nan, np.inf, 2e30])
def test_radiance_that_is_no_light_is_refused_with_its_first_place(tmp_path: Path, wrong: float) -> None:
    values = np.ones((4, 6, 3))
    values[1, 4, 2] = values[3, 0, 0] = wrong
    write_exr(tmp_path / "a.exr", values)
    text = refusal(tmp_path, "environment a.exr")
    assert "a.exr has 2 pixels with radiance that is negative, not a number or above 1e+30, the first in column 5, row 2 (1, 1, " in text


def test_channels_that_mean_no_colour_are_named(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", np.ones((2, 2, 2)), ("U", "V"))
    assert "a.exr has the channels U, V; save it with R, G and B, or with Y alone" in refusal(tmp_path, "environment a.exr")


def test_part_of_a_picture_is_refused(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", np.ones((4, 4, 3)), full_width=8, full_height=4)
    assert "a.exr holds 4 x 4 of 8 x 4 pixels; save it whole" in refusal(tmp_path, "environment a.exr")


def test_picture_from_the_bottom_up_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values(), size="+Y 3 +X 5"))
    assert "a.hdr is stored turned or mirrored" in refusal(tmp_path, "environment a.hdr")


def test_picture_of_no_pixels_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values(), size="-Y 0 +X 5"))
    assert "a.hdr is damaged or cut off" in refusal(tmp_path, "environment a.hdr")


def test_picture_too_large_is_refused_before_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(radiance, "MOST_TEXELS", 10)
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values(), size="-Y 4 +X 5")[:60])
    assert "a.hdr has 5 x 4 pixels; an environment has at most 10 in all and 65536 a side" in refusal(tmp_path, "environment a.hdr")


def test_missing_library_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    (tmp_path / "a.hdr").write_bytes(rgbe(exact_values()))
    expected = "a.hdr is a picture in Radiance HDR, which needs OpenImageIO; install it: pip install 'clrt[hdr]'"
    assert expected in refusal(tmp_path, "environment a.hdr")
    PillowImage.fromarray(np.zeros((1, 1, 3), np.uint8)).save(tmp_path / "a.png")
    assert read(tmp_path, "a.png").shape == (1, 1, 3)
