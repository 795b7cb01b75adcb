"""A sitting, rabbit-like animal as one closed mesh: ellipsoids blended into each other, with a bumpy coat."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clrt.errors import LimitError
from clrt.generate.implicit import FloatArray, IndexArray, is_closed_sphere, relax, split_quads, surface_quads

SMALLEST, LARGEST = 1_000, 4_000_000
_TOLERANCE = 0.02
#: lattices tried: the count varies by some percent with their place, and at small counts a gap may close to a handle
_ATTEMPTS = 60
#: of relaxation
_ROUNDS = 6
#: the animal fits into this box, whatever the seed: it looks along +x, sits on y = 0, its middle plane is z = 0
_LO, _SIZE = np.array([-0.80, -0.15, -0.80]), 1.65
_SMOOTH = 0.06
_HEAD, _EYE_RADIUS = 2, 0.027
#: triangles of a mesh of spacing h are about this / h^2; refined in the search
_COUNT_TIMES_CELL_SQUARED = 8.2


@dataclass(frozen=True, eq=False)
class _Part:
    """An ellipsoid: center and radii (3,), world_from_part (3, 3), and how widely it blends into the rest."""

    center: FloatArray
    radii: FloatArray
    world_from_part: FloatArray
    blend: float


def rabbit_like(triangles: int, seed: int = 0) -> tuple[FloatArray, IndexArray]:
    """A closed mesh of a sitting rabbit: vertices (n, 3) float64, faces (m, 3) int64, m within 2% of `triangles`.

    The animal looks along +x, y is up, it sits on y = 0 and is about 1.2 high. Every edge is shared by exactly two
    triangles, cross(b - a, c - a) points outward, coordinates are rounded to 1e-6. The seed varies the pose and
    the bumps. Raises LimitError below 1,000 or above 4,000,000 triangles.
    """
    if not SMALLEST <= triangles <= LARGEST:
        raise LimitError(f"a rabbit of {triangles:,} triangles: give {SMALLEST:,} to {LARGEST:,}")
    constant = _COUNT_TIMES_CELL_SQUARED
    if triangles > 20_000:
        constant = _measured_constant(6_000, seed, constant)
    shifts = np.random.default_rng(seed).random((_ATTEMPTS, 3))
    for attempt, shift in enumerate(shifts):
        cell = float(np.sqrt(constant / triangles))
        net = surface_quads(_Animal(seed, cell), _LO - cell * shift, cell, int(_SIZE / cell) + 4)
        if net is None:
            continue
        count = 2 * len(net[1])
        # The mean of what the lattices gave so far: one lattice alone is off by some percent at small counts
        constant += (count * cell * cell - constant) / (attempt + 1)
        if abs(count - triangles) <= _TOLERANCE * triangles and len(net[0]) - len(net[1]) == 2:
            vertices, faces = _finished(seed, cell, *net)
            if is_closed_sphere(vertices, faces):
                return vertices, faces
    raise LimitError(f"no closed mesh of {triangles:,} triangles with seed {seed}; take another seed, or some more triangles")


def _measured_constant(triangles: int, seed: int, guess: float) -> float:
    cell = float(np.sqrt(guess / triangles))
    net = surface_quads(_Animal(seed, cell), _LO, cell, int(_SIZE / cell) + 4)
    return guess if net is None else 2 * len(net[1]) * cell * cell


def _finished(seed: int, cell: float, vertices: FloatArray, quads: IndexArray) -> tuple[FloatArray, IndexArray]:
    animal = _Animal(seed, cell)
    vertices = np.round(relax(animal, vertices, quads, 0.25 * cell, rounds=_ROUNDS), 6)
    return vertices, split_quads(animal, vertices, quads)


class _Animal:
    """The animal as a field, about the signed distance to it; bumps finer than the lattice can show are left out."""

    def __init__(self, seed: int, cell: float) -> None:
        random = np.random.default_rng(seed)
        self.parts = [_resolved(part, cell) for part in _parts(random)]
        self.bumps = [_bumps(random, wave, height) for wave, height in _COAT if wave > 3.0 * cell]

    def __call__(self, points: FloatArray) -> FloatArray:
        x = points.T
        distance = _ellipsoid(self.parts[0], x)
        for part in self.parts[1:]:
            distance = _smooth_min(distance, _ellipsoid(part, x), part.blend)
        warped = x
        for wave_vectors, phases, height in self.bumps:
            waves = np.sin(wave_vectors @ warped + phases[:, None])
            distance = distance + height * np.prod(waves, axis=0)
            # Each scale bends the next finer one, so that no regular pattern shows
            warped = warped + 2.5 * height * waves[[1, 2, 0]]
        # A flat seat: the smooth maximum with the half space y < 0
        seated: FloatArray = -_smooth_min(-distance, x[1], _SMOOTH)
        return seated


def _resolved(part: _Part, cell: float) -> _Part:
    """The part, thick enough and rounded off enough for a coarse lattice to show it without holes."""
    return replace(part, radii=np.maximum(part.radii, 0.9 * cell), blend=max(part.blend, 1.5 * cell))


#: wavelength and height of the bumps, from haunches to fur
_COAT = [(0.31, 0.014), (0.13, 0.0045), (0.055, 0.0018), (0.023, 0.0006)]


def _bumps(random: np.random.Generator, wave: float, height: float) -> tuple[FloatArray, FloatArray, float]:
    """Three wave vectors at right angles, in a random frame, and their phases."""
    frame, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return frame * (2.0 * np.pi / wave), random.uniform(0.0, 2.0 * np.pi, 3), height


def _ellipsoid(part: _Part, x: FloatArray) -> FloatArray:
    """About the distance to an ellipsoid, (n,), x : (3, n); Quilez (2008), first order in f / |grad f|."""
    local = (part.world_from_part.T @ (x - part.center[:, None])) / part.radii[:, None]
    reach = np.sqrt(np.sum(local * local, axis=0))
    scaled = local / part.radii[:, None]
    slope = np.sqrt(np.sum(scaled * scaled, axis=0))
    distance: FloatArray = reach * (reach - 1.0) / np.maximum(slope, 1e-9)
    return distance


def _smooth_min(a: FloatArray, b: FloatArray, width: float) -> FloatArray:
    """The lesser of two, rounded off where they differ by less than `width` (polynomial, Quilez 2013)."""
    gap = np.maximum(width - np.abs(a - b), 0.0) / width
    least: FloatArray = np.minimum(a, b) - gap * gap * (width / 4.0)
    return least


def _parts(random: np.random.Generator) -> list[_Part]:
    """The animal's parts; tilts in degrees about z (nose up), then about x (sideways), then about y."""
    pose = random.uniform(-1.0, 1.0, 8)
    head = np.array([0.37, 0.66, 0.0]) + 0.015 * np.array([pose[0], pose[1], 0.0])
    parts = [
        _part((-0.08, 0.33, 0.0), (0.42, 0.31, 0.28), (18.0 + 3.0 * pose[2], 0, 0), 0.10),
        _part((0.20, 0.36, 0.0), (0.20, 0.27, 0.19), (-12, 0, 0), 0.12),
        _part(head, (0.20, 0.155, 0.145), (-12, 0, 0), 0.10),
        _part(head + np.array((0.145, -0.045, 0.0)), (0.095, 0.085, 0.085), (-10, 0, 0), 0.08),
        _part((0.06, 0.13, 0.0), (0.30, 0.14, 0.22), (0, 0, 0), 0.08),
        _part((-0.47, 0.20, 0.0), (0.11, 0.105, 0.10), (0, 0, 0), 0.05),
    ]
    for side, tilt in ((1.0, pose[3]), (-1.0, pose[4])):
        lean = 30.0 + 6.0 * tilt
        root = head + np.array((-0.09, 0.10, 0.060 * side))
        along = _rotation(lean, 24.0 * side, 0.0) @ np.array([0.0, 0.25, 0.0])
        parts += [
            _part((-0.16, 0.20, 0.19 * side), (0.23, 0.21, 0.125), (20, 0, 0), 0.07),
            _part((0.02, 0.045, 0.24 * side), (0.22, 0.07, 0.075), (0, 0, -8 * side), 0.07),
            _part((0.36, 0.16, 0.10 * side), (0.08, 0.20, 0.075), (12, 0, 0), 0.06),
            _part((0.42, 0.045, 0.105 * side), (0.12, 0.06, 0.065), (0, 0, 0), 0.05),
            _part(head + np.array((0.05, -0.055, 0.085 * side)), (0.09, 0.08, 0.07), (0, 0, 0), 0.06),
            _part(root + along, (0.060, 0.29, 0.086), (lean, 24.0 * side, 22.0 * side), 0.05),
        ]
    return parts


