"""Light that arrives at points: of lights without size, of one point of all that shines, of one direction of the environment.

Nothing is picked cleverly: points are uniform over the area of all primitives that send out light, directions uniform over the sphere.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.reference.environment import radiance
from clrt.reference.lights import cone
from clrt.reference.path_hits import seen
from clrt.reference.path_world import Generator, PathWorld
from clrt.scene.model import Environment, PointLight, SpotLight

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Incoming:
    """Light towards m points, if nothing is in its way.

    direction : (m, 3) unit, towards the light; distance : (m,), inf for endless
    power : (m, 3) what stands for radiance times solid angle; its mean over the random numbers is the light's own
    target : (m,) the primitive that it comes from, -1 for none
    """

    direction: FloatArray
    distance: FloatArray
    power: FloatArray
    target: IndexArray

    def take(self, rows: IndexArray) -> Incoming:
        return Incoming(self.direction[rows], self.distance[rows], self.power[rows], self.target[rows])


def arriving(world: PathWorld, light: Incoming, origin: FloatArray, own: IndexArray, time: FloatArray) -> FloatArray:
    """(m, 3) the power that comes through to `origin` (m, 3) past all primitives and through the fog."""
    power = light.power * seen(world, origin, light.direction, light.distance, own, light.target, time)[:, None]
    if world.scene.fog is not None and world.scene.fog.density > 0.0:
        power = power * np.exp(-world.scene.fog.density * light.distance)[:, None]
    return power


def from_points(world: PathWorld, point: FloatArray) -> Iterator[Incoming]:
    """Of each point light and spot: pi times its colour stands for radiance times solid angle (docs/conventions.md, Sampled light)."""
    for light in world.scene.lights_with_position:
        yield _from_point(light, point)


def _from_point(light: PointLight | SpotLight, point: FloatArray) -> Incoming:
    way = np.array(light.position) - point
    distance = np.linalg.norm(way, axis=1)
    there = distance > 0.0
    direction = np.divide(way, distance[:, None], where=there[:, None], out=np.zeros_like(way))
    strength = np.where(there, np.pi * cone(light, direction)[0], 0.0)
    if light.falloff:
        strength = np.divide(strength, distance**2, where=there, out=np.zeros_like(strength))
    return Incoming(direction, distance, strength[:, None] * np.array(light.color), _none(len(point)))


def from_suns(world: PathWorld, m: int) -> Iterator[Incoming]:
    """Of each sun, the same at all m points."""
    for sun in world.scene.suns:
        direction = np.broadcast_to(np.array(sun.direction), (m, 3))
        yield Incoming(direction, np.full(m, np.inf), np.broadcast_to(np.pi * np.array(sun.color), (m, 3)), _none(m))


def from_areas(world: PathWorld, point: FloatArray, own: IndexArray, time: FloatArray, rng: Generator) -> Incoming:
    """Of one point each, uniform over the area A of all emitters: Le |cos| A / distance^2. A flat primitive does not light itself."""
    emitters, m = world.emitters, len(point)
    area = world.area[emitters]
    target = rng.choice(emitters, m, p=area / area.sum())
    place, normal = points_on(world, target, rng)
    way = place + world.motion[target] * time[:, None] - point
    distance = np.linalg.norm(way, axis=1)
    direction = np.divide(way, distance[:, None], where=distance[:, None] > 0.0, out=np.zeros_like(way))
    cosine = -np.einsum("mi,mi->m", normal, direction)
    sphere = target >= world.prims.triangle_count
    outside = sphere & (own != target) & _outside(world, target, point)
    faces = np.where(sphere, ~outside | (cosine > 0.0), target != own) & (distance > 0.0)
    weight = np.divide(np.abs(cosine) * area.sum(), distance**2, where=faces, out=np.zeros(m))
    return Incoming(direction, distance, weight[:, None] * world.sent[target], target)


def points_on(world: PathWorld, prim: IndexArray, rng: Generator) -> tuple[FloatArray, FloatArray]:
    """Points uniform over primitives (m,), at time 0, and the unit normals there, a sphere's outwards; (m, 3) each."""
    m, count = len(prim), world.prims.triangle_count
    point, normal = np.empty((m, 3)), np.empty((m, 3))
    mesh = prim < count
    corners = world.prims.vertices[prim[mesh]]
    u, v = rng.random((2, len(corners), 1))
    over = u + v > 1.0  # the other half of the parallelogram
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    point[mesh] = (1.0 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    normal[mesh] = world.prims.n_geo[prim[mesh]]
    sphere = prim[~mesh] - count
    normal[~mesh] = uniform_sphere(len(sphere), rng)
    point[~mesh] = world.prims.centers[sphere] + world.prims.radii[sphere][:, None] * normal[~mesh]
    return point, normal


def _outside(world: PathWorld, prim: IndexArray, point: FloatArray) -> NDArray[np.bool_]:
    """(m,) of spheres: whether the point is outside; of triangles False."""
    if not len(world.prims.radii):
        return np.zeros(len(prim), np.bool_)
    sphere = np.maximum(prim - world.prims.triangle_count, 0)
    far = np.linalg.norm(point - world.prims.centers[sphere], axis=1) > world.prims.radii[sphere]
    return np.asarray(far & (prim >= world.prims.triangle_count))


def from_environment(environment: Environment, m: int, rng: Generator) -> Incoming:
    """Of one direction each, uniform over the sphere: Le 4 pi."""
    direction = uniform_sphere(m, rng)
    return Incoming(direction, np.full(m, np.inf), 4.0 * np.pi * radiance(environment, direction), _none(m))


def uniform_sphere(m: int, rng: Generator) -> FloatArray:
    """(m, 3) unit vectors, uniform."""
    v = rng.standard_normal((m, 3))
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))


def _none(m: int) -> IndexArray:
    return np.full(m, -1, np.int64)
