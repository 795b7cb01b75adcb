"""A scene as the reference of sampled light takes it: tables over primitives and materials, and what every step asks of them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from clrt.errors import SceneError
from clrt.reference import media
from clrt.reference.bounce import STACK_SIZE, MediumStack
from clrt.reference.expand import expanded
from clrt.reference.geometry import MaterialTable, Primitives
from clrt.reference.lines import TILE_BYTES
from clrt.reference.opacity import SceneCover
from clrt.reference.shade import Surface
from clrt.scene.model import Scene

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
Generator = np.random.Generator

LEAST_ALPHA = 1e-4  #: of facets; a surface is no smoother


@dataclass(frozen=True, eq=False)
class PathWorld:
    """What stays the same for all paths.

    motion : (n + k, 3) of each primitive, scene units a unit of time
    duals : (n, 2, 3) g1, g2 in the plane of each triangle, so that (p - v0) . g1 and (p - v0) . g2 are the barycentric weights of
        corners 1 and 2 of a point p of it; zero where the area is zero
    emission : (n + k, 3) radiance of each primitive; sent : (n + k, 3) that times its opacity; area : (n + k,) its area
    metal_rough, metallic, gloss, alpha : (materials,) alpha is that of the facets of metal-rough materials and of those with gloss
    rank, absorption : of objects, see media.ranks and media.absorption
    first : the media around the eye, as of one ray; cover : what primitives in the way of light keep of it
    """

    scene: Scene
    prims: Primitives
    materials: MaterialTable
    motion: FloatArray
    duals: FloatArray
    emission: FloatArray
    sent: FloatArray
    area: FloatArray
    metal_rough: BoolArray
    metallic: FloatArray
    gloss: FloatArray
    alpha: FloatArray
    rank: IndexArray
    absorption: FloatArray
    first: MediumStack
    cover: SceneCover

    @classmethod
    def of(cls, scene: Scene) -> PathWorld:
        """Raises SceneError for what has no one expectation (a clamp) or is not known here."""
        _check(scene)
        scene = expanded(scene)
        prims, materials = Primitives.build(scene), MaterialTable.build(scene)
        objects = sorted(scene.objects, key=lambda o: (o.first_prim, len(o)))
        still = np.zeros((len(scene.spheres), 3))
        motion = np.concatenate([*(np.broadcast_to(np.array(o.motion), (len(o), 3)) for o in objects), still])
        emission = np.array([m.emission for m in scene.materials], np.float64).reshape(-1, 3)[prims.material]
        part = np.array([m.opacity if m.opacity_seen else 1.0 for m in scene.materials])[prims.material]
        edges = prims.vertices[:, 1:] - prims.vertices[:, :1]
        area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2.0
        duals = np.where((area > 0.0)[:, None, None], np.swapaxes(np.linalg.pinv(edges), 1, 2), 0.0)
        rank = media.ranks(prims, materials)
        # Without depth no light goes through glass, and media are not followed.
        absorption = media.absorption(prims, materials) * (scene.depth > 0)
        metal_rough = np.array([m.metal_rough for m in scene.materials], np.bool_)
        metallic, gloss, roughness = (np.array([getattr(m, name) for m in scene.materials], np.float64)
                                      for name in ("metallic", "gloss", "roughness"))  # fmt: skip
        alpha = np.maximum(np.where(metal_rough, roughness, gloss) ** 2, LEAST_ALPHA)
        return cls(scene, prims, materials, motion, duals, emission, emission * part[:, None],
                   np.concatenate([area, 4.0 * np.pi * prims.radii**2]),
                   metal_rough, metallic, gloss, alpha, rank, absorption, _around_eye(scene, prims, materials, rank),
                   SceneCover.of(scene))  # fmt: skip

    @property
    def emitters(self) -> IndexArray:
        """Primitives that send out light."""
        return np.flatnonzero((self.emission > 0.0).any(axis=1) & (self.area > 0.0))

    @property
    def scatters(self) -> BoolArray:
        """(materials,) whether there is a lobe for indirect light."""
        phong = (self.materials.diffuse > 0.0) | (self.materials.specular > 0.0)
        return np.where(self.metal_rough, self.metallic < 1.0, phong)

    @property
    def walls_may_coincide(self) -> bool:
        """Whether there are several meshes of glass."""
        return int(np.count_nonzero(self.rank[: len(self.scene.objects)] >= 0)) > 1


def _check(scene: Scene) -> None:
    """Refuse what the reference cannot judge."""
    if scene.indirect is not None and np.isfinite(scene.indirect.clamp):
        raise SceneError("a clamp makes pictures that depend on how they are sampled; the reference takes scenes without one")
    for k, material in enumerate(scene.materials):
        if max(material.emission) > 0.0 and material.alpha_texture >= 0:
            raise SceneError(f"material {k} shines through a picture's alpha, which this reference does not know; leave it out")
        if material.emission_map >= 0 or material.metal_rough_map >= 0:
            raise SceneError(f"material {k} has a map that the reference of sampled light does not read; leave it out")


def _around_eye(scene: Scene, prims: Primitives, materials: MaterialTable, rank: IndexArray) -> MediumStack:
    stack, one = MediumStack.outside(1), np.ones(1, np.int64)
    if not (rank >= 0).any():
        return stack
    for k in media.around(prims, rank, np.asarray(scene.camera.eye, np.float64), TILE_BYTES)[-STACK_SIZE:]:
        material = prims.material[(prims.object_id == k) & (materials.refract[prims.material] > 0.0)].min()
        stack = stack.crossed(k * one, materials.ior[[material]], rank[[k]])
    return stack


@dataclass(frozen=True, eq=False)
class Wave:
    """m rays of one depth.

    origin, direction : (m, 3), the direction of unit length; own : (m,) primitive that the ray starts on, -1 for none
    tint : (m, 3) what a radiance that the ray meets is multiplied by on its way into the picture; path : (m,) whose it is
    time : (m,); stack : media around it
    drawn : (m,) the ray stands for a lobe that has been lit by light samples: emission and environment do not count again
    """

    origin: FloatArray
    direction: FloatArray
    own: IndexArray
    tint: FloatArray
    path: IndexArray
    time: FloatArray
    stack: MediumStack
    drawn: BoolArray

    def __len__(self) -> int:
        return len(self.path)

    def take(self, rows: IndexArray) -> Wave:
        return Wave(*(getattr(self, f.name)[rows] for f in fields(Wave)))

    def tinted(self, tint: FloatArray) -> Wave:
        """The same rays with another tint."""
        return replace(self, tint=tint)

    @classmethod
    def join(cls, waves: list[Wave]) -> Wave:
        """The rays of all, those of no tint left out."""
        kept = [w.take(np.flatnonzero(w.tint.any(axis=1))) for w in waves]
        stack = MediumStack(*(np.concatenate([getattr(w.stack, f.name) for w in kept]) for f in fields(MediumStack)))
        columns = {f.name: np.concatenate([getattr(w, f.name) for w in kept]) for f in fields(cls) if f.name != "stack"}
        return cls(stack=stack, **columns)


def surface_rows(surface: Surface, rows: IndexArray) -> Surface:
    """The surface at these hits alone."""
    return Surface(*(getattr(surface, f.name)[rows] for f in fields(Surface)))
