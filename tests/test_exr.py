"""Pictures in OpenEXR, against OpenEXR's own library where it is there, else against OpenImageIO read back."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import clrt
from clrt.image import exr
from clrt.image.image import Image, check_format

oiio = pytest.importorskip("OpenImageIO")


def unclamped() -> np.ndarray:
    """(9, 13, 3) float32: negative, large, tiny and not a number."""
    pixels = np.random.default_rng(3).normal(0.0, 1.0, (9, 13, 3)).astype(np.float32)
    pixels[0, :4, 0] = [3e38, 1e-40, np.nan, np.inf]
    return pixels


def read(path: Path) -> tuple[np.ndarray, list[str]]:
    source = oiio.ImageInput.open(str(path))
    try:
        return source.read_image("float"), list(source.spec().channelnames)
    finally:
        source.close()


def test_exr_holds_the_very_numbers(tmp_path: Path) -> None:
    pixels = unclamped()
    Image(pixels).save(tmp_path / "a.exr")
    found, channels = read(tmp_path / "a.exr")
    assert channels == ["R", "G", "B"]
    np.testing.assert_array_equal(found, pixels)


def test_exr_is_read_by_its_own_library(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    pixels = unclamped()
    Image(pixels).save(tmp_path / "a.EXR")
    found = openexr.File(str(tmp_path / "a.EXR")).channels()["RGB"].pixels
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, pixels)


def test_same_pixels_give_the_same_bytes_without_a_date(tmp_path: Path) -> None:
    for name in ("a.exr", "b.exr"):
        Image(unclamped()).save(tmp_path / name)
    data = (tmp_path / "a.exr").read_bytes()
    assert data == (tmp_path / "b.exr").read_bytes()
    assert b"Date" not in data


def test_srgb_is_refused_and_nothing_written(tmp_path: Path) -> None:
    with pytest.raises(clrt.ClrtError, match=r"a\.exr: an \.exr holds linear values.*--srgb"):
        Image(unclamped()).save(tmp_path / "a.exr", srgb=True)
    assert list(tmp_path.iterdir()) == []


def test_missing_library_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exr, "find_spec", lambda name: None)
    for refused in (lambda: check_format("a.exr"), lambda: Image(unclamped()).save(tmp_path / "a.exr")):
        with pytest.raises(clrt.ClrtError, match=r"pip install 'clrt\[hdr\]'"):
            refused()
    assert list(tmp_path.iterdir()) == []


def test_png_does_not_load_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    Image(np.zeros((2, 2, 3))).save(tmp_path / "a.png")
    assert (tmp_path / "a.png").exists()
