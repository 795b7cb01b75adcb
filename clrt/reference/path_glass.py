"""Rough glass in the reference of sampled light: rays reflected and refracted by drawn facets, and what they hand on in all."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from clrt.reference.bounce import Bounces, MediumStack
from clrt.reference.path_microfacet import COSINES, drawn_facets, facet_grid, masking, visibility
from clrt.reference.path_surfaces import facet_normal
from clrt.reference.path_world import Generator, PathWorld, Wave, surface_rows
from clrt.reference.shade import Surface, dot

FloatArray = NDArray[np.float64]


def through_rough_glass(world: PathWorld, wave: Wave, surface: Surface, b: Bounces, rng: Generator) -> list[Wave]:
    """The reflected and the refracted rays of glass with gloss, (docs/conventions.md, Gloss). They count all that they meet.

    Facets are drawn with the density D cos; of those that the viewer sees, the density is G1(V) (V.m) D / (M.V).
    """
    materials, ids = world.materials, surface.material
    rows = np.flatnonzero((world.gloss[ids] > 0.0) & (materials.refract[ids] > 0.0) & ~world.metal_rough[ids])
    part, ray, behind = surface_rows(surface, rows), wave.take(rows), b.behind[rows]
    ids, alpha, normal = part.material, world.alpha[part.material], facet_normal(part)
    facet, _ = drawn_facets(normal, alpha, rng)
    n_v, v_m, n_m = dot(normal, part.view), dot(part.view, facet), dot(normal, facet)
    seen = masking(n_v, alpha) * np.maximum(v_m, 0.0) / (n_v * n_m)
    n1, n2 = ray.stack.index, behind.index
    back, k = _reflected_share(v_m, n1 / n2, materials.fresnel[ids] > 0.0)
    whole = _albedo(n_v, alpha, n1 / n2, materials.fresnel[ids] > 0.0)
    mirrored = 2.0 * v_m[:, None] * facet - part.view
    up = seen * _kept(n_v, dot(normal, mirrored), alpha) * (dot(mirrored, part.n_geo) > 0.0)
    # Without a change of index nothing is refracted or reflected by facets; what Reflect asks for is a rough mirror's.
    change = n1 != n2
    mirror = np.divide(materials.reflect[ids], _albedo(n_v, alpha, np.zeros(len(rows)), np.zeros(len(rows), np.bool_)))
    weight_up = up * (mirror + np.where(change, materials.refract[ids] * back / whole, 0.0))
    r = (n1 / n2)[:, None]
    bent = -r * part.view + (r * v_m[:, None] - np.sqrt(np.maximum(k, 0.0))[:, None]) * facet
    depth = -dot(normal, bent)
    below = (depth > 0.0) & (dot(bent, part.n_geo) < 0.0) & (k >= 0.0)
    passed = seen * (1.0 - back) / whole * np.where(below, masking(np.where(below, depth, 1.0), alpha), 0.0)
    direction = np.where(change[:, None], bent, -part.view)
    weight_down = materials.refract[ids] * np.where(change, passed, 1.0)
    return [_sent(ray, part, mirrored, weight_up, ray.stack), _sent(ray, part, direction, weight_down, behind)]


def _sent(ray: Wave, surface: Surface, direction: FloatArray, weight: FloatArray, stack: MediumStack) -> Wave:
    return Wave(surface.point, direction, surface.prim, ray.tint * weight[:, None], ray.path, ray.time, stack,
                np.zeros(len(ray), np.bool_))  # fmt: skip


def _kept(n_v: FloatArray, n_l: FloatArray, alpha: FloatArray) -> FloatArray:
    """G2(V, i) / G1(V), 0 below the surface."""
    above = n_l > 0.0
    n_l = np.where(above, n_l, 1.0)
    return np.where(above, visibility(n_v, n_l, alpha) * 4.0 * n_v * n_l / masking(n_v, alpha), 0.0)


def _reflected_share(v_m: FloatArray, ratio: FloatArray, fresnel: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """The part of light that a facet reflects: by Fresnel's equations, or 0; 1 where reflection is total. And k, the square of the
    refracted ray's cosine, negative there."""
    k = 1.0 - ratio**2 * (1.0 - v_m**2)
    cos_t = np.sqrt(np.maximum(k, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (ratio * v_m - cos_t) / (ratio * v_m + cos_t)
        p = (v_m - ratio * cos_t) / (v_m + ratio * cos_t)
    return np.where(k < 0.0, 1.0, np.where(fresnel, np.nan_to_num((s**2 + p**2) / 2.0), 0.0)), k


def _albedo(n_v: FloatArray, alpha: FloatArray, ratio: FloatArray, fresnel: NDArray[np.bool_]) -> FloatArray:
    """(m,) the mean of F G2 / G1 + (1 - F) G1(i) over the facets that the viewer sees; ratio n1 / n2, 0: facets that reflect all."""
    result = np.empty(len(n_v))
    keys = np.stack([alpha, ratio, fresnel.astype(np.float64)], axis=1)
    for key in np.unique(keys, axis=0):
        rows = (keys == key).all(axis=1)
        result[rows] = np.interp(np.clip(n_v[rows], 0.0, 1.0), COSINES, _albedo_table(*key.tolist()))
    return result


@lru_cache(maxsize=64)
def _albedo_table(alpha: float, ratio: float, fresnel: float) -> FloatArray:
    n_m, side, counts = facet_grid(alpha)
    width, table = np.asarray(alpha), np.empty(len(COSINES))
    for row, n_v in enumerate(COSINES.tolist()):
        v_m = np.sqrt(1.0 - n_v**2) * side + n_v * n_m
        seen = masking(np.asarray(n_v), width) * np.maximum(v_m, 0.0) / (n_v * n_m)
        back, k = np.ones_like(v_m), np.zeros_like(v_m)
        if ratio > 0.0:
            back, k = _reflected_share(v_m, np.asarray(ratio), np.asarray(fresnel > 0.0))
        n_l = 2.0 * v_m * n_m - n_v
        depth = ratio * n_v - (ratio * v_m - np.sqrt(np.maximum(k, 0.0))) * n_m  # of the refracted ray, along the normal
        down = np.where((depth > 0.0) & (k >= 0.0), masking(np.where(depth > 0.0, depth, 1.0), width), 0.0)
        table[row] = (counts * seen * (back * _kept(np.asarray(n_v), n_l, width) + (1.0 - back) * down)).mean()
    return table
