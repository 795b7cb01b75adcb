"""PoCL and its library of built-in functions, read while Python imports its modules and the scene is read.

To load PoCL and to look at the machine takes it some 30 ms. Before it compiles the first program of a context it reads the library, for a
quarter of a second: about as long as it takes to import NumPy and to read a scene of a few megabytes. So a thread calls OpenCL's own
functions, outside Python's lock: it opens the processor and, where no program is compiled yet, builds one that cannot be linked, of which
nothing is kept, while the library stays in the context. Whatever fails here is left to the usual way, which says why.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from contextlib import suppress
from ctypes import byref, c_char_p, c_int32, c_size_t, c_uint32, c_uint64, c_void_p
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from clrt.device import kernel_cache, lean, opencl, pocl_cpu
from clrt.device.pocl_cpu import POCL
from clrt.tasks import Task

if TYPE_CHECKING:
    from clrt.device.context import Device

_SYMBOL = "clrt_in_no_library"
_SOURCE = f"void {_SYMBOL}(void);\nkernel void nothing(void) {{ {_SYMBOL}(); }}\n"
_OPTIONS = " ".join(("-cl-std=CL1.2", *lean.OPTIONS)).encode()
_CPU, _PLATFORM_NAME, _DRIVER_VERSION, _VERSION = c_uint64(2), 0x0902, 0x102D, 0x102F  # CL/cl.h
_MOST = 16  #: platforms, and devices of one, that are looked at
#: what runs since the command began
_starting: list[Task[Mapping[int, int]]] = []


def start() -> None:
    """Begins at once, in a thread: for a command that will open a device."""
    _starting.append(Task(begin))


def open_device(name: str | None = None) -> Device:
    """As `context.open_device`; of the default device, what was begun is taken."""
    from clrt.device import context  # not before PoCL reads its library: Python takes 10 ms to make its first dataclasses

    begun = _starting.pop().result() if _starting else begin()
    return context.open_device(name, begun)


def begin() -> Mapping[int, int]:
    """Loads PoCL and, where no program is compiled yet, begins to read the library of its processor: its address, and its context's.

    Empty where there is a compiled program already, or no such device.
    """
    new = kernel_cache.was_new(kernel_cache.choose_folder())
    try:
        cl = opencl.functions()
        device = _processor(cl)
        if device is None or not new:
            return {}
        opened = _new(cl.clCreateContext, None, 1, byref(device), None, None)
    except Exception:  # whatever another system does otherwise
        return {}
    Task(partial(_read_library, cl, opened, device))
    return {_given(device): _given(opened)}


def _given(handle: c_void_p) -> int:
    """The address. Raises OSError where there is none."""
    if not handle.value:
        raise OSError("OpenCL gave nothing")
    return handle.value


def _new(make: Any, *arguments: Any) -> c_void_p:
    """What OpenCL makes. Raises OSError."""
    handle = c_void_p(make(*arguments, byref(c_int32())))
    _given(handle)
    return handle


def _handles(ask: Any, *given: Any) -> list[c_void_p]:
    """What OpenCL lists."""
    found, count = (c_void_p * _MOST)(), c_uint32()
    status = ask(*given, _MOST, found, byref(count))
    return [c_void_p(handle) for handle in found[: count.value]] if status == 0 else []


def _text(ask: Any, handle: c_void_p, what: int) -> str:
    """What OpenCL says of a platform or device."""
    text = ctypes.create_string_buffer(1 << 12)
    return text.value.decode() if ask(handle, c_uint32(what), c_size_t(len(text)), text, None) == 0 else ""


def _processor(cl: ctypes.CDLL) -> c_void_p | None:
    """PoCL's CPU device, its processor named; None where there is none."""
    for platform in _handles(cl.clGetPlatformIDs):
        if _text(cl.clGetPlatformInfo, platform, _PLATFORM_NAME) == POCL:
            for device in _handles(cl.clGetDeviceIDs, platform, _CPU):
                about = {"version": _text(cl.clGetDeviceInfo, device, _VERSION)}
                about["driver_version"] = _text(cl.clGetDeviceInfo, device, _DRIVER_VERSION)
                pocl_cpu.name_processor(SimpleNamespace(int_ptr=_given(device), **about))
                return device
    return None


def _read_library(cl: ctypes.CDLL, opened: c_void_p, device: c_void_p) -> None:
    """Builds what cannot be linked: PoCL reads the library first, and keeps no more than what it has to say about the failure."""
    with suppress(Exception):
        source = c_char_p(_SOURCE.encode())
        program = _new(cl.clCreateProgramWithSource, opened, 1, byref(source), None)
        cl.clBuildProgram(program, 1, byref(device), _OPTIONS, None, None)
        cl.clReleaseProgram(program)
    kernel_cache.remove_failed(_SYMBOL)
