"""Many SAH trees at once, on a device: the same trees as clrt/kdtree/sah.py builds one by one."""

from __future__ import annotations

from clrt.device import opencl
from clrt.errors import DeviceError
from clrt.forest.layout import trees_of
from clrt.forest.machine import Machine
from clrt.forest.pool import Pool
from clrt.forest.ticker import Ticker
from clrt.forest.top import Top
from clrt.kdtree.common import F64, Ints, Progress
from clrt.kdtree.tree import KdTree

_POOL = 1 << 22  #: references that may wait before they are worked on


def build_forest(machine: Machine, vertices: F64, counts: Ints, limits: Ints, progress: Progress | None = None) -> list[KdTree]:
    """A tree over each of `counts` consecutive triangles, none over none.

    vertices : (n, 3, 3), contiguous, finite; not changed. limits : no leaf of a tree is deeper.
    Raises LimitError where the device has too little memory, DeviceError for what else it cannot do.
    """
    cl = opencl.api()
    try:
        return _build(machine, vertices, counts, limits, progress)
    except cl.Error as error:
        raise DeviceError(f"building kd-trees on the device '{machine.device.info.name}' failed: {error}") from error


def _build(machine: Machine, vertices: F64, counts: Ints, limits: Ints, progress: Progress | None) -> list[KdTree]:
    ticker = Ticker(len(vertices), progress)
    shared = machine.share(vertices)
    pool = Pool(machine, shared, min(len(vertices) + len(vertices) // 2, _POOL), ticker)
    top = Top(machine, shared, counts, limits, pool)
    top.build()
    pool.flush()
    trees = trees_of(*pool.results(), top.inner, counts, top.lo, top.hi)
    ticker.finish()
    return trees
