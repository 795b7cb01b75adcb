"""Embree from Python (embreex), one thread a core: the same rays through another tracer.

embreex traces rays one by one and releases Python's lock while it does; `cores_used` of the results tells whether the threads ran
side by side. Rays are laid out in arrays before anything is timed.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.device.pack import unit_normals
from clrt.scene.model import Scene

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
Ints = NDArray[np.int64]

_BLOCK = 1024  #: consecutive rays of one thread: near each other for its caches, dealt out in turns for equal shares
_SHADOW_OFFSET = 8e-6  #: of the diagonal of the largest mesh: where Embree's shadows differ little from clrt's on any scene


def embreex_available() -> bool:
    """Whether embreex is installed."""
    return importlib.util.find_spec("embreex") is not None


@dataclass(frozen=True, eq=False)
class RaySet:
    """Rays for the peer: origins, directions (n, 3) float32; distances (n,) float32, where given: only whether anything is nearer."""

    origins: F32
    directions: F32
    distances: F32 | None = None

    def __len__(self) -> int:
        return len(self.origins)

    def share(self, chosen: Ints) -> RaySet:
        """The chosen rays, contiguous."""
        distances = None if self.distances is None else self.distances[chosen]
        return RaySet(self.origins[chosen], self.directions[chosen], distances)


@dataclass(frozen=True, eq=False)
class PeerHits:
    """Nearest hits in the order of the rays: object, prim (n,) int64, -1 for none; distance (n,) float64."""

    object: Ints
    prim: Ints
    distance: F64


class Embreex:
    """A scene's triangles in Embree, and threads that share out the rays: embreex lets Python go on while it traces."""

    def __init__(self, objects: Sequence[F64], threads: int) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene()
        self._meshes = [TriangleMesh(self._scene, np.ascontiguousarray(vertices, np.float32)) for vertices in objects]
        self._pool = ThreadPoolExecutor(threads)
        self._threads = threads
        self._shares: dict[str, list[tuple[Ints, RaySet]]] = {}

    def __enter__(self) -> Embreex:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._pool.shutdown()

    def load(self, name: str, rays: RaySet) -> None:
        """Share out rays, to be known as `name`; what is timed later copies nothing."""
        turns = (np.arange(len(rays)) // _BLOCK) % self._threads
        chosen = [np.flatnonzero(turns == turn) for turn in range(self._threads)]
        self._shares[name] = [(places, rays.share(places)) for places in chosen]

    def trace(self, name: str) -> None:
        """Trace the rays of this name in all threads and wait for them."""
        list(self._pool.map(self._run, (rays for _, rays in self._shares[name])))

    def _run(self, rays: RaySet) -> Any:
        """The cheapest call of embreex that answers: which triangle is hit, without distances or coordinates."""
        if rays.distances is None:
            return self._scene.run(rays.origins, rays.directions)
        return self._scene.run(rays.origins, rays.directions, rays.distances, query="OCCLUDED")

    def occluded(self, name: str) -> NDArray[np.bool_]:
        """Which rays of this name meet anything before their end."""
        shares = self._shares[name]
        result = np.empty(sum(len(places) for places, _ in shares), bool)
        for places, rays in shares:
            result[places] = self._run(rays) >= 0
        return result

    def nearest(self, rays: RaySet) -> PeerHits:
        """What rays hit first."""
        hits = self._scene.run(rays.origins, rays.directions, output=1)
        return PeerHits(hits["geomID"].astype(np.int64), hits["primID"].astype(np.int64), hits["tfar"].astype(np.float64))


def primary_rays(scene: Scene) -> RaySet:
    """The camera's rays, row by row from the top."""
    directions = scene.camera.directions().reshape(-1, 3).astype(np.float32)
    origins = np.empty_like(directions)
    origins[:] = scene.camera.eye
    return RaySet(origins, directions)


def shadow_rays(scene: Scene, hits: PeerHits) -> tuple[RaySet, Ints]:
    """Rays from hit points to the first light, for those points that can see it at all; and the pixels they belong to.

    As the renderer does, it asks only where the light stands on the viewer's side of the surface and of its shading normal.
    """
    pixel = np.flatnonzero(hits.prim >= 0)
    direction = scene.camera.directions().reshape(-1, 3)[pixel]
    point = scene.camera.eye + hits.distance[pixel, None] * direction
    geometric, shading = _normals(scene, hits.object[pixel], hits.prim[pixel])
    geometric *= np.where(_dot(geometric, direction) > 0.0, -1.0, 1.0)[:, None]
    shading *= np.where(_dot(shading, geometric) < 0.0, -1.0, 1.0)[:, None]
    origin = point + shadow_offset(scene) * geometric
    to_light = np.asarray(scene.lights[0].position) - origin
    distance = np.sqrt(_dot(to_light, to_light))
    asked = (_dot(geometric, to_light) > 0.0) & (_dot(shading, to_light) > 0.0)
    origins, directions, lengths = (a[asked].astype(np.float32) for a in (origin, to_light / distance[:, None], distance))
    return RaySet(origins, directions, lengths), pixel[asked]


def _normals(scene: Scene, object_: Ints, prim: Ints) -> tuple[F64, F64]:
    """Unit normals of the surface and of its shading, as given, (n, 3) each."""
    first = np.concatenate([[0], np.cumsum([len(item) for item in scene.objects])[:-1]])
    place = first[object_] + prim
    geometric = np.concatenate([unit_normals(item.vertices) for item in scene.objects])
    return geometric[place], np.concatenate([item.normals for item in scene.objects])[place]


def shadow_offset(scene: Scene) -> float:
    """How far off a surface a peer's shadow rays begin, scene units."""
    corners = max((item.vertices for item in scene.objects), key=len).reshape(-1, 3)
    return _SHADOW_OFFSET * float(np.linalg.norm(np.ptp(corners, axis=0)))


def _dot(a: F64, b: F64) -> F64:
    product: F64 = np.einsum("ij,ij->i", a, b)
    return product
