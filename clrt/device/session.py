"""A scene on a device: buffers filled, records prepared, one program ready to launch over bands of rows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device import kernel_cache, layout, opencl, program
from clrt.device.arrays_wide import wide_trees
from clrt.device.context import Device
from clrt.device.effect_arrays import PACKERS
from clrt.device.packed import Packed
from clrt.errors import LimitError
from clrt.features import Features
from clrt.precision import Precision
from clrt.scene.model import Scene

FILM_BYTES = 12  #: a pixel of the film: three float32
_WRITTEN = ("sample_sums", "wide_blocks")  #: arrays of effects that kernels fill
_PLANES = ("light_planes", "sun_planes")  #: those that prepare.cl fills before


def check_buffer(device: Device, size: int, what: str) -> None:
    """Raises LimitError where `size` bytes are more than the device gives in one piece."""
    limit = device.handle.max_mem_alloc_size
    if size > limit:
        raise LimitError(f"{what} needs {size >> 20:,} MiB in one piece; the device '{device.info.name}' gives {limit >> 20:,} MiB at most")


def check_picture(device: Device, width: int, height: int) -> None:
    """Raises LimitError where the device has no room for a picture of this size: said before any work."""
    pixels = device.handle.max_mem_alloc_size // FILM_BYTES
    if width * height > pixels:
        raise LimitError(
            f"a picture of {width} x {height} needs {width * height * FILM_BYTES >> 20:,} MiB in one piece; "
            f"the device '{device.info.name}' has room for {pixels:,} pixels"
        )


def shares_lights(scene: Scene, precision: Precision, device: Device, slots: int | None = None) -> bool:
    """Whether edge planes of every light, of so many slots (default: of all triangles), fit in the device's memory."""
    return _have_room(device, _of_lights(scene, precision, slots))


def shares_suns(scene: Scene, precision: Precision, device: Device, slots: int | None = None) -> bool:
    """Whether those along every sun fit beside them."""
    size = _plane_bytes(layout.parallel_planes(precision.real), len(scene.suns), scene, slots)
    return _have_room(device, size, _of_lights(scene, precision, slots) if shares_lights(scene, precision, device, slots) else 0)


def _of_lights(scene: Scene, precision: Precision, slots: int | None) -> int:
    """Bytes of the planes of every light."""
    return _plane_bytes(layout.edge_planes(precision.real), len(scene.lights_with_position), scene, slots)


def _plane_bytes(record: np.dtype[np.void], origins: int, scene: Scene, slots: int | None) -> int:
    return max(1, scene.triangle_count if slots is None else slots) * record.itemsize * origins


