"""A deliberately naive kd-tree in NumPy float32: a splitter that loses triangles, a traversal that loses cells.

Not for use: it proves that a case bites. The traversal is the textbook's (PBRT, 3rd ed., 4.4, without its care), one step of all rays at
a time: split distances are not widened, and comparisons are written so that a NaN enters no child.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.kdtree import LEAF, KdTree
from clrt.verify.naive import F32, TEXTBOOK, Ints, Predicate
from clrt.verify.rays import Rays, Triangles

Bools = NDArray[np.bool_]
#: (bounds lo, hi (k, 3) of triangles, corners (k, 3, 3), axis, plane) -> which go to the lower, which to the upper child
Sorter = Callable[[F32, F32, F32, int, np.float32], tuple[Bools, Bools]]


def strictly(lo: F32, hi: F32, corners: F32, axis: int, plane: np.float32) -> tuple[Bools, Bools]:
    """By strict comparisons: a triangle flat in the plane goes to neither child."""
    return lo[:, axis] < plane, hi[:, axis] > plane


def flat_below(lo: F32, hi: F32, corners: F32, axis: int, plane: np.float32) -> tuple[Bools, Bools]:
    """The careful one: a triangle flat in the plane goes to the lower child, so that nothing is lost."""
    return (lo[:, axis] < plane) | (hi[:, axis] <= plane), hi[:, axis] > plane


def by_clipped_area(lo: F32, hi: F32, corners: F32, axis: int, plane: np.float32) -> tuple[Bools, Bools]:
    """By the area of the clipped piece's box, in float32: a sliver whose box has none is dropped."""
    return _has_area(corners, axis, plane, 1), _has_area(corners, axis, plane, -1)


def _has_area(corners: F32, axis: int, plane: np.float32, sign: int) -> Bools:
    """Whether the box of the part with sign * (x - plane) <= 0 has an area."""
    distance = (corners[:, :, axis] - plane) * np.float32(sign)
    kept = np.where((distance <= 0)[..., None], corners, np.float32(np.nan))
    following, after = np.roll(corners, -1, axis=1), np.roll(distance, -1, axis=1)
    share = distance / (distance - after)
    crosses = (distance < 0) != (after < 0)
    cut = np.where(crosses[..., None], corners + share[..., None] * (following - corners), np.float32(np.nan))
    points = np.concatenate([kept, cut], axis=1)
    x, y, z = (np.fmax.reduce(points, axis=1) - np.fmin.reduce(points, axis=1)).T
    return np.asarray(x * y + y * z + z * x > 0)


def build(tri: Triangles, max_depth: int, sorter: Sorter = strictly, *, middle: bool = False, leaf_size: int = 2) -> KdTree:
    """A tree over triangles: cut on the longest axis of each cell, at the median of the corners or in the middle of the cell.

    No split is ever judged: only the depth and `leaf_size` end it.
    """
    corners = np.asarray(tri, np.float32)
    lo, hi = corners.min(axis=1), corners.max(axis=1)
    cells = [(lo.min(axis=0), hi.max(axis=0), 0, np.arange(len(corners)))]
    axes, planes, children, counts, entries = [], [], [], [], []
    filled = depth_reached = 0
    for cell_lo, cell_hi, depth, refs in cells:  # grows while it is read: breadth first
        axis = int(np.argmax(cell_hi - cell_lo))
        plane = np.float32((cell_lo[axis] + cell_hi[axis]) / 2 if middle or not len(refs) else np.median(corners[refs, :, axis]))
        depth_reached = max(depth_reached, depth)
        if depth == max_depth or len(refs) <= leaf_size or not cell_lo[axis] < plane < cell_hi[axis]:
            axes.append(LEAF)
            planes.append(np.float32(0))
            children.append(filled)
            counts.append(len(refs))
            entries.append(refs)
            filled += len(refs)
            continue
        with np.errstate(all="ignore"):
            below, above = sorter(lo[refs], hi[refs], corners[refs], axis, plane)
        axes.append(axis)
        planes.append(plane)
        children.append(len(cells))
        counts.append(0)
        lower_hi, upper_lo = cell_hi.copy(), cell_lo.copy()
        lower_hi[axis] = upper_lo[axis] = plane
        cells += [(cell_lo, lower_hi, depth + 1, refs[below]), (upper_lo, cell_hi, depth + 1, refs[above])]
    indices = np.concatenate(entries).astype(np.int32)
    columns = (np.array(axes, np.uint8), np.array(planes, np.float32), np.array(children, np.int32), np.array(counts, np.int32))
    return KdTree(cells[0][0].astype(np.float64), cells[0][1].astype(np.float64), *columns, indices, depth_reached, "naive")


@dataclass(frozen=True)
class Habits:
    """Bad habits of a traversal.

    near_by_origin : the nearer child is the one the origin lies in, by `origin < plane`, and planes at t <= 0 are behind
    stop_at_hit : the first hit in any leaf ends the ray, even beyond the leaf's cell
    inside_cell : hits that do not lie between the cell's entry and exit are rejected
    stack : entries of the stack; what is pushed beyond is lost
    """

    near_by_origin: bool = False
    stop_at_hit: bool = False
    inside_cell: bool = False
    stack: int = 64