def _part(center: object, radii: tuple[float, float, float], tilt: tuple[float, float, float], blend: float) -> _Part:
    return _Part(np.asarray(center, np.float64), np.array(radii), _rotation(*tilt), blend)


def _rotation(about_z: float, about_x: float, about_y: float) -> FloatArray:
    z, x, y = np.radians([about_z, about_x, about_y])
    turn_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    turn_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    turn_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    rotation: FloatArray = turn_x @ turn_z @ turn_y
    return rotation


def eyes(triangles: int, seed: int = 0) -> tuple[FloatArray, float]:
    """Centers (2, 3) on the coat of `rabbit_like(triangles, seed)`, and a radius, for two spheres to serve as eyes."""
    head = _parts(np.random.default_rng(seed))[_HEAD]
    animal = _Animal(seed, float(np.sqrt(_COUNT_TIMES_CELL_SQUARED / triangles)))
    sides = np.array([[0.42, 0.38, 0.82], [0.42, 0.38, -0.82]])
    outward = sides @ head.world_from_part.T
    centers = head.center + (sides * head.radii) @ head.world_from_part.T
    for _ in range(4):
        centers = centers - animal(centers)[:, None] * outward
    return centers - 0.3 * _EYE_RADIUS * outward, _EYE_RADIUS
