"""Mitsuba 3, variant llvm_ad_rgb: bare queries of rays that lie ready, marked as coherent; compiled before they are timed."""

from __future__ import annotations

from typing import Any

import drjit
import mitsuba
import numpy as np

from clrt.bench.workers.serve import Floats, Tracer, serve

mitsuba.set_variant("llvm_ad_rgb")


class Mitsuba(Tracer):
    def __init__(self, triangles: Floats, threads: int) -> None:
        self.version = mitsuba.__version__
        self._triangles = triangles
        drjit.set_thread_count(threads)

    def build(self) -> None:
        mesh = mitsuba.Mesh("mesh", 3 * len(self._triangles), len(self._triangles))
        parameters = mitsuba.traverse(mesh)
        parameters["vertex_positions"] = np.ascontiguousarray(self._triangles.ravel())
        parameters["faces"] = np.arange(3 * len(self._triangles), dtype=np.uint32)
        parameters.update()
        self._scene = mitsuba.load_dict({"type": "scene", "mesh": mesh})
        drjit.sync_thread()

    def prepare(self, rays: Floats) -> Any:
        columns = [mitsuba.Float(np.ascontiguousarray(column)) for column in rays.T]
        ray = mitsuba.Ray3f(mitsuba.Point3f(*columns[:3]), mitsuba.Vector3f(*columns[3:6]))
        if len(columns) > 6:
            ray.maxt = columns[6]
        drjit.eval(ray)
        drjit.sync_thread()
        return ray, len(columns) > 6

    def trace(self, prepared: Any) -> Any:
        ray, shadow = prepared
        found = self._scene.ray_test(ray, True) if shadow else self._scene.ray_intersect_preliminary(ray, True)
        drjit.eval(found)
        drjit.sync_thread()
        return found

    def met(self, traced: Any) -> int:
        return int(drjit.count(traced if isinstance(traced, mitsuba.Bool) else traced.is_valid())[0])


if __name__ == "__main__":
    serve(Mitsuba)
