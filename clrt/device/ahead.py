"""Compiling while another core does something else: a program depends on the scene's features and sizes alone, not on its trees.

PoCL compiles a kernel when it is first launched, so each is launched once, over nothing; and one at a time in a process. So the first
command has another process compile what `render` need not wait for (`beside`).
"""

from __future__ import annotations

import re
from functools import partial
from typing import Any

import numpy as np

from clrt.device import beside, kernel_cache, opencl, program
from clrt.device.context import POCL, Device
from clrt.device.prepare import LOCAL
from clrt.device.session import multiple
from clrt.tasks import Task

#: kernel -> its global and its local size
Sizes = dict[str, tuple[tuple[int, ...], tuple[int, ...]]]
_PREPARE = ("prepare", "prepare_blocks")  #: launched over all triangles; with zeros for arguments all kernels return at once
_DUMMY_BYTES = 1 << 16  #: more than any struct that a kernel looks into before it returns
_KERNEL = re.compile(r"^kernel\b[^{;]*?\bvoid (\w+)\(([^)]*)\)", re.M)
_DIRECTIVE = re.compile(r"^#.*$", re.M)
_VALUES: dict[str, Any] = {"int": np.int32(0), "double4": np.zeros(4), "float4": np.zeros(4, np.float32)}


class Compilation(Task[Any]):
    """A program of pictures that is compiled from now on, kernels and all, for a scene of so many triangles.

    helped : whether another process may be started for it
    """

    def __init__(self, device: Device, source: str, triangles: int, *, helped: bool = False) -> None:
        self.source = source
        super().__init__(partial(_compile, device, source, triangles, helped))


def build(device: Device, source: str, begun: Compilation | None = None) -> Any:
    """The program of `source`: the one that was begun, if that is the same, else built now. Raises DeviceError."""
    return begun.result() if begun is not None and begun.source == source else program.build(device, source)


def _compile(device: Device, source: str, triangles: int, helped: bool) -> Any:
    # PoCL tells small launches from large ones, and compiles for each kind: so the sizes are those of later launches.
    size = multiple(max(1, triangles), LOCAL)
    sizes: Sizes = dict.fromkeys(_PREPARE, ((size,), (LOCAL,))) if triangles else {}
    pocl = device.info.platform == POCL
    helped = helped and pocl and bool(triangles) and kernel_cache.was_new(kernel_cache.choose_folder())
    with beside.Helper(device.info.name, helped) as helper:
        built = program.build(device, source)
        helper.compile(source, sizes)
        if pocl:
            launch(device, built, source, {"render": (program.LOCAL_SIZE, program.LOCAL_SIZE)})
    if pocl:
        launch(device, built, source, sizes)
    return built


def launch(device: Device, built: Any, source: str, sizes: Sizes) -> None:
    """Each kernel with its global and local size, over nothing: with zeros for arguments all return at once.

    One that has an argument of another type is left to its first launch.
    """
    cl = opencl.api()
    queue = cl.CommandQueue(device.context)
    zeros = cl.Buffer(device.context, cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=np.zeros(_DUMMY_BYTES, np.uint8))
    with kernel_cache.loading():
        for name, parameters in _KERNEL.findall(source):
            declared = _DIRECTIVE.sub("", parameters).split(",")
            arguments = [zeros if "*" in text else _VALUES.get(text.removeprefix("const ").split()[0]) for text in map(str.strip, declared)]
            if name in sizes and not any(argument is None for argument in arguments):
                cl.Kernel(built, name)(queue, *sizes[name], *arguments)
        queue.finish()
