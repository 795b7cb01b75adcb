"""Where light comes from beyond a surface: the reflected and the refracted ray, and the stack of dielectrics a ray is inside of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.reference.geometry import MaterialTable, Primitives
from clrt.reference.shade import Surface, dot

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

Walls = Sequence[tuple[IndexArray, IndexArray]]

STACK_SIZE = 8  #: dielectrics a ray can be inside of at once
NEARLY_TOTAL = 0.1  #: cosine of refraction below which Fresnel's share changes steeply


@dataclass(frozen=True, eq=False)
class MediumStack:
    """For m rays: object (m, 8) ids of the dielectrics entered, their ior (m, 8) and rank (m, 8), count (m,) in use, oldest first."""

    object: IndexArray
    ior: FloatArray
    rank: IndexArray
    count: IndexArray

    @classmethod
    def outside(cls, m: int) -> MediumStack:
        nobody = np.full((m, STACK_SIZE), -1, np.int64)
        return cls(nobody, np.ones((m, STACK_SIZE)), nobody, np.zeros(m, np.int64))

    def __getitem__(self, rows: IndexArray) -> MediumStack:
        return MediumStack(self.object[rows], self.ior[rows], self.rank[rows], self.count[rows])

    @property
    def index(self) -> FloatArray:
        """(m,) refractive index of the medium around each ray: that of the entry of the highest rank, 1 outside of all."""
        rank = np.where(self._used, self.rank, -1)
        top = np.take_along_axis(self.ior, rank.argmax(axis=1)[:, None], axis=1)[:, 0]
        return np.where(self.count > 0, top, 1.0)

    @property
    def top(self) -> IndexArray:
        """(m,) the object whose medium is around each ray: the entry of the highest rank, -1 outside of all."""
        rank = np.where(self._used, self.rank, -1)
        top = np.take_along_axis(self.object, rank.argmax(axis=1)[:, None], axis=1)[:, 0]
        return np.where(self.count > 0, top, -1)

    @property
    def _used(self) -> BoolArray:
        used: BoolArray = np.arange(STACK_SIZE) < self.count[:, None]
        return used

    def crossed(self, object_id: IndexArray, ior: FloatArray, rank: IndexArray | None = None) -> MediumStack:
        """Behind the surfaces of `object_id` (m,): an object on the stack is left, any other entered with index `ior` and `rank` (m,).

        Without ranks the newest has the highest. A ninth object replaces the newest entry.
        """
        place = np.arange(STACK_SIZE)
        held = (self.object == object_id[:, None]) & self._used
        leaving = held.any(axis=1)
        if rank is None:
            rank = np.where(self._used, self.rank, -1).max(axis=1) + 1
        # Leaving: the entries above move down by one.
        source = np.minimum(place + (leaving[:, None] & (place >= held.argmax(axis=1)[:, None])), STACK_SIZE - 1)
        ids, ranks = (np.take_along_axis(a, source, axis=1) for a in (self.object, self.rank))
        iors = np.take_along_axis(self.ior, source, axis=1)
        new = ~leaving[:, None] & (place == np.minimum(self.count, STACK_SIZE - 1)[:, None])
        count = np.where(leaving, self.count - 1, np.minimum(self.count + 1, STACK_SIZE))
        ids, ranks = (np.where(new, a[:, None], b) for a, b in ((object_id, ids), (rank, ranks)))
        return MediumStack(ids, np.where(new, ior[:, None], iors), ranks, count)

    def crossed_at(self, rows: IndexArray, object_id: IndexArray, ior: FloatArray, rank: IndexArray) -> MediumStack:
        """As `crossed`, for these rows alone."""
        columns = [a.copy() for a in (self.object, self.ior, self.rank, self.count)]
        behind = self[rows].crossed(object_id, ior, rank)
        for column, part in zip(columns, (behind.object, behind.ior, behind.rank, behind.count), strict=True):
            column[rows] = part
        return MediumStack(*columns)


@dataclass(frozen=True, eq=False)
class Bounces:
    """For m hits: reflected and refracted directions (m, 3) unit, their weights (m,) relative to the hit's, and the stack behind.

    reflect_err, refract_err : (2, m) pos_err and dir_err of those rays, see Rays
    margin : (m,) how far the choice of normals and of total reflection is from another
    """

    reflected: FloatArray
    reflect_weight: FloatArray
    reflect_err: FloatArray
    refracted: FloatArray
    refract_weight: FloatArray
    refract_err: FloatArray
    behind: MediumStack
    margin: FloatArray


def bounces(
    prims: Primitives, materials: MaterialTable, surface: Surface, stack: MediumStack, rank: IndexArray, walls: Walls = ()
) -> Bounces:
    """Snell's law against the medium around the ray; under total reflection the weight Refract goes to the reflected ray.

    rank : of every object, see media.ranks; walls : those that coincide with the surface, see media.walls
    """
    ids = surface.material
    object_id = prims.object_id[surface.prim]
    behind = stack.crossed(object_id, materials.ior[ids], rank[object_id])
    for rows, prim in walls:
        object_id = prims.object_id[prim]
        behind = behind.crossed_at(rows, object_id, materials.ior[prims.material[prim]], rank[object_id])
    glass = materials.refract[ids] > 0.0
    ratio = np.divide(stack.index, behind.index, where=glass, out=np.ones(len(ids)))
    refracted, k, flat_margin, stretch, cos_in = _refract(surface, ratio)
    total = glass & (k < 0.0)
    refract_weight = np.where(glass & ~total, materials.refract[ids], 0.0)
    reflect_weight = materials.reflect[ids] + np.where(total, materials.refract[ids], 0.0)
    split, steep_margin = _fresnel(surface, cos_in, k, stack.index, behind.index, glass & ~total & (materials.fresnel[ids] > 0.0))
    reflect_weight += split * refract_weight
    refract_weight *= 1.0 - split
    reflected, above_margin = _reflect(surface)
    margin = np.where(reflect_weight != 0.0, above_margin, np.inf)
    margin = np.minimum(margin, np.where(glass, np.minimum(np.abs(k) / surface.normal_err, flat_margin), np.inf))
    margin = np.minimum(margin, steep_margin)
    turn = surface.curvature * surface.pos_err
    reflect_err = np.stack([_across(surface, reflected), surface.dir_err + 2.0 * turn])
    refract_err = np.stack([_across(surface, refracted), surface.dir_err * np.maximum(stretch, 1.0) + turn * np.abs(stretch - 1.0)])
    return Bounces(reflected, reflect_weight, reflect_err, refracted, refract_weight, refract_err, behind, margin)


def _across(surface: Surface, direction: FloatArray) -> FloatArray:
    """(m,) the hit's error as seen across a ray that leaves it: slanted as it arrives, the ray hides what the slant has added."""
    return np.maximum(surface.spread_err, surface.pos_err * np.abs(dot(direction, surface.n_geo)))


