"""Choosing an OpenCL device by name, saying what it is, and opening it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from clrt.device import kernel_cache, opencl, pocl_cpu
from clrt.device.pocl_cpu import POCL as POCL
from clrt.errors import DeviceError

INSTALL_HINT = "no OpenCL platform found: install one with  pip install 'pyopencl[pocl]'"


@dataclass(frozen=True)
class DeviceInfo:
    """What `clrt devices` tells of a device. `lanes`: rays a packet in float32; `global_mem`: bytes."""

    name: str
    platform: str
    version: str
    driver: str
    compute_units: int
    lanes: int
    fp64: bool
    global_mem: int
    default: bool


@dataclass(frozen=True, eq=False)
class Device:
    """An open device: its pyopencl handles, and what it is."""

    info: DeviceInfo
    handle: Any
    context: Any
    queue: Any


def lanes_of(native_float_width: int) -> int:
    """The packet width for a device: the largest of 16, 8, 4, 1 that its native float vectors hold."""
    return next((n for n in (16, 8, 4) if n <= native_float_width), 1)


def _none_found() -> str:
    wrong = kernel_cache.unwritable_folder()
    return INSTALL_HINT if wrong is None else f"no OpenCL device found: {wrong}"


def _handles() -> list[Any]:
    """Every device of every platform; CPU devices of PoCL first, other CPU devices next."""
    kernel_cache.choose_folder()
    cl = opencl.api()
    try:
        platforms = cl.get_platforms()
    except cl.Error as error:
        raise DeviceError(_none_found()) from error
    handles = []
    for platform in platforms:
        try:
            handles += platform.get_devices()
        except cl.Error:  # a platform without a device
            continue
    if not handles:
        raise DeviceError(_none_found())

    def rank(handle: Any) -> tuple[bool, bool]:
        return not handle.type & cl.device_type.CPU, handle.platform.name != POCL

    return sorted(handles, key=rank)


def _info(handle: Any, default: bool) -> DeviceInfo:
    return DeviceInfo(
        name=handle.name.strip(),
        platform=handle.platform.name.strip(),
        version=handle.version.strip(),
        driver=handle.driver_version.strip(),
        compute_units=handle.max_compute_units,
        lanes=lanes_of(handle.native_vector_width_float),
        fp64="cl_khr_fp64" in handle.extensions,
        global_mem=handle.global_mem_size,
        default=default,
    )


def list_devices() -> list[DeviceInfo]:
    """Every OpenCL device, the default one first. Raises DeviceError where there is none."""
    return [_info(handle, default=i == 0) for i, handle in enumerate(_handles())]


def open_device(name: str | None = None, contexts: Mapping[int, int] | None = None) -> Device:
    """The device whose platform or name contains `name` (any case); the default one for None or an empty name.

    contexts : of devices, by their address, that are open already: the addresses of those, which are taken over
    A platform comes before a name: two platforms' devices may be one processor, and PoCL's name holds the processor's maker.
    Raises DeviceError with the list of devices where none fits, or where the device lacks float64, in which
    the records that rays test are computed.
    """
    # pyopencl sets variables of its own for the compiler's output; PoCL's notes about unused code are not for users.
    os.environ.setdefault("PYOPENCL_COMPILER_OUTPUT", "0")
    handles = _handles()
    chosen = 0
    if name:
        wanted = name.lower()
        fitting = [i for i, h in enumerate(handles) if wanted in h.name.lower() or wanted in h.platform.name.lower()]
        if not fitting:
            there = "; ".join(f"'{h.name.strip()}' ({h.platform.name.strip()})" for h in handles)
            raise DeviceError(f"no OpenCL device is called '{name}'; there is: {there}")
        chosen = min(fitting, key=lambda i: wanted not in handles[i].platform.name.lower())
    handle = handles[chosen]
    info = _info(handle, default=chosen == 0)
    if not info.fp64:
        raise DeviceError(f"the device '{info.name}' has no float64 (cl_khr_fp64), which clrt needs to prepare its triangles")
    if info.platform == POCL:
        pocl_cpu.name_processor(handle)
    cl = opencl.api()
    begun = contexts.get(handle.int_ptr) if contexts else None
    context = cl.Context.from_int_ptr(begun, False) if begun else cl.Context([handle])
    return Device(info, handle, context, cl.CommandQueue(context))
