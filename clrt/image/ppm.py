"""PPM, the binary kind: P6."""

from __future__ import annotations

from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def write(file: BinaryIO, pixels: NDArray[np.uint8], srgb: bool, comment: str = "") -> None:
    """Write (height, width, 3) uint8. The format cannot say whether the values are encoded, so `srgb` changes nothing here."""
    height, width, _ = pixels.shape
    file.write(b"P6\n%s%d %d\n255\n" % (f"# {comment}\n".encode() if comment else b"", width, height))
    file.write(pixels.tobytes())
