"""Rays through a kd-tree in NumPy, one step of all rays at a time: a slow, plain traversal that counts what it does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from kdtree_meshes import F64

from clrt.kdtree import LEAF, KdTree

#: Split distances are widened by this share, so that rounding never hides a child.
WIDENING = 2.0**-20


def hit_distances(origin: F64, direction: F64, triangles: F64) -> F64:
    """Distance of ray i to triangle i, inf for a miss (Moeller and Trumbore, 1997)."""
    edge1, edge2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p, to_origin = np.cross(direction, edge2), origin - triangles[:, 0]
    q = np.cross(to_origin, edge1)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1 / (edge1 * p).sum(axis=1)
        u, v, t = (to_origin * p).sum(axis=1) * scale, (direction * q).sum(axis=1) * scale, (edge2 * q).sum(axis=1) * scale
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & np.isfinite(t)
    return np.where(hit, t, np.inf)


def brute_force(vertices: F64, origin: F64, direction: F64) -> tuple[F64, np.ndarray]:
    """Distance and triangle of the nearest hit of each ray, by all triangles; inf and -1 without one."""
    n = len(vertices)
    t = np.stack([hit_distances(np.tile(o, (n, 1)), np.tile(d, (n, 1)), vertices) for o, d in zip(origin, direction, strict=True)])
    return t.min(axis=1), np.where(np.isfinite(t.min(axis=1)), t.argmin(axis=1), -1)


@dataclass
class Walk:
    """What came of rays: nearest distance and triangle (-1: none), triangle tests and steps down the tree of each ray."""

    t: F64
    triangle: np.ndarray
    tests: np.ndarray
    steps: np.ndarray


class _Rays:
    """Where each ray is, and the far children it has put off."""

    def __init__(self, tree: KdTree, origin: F64, direction: F64, t_max: F64) -> None:
        n = len(origin)
        self.tree, self.origin, self.direction = tree, origin, direction
        self.out = Walk(t_max.copy(), np.full(n, -1), np.zeros(n, np.int64), np.zeros(n, np.int64))
        with np.errstate(divide="ignore", invalid="ignore"):
            self.inverse = 1 / direction
            slabs = np.stack([(bound - origin) * self.inverse for bound in (tree.lo, tree.hi)])
        # NaN: the ray lies in the plane of a slab's face, and is inside the slab.
        near, far = np.minimum(*slabs), np.maximum(*slabs)
        near[np.isnan(near)], far[np.isnan(far)] = -np.inf, np.inf
        self.enter = near.max(axis=1).clip(0) * (1 - WIDENING)
        self.leave = np.minimum(far.min(axis=1) * (1 + WIDENING), t_max)
        self.node, self.top = np.zeros(n, np.int64), np.zeros(n, np.int64)
        self.stack = np.zeros((3, n, tree.depth + 1))

    def step_down(self, rays: np.ndarray) -> None:
        """Move rays at inner nodes to their nearer child, and put the farther off where the ray reaches it."""
        node = self.node[rays]
        axis, plane = self.tree.split_axis[node].astype(np.int64), self.tree.split_pos[node].astype(np.float64)
        at, slope = self.origin[rays, axis], self.direction[rays, axis]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (plane - at) * self.inverse[rays, axis]
        first_upper = np.where(slope == 0, at > plane, slope < 0)
        t = np.where(slope == 0, np.where(at == plane, np.nan, np.inf), t)
        margin = np.where(np.isfinite(t), np.abs(t) * WIDENING, 0)
        # Comparisons are false for NaN, a ray in the plane: both children.
        near, far = ~(t + margin < self.enter[rays]), ~(t - margin > self.leave[rays])
        lower = self.tree.child[node].astype(np.int64)
        self.out.steps[rays] += 1
        put_off = near & far
        later = rays[put_off]
        begins = np.where(np.isnan(t), self.enter[rays], np.maximum(self.enter[rays], t - margin))
        self.stack[:, later, self.top[later]] = (lower + ~first_upper)[put_off], begins[put_off], self.leave[later]
        self.top[later] += 1
        self.leave[later] = np.fmin(self.leave[later], (t + margin)[put_off])
        self.node[rays] = lower + np.where(near, first_upper, ~first_upper)

    def test_leaves(self, rays: np.ndarray, vertices: F64) -> None:
        """Test all triangles of the leaves that rays are at."""
        node = self.node[rays]
        count, first = self.tree.count[node].astype(np.int64), self.tree.child[node].astype(np.int64)
        self.out.tests[rays] += count
        ray = np.repeat(rays, count)
        entry = np.repeat(first - np.cumsum(count) + count, count) + np.arange(int(count.sum()))
        triangle = self.tree.indices[entry]
        t = hit_distances(self.origin[ray], self.direction[ray], vertices[triangle])
        # Far hits first, so that the nearest is what stays; of equal ones the lowest triangle.
        order = np.lexsort((-triangle, -t))
        ray, triangle, t = ray[order], triangle[order], t[order]
        better = (t < self.out.t[ray]) | ((t == self.out.t[ray]) & (triangle < self.out.triangle[ray]))
        self.out.t[ray[better]], self.out.triangle[ray[better]] = t[better], triangle[better]

    def pop(self, rays: np.ndarray) -> np.ndarray:
        """Take up the last child put off that is nearer than the hit; return the rays that have one."""
        alive = []
        while rays.size:
            rays = rays[self.top[rays] > 0]
            self.top[rays] -= 1
            node, enter, leave = self.stack[:, rays, self.top[rays]]
            self.node[rays], self.enter[rays], self.leave[rays] = node, enter, np.minimum(leave, self.out.t[rays])
            goes = enter <= self.out.t[rays]
            alive.append(rays[goes])
            rays = rays[~goes]
        return np.concatenate(alive) if alive else rays


def walk(tree: KdTree, vertices: F64, origin: F64, direction: F64, t_max: F64, any_hit: bool = False) -> Walk:
    """Follow rays to their nearest hit below t_max, or to any."""
    state = _Rays(tree, origin, direction, t_max)
    rays = np.flatnonzero(state.enter <= state.leave)
    while rays.size:
        leaf = tree.split_axis[state.node[rays]] == LEAF
        at_leaf, inner = rays[leaf], rays[~leaf]
        state.step_down(inner)
        state.test_leaves(at_leaf, vertices)
        if any_hit:
            at_leaf = at_leaf[state.out.triangle[at_leaf] < 0]
        rays = np.concatenate([inner, state.pop(at_leaf)])
    return state.out
