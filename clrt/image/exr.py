"""OpenEXR, through OpenImageIO: the linear values themselves, as float32."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from clrt.errors import ClrtError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def check() -> None:
    """Raises ClrtError where the library is not there."""
    if find_spec("OpenImageIO") is None:
        raise ClrtError("pictures in OpenEXR need OpenImageIO; install it: pip install 'clrt[hdr]', or write a .png")


def write(file: BinaryIO, pixels: NDArray[np.float32], comment: str = "") -> None:
    """Write (height, width, 3) float32, whatever they hold, without loss. The same pixels give the same bytes: no date.

    Raises ClrtError where the library is not there, OSError where it cannot write.
    """
    check()
    import OpenImageIO as oiio

    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, "float")
    spec.attribute("compression", "zip")
    spec.attribute("DateTime", "")
    if comment:
        spec.attribute("ImageDescription", comment)
    # The library writes to files of a name alone.
    import shutil
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "picture.exr")
        out = oiio.ImageOutput.create(str(path))
        if out is None or not (out.open(str(path), spec) and out.write_image(pixels) and out.close()):
            raise OSError(f"the picture could not be made: {out.geterror() if out else oiio.geterror()}")
        with path.open("rb") as made:
            shutil.copyfileobj(made, file)