def _have_room(device: Device, size: int, beside: int = 0) -> bool:
    """Whether the device gives `size` bytes in one piece, and has a quarter of its memory for those and `beside`."""
    return bool(size <= device.handle.max_mem_alloc_size and size + beside <= device.handle.global_mem_size // 4)


class Buffers:
    """The device's copy of a packed scene.

    groups : whether packets of its pictures go together
    shared_lights, shared_suns : whether edge planes of every light, of every sun fit in memory
    """

    def __init__(self, device: Device, packed: Packed, features: Features, precision: Precision, groups: bool = False) -> None:
        packed = replace(packed, block=program.block_width(precision.lanes(device.info.lanes)))
        self.device, self.packed, self.features, self.precision = device, packed, features, precision
        self.lanes = precision.lanes(device.info.lanes)
        self.groups = groups and self.lanes > 1
        self.plane_bytes = max(1, packed.slots) * layout.edge_planes(precision.real).itemsize
        self.shared_lights = shares_lights(packed.scene, precision, device, packed.slots)
        self.shared_suns = shares_suns(packed.scene, precision, device, packed.slots)
        self._check_memory()
        self.frame = self.upload(packed.frame)
        self.vertices = self.upload(packed.vertices)
        self.core = [self.upload(a) for a in (packed.nodes, packed.indices, packed.objects, packed.surfaces, packed.materials)]
        self.effects = {
            name: self.upload(np.zeros(0, np.int32) if features.idle(f) else PACKERS[name](packed), writable=name in _WRITTEN)
            for f in features.active
            for name, _ in f.parameters
            if name not in _PLANES
        }
        self.triangles = self.empty(max(1, packed.slots) * layout.triangle(precision.real).itemsize)
        self.eye_planes = self.empty(self.plane_bytes)
        self.effects |= {name: self._planes(name) for f in features.active for name, _ in f.parameters if name in _PLANES}
        #: boxes of directions as seen from the eye, of those from all lights, and along all suns, where the program reads them; where the
        #: device has no room for them there are no levels of them, and packets go alone
        self.box_levels: list[int] = []
        self.boxes: dict[str, Any] = {}
        if self.groups:
            self.box_levels, self.boxes = self._boxes()

    @property
    def wide_stack(self) -> int:
        """Entries of the stack of wide trees."""
        return max(program.WIDE_STACK, wide_trees(self.packed).stack) if "single rays" in dict(self.features.lines) else program.WIDE_STACK

    @property
    def size(self) -> int:
        """Bytes of all buffers: the scene's, and those of effects."""
        own = (self.frame, self.vertices, self.triangles, self.eye_planes)
        return sum(b.size for b in (*own, *self.core, *self.effects.values(), *self.boxes.values()))

    @property
    def box_count(self) -> int:
        """Records of boxes as seen from one origin, and the one in front of them that tells how directions are measured; or 0."""
        return 1 + sum(self.box_levels) if self.box_levels else 0

    def _planes(self, name: str) -> Any:
        """Room for the planes of every light or sun; for one record where rays do without."""
        real, scene = self.precision.real, self.packed.scene
        if name == "light_planes":
            record, origins = layout.edge_planes(real), len(scene.lights_with_position) if self.shared_lights else 0
        else:
            record, origins = layout.parallel_planes(real), len(scene.suns) if program.suns_share(self.features, self.shared_suns) else 0
        return self.empty(record.itemsize * max(1, self.packed.slots * origins))

    def _boxes(self) -> tuple[list[int], dict[str, Any]]:
        """How many records each level has as seen from one origin, and room for those of all, in the order of the program's arguments."""
        shape, scene = program.Shape(0, shared_lights=self.shared_lights, groups=True), self.packed.scene
        origins = {"eye": 1}
        if program.lights_grouped(self.features, self.lanes, shape):
            origins["lights"] = min(len(scene.lights_with_position), program.LIGHTS_SEEN)
        if program.suns_grouped(self.features, self.lanes, shape):
            origins["suns"] = min(len(scene.suns), program.LIGHTS_SEEN)
        levels, record = self._box_levels(), layout.direction_boxes().itemsize
        size = (1 + sum(levels)) * record
        most = max(origins.values())
        if not _have_room(self.device, size * most, size * (sum(origins.values()) - most)):
            levels, size = [], record
        return levels, {name: self.empty(size * n) for name, n in origins.items()}

    def _box_levels(self) -> list[int]:
        """Blocks, records of 16 of those, and so on to one; none where trees have but a leaf, so that every ray meets all triangles."""
        split = len(self.packed.nodes) > len(self.packed.objects)
        levels = [len(self.packed.blocks)] if split and len(self.packed.blocks) else []
        while levels and levels[-1] > 1:
            levels.append(-(-levels[-1] // layout.BOXES))
        return levels

    def _check_memory(self) -> None:
        need, there = self.plane_bytes * 4, self.device.handle.global_mem_size
        if need > there:
            raise LimitError(f"{self.packed.slots:,} triangles need {need >> 20:,} MiB on the device, which has {there >> 20:,} MiB")

    def upload(self, array: NDArray[Any], *, writable: bool = False) -> Any:
        cl = opencl.api()
        flags = (cl.mem_flags.READ_WRITE if writable else cl.mem_flags.READ_ONLY) | cl.mem_flags.COPY_HOST_PTR
        contents = np.ascontiguousarray(array) if array.size else np.zeros(1, array.dtype)
        check_buffer(self.device, contents.nbytes, "the scene")
        return cl.Buffer(self.device.context, flags, hostbuf=contents)

    def empty(self, size: int) -> Any:
        cl = opencl.api()
        check_buffer(self.device, size, "the scene")
        return cl.Buffer(self.device.context, cl.mem_flags.READ_WRITE, size)


class StageCounter:
    """How many lanes each later stage of the rung `exact` decided."""

    def __init__(self, buffers: Buffers) -> None:
        self.queue = buffers.device.queue
        self.buffer = buffers.upload(np.zeros(2, np.int32), writable=True)

    def read(self) -> dict[str, int]:
        """The counts since the last call."""
        cl = opencl.api()
        counts = np.zeros(2, np.int32)
        cl.enqueue_copy(self.queue, counts, self.buffer)
        cl.enqueue_copy(self.queue, self.buffer, np.zeros(2, np.int32))
        return {"float64": int(counts[0]), "exact": int(counts[1])}


class Tracer:
    """A built program with the buffers it reads; `run` renders rows of the film."""

    def __init__(self, buffers: Buffers, built: Any, *, counting: bool = False) -> None:
        cl = opencl.api()
        scene = buffers.packed.scene
        self.buffers, self.counting = buffers, counting
        self.width, self.height = scene.camera.width, scene.camera.height
        self.item = program.item_size(buffers.lanes, buffers.groups)
        self.film = buffers.empty(self.width * self.height * FILM_BYTES)
        self.kernel = cl.Kernel(built, "render")
        self.counters = np.zeros(len(buffers.features.ray_kinds) + len(scene.objects), np.uint64)
        self.counts = np.zeros(len(self.counters), np.int64)
        self._counter_buffer: Any = buffers.empty(self.counters.nbytes) if counting else None
        nodes, indices, objects, surfaces, materials = buffers.core
        self._before = (
            buffers.frame,
            nodes,
            indices,
            buffers.triangles,
            buffers.eye_planes,
            buffers.vertices,
            objects,
            surfaces,
            materials,
        )
        self._effects = [name for f in buffers.features.active for name, _ in f.parameters]
        self._after = (self.film, *(buffers.effects[name] for name in self._effects))
        if counting:
            self._after += (self._counter_buffer,)
        self.stages = StageCounter(buffers) if buffers.precision.decides_in_stages else None
        if self.stages is not None:
            self._after += (self.stages.buffer,)
        if buffers.boxes:
            eye_boxes, *other_boxes = buffers.boxes.values()
            self._after += (eye_boxes, np.int32(len(buffers.packed.blocks)), np.int32(buffers.box_count), *other_boxes)

    def begin_samples(self, first: int, end: int) -> None:
        """The next rows are those of samples [first, end), which are added to the ones before them. For scenes that are sampled."""
        cl = opencl.api()
        cl.enqueue_copy(self.buffers.device.queue, self.buffers.effects["sample_range"], np.array([first, end, 0], np.int32))

    def run_tiles(self, frame: Any, sums: Any, samples: tuple[int, int], tiles: NDArray[np.int32]) -> None:
        """Adds samples [first, end) of tiles to `sums`, and waits for them; `frame` is taken in place of the tracer's own.

        sums : buffer of float64, tile by tile, each (TILE height, width, 3)
        tiles : (n, 4) column and row of the first pixel, seed, and the place of the sums, counted in tiles
        """
        width, height = self.item
        items = len(tiles) * (program.TILE[0] // width) * (program.TILE[1] // height)
        size = program.LOCAL_SIZE[0], multiple(-(-items // program.LOCAL_SIZE[0]), program.LOCAL_SIZE[1])
        given = self.buffers.upload(np.concatenate([np.array([*samples, len(tiles)], np.int32), tiles.ravel()]))
        effects = {"sample_range": given, "sample_sums": sums}
        after = (self.film, *(effects.get(name, own) for name, own in zip(self._effects, self._after[1:], strict=False)))
        rows = np.int32(0), np.int32(self.height)
        queue = self.buffers.device.queue
        self.kernel(queue, size, program.LOCAL_SIZE, frame, *self._before[1:], *rows, *after, *self._after[len(after) :])
        queue.finish()

    @property
    def row_step(self) -> int:
        """Rows that launches best begin and end at: of whole work-items, and of whole tiles."""
        return max(program.TILE[1], self.item[1])

    def warm_up(self) -> None:
        """Launches over no rows: PoCL compiles for a local size at its first launch, which belongs to compiling."""
        with kernel_cache.loading():
            self.run(0, 0)

    def run(self, first_row: int, end_row: int) -> None:
        """Renders rows [first_row, end_row) and waits for them. In the counting build, adds to `counts`."""
        columns = multiple(-(-self.width // self.item[0]), program.LOCAL_SIZE[0])
        rows = multiple(max(1, -(-(end_row - first_row) // self.item[1])), program.LOCAL_SIZE[1])
        queue = self.buffers.device.queue
        if self.counting:
            self.begin_counting()
        self.kernel(queue, (columns, rows), program.LOCAL_SIZE, *self._before, np.int32(first_row), np.int32(end_row), *self._after)
        queue.finish()
        if self.counting:
            self.end_counting()

    def begin_counting(self) -> None:
        """What is launched next is counted from 0. In the counting build alone, as is `end_counting`."""
        cl = opencl.api()
        self.counters[:] = 0
        cl.enqueue_copy(self.buffers.device.queue, self._counter_buffer, self.counters)

    def end_counting(self) -> None:
        """Adds what was counted to `counts`."""
        cl = opencl.api()
        cl.enqueue_copy(self.buffers.device.queue, self.counters, self._counter_buffer)
        self.counts += self.counters.astype(np.int64)

    def picture(self) -> NDArray[np.float32]:
        """(height, width, 3) float32, linear."""
        cl = opencl.api()
        pixels = np.empty((self.height, self.width, 3), np.float32)
        cl.enqueue_copy(self.buffers.device.queue, pixels, self.film)
        return pixels


def multiple(value: int, of: int) -> int:
    """The least multiple of `of` that is not below `value`."""
    return -(-value // of) * of
