"""Trees of earlier runs: a tree is a function of its triangles, of the builder and of its code; their hash is its name in a store.

Which way a builder ran, in NumPy or on a device, is no part of the name: both give the same tree.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from clrt import __version__
from clrt.kdtree.common import F64
from clrt.kdtree.tree import KdTree
from clrt.store import Store, digest

LEAST_TRIANGLES = 1_000  #: trees of fewer are built as soon as found
_ARRAYS = ("lo", "hi", "split_axis", "split_pos", "child", "count", "indices")
_PACKAGES = ("kdtree", "forest")  #: whose code makes trees, with the kernels build_*.cl

#: meshes and their origins -> their trees, and the seconds of each
Build = Callable[[Sequence[F64], F64], tuple[list[KdTree], list[float]]]


def tree_code() -> list[Path]:
    """The files that make trees."""
    package = Path(__file__).parents[1]
    files = [file for name in _PACKAGES for file in sorted((package / name).glob("*.py"))]
    for folder in (package / "kernels", package.parent / "kernels"):
        files += sorted(folder.glob("build_*.cl"))
    return files


@cache
def code_digest() -> str:
    """Of the version, and of all code that makes trees: another builder never meets trees of its forerunners."""
    return digest(__version__.encode(), *(file.read_bytes() for file in tree_code()))


def tree_key(vertices: F64, origin: NDArray[np.float64], builder: str) -> str:
    """The name of the tree over vertices (n, 3, 3) less `origin` (3,), by the settings that `build_tree` has without being told."""
    own = np.ascontiguousarray(vertices)
    return digest(code_digest().encode(), builder.encode(), origin.tobytes(), str(own.shape).encode(), own.data.cast("B"))


def saved_trees(store: Store | None, meshes: Sequence[F64], origins: F64, builder: str, build: Build) -> tuple[list[KdTree], list[float]]:
    """A tree over each of `meshes` (n, 3, 3) less its row of `origins`, and the seconds that each took: read, or built and kept.

    store : None builds them all
    """
    if store is None:
        return build(meshes, origins)
    found: dict[int, tuple[KdTree, float]] = {}
    keys = {}
    for number, (mesh, origin) in enumerate(zip(meshes, origins, strict=True)):
        if len(mesh) >= LEAST_TRIANGLES:
            start = time.perf_counter()
            keys[number] = tree_key(mesh, origin, builder)
            tree = _read(store, keys[number], len(mesh), builder)
            if tree is not None:
                found[number] = tree, time.perf_counter() - start
    missing = [number for number in range(len(meshes)) if number not in found]
    if missing:
        trees, seconds = build([meshes[i] for i in missing], origins[missing])
        for number, tree, taken in zip(missing, trees, seconds, strict=True):
            found[number] = tree, taken
            if number in keys:
                _keep(store, keys[number], tree)
    return [found[i][0] for i in range(len(meshes))], [found[i][1] for i in range(len(meshes))]


def _keep(store: Store, key: str, tree: KdTree) -> None:
    arrays = {name: np.ascontiguousarray(getattr(tree, name)) for name in _ARRAYS}
    store.put(key, arrays | {"depth": np.array([tree.depth]), "built_on": np.array([tree.built_on])})


def _read(store: Store, key: str, triangles: int, builder: str) -> KdTree | None:
    """The tree of so many triangles; None where the store has none, or one that cannot be."""
    arrays = store.get(key)
    if arrays is None or set(arrays) != {*_ARRAYS, "depth", "built_on"} or arrays["indices"].max(initial=0) >= triangles:
        return None
    depth, built_on = int(arrays.pop("depth")[0]), str(arrays.pop("built_on")[0])
    return KdTree(depth=depth, builder=builder, built_on=built_on, **arrays)
