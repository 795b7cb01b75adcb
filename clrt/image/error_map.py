"""How sure each pixel is, as a picture beside the picture."""

from __future__ import annotations

from os import PathLike

import numpy as np
from numpy.typing import NDArray

from clrt.files import atomic_write, check_writable
from clrt.image import exr, png, ppm
from clrt.image.image import Image, check_format

_PART = 0.99  #: of pixels that are not to be beyond white


def scale_of(standard_error: NDArray[np.float32]) -> float:
    """What white is to stand for: 1, 2 or 5 times a power of ten, that 99% of the finite numbers are not above; 1 where all are 0."""
    finite = standard_error[np.isfinite(standard_error)]
    most = float(np.quantile(finite, _PART)) or float(finite.max()) if finite.size else 0.0
    if most <= 0.0:
        return 1.0
    unit = 10.0 ** np.floor(np.log10(most))
    return float(next(f"{step * unit:.0e}" for step in (1.0, 2.0, 5.0, 10.0) if step * unit >= most * (1.0 - 1e-9)))


def save_error_map(path: str | PathLike[str], standard_error: NDArray[np.float32]) -> float:
    """Write (h, w, 3) float32 standard errors; what white stands for is returned, and said in a comment of the file.

    An .exr holds the numbers themselves, so its white is 1. Raises ClrtError for any other ending than a picture's, OSError.
    """
    suffix = check_format(path)
    check_writable(path)
    scale = 1.0 if suffix == ".exr" else scale_of(standard_error)
    label = f"standard error of each channel; white is {scale:g}"
    with atomic_write(path) as file:
        if suffix == ".exr":
            exr.write(file, standard_error, label)
        else:
            shown = Image(np.where(np.isfinite(standard_error), standard_error, np.inf) / np.float32(scale)).to_uint8()
            (png if suffix == ".png" else ppm).write(file, shown, False, label)
    return scale