def _reflect(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """d - 2 (d.N) N; about the geometric normal where that would go below the surface. And the margin of this choice."""
    d = -surface.view
    smooth = d - 2.0 * dot(d, surface.n_shade)[:, None] * surface.n_shade
    flat = d - 2.0 * dot(d, surface.n_geo)[:, None] * surface.n_geo
    above = dot(smooth, surface.n_geo)
    margin = np.where(surface.curvature > 0.0, np.abs(above) / surface.normal_err, np.inf)
    return _unit(np.where((above > 0.0)[:, None], smooth, flat)), margin


def _refract(surface: Surface, ratio: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Refracted directions, k = cos^2 of the refracted angle (negative: total reflection), the margin of the choice of normal,
    the derivative of the refracted by the incident angle, and the cosine of the latter.

    About the shading normal; about the geometric one where the shading normal faces away from the viewer, or where the refracted ray
    would stay on the viewer's side.
    """
    about_shade, k_shade = _snell(surface, surface.n_shade, ratio)
    about_geo, k_geo = _snell(surface, surface.n_geo, ratio)
    facing, side = dot(surface.view, surface.n_shade), dot(about_shade, surface.n_geo)
    use_geo = (facing <= 0.0) | ((k_shade >= 0.0) & (side >= 0.0))
    choice = np.minimum(np.abs(facing), np.where(k_shade >= 0.0, np.abs(side), np.inf))
    margin = np.where(surface.curvature > 0.0, choice / surface.normal_err, np.inf)
    k = np.where(use_geo, k_geo, k_shade)
    cos_in = np.abs(np.where(use_geo, dot(surface.view, surface.n_geo), facing))
    stretch = ratio * cos_in / np.sqrt(np.maximum(k, 1e-6))
    return np.where(use_geo[:, None], about_geo, about_shade), k, margin, stretch, cos_in


def _fresnel(
    surface: Surface, cos_in: FloatArray, k: FloatArray, before: FloatArray, behind: FloatArray, wanted: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """The share of unpolarised light that is reflected (m,), the mean of both polarisations; 0 where not wanted.

    before, behind : indices n1, n2; k : cos^2 of the refracted angle
    And its margin: near the critical angle the share is 1 - s sqrt(k), with s = 2 (n1 / n2 + n2 / n1) / cos i, so that an error e of k
    changes it by s e / (2 sqrt(k)): by 1e-4 where e is a 100th of this margin.
    """
    share, margin = np.zeros(len(k)), np.full(len(k), np.inf)
    rows = np.flatnonzero(wanted & (before != behind))
    n1, n2 = before[rows], behind[rows]
    cos_i, cos_t = cos_in[rows], np.sqrt(k[rows])
    s = (n1 * cos_i - n2 * cos_t) / (n1 * cos_i + n2 * cos_t)
    p = (n2 * cos_i - n1 * cos_t) / (n2 * cos_i + n1 * cos_t)
    share[rows] = (s**2 + p**2) / 2.0
    slope = (n1 / n2 + n2 / n1) / np.maximum(cos_i * cos_t, 1e-30)
    margin[rows] = np.where((n1 > n2) & (cos_t < NEARLY_TOTAL), 1e-2 / (slope * surface.normal_err[rows]), np.inf)
    return share, margin


def _snell(surface: Surface, normal: FloatArray, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
    """ratio d + (ratio cos - sqrt(k)) n with k = 1 - ratio^2 (1 - cos^2), taking 1 - cos^2 as |view x n|^2; unit (m, 3), and k (m,)."""
    cos_in = dot(surface.view, normal)
    sine = np.cross(surface.view, normal)
    k = 1.0 - ratio**2 * dot(sine, sine)
    bent = -ratio[:, None] * surface.view + (ratio * cos_in - np.sqrt(np.maximum(k, 0.0)))[:, None] * normal
    return _unit(bent), k


def _unit(v: FloatArray) -> FloatArray:
    length = np.linalg.norm(v, axis=1, keepdims=True)
    unit: FloatArray = np.divide(v, length, where=length > 0.0, out=v.copy())
    return unit
