"""trimesh, which traces by embreex where that is installed: the triangle of the nearest hit; whether anything is hit."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh

from clrt.bench.workers.serve import Floats, Tracer, serve


class Trimesh(Tracer):
    def __init__(self, triangles: Floats, threads: int) -> None:
        engine = "embreex" if trimesh.ray.has_embree else "no embreex"
        self.version = f"{trimesh.__version__} ({engine}, 1 thread)"
        self._triangles = triangles

    def build(self) -> None:
        faces = np.arange(3 * len(self._triangles)).reshape(-1, 3)
        self._mesh: Any = trimesh.Trimesh(self._triangles.reshape(-1, 3), faces, process=False)
        self._mesh.ray.intersects_first([[0.0, 0.0, 0.0]], [[1.0, 1.0, 1.0]])

    def prepare(self, rays: Floats) -> Any:
        return np.ascontiguousarray(rays[:, :3]), np.ascontiguousarray(rays[:, 3:6]), rays.shape[1] > 6

    def trace(self, prepared: Any) -> Any:
        origins, directions, shadow = prepared
        # It knows no far end: nothing lies behind the light in the view that is measured.
        return self._mesh.ray.intersects_any(origins, directions) if shadow else self._mesh.ray.intersects_first(origins, directions) >= 0

    def met(self, traced: Any) -> int:
        return int(np.count_nonzero(traced))


if __name__ == "__main__":
    serve(Trimesh)
