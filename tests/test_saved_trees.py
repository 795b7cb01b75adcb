"""Trees of earlier runs: the same trees, only where everything that makes a tree is the same."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from clrt.kdtree import build_tree, saved
from clrt.kdtree.common import F64
from clrt.kdtree.saved import LEAST_TRIANGLES, saved_trees, tree_key
from clrt.kdtree.tree import KdTree
from clrt.store import Store

FIELDS = ("lo", "hi", "split_axis", "split_pos", "child", "count", "indices", "depth", "builder", "built_on")


def soup(count: int, seed: int) -> F64:
    """(count, 3, 3) small triangles in a unit cube."""
    rng = np.random.default_rng(seed)
    return rng.random((count, 1, 3)) + 0.02 * rng.normal(size=(count, 3, 3))


class Builder:
    """Builds with NumPy, and notes how many triangles each mesh had that it was asked for."""

    def __init__(self, name: str = "sah") -> None:
        self.name = name
        self.asked: list[int] = []

    def __call__(self, meshes: Sequence[F64], origins: F64) -> tuple[list[KdTree], list[float]]:
        self.asked += [len(mesh) for mesh in meshes]
        trees = [build_tree(mesh - origin, self.name) for mesh, origin in zip(meshes, origins, strict=True)]
        return trees, [float(len(mesh)) for mesh in meshes]


def equal(one: KdTree, other: KdTree) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in FIELDS)


def test_tree_of_an_earlier_run_is_the_tree(tmp_path: Path) -> None:
    mesh, origin = soup(LEAST_TRIANGLES, 1), np.array([[0.5, 0.25, 0.0]])
    (built,), _ = saved_trees(Store(tmp_path), [mesh], origin, "sah", Builder())
    (read,), seconds = saved_trees(Store(tmp_path), [mesh.copy()], origin, "sah", later := Builder())
    assert later.asked == []
    assert equal(read, built)
    assert equal(read, build_tree(mesh - origin[0]))
    assert read.validate(mesh - origin[0]) == 0
    assert 0.0 < seconds[0] < 1.0


def test_trees_that_are_missing_are_built_in_their_places(tmp_path: Path) -> None:
    meshes = [soup(n, n) for n in (LEAST_TRIANGLES, 5, LEAST_TRIANGLES + 7, 0, LEAST_TRIANGLES + 3)]
    origins = np.zeros((5, 3))
    saved_trees(Store(tmp_path), [meshes[2]], origins[:1], "sah", Builder())
    trees, seconds = saved_trees(Store(tmp_path), meshes, origins, "sah", builder := Builder())
    assert builder.asked == [LEAST_TRIANGLES, 5, 0, LEAST_TRIANGLES + 3]
    assert all(equal(tree, build_tree(mesh)) for tree, mesh in zip(trees, meshes, strict=True))
    assert seconds[3] == 0.0
    assert seconds[4] == LEAST_TRIANGLES + 3


def test_without_a_store_all_are_built() -> None:
    mesh = soup(LEAST_TRIANGLES, 2)
    (tree,), _ = saved_trees(None, [mesh], np.zeros((1, 3)), "median", builder := Builder("median"))
    assert builder.asked == [LEAST_TRIANGLES]
    assert tree.builder == "median"


def test_name_tells_all_that_makes_a_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, origin = soup(40, 3), np.zeros(3)
    moved = mesh.copy()
    moved[7, 1, 2] = np.nextafter(moved[7, 1, 2], 2.0)
    names = [
        tree_key(mesh, origin, "sah"), tree_key(mesh, origin, "median"), tree_key(moved, origin, "sah"),
        tree_key(mesh, origin + 1e-300, "sah"), tree_key(mesh[:-1], origin, "sah"), tree_key(mesh[::-1], origin, "sah"),
    ]  # fmt: skip
    assert len(set(names)) == len(names)
    assert tree_key(np.asfortranarray(mesh), origin, "sah") == names[0]
    monkeypatch.setattr(saved, "code_digest", lambda: "of another builder")
    assert tree_key(mesh, origin, "sah") != names[0]


def test_code_that_makes_trees_is_part_of_the_name() -> None:
    """A hash over no files would never change."""
    package = Path(saved.__file__).parent
    assert {"sah.py", "common.py", "clip.py"} <= {file.name for file in saved.tree_code()}
    assert package / "sah.py" in saved.tree_code()
    assert any(file.name.startswith("build_") and file.suffix == ".cl" for file in saved.tree_code())


@pytest.mark.parametrize("damage", ["a triangle that is not there", "no indices"])
def test_entry_that_cannot_be_is_built_again(tmp_path: Path, damage: str) -> None:
    """Whole files of a wrong content: of another program, say."""
    mesh, store = soup(LEAST_TRIANGLES, 4), Store(tmp_path)
    saved_trees(store, [mesh], np.zeros((1, 3)), "sah", Builder())
    (file,) = tmp_path.iterdir()
    arrays = dict(store.get(file.stem) or {})
    if damage == "no indices":
        del arrays["indices"]
    else:
        arrays["indices"] = arrays["indices"] + 1
    store.put(file.stem, arrays)
    (tree,), _ = saved_trees(store, [mesh], np.zeros((1, 3)), "sah", builder := Builder())
    assert builder.asked == [LEAST_TRIANGLES]
    assert equal(tree, build_tree(mesh))
