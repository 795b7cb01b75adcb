"""Arrays of rays in, arrays of hits out.

caster = clrt.RayCaster((vertices, faces), precision="exact")
hits = caster.first_hit(origins, directions)
hits["t"], hits["prim_id"]
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clrt.device import program
from clrt.device.context import open_device
from clrt.device.pack import Packed, local_origin, pack, unit_normals
from clrt.device.session import Buffers, StageCounter
from clrt.errors import MeshError
from clrt.features import Features
from clrt.kdtree import build_tree
from clrt.kdtree.tree import KdTree
from clrt.mesh import check_mesh
from clrt.precision import rung
from clrt.scene.model import Camera, Material, MeshObject, Scene

#: a hit: t in units of the direction's length (inf: none); u, v barycentric weights of corners 1 and 2; ids (-1: none);
#: unit normal (v1 - v0) x (v2 - v0), zero where nothing is hit
HIT_DTYPE = np.dtype([("t", "f8"), ("u", "f8"), ("v", "f8"), ("prim_id", "i8"), ("object_id", "i8"), ("normal", "f8", (3,))])

Mesh = tuple[ArrayLike, ArrayLike]
_CHUNK = 1 << 20  #: rays a launch: keeps buffers small and lets Ctrl-C in
_LOCAL = 8  #: packets a work-group
_FINISH_LOCAL = 64
_NONE = -2  #: in `last`: the ray has no (further) hit


class RayCaster:
    """Closest, any and counted hits of rays with triangles.

    mesh : a Scene (its triangles; spheres are left out), a pair (vertices (n, 3), faces (m, 3)), a list of such pairs (one
        object each), or triangles (m, 3, 3). float32 and float64 numbers are taken as they are; for float32 and `exact`, see below.
    precision : "exact" (default): the primitive that exact arithmetic gives for the numbers as given, the lowest id of equal t;
        "watertight", "double", "fast" as in docs/numerics.md
    tree, device : as in `clrt.render`

    Buffers stay on the device and grow with the largest call. Not safe to share between threads.
    Raises MeshError for triangles that cannot be used, DeviceError, ClrtError.
    """

    def __init__(
        self, mesh: Scene | Mesh | ArrayLike | Sequence[Mesh], precision: str = "exact", *, tree: str = "sah", device: str | None = None
    ) -> None:
        self.scene = mesh if isinstance(mesh, Scene) else _scene_of(mesh)
        self.precision = rung(precision)
        self._device = open_device(device)
        origin = local_origin(self.scene)
        self.trees: tuple[KdTree, ...] = tuple(build_tree(item.vertices - origin, tree) for item in self.scene.objects)
        features = Features(())
        self._packed: Packed = pack(self.scene, self.trees, features, self.precision)
        self._lanes = self.precision.lanes(self._device.info.lanes)
        shape = program.Shape(program.stack_size(max((t.depth for t in self.trees), default=0)))
        program.check_limits(self.precision, self._lanes, shape, features)
        built = program.build(self._device, program.compose(features, self.precision, self._lanes, shape, entry="cast"))
        self._buffers = Buffers(self._device, self._packed, features, self.precision)
        self._buffers.prepare(built, planes=False)
        self._stages = StageCounter(self._buffers) if self.precision.decides_in_stages else None
        self._kernels = _Kernels(built)
        self._capacity = 0
        self._normals = np.concatenate([unit_normals(self._packed.vertices), np.zeros((1, 3))])
        self._objects = np.append(self._packed.surfaces["object"].astype(np.int64), -1)
        self._prims = np.append(self._packed.prim_ids, -1)
        self.counters: dict[str, int] = {}

    def first_hit(self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf) -> NDArray[np.void]:
        """The hit of least t in the open interval (t_min, t_max) of each ray: (n,) of HIT_DTYPE.

        origins, directions : (n, 3) or (3,), float32 or float64, any strides; a direction may have any length but zero
        t_min, t_max : numbers or (n,), in units of the direction's length

        A ray with a NaN, an infinity in origin or direction, or a zero direction hits nothing. Raises ValueError for other shapes
        or types, naming the argument.
        """
        rays = _rays(origins, directions, t_min, t_max)
        hits = np.empty(len(rays), HIT_DTYPE)
        for start in range(0, len(rays), _CHUNK):
            part = rays[start : start + _CHUNK]
            self._begin(part)
            self._cast(len(part), any_hit=False)
            self._finish(len(part), hits[start : start + _CHUNK])
        self._read_stages(len(rays))
        return hits

    def any_hit(self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf) -> NDArray[np.bool_]:
        """Whether each ray hits anything in the open interval (t_min, t_max): (n,) bool. Arguments as in `first_hit`."""
        rays = _rays(origins, directions, t_min, t_max)
        found = np.empty(len(rays), np.bool_)
        for start in range(0, len(rays), _CHUNK):
            part = rays[start : start + _CHUNK]
            self._begin(part)
            self._cast(len(part), any_hit=True)
            found[start : start + _CHUNK] = self._last(len(part)) >= 0
        self._read_stages(len(rays))
        return found

    def count_hits(self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf) -> NDArray[np.int64]:
        """How many triangles each ray hits in the open interval (t_min, t_max): (n,) int64. Arguments as in `first_hit`.

        An edge or a vertex that a ray meets counts once for each triangle it belongs to.
        """
        rays = _rays(origins, directions, t_min, t_max)
        counts = np.zeros(len(rays), np.int64)
        for start in range(0, len(rays), _CHUNK):
            part = rays[start : start + _CHUNK]
            self._begin(part)
            # One hit after the other, in the order of t and id, until no ray has a further one.
            for _ in range(self._packed.slots):
                self._cast(len(part), any_hit=False)
                going = self._last(len(part)) >= 0
                if not going.any():
                    break
                counts[start : start + _CHUNK] += going
        self._read_stages(len(rays))
        return counts

    def _reserve(self, count: int) -> None:
        if count <= self._capacity:
            return
        self._capacity = min(_CHUNK, max(count, 2 * self._capacity, 1024))
        real = np.dtype(self.precision.real).itemsize
        self._given, self._last_slot = self._buffers.empty(64 * self._capacity), self._buffers.empty(4 * self._capacity)
        self._last_t, self._result = self._buffers.empty(real * self._capacity), self._buffers.empty(32 * self._capacity)

    def _begin(self, rays: NDArray[np.float64]) -> None:
        import pyopencl as cl

        count, queue = len(rays), self._device.queue
        self._reserve(count)
        cl.enqueue_copy(queue, self._given, rays)
        cl.enqueue_copy(queue, self._last_slot, np.full(count, -1, np.int32))
        cl.enqueue_copy(queue, self._last_t, np.zeros(count, self.precision.real))

    def _cast(self, count: int, *, any_hit: bool) -> None:
        packed, buffers = self._packed, self._buffers
        nodes, indices, objects, surfaces, _ = buffers.core
        packets = -(-count // self._lanes)
        stages = (self._stages.buffer,) if self._stages is not None else ()
        self._kernels.cast(
            self._device.queue, (-(-packets // _LOCAL) * _LOCAL,), (_LOCAL,), nodes, indices, buffers.triangles, buffers.vertices, objects,
            surfaces, np.int32(len(self.trees)), np.int32(packed.slots), np.array([*packed.origin, 0.0]),
            self.precision.real(packed.objects["extent"].max(initial=0.0)), self._given, np.int32(count), np.int32(any_hit),
            self._last_slot, self._last_t, *stages,
        )  # fmt: skip
        self._device.queue.finish()

    def _last(self, count: int) -> NDArray[np.int32]:
        import pyopencl as cl

        slots = np.empty(count, np.int32)
        cl.enqueue_copy(self._device.queue, slots, self._last_slot)
        return slots

    def _finish(self, count: int, hits: NDArray[np.void]) -> None:
        """Fills `hits` from the slots that the last cast found."""
        import pyopencl as cl

        queue, size = self._device.queue, (-(-count // _FINISH_LOCAL) * _FINISH_LOCAL,)
        given = (self._buffers.vertices, self._given, np.int32(count), self._last_slot, self._result)
        self._kernels.finish(queue, size, (_FINISH_LOCAL,), *given)
        result = np.empty((count, 4))
        cl.enqueue_copy(queue, result, self._result)
        slots = self._last(count)
        slots[slots < 0] = -1  # the entry after the last slot stands for a miss
        hits["t"], hits["u"], hits["v"] = result[:, 0], result[:, 1], result[:, 2]
        hits["prim_id"], hits["object_id"], hits["normal"] = self._prims[slots], self._objects[slots], self._normals[slots]

    def _read_stages(self, rays: int) -> None:
        self.counters = {"rays": rays} | (self._stages.read() if self._stages is not None else {})


class _Kernels:
    """The two kernels of a built program; pyopencl makes a new object at each attribute access."""

    def __init__(self, built: Any) -> None:
        import pyopencl as cl

        self.cast, self.finish = cl.Kernel(built, "cast"), cl.Kernel(built, "cast_finish")


def _array(values: ArrayLike, name: str) -> NDArray[np.float64]:
    """(n, 3) float64 of what is given. Raises ValueError naming the argument."""
    array = np.asarray(values)
    if array.dtype.kind not in "fiu" or array.dtype.itemsize > 8:
        raise ValueError(f"{name}: expected numbers of float32 or float64, found {array.dtype}")
    if array.ndim == 1 and array.shape == (3,):
        array = array[None]
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name}: expected an array of shape (n, 3), found {array.shape}")
    return array.astype(np.float64, copy=False)


def _rays(origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike) -> NDArray[np.float64]:
    """(n, 8) float64: origin, direction, t_min, t_max."""
    start, along = _array(origins, "origins"), _array(directions, "directions")
    count = max(len(start), len(along)) if len(start) and len(along) else 0
    if len(start) not in (1, count) or len(along) not in (1, count):
        raise ValueError(f"origins and directions: {len(start)} against {len(along)} rays; give as many of both, or one of either")
    rays = np.empty((count, 8))
    rays[:, :3], rays[:, 3:6] = start[:count], along[:count]
    for column, (name, limit) in enumerate((("t_min", t_min), ("t_max", t_max)), 6):
        values = np.asarray(limit)
        if values.dtype.kind not in "fiu" or values.shape not in ((), (count,)):
            raise ValueError(f"{name}: expected a number or an array of shape ({count},), found {values.dtype} of shape {values.shape}")
        rays[:, column] = values
    return rays


def _scene_of(mesh: Any) -> Scene:
    """A scene of the triangles alone; camera and material are never looked at."""
    if isinstance(mesh, tuple) and len(mesh) == 2:
        meshes: list[Any] = [mesh]
    elif isinstance(mesh, list) and mesh and all(isinstance(m, tuple) and len(m) == 2 for m in mesh):
        meshes = mesh
    else:
        triangles = np.asarray(mesh)
        if triangles.ndim != 3 or triangles.shape[1:] != (3, 3) or triangles.dtype.kind not in "fiu":
            raise MeshError(
                "a mesh is a Scene, (vertices, faces), a list of such pairs, or triangles of shape (m, 3, 3); "
                f"found {type(mesh).__name__}" + (f" of shape {triangles.shape}" if triangles.ndim else "")
            )
        corners = triangles.astype(np.float64).reshape(-1, 3)
        meshes = [(corners, np.arange(len(corners)).reshape(-1, 3))] if len(corners) else [(np.zeros((0, 3)), np.zeros((0, 3), np.int64))]
    objects, first = [], 0
    for number, (vertices, faces) in enumerate(meshes, 1):
        checked, index = check_mesh(vertices, faces)
        corners = checked[index]
        objects.append(MeshObject(corners, unit_normals(corners), np.zeros(len(corners), np.int32), first, name=f"object {number}"))
        first += len(corners)
    camera = Camera.from_view(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]), 45.0, 1, 1)
    return Scene(camera, (), (Material((1.0, 1.0, 1.0), 0.0, 0.0, 0.0, 1.0),), tuple(objects), source="<mesh>")