@dataclass(frozen=True, eq=False)
class Walk:
    """prim_id (m,) and t (m,) float32 as a rung reports them, tests (m,): triangle tests of each ray."""

    prim_id: Ints
    t: F32
    tests: Ints


class _State:
    """Where each ray is, and the children it has put off."""

    def __init__(self, tree: KdTree, rays: Rays, habits: Habits) -> None:
        self.tree, self.habits = tree, habits
        self.origin, self.direction = (np.asarray(x, np.float32) for x in rays)
        self.inverse = np.float32(1) / self.direction
        t0 = (tree.lo.astype(np.float32) - self.origin) * self.inverse
        t1 = (tree.hi.astype(np.float32) - self.origin) * self.inverse
        count = len(self.origin)
        self.enter = np.maximum(np.minimum(t0, t1).max(axis=1, initial=-np.inf), np.float32(0))
        self.leave = np.maximum(t0, t1).min(axis=1, initial=np.inf)
        self.node, self.top = np.zeros(count, np.int64), np.zeros(count, np.int64)
        self.nodes = np.zeros((count, habits.stack), np.int64)
        self.ends = np.zeros((2, count, habits.stack), np.float32)
        self.prim, self.t = np.full(count, -1, np.int64), np.full(count, np.inf, np.float32)
        self.tests = np.zeros(count, np.int64)

    def descend(self, rays: Ints) -> Ints:
        """Move rays from inner nodes to a child; return those that entered none."""
        node = self.node[rays]
        axis, plane = self.tree.split_axis[node].astype(np.int64), self.tree.split_pos[node]
        origin, along = self.origin[rays, axis], self.direction[rays, axis]
        t = (plane - origin) * self.inverse[rays, axis]
        enter, leave = self.enter[rays], self.leave[rays]
        if self.habits.near_by_origin:
            upper_first = origin >= plane
            go_far = (t <= leave) & (t > 0)
            go_near = ~go_far | (t >= enter)
        else:
            upper_first = along < 0
            go_near, go_far = t >= enter, t <= leave
        near = self.tree.child[node].astype(np.int64) + upper_first
        far = self.tree.child[node].astype(np.int64) + ~upper_first
        both = go_near & go_far
        self._push(rays[both], far[both], t[both])
        self.node[rays] = np.where(go_near, near, far)
        self.leave[rays] = np.where(both, t, leave)
        return np.asarray(rays[~(go_near | go_far)])

    def _push(self, rays: Ints, node: Ints, t: F32) -> None:
        fits = self.top[rays] < self.habits.stack
        rays, node, t = rays[fits], node[fits], t[fits]
        top = self.top[rays]
        self.nodes[rays, top] = node
        self.ends[0, rays, top], self.ends[1, rays, top] = t, self.leave[rays]
        self.top[rays] += 1

    def visit(self, rays: Ints, tri: F32, predicate: Predicate) -> Ints:
        """Test the leaves that rays are at; return the rays that go on."""
        node = self.node[rays]
        count, first = self.tree.count[node].astype(np.int64), self.tree.child[node].astype(np.int64)
        self.tests[rays] += count
        ray = np.repeat(rays, count)
        place = np.repeat(first - np.cumsum(count) + count, count) + np.arange(int(count.sum()))
        which = self.tree.indices[place]
        t = predicate(tri[which], self.origin[ray], self.direction[ray])
        if self.habits.inside_cell:
            t = np.where((t >= self.enter[ray]) & (t <= self.leave[ray]), t, np.float32(np.inf))
        order = np.lexsort((-which, -t))  # the nearest, and of equal ones the first, is written last
        ray, which, t = ray[order], which[order], t[order]
        better = t < self.t[ray]
        self.t[ray[better]], self.prim[ray[better]] = t[better], which[better]
        return rays[~np.isfinite(self.t[rays])] if self.habits.stop_at_hit else rays

    def pop(self, rays: Ints) -> Ints:
        """Take up the last child put off that begins before the hit; return the rays that have one."""
        going = []
        while rays.size:
            rays = rays[self.top[rays] > 0]
            self.top[rays] -= 1
            top = self.top[rays]
            self.node[rays] = self.nodes[rays, top]
            self.enter[rays], self.leave[rays] = self.ends[0, rays, top], self.ends[1, rays, top]
            live = self.enter[rays] <= self.t[rays]
            going.append(rays[live])
            rays = rays[~live]
        return np.concatenate(going) if going else rays


def walk(tree: KdTree, tri: Triangles, rays: Rays, habits: Habits | None = None, predicate: Predicate = TEXTBOOK) -> Walk:
    """Follow rays to their nearest hit, or what these habits take for it."""
    corners = np.asarray(tri, np.float32)
    with np.errstate(all="ignore"):
        state = _State(tree, rays, habits or Habits())
        active = np.flatnonzero(state.enter <= state.leave)
        while active.size:
            leaf = tree.split_axis[state.node[active]] == LEAF
            lost = state.descend(active[~leaf])
            done = state.visit(active[leaf], corners, predicate)
            inner = active[~leaf]
            active = np.concatenate([inner[~np.isin(inner, lost)], state.pop(np.concatenate([done, lost]))])
    return Walk(state.prim, state.t, state.tests)
