"""OpenCL by pyopencl: the whole package where it is imported, else its extension module alone.

The package imports a hundred modules that a picture has no use for, for a tenth of a second. What it calls is in the extension; of the
little that it puts around that, here is what pictures need, with the same names and arguments. Objects made one way work the other.
"""

from __future__ import annotations

import ctypes
import importlib
import importlib.machinery
import importlib.util
import os
import sys
from contextlib import suppress
from ctypes import byref, c_char_p, c_int, c_int32, c_size_t, c_void_p, sizeof
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

T = TypeVar("T")

PACKAGE = "pyopencl"
_EXTENSION = "pyopencl._cl"
_OPTIONS = "PYOPENCL_BUILD_OPTIONS"  #: the package adds these to every build


def api() -> Any:
    """What has `get_platforms`, `Context`, `Buffer` and so on: the package, or a stand-in of the same names."""
    if _is_imported() or os.environ.get(_OPTIONS):
        return importlib.import_module(PACKAGE)
    try:
        return _stand_in()
    except Exception:  # whatever another release of pyopencl does otherwise
        return importlib.import_module(PACKAGE)


def _is_imported() -> bool:
    package = sys.modules.get(PACKAGE)
    return package is not None and not getattr(package.__spec__, "_initializing", False)


def extension_file() -> Path:
    """The extension module. Raises ImportError where there is none."""
    folder = Path(_given(_given(importlib.util.find_spec(PACKAGE)).origin)).parent
    # As the package does: the loader of its wheel looks there for PoCL.
    os.environ["PYOPENCL_HOME"] = str(folder)
    files = (folder / f"_cl{suffix}" for suffix in importlib.machinery.EXTENSION_SUFFIXES)
    return _given(next((file for file in files if file.is_file()), None))


def extension() -> Any:
    """The extension module, imported without the package. Raises ImportError."""
    if _EXTENSION in sys.modules:
        return sys.modules[_EXTENSION]
    spec = _given(importlib.util.spec_from_file_location(_EXTENSION, extension_file()))
    module = importlib.util.module_from_spec(spec)
    _given(spec.loader).exec_module(module)
    sys.modules[_EXTENSION] = module
    return module


@cache
def functions() -> ctypes.CDLL:
    """OpenCL's own functions, from the library that the extension takes, loaded outside Python's lock. Raises ImportError, OSError."""
    file = extension_file()
    load = ctypes.CDLL(None).dlopen
    load.restype, load.argtypes = c_void_p, (c_char_p, c_int)
    handle = load(os.fsencode(file), os.RTLD_NOW)
    if not handle:
        raise ImportError(file)
    cl = ctypes.CDLL(str(file), handle=handle)
    for make in (cl.clCreateContext, cl.clCreateProgramWithSource, cl.clCreateKernel):
        make.restype = c_void_p
    return cl


def _given(value: T | None) -> T:
    """What is there. Raises ImportError where it is not."""
    if value is None:
        raise ImportError(_EXTENSION)
    return value


@cache
def _stand_in() -> SimpleNamespace:
    cl = extension()
    if not _is_imported():
        for kind, asked in ((cl.Platform, cl.platform_info), (cl.Device, cl.device_info), (cl.MemoryObjectHolder, cl.mem_info)):
            _add_properties(kind, asked)
    same = ("get_platforms", "Context", "CommandQueue", "Buffer", "Error", "mem_flags", "device_type", "_Program", "_enqueue_read_buffer",
             "_enqueue_write_buffer", "_enqueue_copy_buffer", "MemoryObjectHolder")  # fmt: skip
    found = {name: getattr(cl, name) for name in same}
    return SimpleNamespace(**found, Kernel=Kernel, Program=Program, enqueue_copy=enqueue_copy, CompilerWarning=UserWarning)


def _add_properties(kind: Any, asked: Any) -> None:
    """`device.name` for `device.get_info(device_info.NAME)`, and so on."""
    for name in vars(asked):
        if name.isupper():
            setattr(kind, name.lower(), property(partial(_told, getattr(asked, name))))


def _told(what: Any, thing: Any) -> Any:
    return thing.get_info(what)


class Program:
    """As the package's: `build` gives what kernels are made of."""

    def __init__(self, context: Any, source: str) -> None:
        self._context, self._source = context, source

    def build(self, options: list[str]) -> Any:
        """The program, built. Raises what the package raises, which knows what the compiler said."""
        cl = _stand_in()
        program = cl._Program(self._context, self._source)
        # The package's own files are looked for in all its builds; PoCL's cache knows a program by its options, too.
        folder = extension_file().parent / "cl"
        if " " in str(folder):
            return importlib.import_module(PACKAGE).Program(self._context, self._source).build(options)
        try:
            program._build(" ".join([*options, "-I", str(folder)]).encode(), self._context.get_info(extension().context_info.DEVICES))
        except cl.Error:
            return importlib.import_module(PACKAGE).Program(self._context, self._source).build(options)
        return program


class Kernel:
    """As the package's, called with a queue, the global and the local size, and all arguments; by OpenCL's own functions.

    The extension's kernels import the package.
    """

    def __init__(self, program: Any, name: str) -> None:
        self.function_name = name
        self._cl, status = functions(), c_int32()
        self._kernel = c_void_p(self._cl.clCreateKernel(c_void_p(program.int_ptr), name.encode(), byref(status)))
        _check("clCreateKernel", status.value)

    def __call__(self, queue: Any, size: tuple[int, ...], local: tuple[int, ...], *arguments: Any, global_offset: Any = None) -> None:
        for index, argument in enumerate(arguments):
            value = argument.int_ptr.to_bytes(sizeof(c_void_p), sys.byteorder) if hasattr(argument, "int_ptr") else argument.tobytes()
            _check("clSetKernelArg", self._cl.clSetKernelArg(self._kernel, index, c_size_t(len(value)), value))
        sizes = (None if given is None else (c_size_t * len(size))(*given) for given in (global_offset, size, local))
        launch = self._cl.clEnqueueNDRangeKernel
        _check("clEnqueueNDRangeKernel", launch(c_void_p(queue.int_ptr), self._kernel, len(size), *sizes, 0, None, None))

    def __del__(self) -> None:
        with suppress(AttributeError):  # where there is none
            if self._kernel:
                self._cl.clReleaseKernel(self._kernel)


def _check(what: str, status: int) -> None:
    """Raises the extension's Error where OpenCL tells of one."""
    if status:
        raise extension().Error(f"{what} failed: {status}")


def enqueue_copy(queue: Any, dest: Any, src: Any, *, src_offset: int = 0, dst_offset: int = 0) -> Any:
    """Copies between a buffer, from a byte on, and an array, either way, or two buffers; waits for the end where there is an array."""
    cl = _stand_in()
    if not isinstance(dest, cl.MemoryObjectHolder):
        return cl._enqueue_read_buffer(queue, src, dest, src_offset=src_offset)
    if isinstance(src, cl.MemoryObjectHolder):
        return cl._enqueue_copy_buffer(queue, src, dest, src_offset=src_offset, dst_offset=dst_offset)
    return cl._enqueue_write_buffer(queue, dest, src, dst_offset=dst_offset)
