"""Who builds a scene's kd-trees: kernels on the device where that is sooner, NumPy else and wherever the device fails.

CLRT_TREES in the environment asks for one of them: `numpy`, `device`, or `auto` (default), which goes by the number of triangles.
Trees are the same, to the bit on devices that round as IEEE 754 says, so the choice is one of time alone.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from clrt.device.context import Device
from clrt.errors import ClrtError, DeviceError, LimitError, MeshError
from clrt.kdtree import build_tree
from clrt.kdtree.common import F64, Ints, Progress, checked_vertices, default_max_depth
from clrt.kdtree.tree import KdTree

VARIABLE = "CLRT_TREES"
WAYS = ("auto", "numpy", "device")
READY_FROM = 16_000  #: triangles from which on kernels are sooner that only have to be loaded (docs/kdtree.md has the measurement)
FRESH_FROM = 500_000  #: the same for kernels that have to be compiled
_FEW = 100  #: meshes up to which each is gone through by itself, which takes one pass over its triangles in place of two
_TREE = 150  #: triangles whose building takes NumPy as long as what every tree takes, even the smallest

Tell = Callable[[float], None]


def build_trees(
    meshes: Sequence[F64], origins: F64, builder: str, device: Device | None, tell: Tell | None = None
) -> tuple[list[KdTree], list[float]]:
    """A tree over each of `meshes` (n, 3, 3) less its row of `origins` (meshes, 3), and the seconds of each.

    device : None builds with NumPy. Seconds of trees that are built together are told apart by their triangles.
    A RuntimeWarning tells why NumPy builds where the device was to. Raises MeshError, ClrtError for an unknown value of CLRT_TREES.
    """
    told = tell or (lambda fraction: None)
    if device is not None and on_device(builder, [len(mesh) for mesh in meshes], device):
        try:
            return _by_device(meshes, origins, device, told)
        except (DeviceError, LimitError, MemoryError) as error:
            warnings.warn(f"the kd-trees are built by NumPy, since the device could not: {error}", RuntimeWarning, 2)
    return _by_numpy(meshes, origins, builder, told)


def on_device(builder: str, counts: Sequence[int], device: Device) -> bool:
    """Whether the device is to build trees over so many triangles each."""
    way = os.environ.get(VARIABLE) or "auto"
    if way not in WAYS:
        raise ClrtError(f"{VARIABLE}={way} is not known; use one of {', '.join(WAYS)}")
    if builder != "sah" or not any(counts) or way == "numpy":
        return False
    if way == "device":
        return True
    work = sum(counts) + _TREE * len(counts)
    if work < READY_FROM:
        return False
    # Imported where it is needed, as are the builders: where trees are kept, a few triangles are left for NumPy.
    from clrt.forest.machine import compiled_before, is_processor

    # On anything but a processor a work-item alone, with a subtree to itself, is slow.
    return is_processor(device) and (work >= FRESH_FROM or compiled_before(device))


def _by_numpy(meshes: Sequence[F64], origins: F64, builder: str, tell: Tell) -> tuple[list[KdTree], list[float]]:
    trees, seconds = [], []
    total, done = max(1, sum(map(len, meshes))), 0
    for mesh, origin in zip(meshes, origins, strict=True):
        tell(done / total)
        start = time.perf_counter()
        trees.append(build_tree(mesh - origin, builder, progress=partial(_tell_share, tell, done / total, len(mesh) / total)))
        seconds.append(time.perf_counter() - start)
        done += len(mesh)
    return trees, seconds


def _tell_share(tell: Progress, done: float, share: float, fraction: float) -> None:
    tell(done + share * fraction)


def _by_device(meshes: Sequence[F64], origins: F64, device: Device, tell: Tell) -> tuple[list[KdTree], list[float]]:
    """All trees at once; meshes without triangles are NumPy's."""
    from clrt.forest.build import build_forest
    from clrt.forest.machine import Machine

    start = time.perf_counter()
    tell(0.0)
    some = [i for i, mesh in enumerate(meshes) if len(mesh)]
    counts = np.array([len(meshes[i]) for i in some], np.int64)
    corners = _corners([meshes[i] for i in some], origins[some], counts)
    sizes, which = np.unique(counts, return_inverse=True)
    limits = np.array([default_max_depth(size) for size in sizes.tolist()], np.int64)[which]
    built = iter(build_forest(Machine.of(device), corners, counts, limits, tell))
    trees = [next(built) if len(mesh) else build_tree(mesh) for mesh in meshes]
    each = (time.perf_counter() - start) / len(corners)
    return trees, [each * len(mesh) for mesh in meshes]


def _corners(meshes: Sequence[F64], origins: F64, counts: Ints) -> F64:
    """(n, 3, 3): the triangles of all meshes, each less its origin; checked."""
    corners = np.empty((int(counts.sum()), 3, 3))
    if len(meshes) <= _FEW:
        for mesh, origin, end in zip(meshes, origins, np.cumsum(counts), strict=True):
            np.subtract(mesh, origin, out=corners[end - len(mesh) : end])
    else:
        np.concatenate(meshes, out=corners)
        corners -= np.repeat(origins, counts, axis=0)[:, None]
    try:
        return checked_vertices(corners)
    except MeshError:
        for mesh, origin in zip(meshes, origins, strict=True):
            checked_vertices(mesh - origin)  # says which triangle of its own mesh it is
        raise
