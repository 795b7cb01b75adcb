"""Needles that float64 barely knows, and rays that start next to a surface."""

from __future__ import annotations

import numpy as np
import pytest

import clrt
from clrt.generate import uv_sphere
from clrt.reference import exact
from clrt.scene.build import parse_scene


@pytest.mark.matrix(keep=2)
@pytest.mark.parametrize("sine", [1e-7, 1e-10, 1e-13, 1e-14, 1e-16])
def test_needle_before_a_wall_is_seen(sine: float) -> None:
    """The wall stands first in the leaf, so that the needle has to beat it: its normal is known to no more than sine / 2^-53."""
    rng = np.random.default_rng(22)
    compared = 0
    for _ in range(40):
        corner = rng.uniform(-1, 1, 3) * (1, 1, 0) + (0, 0, 3)
        edge, across = rng.normal(size=3) * (1, 1, 0.3), rng.normal(size=3)
        needle = np.stack([corner, corner + edge, corner + edge * rng.uniform(0.2, 0.8) + sine * across])
        target = np.array([0.3, 0.3, 0.4]) @ needle
        along = target / np.linalg.norm(target)
        side = np.cross(along, (0.3, 0.5, 0.7))
        up, behind = np.cross(along, side), target + along * 10.0 ** rng.uniform(-6.5, -1)
        wall = np.stack([behind - side - up, behind + side - up, behind + 2 * up])
        triangles = np.stack([wall, needle])
        expected, _ = exact.first_hit(triangles, np.zeros((1, 3)), target[None])
        if expected[0] == 1:
            compared += 1
            found = clrt.RayCaster(triangles, tree="brute").first_hit(np.zeros(3), target)["prim_id"]
            assert found == 1
    assert compared >= 5


@pytest.mark.parametrize("precision", ["watertight", "exact", "double"])
@pytest.mark.parametrize("depth", [1e-3, 1e-7, 1e-9, 1e-12, 1e-15])
def test_no_ray_leaves_a_closed_mesh_from_next_to_its_surface(precision: str, depth: float) -> None:
    vertices, faces = uv_sphere(1200)
    rng = np.random.default_rng(5)
    face = rng.integers(len(faces), size=4000)
    weights = rng.dirichlet((1, 1, 1), size=4000)
    on = np.einsum("ik,ikj->ij", weights, vertices[faces[face]])
    origins = on * (1 - depth)
    inside = exact.any_hit(vertices[faces], origins[:300], on[:300])
    assert inside.all(), "the origins lie inside, by exact arithmetic"
    caster = clrt.RayCaster((vertices, faces), precision=precision)
    assert caster.any_hit(origins, on).all()
    assert (caster.first_hit(origins, on)["prim_id"] >= 0).all()


def test_fast_loses_rays_from_next_to_a_surface() -> None:
    vertices, faces = uv_sphere(1200)
    on = vertices[faces].mean(axis=1)
    assert not clrt.RayCaster((vertices, faces), precision="fast").any_hit(on * (1 - 1e-9), on).all()


def test_triangle_seen_edge_on_hides_nothing_far_beside_it() -> None:
    """A leaf of size 0.14 in one object with a floor of 600, at the height of a lens: what is metres beside it keeps its colour."""
    scene = parse_scene(
        "E 0 0.8 -5\nV 0 0 1\nF 46\nR 96 33\nsamples 16\nbackground 1 0.6 0.4\nlens 0.02 10\nM 0.5 0.5 0.5  1 0 0 1  0\n"
        "T -300 0 -20   300 0 -20   300 0 600\nM 0.1 0.1 0.1  1 0 0 1  0\nT 3.33 0.8 5.43   3.47 0.8 5.43   3.47 0.8 5.57\n"
    )
    left = clrt.render(scene).pixels[14:19, :48]  # the leaf stands to the right
    exact_left = clrt.render(scene, precision="exact").pixels[14:19, :48]
    assert (np.abs(left - exact_left) < 0.1).all(), "no more than a sample at an edge"
