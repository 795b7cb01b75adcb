"""PoCL's library of built-in functions, read while the scene is read.

Before PoCL compiles the first program of a context it reads the library, for a quarter of a second: about as long as it takes to import
pyopencl and to read a scene of a few megabytes. So where no program is compiled yet, one that cannot be linked is built as soon as
NumPy is there, in another thread, outside Python's lock and with pyopencl's extension module alone: the library stays in the context, of
the program nothing is kept. Whatever fails here is left to the usual way, which says why.
"""

from __future__ import annotations

import importlib
import importlib.machinery
import importlib.util
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

from clrt.device import context, kernel_cache, lean, pocl_cpu
from clrt.device.context import POCL, Device
from clrt.tasks import Task

T = TypeVar("T")

_EXTENSION = "pyopencl._cl"
_SYMBOL = "clrt_in_no_library"
_SOURCE = f"void {_SYMBOL}(void);\nkernel void nothing(void) {{ {_SYMBOL}(); }}\n"
_OPTIONS = " ".join(("-cl-std=CL1.2", *lean.OPTIONS)).encode()


def open_device(name: str | None = None) -> Device:
    """As `context.open_device`; where no program is compiled yet, the default device's library is being read from then on."""
    begun = {} if name else begin()
    opened = context.open_device(name, begun)
    if begun:
        with suppress(ImportError):  # what the first kernel would import while the compiler waits for it
            importlib.import_module("pyopencl.invoker")
    return opened


def begin() -> Mapping[int, Any]:
    """Begins to read the library of PoCL's processor: the address of the device, as pyopencl's `int_ptr` tells it, and its context.

    Empty where there is a compiled program already, or no such device.
    """
    if not kernel_cache.is_new(kernel_cache.choose_folder()):
        return {}
    try:
        extension = _extension()
        handle = _processor(extension)
        if handle is None:
            return {}
        opened = extension.Context([handle])
    except Exception:  # whatever another release of pyopencl does otherwise
        return {}
    Task(partial(_read_library, extension, opened, handle))
    return {handle.int_ptr: opened}


def _extension() -> Any:
    """pyopencl's extension module without the package around it, which takes a tenth of a second to import."""
    if _EXTENSION in sys.modules:
        return sys.modules[_EXTENSION]
    package = importlib.util.find_spec("pyopencl")
    folder = Path(_given(_given(package).origin)).parent
    # As the package does: the loader of its wheel looks there for PoCL.
    os.environ["PYOPENCL_HOME"] = str(folder)
    (file,) = (path for suffix in importlib.machinery.EXTENSION_SUFFIXES for path in folder.glob(f"_cl{suffix}"))
    spec = _given(importlib.util.spec_from_file_location(_EXTENSION, file))
    module = importlib.util.module_from_spec(spec)
    _given(spec.loader).exec_module(module)
    sys.modules[_EXTENSION] = module
    return module


def _given(value: T | None) -> T:
    """What is there. Raises ImportError where it is not."""
    if value is None:
        raise ImportError(_EXTENSION)
    return value


def _processor(extension: Any) -> Any:
    """PoCL's CPU device, its processor named; None where there is none."""
    asked = extension.device_info
    for platform in extension.get_platforms():
        if platform.get_info(extension.platform_info.NAME) == POCL:
            for handle in platform.get_devices(extension.device_type.CPU):
                about = {"version": handle.get_info(asked.VERSION), "driver_version": handle.get_info(asked.DRIVER_VERSION)}
                pocl_cpu.name_processor(SimpleNamespace(int_ptr=handle.int_ptr, **about))
                return handle
    return None


def _read_library(extension: Any, opened: Any, handle: Any) -> None:
    """Builds what cannot be linked: PoCL reads the library first, and keeps no more than what it has to say about the failure."""
    with suppress(Exception):
        extension._Program(opened, _SOURCE)._build(_OPTIONS, [handle])
    kernel_cache.remove_failed(_SYMBOL)
