"""The pictures of a study as the page shows them: data URIs, and a crop where the rungs differ most."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from clrt.errors import ClrtError
from clrt.study.report_numbers import TIMES, Number

REFERENCE = "reference"
_CROP_PIXELS = 288  #: width that a crop is magnified to, by whole factors


@dataclass(frozen=True)
class Picture:
    """`uri` holds the whole PNG; sizes in pixels; `full_scale` is what the brightest value of a difference map stands for."""

    name: str
    file: str
    uri: str
    width: int
    height: int
    full_scale: str = ""


@dataclass(frozen=True)
class Pictures:
    """`reference` is None where there is nothing to compare; `place` says in words where the crops are."""

    reference: Picture | None = None
    rungs: list[Picture] = field(default_factory=list)
    differences: list[Picture] = field(default_factory=list)
    compared_with: str = REFERENCE  #: what the difference maps are from
    crops: list[Picture] = field(default_factory=list)
    place: str = ""


def read_pictures(folder: Path, precision: object) -> Pictures:
    """All that the part `precision` names. Raises ClrtError for a file outside of the folder, a missing or unreadable one."""
    if not isinstance(precision, Mapping):
        return Pictures()
    files = {str(name): str(file) for name, file in (precision.get("pictures") or {}).items() if name != "note"}
    shown = {name: _picture(folder, name, file) for name, file in files.items()}
    differences = [
        _picture(folder, str(name), str(entry["file"]), _full_scale(entry.get("scale")))
        for name, entry in (precision.get("differences") or {}).items() if isinstance(entry, Mapping) and "file" in entry
    ]  # fmt: skip
    crops, place = _crops(folder, files, precision.get("crop"))
    rungs = [picture for name, picture in shown.items() if name != REFERENCE]
    without = [picture.name for picture in rungs if picture.name not in {each.name for each in differences}]
    base = without[0] if len(without) == 1 else REFERENCE  # the one rung that has no map is what the others are compared with
    return Pictures(shown.get(REFERENCE), rungs, differences, base, crops, place)


def _full_scale(value: object) -> str:
    number = Number.of(value)
    return str(number) if number else ""


def _bytes(folder: Path, file: str) -> bytes:
    """A picture's file, which the JSON may choose only among the PNG files of the folder's own `pictures`."""
    home, path = (folder / "pictures").resolve(), (folder / file).resolve()
    if path.parent != home or path.suffix != ".png":
        raise ClrtError(f"{folder / 'study.json'} names the picture {file!r}; it should be a .png file in {folder / 'pictures'}")
    try:
        return path.read_bytes()
    except OSError as error:
        raise ClrtError(f"{folder / 'study.json'} names a picture that cannot be read, {file}: {error.strerror}; measure again") from error


def _picture(folder: Path, name: str, file: str, full_scale: str = "") -> Picture:
    from PIL import Image, UnidentifiedImageError

    content = _bytes(folder, file)
    try:
        with Image.open(io.BytesIO(content), formats=["PNG"]) as image:
            width, height = image.size
    except UnidentifiedImageError as error:
        raise ClrtError(f"{folder / file} is no PNG picture; measure again") from error
    return Picture(name, file, _uri(content), width, height, full_scale)


def _uri(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


def _crops(folder: Path, files: Mapping[str, str], crop: object) -> tuple[list[Picture], str]:
    """The same part of every picture, magnified so that its pixels can be counted."""
    if not isinstance(crop, Mapping):
        return [], ""
    sides = [crop.get(side) for side in ("x", "y", "width", "height")]
    if not all(isinstance(side, int) for side in sides):
        return [], ""
    x, y, width, height = (int(side) for side in sides if side is not None)
    crops = [_crop(folder, name, file, (x, y, x + width, y + height)) for name, file in files.items()]
    return crops, f"{width} {TIMES} {height} pixels from column {x} and row {y} (from the top left)"


def _crop(folder: Path, name: str, file: str, box: tuple[int, int, int, int]) -> Picture:
    from PIL import Image

    with Image.open(io.BytesIO(_bytes(folder, file)), formats=["PNG"]) as image:
        part = image.convert("RGB").crop(box)
    factor = max(_CROP_PIXELS // max(part.size), 1)
    part = part.resize((part.width * factor, part.height * factor), Image.Resampling.NEAREST)
    buffer = io.BytesIO()
    part.save(buffer, "PNG")
    return Picture(name, file, _uri(buffer.getvalue()), part.width, part.height)
