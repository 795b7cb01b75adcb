"""The program that builds trees, on one device: its kernels, its buffers, its launches."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device import kernel_cache, opencl, program
from clrt.device.context import Device
from clrt.device.session import check_buffer
from clrt.kdtree.binning import LEAST_BINS, MOST_BINS
from clrt.kdtree.common import DEPTH_CAP
from clrt.kdtree.sah import EMPTY_BONUS
from clrt.kdtree.tree import TRAVERSAL_COST

FILES = ("build_clip.cl", "build_split.cl", "build_top.cl", "build_subtree.cl")
_KERNELS = ("build_roots", "build_bins", "build_sides", "build_scatter", "build_subtrees")
_LOCAL = (1,)  #: a work-item has a chunk or a whole subtree to itself
BOUNDS_ROWS = 6  #: of references: lo x y z, hi x y z


def source() -> str:
    """The text of the program: a pure function of the kernel files and of the constants of clrt/kdtree."""
    values = {
        "LEAST_BINS": str(LEAST_BINS), "MOST_BINS": str(MOST_BINS), "MOST_DEPTH": str(DEPTH_CAP),
        "TRAVERSAL_COST": f"{TRAVERSAL_COST!r}f", "EMPTY_FACTOR": f"{1 - EMPTY_BONUS!r}f",
    }  # fmt: skip
    defines = "".join(f"#define {name} {value}\n" for name, value in values.items())
    return defines + "".join(f'#line 1 "{name}"\n{program.kernel_source(name)[0]}' for name in FILES)


def compiled_before(device: Device) -> bool:
    """Whether this process has all kernels for this device, or PoCL's cache does, by the note that was left when they were launched."""
    return device in _ready or _note(device).exists()


def is_processor(device: Device) -> bool:
    """Whether it is a CPU, whose work-items are fast alone."""
    cl = opencl.api()
    return bool(device.handle.type & cl.device_type.CPU)


def _note(device: Device) -> Path:
    text = "\0".join(program.cached_as(device, source()))
    return kernel_cache.compiled_note(hashlib.sha256(text.encode()).hexdigest()[:16])


_ready: set[Device] = set()  #: devices that this process has all kernels for, whatever becomes of the cache


@lru_cache(maxsize=1)
def _machine(device: Device) -> Machine:
    return Machine(device)


class Machine:
    """A device with the program built. Raises DeviceError where it cannot be."""

    @staticmethod
    def of(device: Device) -> Machine:
        """The one of this device, kept for the next trees."""
        return _machine(device)

    def __init__(self, device: Device) -> None:
        cl = opencl.api()
        self.device, self._cl = device, cl
        built = program.build(device, source())
        self._kernels = {name: cl.Kernel(built, name) for name in _KERNELS}
        self._launched: set[str] = set()

    @property
    def workers(self) -> int:
        """Work-items that keep every core busy."""
        return max(1, self.device.info.compute_units)

    def empty(self, size: int) -> Any:
        """A buffer of at least `size` bytes. Raises LimitError where the device has none so large."""
        check_buffer(self.device, size, "building the kd-tree")
        return self._cl.Buffer(self.device.context, self._cl.mem_flags.READ_WRITE, max(size, 64))

    def upload(self, array: NDArray[Any]) -> Any:
        """A copy of a small array."""
        flags = self._cl.mem_flags
        contents = np.ascontiguousarray(array) if array.size else np.zeros(16, array.dtype)
        return self._cl.Buffer(self.device.context, flags.READ_WRITE | flags.COPY_HOST_PTR, hostbuf=contents)

    def share(self, array: NDArray[Any]) -> Any:
        """A large array, contiguous, read where it lies if the device can; it must outlive the buffer."""
        check_buffer(self.device, array.nbytes, "building the kd-tree")
        flags = self._cl.mem_flags
        return self._cl.Buffer(self.device.context, flags.READ_ONLY | flags.USE_HOST_PTR, hostbuf=array)

    def read(self, buffer: Any, shape: int | Sequence[int], dtype: type[np.generic], offset: int = 0) -> NDArray[Any]:
        """What a buffer holds, from byte `offset` on; waits for what writes it."""
        array = np.empty(shape, dtype)
        if array.size:
            self._cl.enqueue_copy(self.device.queue, array, buffer, src_offset=offset)
        return array

    def run(self, name: str, size: int, *arguments: Any) -> None:
        """Enqueues a kernel over `size` work-items. PoCL compiles it at its first launch."""
        values = [np.int32(a) if isinstance(a, int | np.integer) else a for a in arguments]
        if name in self._launched:
            self._kernels[name](self.device.queue, (size,), _LOCAL, *values)
            return
        with kernel_cache.loading():
            self._kernels[name](self.device.queue, (size,), _LOCAL, *values)
            self.device.queue.finish()
        self._launched.add(name)
        if len(self._launched) == len(_KERNELS):
            _ready.add(self.device)
            with suppress(OSError):
                _note(self.device).touch()


class Store:
    """References on the device: their triangles, and six rows of bounds. `rows`: how many there is room for."""

    def __init__(self, machine: Machine, rows: int) -> None:
        self.rows = max(rows, 16)
        self.ref = machine.empty(self.rows * 4)
        self.bounds = machine.empty(self.rows * 4 * BOUNDS_ROWS)

    @property
    def arguments(self) -> tuple[Any, Any, int]:
        """As the kernels take it."""
        return self.ref, self.bounds, self.rows


def roomy(machine: Machine, store: Store | None, rows: int) -> Store:
    """The store itself where it has room for so many references, else a new one with some to spare."""
    return store if store is not None and store.rows >= rows else Store(machine, rows + rows // 8)
