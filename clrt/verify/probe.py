"""Single functions of the kernel files on arrays of inputs: the text that pictures are made with, under a kernel of a case's own."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device import layout, program
from clrt.device.context import Device, open_device
from clrt.features import FEATURES, Features
from clrt.precision import rung


@cache
def _device(name: str | None) -> Device:
    return open_device(name)


@cache
def _built(device: str | None, precision: str, lanes: int, effects: tuple[str, ...], files: tuple[str, ...], kernels: str) -> Any:
    features = Features(tuple((f.name, 0) for f in FEATURES if f.name in effects))
    shape = program.Shape(program.stack_size(0), 1)
    source = program.compose(features, rung(precision), lanes, shape)
    texts = [f'#line 1 "{name}"\n{program.kernel_source(name)[0]}' for name in files]
    return program.build(_device(device), "\n".join([source, *texts, '#line 1 "probe"\n' + kernels]))


def lanes_of(device: str | None, precision: str) -> int:
    """Lanes of a packet, as pictures on this device have them."""
    return rung(precision).lanes(_device(device).info.lanes)


def run(
    kernels: str,
    name: str,
    items: int,
    arrays: Sequence[NDArray[Any]],
    *,
    device: str | None,
    precision: str,
    effects: tuple[str, ...] = (),
    files: tuple[str, ...] = (),
) -> None:
    """Runs the kernel `name` of the text `kernels` over `items` work-items; arrays are its arguments, and are read back.

    The program is the composed one of `effects` with the kernel files `files` behind it, in the number type of the rung.
    """
    import pyopencl as cl

    opened = _device(device)
    built = _built(device, precision, lanes_of(device, precision), effects, files, kernels)
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    buffers = [cl.Buffer(opened.context, flags, hostbuf=np.ascontiguousarray(a)) for a in arrays]
    cl.Kernel(built, name)(opened.queue, (items,), None, *buffers)
    for array, buffer in zip(arrays, buffers, strict=True):
        cl.enqueue_copy(opened.queue, array, buffer)
    opened.queue.finish()


def sphere_records(centers: NDArray[np.float64], radii: NDArray[np.float64], real: type) -> NDArray[np.void]:
    """Sphere structs as the kernels read them."""
    records = np.zeros(len(radii), layout.sphere(real))
    records["given"] = np.column_stack([centers, radii])
    records["center"], records["radius"] = centers, radii
    return records
