"""Pictures: bytes against exact arithmetic, files against Pillow and a reader of PPM written here."""

from __future__ import annotations

import io
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PillowImage

import clrt
from clrt.image import png
from clrt.image.image import Image, check_format


def gradient(height: int = 5, width: int = 7) -> np.ndarray:
    """(height, width, 3) float32, reproducible, some of it outside [0, 1]."""
    return np.random.default_rng(7).uniform(-0.2, 1.2, (height, width, 3)).astype(np.float32)


def exact_byte(value: np.float32) -> int:
    """255 x clamped to [0, 1], rounded half up, in rational arithmetic."""
    clamped = min(max(Fraction(float(value)), Fraction(0)), Fraction(1))
    return math.floor(255 * clamped + Fraction(1, 2))


def read_ppm(data: bytes) -> np.ndarray:
    magic, width, height, most = data.split(maxsplit=4)[:4]
    header = b"P6\n%d %d\n255\n" % (int(width), int(height))
    assert (magic, most, data[: len(header)]) == (b"P6", b"255", header)
    pixels = data[len(header) :]
    return np.frombuffer(pixels, np.uint8).reshape(int(height), int(width), 3)


def test_to_uint8_random_values_are_the_correctly_rounded_ones() -> None:
    pixels = gradient(40, 50)
    expected = [exact_byte(v) for v in pixels.ravel()]
    assert Image(pixels).to_uint8().ravel().tolist() == expected


def test_to_uint8_around_every_tie_rounds_half_up() -> None:
    ties = ((np.arange(255) + 0.5) / 255.0).astype(np.float32)
    values = np.concatenate([np.nextafter(ties, np.float32(-1)), ties, np.nextafter(ties, np.float32(2))])
    values = np.concatenate([values, np.float32([0.5, 0.1, 1.0, 0.0])])[: 3 * (769 // 3)].reshape(1, -1, 3)
    expected = [exact_byte(v) for v in values.ravel()]
    assert Image(values).to_uint8().ravel().tolist() == expected


def test_to_uint8_half_is_128() -> None:
    assert Image(np.full((1, 1, 3), 0.5)).to_uint8().tolist() == [[[128, 128, 128]]]  # 127.5 goes up


def test_to_uint8_infinities_are_clamped() -> None:
    assert Image([[[np.inf, -np.inf, 1e30]]]).to_uint8().tolist() == [[[255, 0, 255]]]


def test_to_uint8_nan_is_black_counted_and_leaves_pixels_alone() -> None:
    pixels = np.ones((130, 2, 3), np.float32)
    pixels[0, 0, 1] = pixels[0, 0, 2] = pixels[129, 1, 0] = np.nan  # in two blocks of rows; two channels of one pixel
    with pytest.warns(RuntimeWarning, match="^2 pixels are not a number"):
        out = Image(pixels).to_uint8()
    assert out[0, 0].tolist() == [255, 0, 0]
    assert out[129, 1].tolist() == [0, 255, 255]
    assert np.isnan(pixels).sum() == 3


def test_to_uint8_srgb_is_the_standards_curve() -> None:
    # Table of IEC 61966-2-1: the linear value 0.0031308 is where its two pieces meet, 0.2140 is the encoded 0.5.
    values = [0.0, 0.0031308, 0.21404114, 0.5, 1.0]
    expected = [0, round(255 * 12.92 * 0.0031308), 128, 188, 255]
    pixels = np.array(values, np.float32)[None, :, None].repeat(3, axis=2)
    assert Image(pixels).to_uint8(srgb=True)[0, :, 0].tolist() == expected


@pytest.mark.parametrize("shape", [(3, 3), (2, 2, 4), (0, 4, 3)])
def test_image_wrong_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="shape"):
        Image(np.zeros(shape))


def test_image_width_height_are_columns_rows() -> None:
    image = clrt.Image(gradient(height=5, width=7))
    assert (image.width, image.height) == (7, 5)


def test_save_ppm_and_png_hold_the_same_bytes(tmp_path: Path) -> None:
    image = Image(gradient())
    image.save(tmp_path / "a.ppm")
    image.save(str(tmp_path / "a.PNG"))
    expected = np.array([exact_byte(v) for v in image.pixels.ravel()]).reshape(image.pixels.shape)
    assert np.array_equal(read_ppm((tmp_path / "a.ppm").read_bytes()), expected)
    with PillowImage.open(tmp_path / "a.PNG") as read:
        assert (read.format, read.mode, read.size) == ("PNG", "RGB", (7, 5))
        assert np.array_equal(np.asarray(read), expected)
        assert "srgb" not in read.info


@pytest.mark.parametrize("size", [(1, 1), (3, 300), (700, 2), (257, 256)])
def test_png_of_any_size_holds_the_pixels(size: tuple[int, int]) -> None:
    """Heights around a block of rows; read back by another program."""
    pixels = np.random.default_rng(4).integers(0, 256, (*size, 3), np.uint8)
    with PillowImage.open(io.BytesIO(png.encode(pixels, comment="a note"))) as read:
        assert np.array_equal(np.asarray(read), pixels)
        assert read.text == {"Comment": "a note"}
        read.load()


def test_save_srgb_png_says_so(tmp_path: Path) -> None:
    Image(gradient()).save(tmp_path / "a.png", srgb=True)
    with PillowImage.open(tmp_path / "a.png") as read:
        assert read.info["srgb"] == 0


def test_save_twice_gives_the_same_file(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        Image(gradient()).save(tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_repr_png_is_a_png() -> None:
    with PillowImage.open(io.BytesIO(Image(gradient())._repr_png_())) as read:
        assert read.size == (7, 5)


@pytest.mark.parametrize("name", ["a.jpg", "a", "png", "a.png.txt"])
def test_check_format_other_endings_name_those(name: str) -> None:
    with pytest.raises(clrt.ClrtError, match=r"\.png, \.ppm or \.exr"):
        check_format(name)


def test_save_unknown_ending_writes_nothing(tmp_path: Path) -> None:
    with pytest.raises(clrt.ClrtError):
        Image(gradient()).save(tmp_path / "a.bmp")
    assert list(tmp_path.iterdir()) == []
