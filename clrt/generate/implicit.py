"""A closed surface f(x) = 0 as triangles: naive surface nets (Gibson 1998) on a sparse lattice, then relaxed.

The lattice is refined only near the surface, so time and memory grow with the number of triangles, not with the
volume. A vertex is placed in each crossed cell, a quad around each crossed lattice edge. Two quads meet in an edge, and one
fan of quads in a vertex, exactly if no cell holds two sheets of the surface; cells that do are filled until none is left.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
#: values of the field at (n, 3) points: negative inside, about the distance to the surface
Field = Callable[[FloatArray], FloatArray]

_BITS = 20
_CORNERS = np.array([(i, j, k) for k in (0, 1) for j in (0, 1) for i in (0, 1)], np.int64)
_EDGES = [(a, b) for a in range(8) for b in range(8) if b > a and (b - a) in (1, 2, 4) and not a & (b - a)]
#: |f| may exceed the true distance by this factor before a cell that the surface crosses is overlooked
_SLACK = 2.5
_CHUNK = 1 << 15


def surface_quads(field: Field, lo: FloatArray, cell: float, cells: int) -> tuple[FloatArray, IndexArray] | None:
    """Vertices (n, 3) near the surface and quads (m, 4), counter-clockwise from outside by cross(b - a, c - a) outward.

    lo : (3,) lower corner of the lattice; cell : its spacing; cells : its cells a side, at most 2**19
    Returns None where the lattice is too coarse: a cell that a crossed edge needs was overlooked.
    """
    keys = _cells_near(field, lo, cell, cells)
    ijk = _unpack(keys)
    corner_keys, place = np.unique(_pack(ijk[:, None, :] + _CORNERS), return_inverse=True)
    corners = np.reshape(place, (-1, 8))
    values = _single_sheets(evaluate(field, lo + cell * _unpack(corner_keys)), corners)[corners]
    inside = values < 0.0
    mixed = inside.any(axis=1) & ~inside.all(axis=1)
    keys, ijk, values, inside = keys[mixed], ijk[mixed], values[mixed], inside[mixed]
    if not len(keys):
        return None
    vertices = lo + cell * (ijk + _mean_crossing(values, inside))
    quads = [_quads_along(axis, keys, ijk, inside) for axis in range(3)]
    if any(q is None for q in quads):
        return None
    return _largest_piece(vertices, np.concatenate([q for q in quads if q is not None]))


def _largest_piece(vertices: FloatArray, quads: IndexArray) -> tuple[FloatArray, IndexArray]:
    """The mesh without the crumbs that bumps can leave in narrow gaps.

    Every vertex takes the least number it can reach: neighbours are compared, then labels followed, until all rest.
    """
    if len(vertices) - len(quads) == 2:  # a quad mesh has two edges a quad: Euler's characteristic of one sphere
        return vertices, quads
    label = np.arange(len(vertices))
    while True:
        least = np.repeat(label[quads].min(axis=1), 4)
        lower = label.copy()
        np.minimum.at(lower, quads.ravel(), least)
        lower = lower[lower]
        if np.array_equal(lower, label):
            break
        label = lower
    kept = label == np.argmax(np.bincount(label))
    return vertices[kept], (np.cumsum(kept) - 1)[quads[kept[quads[:, 0]]]]


def relax(field: Field, vertices: FloatArray, quads: IndexArray, step: float, rounds: int) -> FloatArray:
    """Even out the triangles: each vertex towards the mean of its neighbours, then back onto the surface by Newton steps.

    step : length for the differences that give the gradient, scene units; a vertex moves at most that far by Newton
    """
    ends = np.concatenate([quads[:, [i, (i + 1) % 4]] for i in range(4)])
    degree = np.bincount(ends[:, 0], minlength=len(vertices))[:, None]
    for _ in range(rounds):
        sums = [np.bincount(ends[:, 0], vertices[ends[:, 1], axis], len(vertices)) for axis in range(3)]
        vertices = vertices + 0.5 * (np.stack(sums, axis=1) / degree - vertices)
        vertices = _project(field, vertices, step)
    return _project(field, vertices, step)


def split_quads(field: Field, vertices: FloatArray, quads: IndexArray) -> IndexArray:
    """Two triangles a quad, (2m, 3), along the diagonal whose middle lies nearer to the surface: edges follow ridges."""
    a, b, c, d = quads.T
    off_ac = np.abs(evaluate(field, 0.5 * (vertices[a] + vertices[c])))
    off_bd = np.abs(evaluate(field, 0.5 * (vertices[b] + vertices[d])))
    first = off_ac <= off_bd
    upper = np.where(first[:, None], np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    lower = np.where(first[:, None], np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return np.stack([upper, lower], axis=1).reshape(-1, 3)


def is_closed_sphere(vertices: FloatArray, faces: IndexArray) -> bool:
    """Whether the mesh is closed, consistently wound, of the sphere's Euler characteristic, with no vertex place twice."""
    count = len(vertices)
    ahead = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    codes = np.sort(ahead[:, 0] * count + ahead[:, 1])
    turned = np.sort(ahead[:, 1] * count + ahead[:, 0])
    closed = np.array_equal(codes, turned) and bool((codes[1:] != codes[:-1]).all())
    euler = len(np.unique(faces)) - len(codes) // 2 + len(faces)
    return closed and euler == 2 and len(np.unique(vertices, axis=0)) == count


