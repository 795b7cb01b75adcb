"""What is compiled once a machine, before anything is timed."""

from __future__ import annotations

import os

import numpy as np

from clrt.device.context import Device
from clrt.forest import choose
from clrt.generate import uv_sphere

_TRIANGLES = 70_000  #: enough for the kernels of large cells, too


def compile_builder(device: Device) -> None:
    """The kernels that build trees: without them the first large tree would take their compiling, and small ones NumPy."""
    before = os.environ.get(choose.VARIABLE)
    os.environ[choose.VARIABLE] = "device"
    try:
        points, faces = uv_sphere(_TRIANGLES)
        choose.build_trees([points[faces]], np.zeros((1, 3)), "sah", device)
    finally:
        if before is None:
            del os.environ[choose.VARIABLE]
        else:
            os.environ[choose.VARIABLE] = before
