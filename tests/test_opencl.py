"""The stand-in for pyopencl does as the package does, and gives way to it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from clrt.device import kernel_cache

HEAD = """
import sys
import numpy as np
from clrt.device import opencl
from clrt.device.context import open_device
from clrt.device.program import build
source = "kernel void scaled(global const int *of, int by, double4 more, global double *to)"
source += " { const int i = get_global_id(0); to[i] = of[i] * by + more.z; }"
"""
SCALED = """
def scaled(device):
    cl = opencl.api()
    kernel = cl.Kernel(build(device, source), "scaled")
    flags = cl.mem_flags
    of = cl.Buffer(device.context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=np.arange(8, dtype=np.int32))
    to = cl.Buffer(device.context, flags.READ_WRITE, 64)
    cl.enqueue_copy(device.queue, to, np.full(8, -1.0))
    kernel(device.queue, (4,), (1,), of, np.int32(3), np.array([0, 0, 0.5, 0]), to, global_offset=(2,))
    found = np.empty(8)
    cl.enqueue_copy(device.queue, found, to)
    part, copy = np.empty(2), cl.Buffer(device.context, flags.READ_WRITE, 64)
    cl.enqueue_copy(device.queue, copy, to)
    cl.enqueue_copy(device.queue, part, copy, src_offset=16)
    device.queue.finish()
    return [*found.tolist(), *part.tolist(), to.size]
"""
EXPECTED = [-1.0, -1.0, 6.5, 9.5, 12.5, 15.5, -1.0, -1.0, 6.5, 9.5, 64]


def told(code: str, folder: Path, **more: str) -> list[str]:
    environment = os.environ | {kernel_cache.VARIABLE: str(folder / "pocl"), "XDG_CACHE_HOME": str(folder / "cache")} | more
    done = subprocess.run([sys.executable, "-c", HEAD + SCALED + code], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip().split("\n")


@pytest.mark.parametrize("first", ["", "import pyopencl"])
def test_kernels_and_copies_are_those_of_the_package(tmp_path: Path, first: str) -> None:
    code = f"{first}\ndevice = open_device()\nprint(scaled(device))\nprint('pyopencl' in sys.modules)\n"
    assert told(code, tmp_path) == [str(EXPECTED), str(bool(first))]


def test_what_the_stand_in_made_is_used_by_the_package(tmp_path: Path) -> None:
    code = "device = open_device()\nfirst = build(device, source)\nimport pyopencl as cl\nassert opencl.api() is cl\n"
    code += "print(cl.Kernel(first, 'scaled').num_args, device.handle.name == device.info.name, scaled(device))\n"
    assert told(code, tmp_path) == [f"4 True {EXPECTED}"]


def test_device_is_told_of_alike(tmp_path: Path) -> None:
    code = "print(open_device().info)\n"
    assert told(code, tmp_path) == told("import pyopencl\n" + code, tmp_path)


def test_compiler_s_words_are_those_of_the_package(tmp_path: Path) -> None:
    code = "try:\n    build(open_device(), 'kernel void one(void) { two(); }')\n"
    code += "except Exception as error:\n    print(type(error).__name__, 'two' in str(error))"
    assert told(code, tmp_path) == ["DeviceError True"]


def test_kernel_that_is_not_there_is_an_error_of_the_extension(tmp_path: Path) -> None:
    code = "device = open_device()\ncl = opencl.api()\n"
    code += "try:\n    cl.Kernel(build(device, source), 'other')\nexcept cl.Error as error:\n    print(error)\n"
    (message,) = told(code, tmp_path)
    assert message.startswith("clCreateKernel failed")


def test_package_is_taken_where_the_extension_is_another(tmp_path: Path) -> None:
    code = "opencl.extension = lambda: object()\nprint(scaled(open_device()), 'pyopencl' in sys.modules)\n"
    assert told(code, tmp_path) == [f"{EXPECTED} True"]


def test_options_that_the_package_adds_are_added(tmp_path: Path) -> None:
    code = "source = source.replace('more.z', 'more.z + MORE')\nprint(scaled(open_device())[2])\n"
    assert told(code, tmp_path, PYOPENCL_BUILD_OPTIONS="-DMORE=100") == ["106.5"]
