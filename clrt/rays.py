"""Arrays of rays in, arrays of hits out.

    caster = clrt.RayCaster((vertices, faces))
    hits = caster.first_hit(origins, directions)
    hits["t"], hits["prim_id"]

docs/rays.md is the guide to it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clrt.device import kernel_cache, layout, program
from clrt.device.blocks import WideArrays, wide_arrays
from clrt.device.context import open_device
from clrt.device.pack import local_origin, pack
from clrt.device.packed import Packed
from clrt.device.prepare import prepare
from clrt.device.ray_sort import FEWEST, RaySorter, in_order_already
from clrt.device.session import Buffers, StageCounter
from clrt.features import Features
from clrt.forest.choose import build_trees
from clrt.kdtree.tree import KdTree
from clrt.precision import rung
from clrt.ray_arrays import RayArrays
from clrt.ray_mesh import at_unit_size, scene_of, surface_normals
from clrt.scene.model import Scene

#: a hit: t in units of the direction's length (inf: none); u, v barycentric weights of corners 1 and 2; ids (-1: none);
#: unit normal (v1 - v0) x (v2 - v0), zero where nothing is hit
HIT_DTYPE = layout.HIT_RECORD

_CHUNK = 1 << 20  #: rays a launch: keeps buffers small and lets Ctrl-C in
_LOCAL = 64  #: hits a work-group
_LIST_LIMIT = 1 << 20  #: hits listed by a launch, but for a single ray that has more
_FIRST, _ANY, _COUNT, _LIST = 0, 1, 2, 3  #: modes of the kernel `cast`
_GIVEN, _ORDER, _RECORDS, _RESULT, _HIT_LIST, _RAYS, _MODE, _STAGES = 11, 17, 18, 19, 20, 21, 22, 23  #: its arguments that change


class RayCaster:
    """First, any, all and counted hits of rays with triangles.

    mesh : (vertices (n, 3), faces (m, 3)); triangles (m, 3, 3); an object with .vertices and .faces, such as a trimesh.Trimesh; a list
        of such pairs and objects, one object id each; or a Scene, of which spheres are left out. No triangles: every ray misses.
    precision : "exact" (default): the triangle that exact arithmetic gives for the numbers as given, the lowest id of equal t;
        "watertight", "double", "fast" as in docs/numerics.md
    tree, device : as in `clrt.render`

    Closed triangles, both sides: edges and corners count; a ray in a triangle's plane passes it by, as every ray does one of zero area.
    On the rung `exact`, t, u and v are within a relative 2^-31 of their exact values for the numbers as given, a zero exactly zero
    (derived in kernels/exact.cl; tests/test_rays_exact.py measures below 2^-42); on the others nearly so, but unproven.
    All this holds while sizes and distances are within 1e-30 to 1e30 of the mesh's.

    Buffers stay on the device and grow with the largest call. Not safe to share between threads.
    Raises MeshError for triangles that cannot be used, DeviceError, ClrtError.
    """

    def __init__(self, mesh: Any, precision: str = "exact", *, tree: str = "sah", device: str | None = None) -> None:
        self.precision = rung(precision)
        self.scene: Scene = scene_of(mesh)
        self._device = open_device(device)
        scene, self._scale = at_unit_size(self.scene)
        origin = local_origin(scene)
        meshes = [item.vertices for item in scene.objects]
        self.trees: tuple[KdTree, ...] = tuple(build_trees(meshes, np.tile(origin, (len(meshes), 1)), tree, self._device)[0])
        features = Features(())
        self._packed = pack(scene, self.trees, features, self.precision)
        width = max(4, self.precision.lanes(self._device.info.lanes))
        wide = wide_arrays(self._packed, self.trees, width)
        shape = program.Shape(0, block=width, wide=wide.stack)
        built = program.build(self._device, program.compose(features, self.precision, 1, shape, entry="cast"))
        self._buffers = Buffers(self._device, self._packed, features, self.precision)
        prepare(self._buffers, built, planes=False)
        self._upload_wide(built, wide)
        self._stages: StageCounter | None = None
        self._sources = self._buffers.upload(_sources(self.scene, self._packed))
        self._set_arguments(built)
        self._capacity = 0
        self._rays = 0
        self._counters: dict[str, int] | None = None
        with kernel_cache.loading():  # the first launch is part of compiling
            self.first_hit(np.zeros(3), np.ones(3))
        self._rays, self._counters, self._stages = 0, None, None

    @property
    def first_prims(self) -> NDArray[np.int64]:
        """(objects,) the primitive id of each object's face 0: face = prim_id - first_prims[object_id]."""
        return np.array([item.first_prim for item in self.scene.objects], np.int64)

    @property
    def counters(self) -> dict[str, int]:
        """Of the last call: `rays`; on the rung `exact` also the tests of a ray with a triangle that float32 could not decide, by what
        did: `float64` with its error bound, or `exact` expansions. All other tests were decided in float32."""
        if self._counters is None:
            self._counters = {"rays": self._rays} | (self._stages.read() if self._stages is not None else {})
        return dict(self._counters)

    def first_hit(self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf) -> NDArray[np.void]:
        """The hit of least t in the open interval (t_min, t_max) of each ray: (n,) of HIT_DTYPE.

        origins, directions : (n, 3), or (3,) for one that serves all; any numbers that float64 holds, in any layout. More
            dimensions, (..., 3), give results of shape (...). A direction may have any length but zero.
        t_min, t_max : numbers or (n,), in units of the direction's length; may be negative

        A ray with a NaN, an infinity in origin or direction, a zero direction, or an interval that is empty or NaN hits nothing.
        Raises RayError (a ValueError) for other shapes or types, naming the argument.
        """
        rays = RayArrays.of(origins, directions, t_min, t_max)
        hits = np.empty(len(rays), HIT_DTYPE)
        for _ in self._cast(rays, _FIRST, hits):
            pass
        return hits.reshape(rays.shape)

    def any_hit(self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf) -> NDArray[np.bool_]:
        """Whether each ray hits anything in the open interval (t_min, t_max): (n,) bool. Arguments as in `first_hit`."""
        rays = RayArrays.of(origins, directions, t_min, t_max)
        found = np.empty(len(rays), np.bool_)
        for part in self._cast(rays, _ANY):
            np.greater_equal(self._results(part), 0, out=found[part])
        return found.reshape(rays.shape)

    def count_hits(self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf) -> NDArray[np.int64]:
        """How many triangles each ray hits in the open interval (t_min, t_max): (n,) int64. Arguments as in `first_hit`.

        An edge or a corner that a ray meets counts once for each triangle it belongs to. Takes a traversal for each hit.
        """
        rays = RayArrays.of(origins, directions, t_min, t_max)
        return self._counted(rays).reshape(rays.shape)

    def all_hits(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> tuple[NDArray[np.int64], NDArray[np.void]]:
        """Every hit in the open interval (t_min, t_max): ray_ids (k,) int64, hits (k,) of HIT_DTYPE. Arguments as in `first_hit`.

        Ordered by ray, then t, then primitive id; ray_ids are places in the flattened rays. An edge or a corner that a ray meets is a
        hit for each triangle it belongs to. Takes two traversals for each hit.
        """
        rays = RayArrays.of(origins, directions, t_min, t_max)
        counts = self._counted(rays)
        ends = np.cumsum(counts)
        hits = np.empty(int(counts.sum()), HIT_DTYPE)
        first = done = 0
        while done < len(hits):
            some = max(1, int(np.searchsorted(ends[first : first + _CHUNK], done + _LIST_LIMIT, side="right")))
            part = slice(first, first + some)
            first, end = part.stop, int(ends[part.stop - 1])
            if end > done:
                self._list(rays, part, ends[part] - counts[part] - done, hits[done:end])
            done = end
        return np.repeat(np.arange(len(rays)), counts), hits

    def _counted(self, rays: RayArrays) -> NDArray[np.int64]:
        counts = np.empty(len(rays), np.int64)
        for part in self._cast(rays, _COUNT):
            counts[part] = self._results(part)
        return counts

    def _list(self, rays: RayArrays, part: slice, starts: NDArray[np.int64], hits: NDArray[np.void]) -> None:
        """Fills `hits` with all hits of the rays `part`; those of each begin at `starts`."""
        import pyopencl as cl

        queue = self._device.queue
        given = self._load(rays, part)
        cl.enqueue_copy(queue, self._result, starts.astype(np.int32))
        found, records = self._buffers.empty(8 * len(hits)), self._records(hits)
        self._cast_kernel.set_arg(_HIT_LIST, found)
        self._launch(given, part.stop - part.start, _LIST, self._worth_sorting(rays, part))
        self._cast_kernel.set_arg(_HIT_LIST, None)  # later launches must not meet a buffer that is gone
        size = (-(-len(hits) // _LOCAL) * _LOCAL,)
        self._list_kernel(queue, size, (_LOCAL,), self._buffers.vertices, self._sources, *given, found, records, np.int32(len(hits)))
        self._fetch(records, hits)

    def _upload_wide(self, built: Any, wide: WideArrays) -> None:
        """Brings the wide trees to the device, and fills their blocks there."""
        import pyopencl as cl

        buffers, objects = self._buffers, self._packed.objects.copy()
        objects["root"] = wide.roots
        self._objects, self._wide = buffers.upload(objects), buffers.upload(wide.nodes)
        record = layout.block(self.precision.real, wide.slots.shape[1]).itemsize
        self._blocks = buffers.empty(max(1, len(wide.slots)) * record)
        if wide.slots.size:
            slots, size = buffers.upload(wide.slots), (-(-wide.slots.size // _LOCAL) * _LOCAL,)
            kernel = cl.Kernel(built, "prepare_blocks")
            kernel(self._device.queue, size, (_LOCAL,), buffers.triangles, slots, self._blocks, np.int32(wide.slots.size))
            kernel, count = cl.Kernel(built, "prepare_boxes"), wide.nodes["child"].size
            kernel(self._device.queue, (-(-count // _LOCAL) * _LOCAL,), (_LOCAL,), self._wide, self._blocks, np.int32(count))
            self._device.queue.finish()

    def _set_arguments(self, built: Any) -> None:
        """Sets what is the same for all launches; pyopencl makes a new kernel object at each attribute access of a program."""
        import pyopencl as cl

        packed, buffers = self._packed, self._buffers
        self._cast_kernel, self._list_kernel = cl.Kernel(built, "cast"), cl.Kernel(built, "cast_list")
        extent = self.precision.real(packed.objects["extent"].max(initial=0.0))
        constant = (
            self._wide, self._blocks, buffers.triangles, buffers.vertices, self._objects, buffers.core[3], self._sources,
            np.int32(len(self.trees)), np.int32(packed.slots), np.array([*packed.origin, 0.0]), extent,
        )  # fmt: skip
        for place, value in enumerate(constant):
            self._cast_kernel.set_arg(place, value)
        self._cast_kernel.set_arg(_HIT_LIST, None)
        corners = packed.vertices.reshape(-1, 3)
        lo, hi = (corners.min(axis=0), corners.max(axis=0)) if len(corners) else (np.zeros(3), np.zeros(3))
        self._sorter, self._size = RaySorter(buffers, built, lo, hi), float((hi - lo).max()) / self._scale

    def _cast(self, rays: RayArrays, mode: int, hits: NDArray[np.void] | None = None) -> Iterator[slice]:
        """Casts a chunk after the other; gives the rays whose results are on the device, or, for _FIRST, in `hits`."""
        self._rays, self._counters = len(rays), None
        if self.precision.decides_in_stages:
            # New ones: a tenth of the time of setting old ones to zero through the queue.
            self._stages = StageCounter(self._buffers)
            self._cast_kernel.set_arg(_STAGES, self._stages.buffer)
        for first in range(0, len(rays), _CHUNK):
            part = slice(first, min(first + _CHUNK, len(rays)))
            given = self._load(rays, part)
            records = None if hits is None else self._records(hits[part])
            self._cast_kernel.set_arg(_RECORDS, records)
            self._launch(given, part.stop - part.start, mode, self._worth_sorting(rays, part))
            if hits is not None:
                self._fetch(records, hits[part])
            yield part

    def _load(self, rays: RayArrays, part: slice) -> tuple[Any, ...]:
        """The kernels' arguments for the rays `part`: on a CPU they are read where the caller has them."""
        import pyopencl as cl

        arrays, kinds = rays.columns(part)
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.USE_HOST_PTR
        given = (*(cl.Buffer(self._device.context, flags, hostbuf=array) for array in arrays), np.int32(kinds), np.float64(self._scale))
        for place, value in enumerate(given, _GIVEN):
            self._cast_kernel.set_arg(place, value)
        if part.stop - part.start > self._capacity:
            self._capacity = min(_CHUNK, max(part.stop - part.start, 2 * self._capacity, 1024))
            self._result = self._buffers.empty(4 * self._capacity)
            self._cast_kernel.set_arg(_RESULT, self._result)
        return given

    def _worth_sorting(self, rays: RayArrays, part: slice) -> bool:
        return part.stop - part.start >= FEWEST and not in_order_already(rays.origins[part], rays.directions[part], self._size)

    def _launch(self, given: tuple[Any, ...], count: int, mode: int, ordered: bool) -> None:
        """`ordered`: trace in the sorter's order."""
        import pyopencl as cl

        self._cast_kernel.set_arg(_ORDER, self._sorter.order(given, count) if ordered else None)
        self._cast_kernel.set_arg(_RAYS, np.int32(count))
        self._cast_kernel.set_arg(_MODE, np.int32(mode))
        cl.enqueue_nd_range_kernel(self._device.queue, self._cast_kernel, (-(-count // program.RUN),), (1,))

    def _results(self, part: slice) -> NDArray[np.int32]:
        import pyopencl as cl

        results = np.empty(part.stop - part.start, np.int32)
        cl.enqueue_copy(self._device.queue, results, self._result)
        return results

    def _records(self, hits: NDArray[np.void]) -> Any:
        """A buffer that is `hits` itself, where the device shares its memory."""
        import pyopencl as cl

        return cl.Buffer(self._device.context, cl.mem_flags.WRITE_ONLY | cl.mem_flags.USE_HOST_PTR, hostbuf=hits)

    def _fetch(self, records: Any, hits: NDArray[np.void]) -> None:
        """Waits for the records; where the device has memory of its own, this is what brings them here."""
        import pyopencl as cl

        mapped, _ = cl.enqueue_map_buffer(self._device.queue, records, cl.map_flags.READ, 0, hits.shape, hits.dtype)
        mapped.base.release(self._device.queue)
        self._device.queue.finish()


def _sources(scene: Scene, packed: Packed) -> NDArray[np.void]:
    """What hits tell of each slot's triangle, by the caller's numbering of objects."""
    sources = np.zeros(packed.slots, layout.HIT_SOURCE)
    sources["prim_id"] = packed.prim_ids
    sources["normal"] = surface_normals(packed.vertices)
    used = np.array([number for number, item in enumerate(scene.objects) if len(item)], np.int64)
    sources["object_id"] = used[packed.surfaces["object"]]
    return sources
