"""The pictures of a study: the reference, each rung, maps of their differences, and a crop where they differ most."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.image.image import Image
from clrt.study.reference import RUNG
from clrt.study.subject import Picture

FloatArray = NDArray[np.float64]

FOLDER = "pictures"
_CROP_PART = 6  #: of the picture's longer side that a crop's side is
_CROP_LEAST = 8
_CROP_SHOWN = 256  #: pixels that a crop's side is enlarged to, about


def write_pictures(folder: Path, reference: FloatArray, rungs: dict[str, Picture]) -> dict[str, Any]:
    """PNG files into folder/pictures; their names as the part `precision` lists them. Raises OSError.

    reference : (h, w, 3); rungs : of the same size. Differences are from the rung `double`; what is white in a map differs by its scale.
    """
    place = folder / FOLDER
    place.mkdir(exist_ok=True)
    base = rungs[RUNG].astype(np.float64)
    apart = {name: np.abs(picture.astype(np.float64) - base).max(axis=-1) for name, picture in rungs.items()}
    listed = {"reference": _save(folder, "reference", reference)}
    listed |= {name: _save(folder, name, picture) for name, picture in rungs.items()}
    differences = {name: _difference(folder, name, apart[name]) for name in rungs if name != RUNG}
    return {"pictures": listed, "differences": differences, "crop": _crop(folder, {"reference": reference, **rungs}, apart)}


def _save(folder: Path, name: str, pixels: NDArray[Any]) -> str:
    file = f"{FOLDER}/{name}.png"
    Image(pixels).save(folder / file)
    return file


def _difference(folder: Path, name: str, apart: FloatArray) -> dict[str, Any]:
    scale = float(apart.max())
    shown = apart / scale if scale > 0.0 else apart
    return {"file": _save(folder, f"difference-{name}", np.repeat(shown[..., None], 3, axis=-1)), "scale": scale}


def _crop(folder: Path, pictures: dict[str, NDArray[Any]], apart: dict[str, FloatArray]) -> dict[str, Any]:
    """The square in which the rung that differs most does so most; enlarged, each pixel a square."""
    rung = max(apart, key=lambda name: float((apart[name] ** 2).sum()))
    height, width = apart[rung].shape
    side = min(height, width, max(_CROP_LEAST, max(height, width) // _CROP_PART))
    sums = np.pad(apart[rung] ** 2, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    boxes = sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]
    y, x = (int(i) for i in np.unravel_index(boxes.argmax(), boxes.shape))
    times = max(1, _CROP_SHOWN // side)
    files = {}
    for name, picture in pictures.items():
        part = np.repeat(np.repeat(picture[y : y + side, x : x + side], times, axis=0), times, axis=1)
        files[name] = _save(folder, f"crop-{name}", part)
    return {"rung": rung, "x": x, "y": y, "width": side, "height": side, "files": files}
