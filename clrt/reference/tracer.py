"""The reference picture: a float64 ray tracer over all primitives, without a tree, for comparison with anything faster.

It follows docs/conventions.md to the letter and shares no code with the devices' side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.errors import SceneError
from clrt.reference import media
from clrt.reference.bounce import STACK_SIZE, MediumStack, Walls, bounces
from clrt.reference.crossings import BAND, Rays
from clrt.reference.environment import behind
from clrt.reference.expand import expanded
from clrt.reference.geometry import MaterialTable, Primitives
from clrt.reference.lights import lights_of
from clrt.reference.lines import TILE_BYTES
from clrt.reference.normalmap import tilted
from clrt.reference.opacity import SceneCover
from clrt.reference.shade import Surface, local_color, surfaces
from clrt.reference.texture import tints
from clrt.reference.visibility import closest
from clrt.scene.model import Scene

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

PIXELS_AT_ONCE = 1 << 15


@dataclass(frozen=True, eq=False)
class ReferencePicture:
    """What the scene looks like, and how sure that is.

    pixels : (h, w, 3) float64, linear, unclamped
    prim_id : (h, w) int64, the primitive each primary ray hits first, -1 for none
    t : (h, w) float64, where: eye + t * direction, direction as given; inf for none
    margin : (h, w) float64, the smallest distance to a flipped decision over all rays of the pixel, in relative errors: rounding with a
        unit roundoff well below it (say by a factor of 100) cannot change what the pixel's rays hit. inf: above BAND = 1e-3
    rays : how many rays were traced, by kind: primary, shadow, reflected, refracted, passed
    """

    pixels: FloatArray
    prim_id: IndexArray
    t: FloatArray
    margin: FloatArray
    rays: dict[str, int]


@dataclass(frozen=True, eq=False)
class _Wave:
    """All rays of one depth: what they contribute to which pixel, what media have left of it (m, 3), and the media they are in."""

    rays: Rays
    weight: FloatArray
    pixel: IndexArray
    stack: MediumStack
    tint: FloatArray


@dataclass(frozen=True, eq=False)
class _World:
    scene: Scene
    prims: Primitives
    materials: MaterialTable
    rank: IndexArray
    absorption: FloatArray
    cover: SceneCover
    tile_bytes: int

    @classmethod
    def of(cls, scene: Scene, tile_bytes: int) -> _World:
        scene = expanded(scene)
        prims, materials = Primitives.build(scene), MaterialTable.build(scene)
        # Without depth no light goes through glass, and media are not followed.
        absorption = media.absorption(prims, materials) * (scene.depth > 0)
        return cls(scene, prims, materials, media.ranks(prims, materials), absorption, SceneCover.of(scene), tile_bytes)

    @property
    def walls_may_coincide(self) -> bool:
        """Whether there are several meshes of glass."""
        return int(np.count_nonzero(self.rank[: len(self.scene.objects)] >= 0)) > 1

    def first_media(self) -> MediumStack:
        """The media around the eye, as of one ray."""
        stack, one = MediumStack.outside(1), np.ones(1, np.int64)
        if not (self.rank >= 0).any():
            return stack
        for k in media.around(self.prims, self.rank, np.asarray(self.scene.camera.eye, np.float64), self.tile_bytes)[-STACK_SIZE:]:
            material = self.prims.material[(self.prims.object_id == k) & (self.materials.refract[self.prims.material] > 0.0)].min()
            stack = stack.crossed(k * one, self.materials.ior[[material]], self.rank[[k]])
        return stack


def render(
    scene: Scene, *, directions: FloatArray | None = None, origins: FloatArray | None = None, chunk_bytes: int = TILE_BYTES
) -> ReferencePicture:
    """Trace the scene's picture, one ray through each pixel's centre (clrt.reference.sampled takes many, and those of a lens).

    directions : (h, w, 3) of any length, in place of `scene.camera.directions()`; float32 ones are taken as the exact numbers they are
    origins : (h, w, 3) where the rays start, in place of the eye; the media around the eye count as being around all of them
    chunk_bytes : memory for one tile of rays times triangles
    Coordinates from about 1e-60 to 1e60 keep their precision. Raises SceneError for directions that do not fit or are zero or not finite,
    for a refracting material without an index, and for primitive ids with gaps.
    """
    height, width = scene.camera.height, scene.camera.width
    d = scene.camera.directions() if directions is None else np.asarray(directions).astype(np.float64)
    if d.shape != (height, width, 3):
        raise SceneError(f"directions have the shape {d.shape}; a picture of {width} x {height} takes {(height, width, 3)}")
    if not np.isfinite(d).all() or not d.any(axis=2).all():
        raise SceneError("a direction is zero or not finite; every pixel needs one")
    eyes = np.broadcast_to(np.asarray(scene.camera.eye if origins is None else origins, np.float64), d.shape).reshape(-1, 3)
    world = _World.of(scene, chunk_bytes)
    first = world.first_media()
    picture = ReferencePicture(
        np.zeros((height * width, 3)), np.full(height * width, -1, np.int64), np.full(height * width, np.inf),
        np.full(height * width, np.inf), dict.fromkeys(("primary", "shadow", "reflected", "refracted", "passed"), 0),
    )  # fmt: skip
    for start in range(0, height * width, PIXELS_AT_ONCE):
        pixel = np.arange(start, min(start + PIXELS_AT_ONCE, height * width))
        wave = _primary(eyes[pixel], d.reshape(-1, 3)[pixel], pixel, first)
        picture.rays["primary"] += len(pixel)
        for depth in range(scene.depth + 1):
            wave = _trace(world, wave, picture, depth)
            if not len(wave.pixel):
                break
    shape = (height, width)
    picture.margin[picture.margin > BAND] = np.inf
    return ReferencePicture(picture.pixels.reshape(*shape, 3), picture.prim_id.reshape(shape), picture.t.reshape(shape),
                            picture.margin.reshape(shape), picture.rays)  # fmt: skip


def _primary(origin: FloatArray, directions: FloatArray, pixel: IndexArray, first: MediumStack) -> _Wave:
    m = len(pixel)
    rays = Rays(origin, directions, np.full(m, -1, np.int64), np.zeros(m), np.ones(m))
    return _Wave(rays, np.ones(m), pixel, first[np.zeros(m, np.int64)], np.ones((m, 3)))


def _trace(world: _World, wave: _Wave, picture: ReferencePicture, depth: int) -> _Wave:
    """Add what the rays of one depth see by themselves; return those of the next."""
    prim, t, margin = closest(world.prims, wave.rays, world.tile_bytes)
    if depth == 0:
        picture.prim_id[wave.pixel], picture.t[wave.pixel] = prim, t
    np.minimum.at(picture.margin, wave.pixel, margin)
    left = wave.tint * media.transmittance(world.absorption[wave.stack.top], t * wave.rays.speed)
    wave = replace(wave, tint=left, weight=np.where(left.any(axis=1), wave.weight, 0.0))
    missed, hit = np.flatnonzero(prim < 0), np.flatnonzero(prim >= 0)
    color, margin = behind(world.scene, wave.rays.direction[missed], wave.rays.dir_err[missed])
    np.add.at(picture.pixels, wave.pixel[missed], wave.weight[missed, None] * left[missed] * color)
    np.minimum.at(picture.margin, wave.pixel[missed], margin)
    wave, prim, t = _select(wave, hit), prim[hit], t[hit]
    surface = tilted(world.scene, world.prims, surfaces(world.prims, wave.rays, prim, t))
    solid, edges = world.cover.solid(world.prims, surface)
    np.minimum.at(picture.margin, wave.pixel, edges)
    straight = replace(wave, weight=wave.weight * (1.0 - solid))
    wave = replace(wave, weight=wave.weight * solid)
    color, margin, shadow_rays = local_color(
        world.prims, world.materials, lights_of(world.scene), surface, wave.weight, world.tile_bytes, world.cover
    )
    picture.rays["shadow"] += shadow_rays
    tint, sharpness = tints(world.scene, world.prims, surface)
    color, margin = color * tint, np.minimum(margin, sharpness)
    np.add.at(picture.pixels, wave.pixel, wave.weight[:, None] * wave.tint * color)
    np.minimum.at(picture.margin, wave.pixel, margin)
    if depth == world.scene.depth:
        return _select(wave, np.zeros(0, np.int64))
    return _joined(_next(world, wave, surface, t, picture), _passed(straight, surface, picture))


def _select(wave: _Wave, rows: IndexArray) -> _Wave:
    rays = Rays(*(getattr(wave.rays, name)[rows] for name in ("origin", "direction", "own", "pos_err", "dir_err")))
    return _Wave(rays, wave.weight[rows], wave.pixel[rows], wave.stack[rows], wave.tint[rows])


def _next(world: _World, wave: _Wave, surface: Surface, t: FloatArray, picture: ReferencePicture) -> _Wave:
    """Reflected rays, then refracted ones, those of weight 0 left out."""
    walls: Walls = ()
    if world.walls_may_coincide:
        walls = media.walls(world.prims, world.materials, wave.rays, surface.prim, t, world.tile_bytes)
    b = bounces(world.prims, world.materials, surface, wave.stack, world.rank, walls)
    np.minimum.at(picture.margin, wave.pixel, b.margin)
    up, down = np.flatnonzero(wave.weight * b.reflect_weight), np.flatnonzero(wave.weight * b.refract_weight)
    picture.rays["reflected"] += len(up)
    picture.rays["refracted"] += len(down)
    both = np.concatenate([up, down])
    direction = np.concatenate([b.reflected[up], b.refracted[down]])
    pos_err, dir_err = np.concatenate([b.reflect_err[:, up], b.refract_err[:, down]], axis=1)
    weight = wave.weight[both] * np.concatenate([b.reflect_weight[up], b.refract_weight[down]])
    above, behind = wave.stack[up], b.behind[down]
    stack = MediumStack(*(np.concatenate([getattr(above, n), getattr(behind, n)]) for n in ("object", "ior", "rank", "count")))
    rays = Rays(surface.point[both], direction, surface.prim[both], pos_err, dir_err)
    return _Wave(rays, weight, wave.pixel[both], stack, wave.tint[both])


def _passed(wave: _Wave, surface: Surface, picture: ReferencePicture) -> _Wave:
    """The rays that go straight on from their hits, in the media that they are in, those of weight 0 left out."""
    rows = np.flatnonzero(wave.weight)
    picture.rays["passed"] += len(rows)
    passed = _select(wave, rows)
    rays = Rays(surface.point[rows], -surface.view[rows], surface.prim[rows], surface.spread_err[rows], surface.dir_err[rows])
    return replace(passed, rays=rays)


def _joined(first: _Wave, second: _Wave) -> _Wave:
    def both(a: object, b: object, *names: str) -> list[Any]:
        return [np.concatenate([getattr(a, name), getattr(b, name)]) for name in names]

    rays = Rays(*both(first.rays, second.rays, "origin", "direction", "own", "pos_err", "dir_err"))
    stack = MediumStack(*both(first.stack, second.stack, "object", "ior", "rank", "count"))
    weight, pixel, tint = both(first, second, "weight", "pixel", "tint")
    return _Wave(rays, weight, pixel, stack, tint)