def evaluate(field: Field, points: FloatArray) -> FloatArray:
    """The field at many points, in pieces that stay in the cache."""
    pieces = [field(points[i : i + _CHUNK]) for i in range(0, len(points), _CHUNK)]
    return np.concatenate(pieces) if pieces else np.zeros(0)


def _pack(ijk: IndexArray) -> IndexArray:
    packed: IndexArray = (ijk[..., 0] << 2 * _BITS) | (ijk[..., 1] << _BITS) | ijk[..., 2]
    return packed


def _unpack(keys: IndexArray) -> IndexArray:
    mask = (1 << _BITS) - 1
    return np.stack([keys >> 2 * _BITS, (keys >> _BITS) & mask, keys & mask], axis=-1)


def _cells_near(field: Field, lo: FloatArray, cell: float, cells: int) -> IndexArray:
    """Sorted keys of the cells that the surface may cross, found from coarse blocks down to single cells."""
    levels = max(0, int(np.ceil(np.log2(cells / 12.0))))
    side = -(-cells >> levels) + 1
    ijk = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    for level in range(levels, -1, -1):
        size = cell * (1 << level)
        distance = np.abs(evaluate(field, lo + size * (ijk + 0.5)))
        ijk = ijk[distance <= _SLACK * np.sqrt(0.75) * size]
        if level:
            ijk = (2 * ijk[:, None, :] + _CORNERS).reshape(-1, 3)
    return np.sort(_pack(ijk))


def _single_sheets(values: FloatArray, corners: IndexArray) -> FloatArray:
    """The lattice values with a few corners taken inside, so that no cell is crossed by two sheets of the surface.

    The corner taken is the outer one nearest to the surface; each round takes more inside, so the rounds end.
    """
    values = values.copy()
    while True:
        codes = (values[corners] < 0.0) @ (1 << np.arange(8))
        wrong = corners[_TWO_SHEETS[codes]]
        if not len(wrong):
            return values
        outer = np.where(values[wrong] < 0.0, np.inf, values[wrong])
        chosen = wrong[np.arange(len(wrong)), np.argmin(outer, axis=1)]
        values[chosen] = -np.maximum(values[chosen], 1e-12)


def _connected(corners: set[int]) -> bool:
    """Whether corners of a cell hang together along its edges."""
    reached, wave = set(), set(list(corners)[:1])
    while wave:
        reached |= wave
        wave = {b for a in wave for b in (a ^ 1, a ^ 2, a ^ 4)} & corners - reached
    return reached == corners


def _two_sheets() -> NDArray[np.bool_]:
    """For each of the 256 patterns of inner corners: whether a face has them at a diagonal, or the cell in two pieces."""
    table = np.zeros(256, bool)
    for code in range(256):
        inner = {a for a in range(8) if code >> a & 1}
        faces = [{a for a in range(8) if a >> axis & 1 == side} for axis in range(3) for side in (0, 1)]
        whole = all(_connected(part & face) for face in [set(range(8)), *faces] for part in (inner, set(range(8)) - inner))
        table[code] = not whole
    return table


_TWO_SHEETS = _two_sheets()


def _mean_crossing(values: FloatArray, inside: NDArray[np.bool_]) -> FloatArray:
    """Where the surface crosses the edges of each cell, on average; in cell units, (n, 3)."""
    total, count = np.zeros((len(values), 3)), np.zeros((len(values), 1))
    for a, b in _EDGES:
        crossed = inside[:, a] != inside[:, b]
        t = np.divide(values[:, a], values[:, a] - values[:, b], out=np.zeros(len(values)), where=crossed)
        point = _CORNERS[a] + t[:, None] * (_CORNERS[b] - _CORNERS[a])
        total += np.where(crossed[:, None], point, 0.0)
        count += crossed[:, None]
    mean: FloatArray = total / count
    return mean


def _quads_along(axis: int, keys: IndexArray, ijk: IndexArray, inside: NDArray[np.bool_]) -> IndexArray | None:
    """The quads around the crossed edges that leave each cell's lowest corner along `axis`; None if a cell is missing."""
    crossed = inside[:, 0] != inside[:, 1 << axis]
    unit = np.eye(3, dtype=np.int64)
    back_b, back_c = unit[(axis + 1) % 3], unit[(axis + 2) % 3]
    around = np.stack([ijk[crossed] - offset for offset in (0 * back_b, back_b, back_b + back_c, back_c)], axis=1)
    wanted = _pack(around)
    places = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    if not np.array_equal(keys[places], wanted):
        return None
    outward = inside[crossed, 0]
    return np.where(outward[:, None], places, places[:, ::-1])


def _project(field: Field, points: FloatArray, step: float) -> FloatArray:
    """One Newton step along the gradient onto f = 0, with central differences over `step`; at most `step` long."""
    gradient = np.stack([evaluate(field, points + step * e) - evaluate(field, points - step * e) for e in 0.5 * np.eye(3)], axis=1) / step
    squared = np.maximum(np.sum(gradient**2, axis=1), 0.01)
    move = -(evaluate(field, points) / squared)[:, None] * gradient
    length = np.linalg.norm(move, axis=1, keepdims=True)
    projected: FloatArray = points + move * np.minimum(1.0, step / np.maximum(length, 1e-300))
    return projected
