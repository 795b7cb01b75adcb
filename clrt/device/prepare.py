"""The records that rays test, made on the device from the vertices as given: one kernel for all kinds, launched over each (prepare.cl)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device import kernel_cache, layout, opencl, program
from clrt.device.arrays_wide import wide_trees
from clrt.device.session import Buffers, multiple

LOCAL = 64
_TRIANGLES, _PLANES, _DIRECTIONS, _UNIONS, _PLACES, _PLACED, _PARALLEL = map(np.int32, range(7))
_OUTERMOST = 32000  #: steps to the direction farthest from the middle: an int16 holds all


def prepare(buffers: Buffers, built: Any, *, planes: bool = True) -> None:
    """Computes the records of all triangles and waits for them; `planes`: those as seen from shared origins, too."""
    if not buffers.packed.slots:
        return
    with kernel_cache.loading():
        _Launches(buffers, built, planes).run()
        buffers.device.queue.finish()


class _Launches:
    """The one kernel, over all kinds of records that the program reads."""

    def __init__(self, buffers: Buffers, built: Any, planes: bool) -> None:
        cl = opencl.api()
        self.buffers, self.built, self.planes = buffers, built, planes
        self.kernel = cl.Kernel(built, "prepare")
        packed = buffers.packed
        self.eye = np.asarray(packed.scene.camera.eye)
        self.lights = [np.asarray(light.position) for light in packed.scene.lights_with_position]
        #: PoCL tells small launches from large ones, and compiles for each kind: those of a few records are as large as the first
        self.least = packed.slots
        effects = buffers.effects
        self.of_places = (effects["object_origins"], buffers.core[3]) if "object_origins" in effects else ()
        self.blocks = buffers.upload(packed.blocks) if buffers.boxes else None

    def run(self) -> None:
        buffers, packed = self.buffers, self.buffers.packed
        called = dict(buffers.features.lines)
        self._launch(_PLACED if "placed" in called else _TRIANGLES, packed.slots, packed.origin, 0, packed.slots)
        if "single rays" in called:
            self._single_rays()
        if not self.planes:
            return
        self._launch(_PLANES, packed.slots, self.eye, 0, packed.slots, planes=buffers.eye_planes)
        if "light_planes" in buffers.effects and buffers.shared_lights:
            for i, light in enumerate(self.lights):
                self._launch(_PLANES, packed.slots, light, i * packed.slots, packed.slots, planes=buffers.effects["light_planes"])
        if "sun_planes" in buffers.effects and program.suns_share(buffers.features, buffers.shared_suns):
            for i, sun in enumerate(packed.scene.suns):
                self._launch(_PARALLEL, packed.slots, packed.origin, i * packed.slots, packed.slots, along=np.asarray(sun.direction))
        if buffers.boxes and buffers.box_count:
            self._directions(self.eye, buffers.boxes["eye"], 0)
            for i, light in enumerate(self.lights[: program.LIGHTS_SEEN] if "lights" in buffers.boxes else ()):
                self._directions(light, buffers.boxes["lights"], i * buffers.box_count)
            for i, sun in enumerate(packed.scene.suns[: program.LIGHTS_SEEN] if "suns" in buffers.boxes else ()):
                self._places(np.asarray(sun.direction), buffers.boxes["suns"], i * buffers.box_count)

    def _launch(self, what: np.int32, items: int, origin: NDArray[np.float64], first: int, end: int, *, planes: Any = None,
                of_boxes: tuple[Any, ...] = (), along: NDArray[np.float64] | None = None, frame: NDArray[np.float32] | None = None
                ) -> None:  # fmt: skip
        """The kernel's arguments: those of all scenes, then those of files, in the order of the program."""
        buffers = self.buffers
        size = (multiple(max(items, self.least), LOCAL),)
        records = buffers.triangles, buffers.eye_planes if planes is None else planes
        given = [what, buffers.vertices, _four(origin), *records, np.int32(first), np.int32(end)]
        if buffers.boxes:
            given += of_boxes or self._of_boxes(np.zeros(4, np.float32), buffers.boxes["eye"])
        given += self.of_places
        if "sun_planes" in buffers.effects:
            # The direction that rays have: rounded as theirs.
            direction = np.zeros(3) if along is None else along.astype(buffers.precision.real).astype(np.float64)
            given += buffers.effects["sun_planes"], _four(direction)
        if "suns" in buffers.boxes:
            given += buffers.upload(np.zeros(13, np.float32) if frame is None else frame), _four(buffers.packed.origin)
        self.kernel(buffers.device.queue, size, (LOCAL,), *given)

    def _of_boxes(self, scale: NDArray[np.float32], boxes: Any, below: int = 0, count: int = 0) -> tuple[Any, ...]:
        return self.blocks, scale, boxes, np.int32(below), np.int32(count)

    def _directions(self, origin: NDArray[np.float64], boxes: Any, first: int) -> None:
        """Of blocks, then of the records above them."""
        packed = self.buffers.packed
        items = self.buffers.box_levels[0] * layout.BOXES
        scale = direction_scale(origin - packed.origin, packed.objects)
        self._launch(_DIRECTIONS, items, origin, first, items, of_boxes=self._of_boxes(scale, boxes))
        self._unions(boxes, first)

    def _places(self, direction: NDArray[np.float64], boxes: Any, first: int) -> None:
        """As seen along a sun's direction."""
        packed = self.buffers.packed
        items = self.buffers.box_levels[0] * layout.BOXES
        frame = place_frame(direction, packed.objects)
        self._launch(_PLACES, items, self.eye, first, items, of_boxes=self._of_boxes(frame[:4], boxes), frame=frame)
        self._unions(boxes, first)

    def _unions(self, boxes: Any, first: int) -> None:
        """Level by level."""
        below = 1
        for count in self.buffers.box_levels[:-1]:
            items = multiple(count, layout.BOXES)
            self._launch(_UNIONS, items, self.eye, first, items, of_boxes=self._of_boxes(np.zeros(4, np.float32), boxes, below, count))
            below += count

    def _single_rays(self) -> None:
        """Blocks of the wide trees."""
        cl = opencl.api()
        buffers = self.buffers
        slots = wide_trees(buffers.packed).slots
        given = buffers.upload(slots)
        size = (multiple(slots.size, LOCAL),)
        cl.Kernel(self.built, "prepare_blocks")(
            buffers.device.queue, size, (LOCAL,), buffers.triangles, given, buffers.effects["wide_blocks"], np.int32(slots.size)
        )
        buffers.device.queue.finish()


