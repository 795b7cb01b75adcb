"""Processors newer than PoCL's compiler.

PoCL asks its LLVM for the processor's name. The LLVM 14 of the wheel does not know processors made after 2022 (AMD Zen 4
and 5, newer Xeons) and answers "generic", which its own front end then refuses: "unknown target CPU 'generic'"
(pocl issues 512 and 1049; PoCL later added a fall-back). The name can be set nowhere in version 3.0, so it is set
here, where PoCL keeps it: in the device's record. The new name is the oldest processor that has the instructions
PoCL's own kernel library was chosen by.

Nothing is written unless the record holds a pointer to the text "generic". PoCL zeroes a record before it fills it, so the first
such pointer is the record's own; one behind it may be left over from other memory. Memory is read through /proc/self/mem, which
refuses bad addresses instead of faulting.
"""

from __future__ import annotations

import ctypes
import os
import struct
from pathlib import Path
from typing import Any

from clrt.errors import DeviceError

POCL = "Portable Computing Language"  #: its platform
#: (instruction sets as /proc/cpuinfo names them, processor as LLVM names it), best first: the variants of PoCL's kernel library
_PROCESSORS: tuple[tuple[set[str], str], ...] = (
    ({"avx512f", "avx512bw", "avx512dq", "avx512vl", "avx512cd"}, "skylake-avx512"),
    ({"avx2", "fma", "bmi1", "bmi2", "movbe"}, "haswell"),
    ({"avx", "fma4"}, "bdver1"),
    ({"avx", "f16c"}, "ivybridge"),
    ({"avx"}, "sandybridge"),
    ({"sse4_1"}, "penryn"),
    ({"ssse3"}, "core2"),
    (set(), "x86-64"),
)
_RECORD_BYTES = 2048  # the name stands in the first kilobyte of PoCL 3.0's record
_UNKNOWN = b"generic\0"
#: address of a device's record -> the text it points to, which lives as long as the process
_named: dict[int, Any] = {}


def processor_name(flags: set[str]) -> str:
    """The processor that LLVM 14 knows and that has no instruction set beyond `flags`."""
    return next(name for needs, name in _PROCESSORS if needs <= flags)


def _cpu_flags() -> set[str]:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("flags"):
            return set(line.partition(":")[2].split())
    return set()


def _slots_of_unknown(record: int) -> list[int]:
    """Offsets in the device's record of pointers to the text "generic"."""
    memory = os.open("/proc/self/mem", os.O_RDONLY)
    try:
        words = os.pread(memory, _RECORD_BYTES, record)
        found = []
        for offset in range(0, len(words) - 7, 8):
            (address,) = struct.unpack_from("<Q", words, offset)
            if 4096 <= address < 1 << 47:
                try:
                    text = os.pread(memory, len(_UNKNOWN), address)
                except OSError:  # not an address
                    continue
                if text == _UNKNOWN:
                    found.append(offset)
        return found
    finally:
        os.close(memory)


def name_processor(handle: Any) -> str | None:
    """Names the processor to a PoCL device that could not; gives that name, or None where nothing was to be done.

    Raises DeviceError where PoCL does not know the processor and cannot be told.
    """
    # A record is searched once: were it searched again, a pointer left over behind it would come first.
    if not handle.version.rstrip().endswith("-generic") or os.uname().machine != "x86_64" or handle.int_ptr in _named:
        return None
    try:
        slots = _slots_of_unknown(handle.int_ptr)
    except OSError:
        slots = []
    if not slots:
        raise DeviceError(
            f"PoCL ({handle.driver_version.strip()}) does not know this processor and cannot be told its name; "
            "install a newer PoCL, or Intel's runtime (pip install intel-opencl-rt)"
        )
    text = ctypes.create_string_buffer(processor_name(_cpu_flags()).encode())
    _named[handle.int_ptr] = text
    ctypes.c_uint64.from_address(handle.int_ptr + slots[0]).value = ctypes.addressof(text)
    return text.value.decode()
