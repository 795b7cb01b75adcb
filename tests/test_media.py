"""Ranks of glass objects and the media around the eye: the renderer's and the reference's, each against what the scene says."""

from __future__ import annotations

import numpy as np
import pytest

import clrt
import clrt.reference
from clrt.reference import media as reference_media
from clrt.reference.geometry import MaterialTable, Primitives
from clrt.scene import media
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene
from clrt.verify.pictures import box, triangles

GLASS = "M 1 1 1 0.1 0.2 0 1 0 0.9 1.5\n"
WATER = "M 1 1 1 0.1 0.2 0 1 0 0.8 1.33\n"
MATT = "M 0.7 0.8 0.9 0.5 0.5 0 1 0\n"


def _cube(half: float, x: float = 0.0) -> str:
    return triangles(box((x - half, -half, -half), (x + half, half, half))) + "O\n"


def _scene(body: str, eye: str = "0 0 -9") -> Scene:
    return parse_scene(f"E {eye}\nV 0 0 1\nF 40\nR 40 40\nL 3 5 -8\ndepth 6\nbackground 0.2 0.4 0.6\n" + body)


def _both(scene: Scene) -> tuple[list[int], list[int]]:
    """(ranks, objects around the eye), on which renderer and reference agree."""
    prims, materials = Primitives.build(scene), MaterialTable.build(scene)
    rank = reference_media.ranks(prims, materials)
    assert media.ranks(scene).tolist() == rank.tolist()
    around = media.around_eye(scene)
    assert reference_media.around(prims, rank, scene.camera.eye, 1 << 24) == around
    return rank.tolist(), around


@pytest.mark.parametrize(
    ("body", "ranks"),
    [
        (GLASS + _cube(2) + WATER + _cube(1), [0, 1]),
        (WATER + _cube(1) + GLASS + _cube(2), [1, 0]),
        (GLASS + _cube(1) + WATER + _cube(1, 0.5), [0, 1]),
        (GLASS + WATER + _cube(1) + GLASS + _cube(1, 0.5), [0, 1]),
        (MATT + _cube(3) + GLASS + _cube(1) + "S 0 0 0 2\n", [-1, 1, 0]),
        (GLASS + "S 0 0 0 2\nS 0 0 0 1\n" + WATER + "S 5 0 0 1\n" + MATT + "S 7 0 0 1\n", [0, 2, 1, -1]),
        (GLASS + _cube(1) + _cube(1), [0, 1]),
    ],
    ids=["nested", "nested, inner first", "overlapping", "by material", "a sphere around a cube", "spheres", "the same box twice"],
)
def test_ranks_follow_nesting_then_materials(body: str, ranks: list[int]) -> None:
    assert _both(_scene(body))[0] == ranks


def test_eye_knows_what_it_is_inside_of() -> None:
    body = GLASS + _cube(2) + WATER + _cube(1) + MATT + _cube(3) + GLASS + "S 0 0 0 5\nS 9 0 0 1\n"
    assert _both(_scene(body, "0.1 0.2 0.3"))[1] == [3, 0, 1]
    assert _both(_scene(body, "1.5 0.2 0.3"))[1] == [3, 0]
    assert _both(_scene(body, "0 0 -4"))[1] == [3]
    assert _both(_scene(body))[1] == []


def test_open_mesh_holds_no_eye() -> None:
    assert _both(_scene(GLASS + "T -1 -1 -1 1 -1 -1 0 1 1\nT -1 -1 -1 1 -1 -1 0 0.2 3\n", "0 0 0.5"))[1] == []


@pytest.mark.matrix(keep=2)
@pytest.mark.parametrize(
    ("body", "eye"),
    [
        (GLASS + _cube(1) + WATER + _cube(1, 0.9) + MATT + _cube(0.3, 3), "0.4 0.3 -7"),
        (WATER + _cube(1, 0.9) + GLASS + _cube(1) + MATT + _cube(0.3, 3), "0.4 0.3 -7"),
        (GLASS + _cube(2) + MATT + _cube(0.4, 0.8), "0.3 0.2 -1.5"),
        (GLASS + "S 0 0 0 2\n" + MATT + "S 0.5 0.2 1 0.4\n", "0.1 0.2 -1"),
    ],
    ids=["overlapping", "overlapping, other order", "eye in a cube", "eye in a sphere"],
)
def test_pictures_of_overlapping_glass_match_the_reference(body: str, eye: str) -> None:
    scene = _scene(body, eye)
    reference = clrt.reference.render(scene)
    for rung in ("watertight", "double"):
        wrong = np.abs(clrt.render(scene, precision=rung).pixels - reference.pixels).max(-1) > 1e-4
        assert not (wrong & (reference.margin > 2e-5)).any()
        assert wrong.mean() < 0.03
    assert reference.pixels.std() > 1e-3