def _four(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """As a double4."""
    return np.array([*vector, 0.0])


def direction_scale(origin: NDArray[np.float64], objects: NDArray[np.void]) -> NDArray[np.float32]:
    """(4,): the direction to the middle of all objects, and the steps a unit in which others are measured from it (directions.cl).

    origin : (3,), relative to what the objects' boxes are relative to

    All objects lie in a sphere, as seen from outside it in a cone: no direction in it is farther from its middle than twice the sine of
    half its angle. From inside, directions go all around.
    """
    lo, hi = objects["lo"].min(0).astype(np.float64), objects["hi"].max(0).astype(np.float64)
    to_middle, radius = (lo + hi) / 2 - origin, np.linalg.norm(hi - lo) / 2
    distance = np.linalg.norm(to_middle)
    if not radius < distance < np.inf:
        return np.array([0, 0, 0, _OUTERMOST], np.float32)
    farthest = max(2 * np.sin(np.arcsin(radius / distance) / 2), 1e-6)
    return np.array([*(to_middle / distance), _OUTERMOST / farthest], np.float32)


def place_frame(direction: NDArray[np.float64], objects: NDArray[np.void]) -> NDArray[np.float32]:
    """(13,): the middle of all objects, steps a unit of length, three axes at right angles, the last along `direction` (group_sun.cl)."""
    lo, hi = objects["lo"].min(0).astype(np.float64), objects["hi"].max(0).astype(np.float64)
    radius = max(np.linalg.norm(hi - lo) / 2, 1e-30)
    along = direction / np.linalg.norm(direction)
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    return np.concatenate([(lo + hi) / 2, [_OUTERMOST / radius], across, np.cross(along, across), along]).astype(np.float32)
