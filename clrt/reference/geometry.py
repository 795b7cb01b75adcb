"""A scene's primitives side by side, in the order of their ids, and what every step of the reference asks of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clrt.errors import SceneError
from clrt.reference.lines import EdgeTable
from clrt.scene.model import Scene

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class MaterialTable:
    """Materials as columns, indexed by material id: color, absorb (k, 3), the others (k,); fresnel is 1 where it holds, or 0."""

    color: FloatArray
    ambient: FloatArray
    diffuse: FloatArray
    specular: FloatArray
    exponent: FloatArray
    reflect: FloatArray
    refract: FloatArray
    ior: FloatArray
    fresnel: FloatArray
    absorb: FloatArray

    @classmethod
    def build(cls, scene: Scene) -> MaterialTable:
        columns = [np.array([getattr(m, name) for m in scene.materials], np.float64)
                   for name in ("ambient", "diffuse", "specular", "exponent", "reflect", "refract", "ior",
                                "fresnel", "absorb")]  # fmt: skip
        table = cls(np.array([m.color for m in scene.materials], np.float64).reshape(-1, 3), *columns)
        bad = np.flatnonzero((table.refract > 0.0) & ~(table.ior > 0.0))
        if len(bad):
            raise SceneError(f"material {bad[0]} refracts with the index {table.ior[bad[0]]:g}; give it an index above 0")
        return table


@dataclass(frozen=True, eq=False)
class Primitives:
    """n triangles and k spheres; arrays of length n + k are indexed by primitive id.

    vertices : (n, 3, 3); n_geo : (n, 3) unit normal of the given orientation, zero where the area is zero
    corner_normals : (n, 3, 3) unit shading normals, the face's thrice where the object is not smooth
    centers : (k, 3); radii : (k,)
    material : (n + k,); object_id : (n + k,) what the stack of dielectrics holds: mesh objects first, then spheres
    curvature : (n + k,) 1 / length: how fast the shading normal turns along the surface (0: flat)
    curved : (n + k,) bool, a triangle whose corners' normals are not all the face's own
    uvs : (n, 3, 2) texture coordinates of the corners, 0 where there are none; textured : (n + k,) bool
    largest : no coordinate of a triangle or of the eye is greater
    """

    vertices: FloatArray
    n_geo: FloatArray
    corner_normals: FloatArray
    centers: FloatArray
    radii: FloatArray
    material: IndexArray
    object_id: IndexArray
    curvature: FloatArray
    curved: BoolArray
    uvs: FloatArray
    textured: BoolArray
    largest: float
    edges: EdgeTable

    @classmethod
    def build(cls, scene: Scene) -> Primitives:
        """Raises SceneError where the ids of the objects' triangles are not 0, 1, 2, ..., each once."""
        objects = sorted(scene.objects, key=lambda o: (o.first_prim, len(o)))
        count = 0
        for mesh in objects:
            if mesh.first_prim != count:
                raise SceneError(f"{mesh.name} begins at primitive {mesh.first_prim}, not {count}; number triangles without gaps")
            count += len(mesh)
        ids = {id(mesh): k for k, mesh in enumerate(scene.objects)}
        empty = np.zeros((0, 3, 3))
        vertices = np.concatenate([empty, *(o.vertices for o in objects)])
        corner = np.concatenate([empty, *(np.repeat(o.normals[:, None], 3, axis=1) if o.vertex_normals is None else o.vertex_normals
                                          for o in objects)])  # fmt: skip
        own = np.concatenate([np.zeros((0, 3)), *(o.normals for o in objects)])
        spheres = scene.spheres
        curved = np.concatenate([(corner != own[:, None]).any(axis=(1, 2)), np.zeros(len(spheres), np.bool_)])
        material = np.concatenate([*(o.material_ids for o in objects), spheres.material_ids]).astype(np.int64)
        object_id = np.concatenate([*(np.full(len(o), ids[id(o)]) for o in objects), len(objects) + np.arange(len(spheres))])
        largest = float(np.abs(np.concatenate([vertices.reshape(-1, 3), scene.camera.eye[None]])).max())
        uvs = np.concatenate([np.zeros((0, 3, 2)), *(np.zeros((len(o), 3, 2)) if o.uvs is None else o.uvs for o in objects)])
        textured = np.array([max(m.texture, m.normal_map) >= 0 for m in scene.materials], np.bool_)[material]
        curvature = np.concatenate([_curvature(vertices, corner), 1.0 / spheres.radii])
        return cls(vertices, _face_normals(vertices), corner, spheres.centers, spheres.radii, material, object_id.astype(np.int64),
                   curvature, curved, uvs, textured, largest, EdgeTable.build(vertices, largest))  # fmt: skip

    @property
    def triangle_count(self) -> int:
        return len(self.vertices)

    def same_look(self, p: IndexArray, q: IndexArray) -> BoolArray:
        """(k,) bool: flat triangles of one plain material and one normal (either sign), so that it makes no difference which is seen."""
        flat = (np.maximum(p, q) < self.triangle_count) & (self.curvature[p] == 0.0) & (self.curvature[q] == 0.0)
        same: BoolArray = flat & (self.material[p] == self.material[q]) & ~self.textured[p]
        rows = np.flatnonzero(same)
        n_p, n_q = self.corner_normals[p[rows], 0], self.corner_normals[q[rows], 0]
        same[rows] = np.abs(np.einsum("ki,ki->k", n_p, n_q)) > 1.0 - 1e-12
        return same


def _face_normals(vertices: FloatArray) -> FloatArray:
    """Unit (v1 - v0) x (v2 - v0); edges are scaled first, so that tiny triangles keep theirs."""
    e1, e2 = vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0]
    normal = np.cross(_scaled(e1), _scaled(e2))
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    unit: FloatArray = np.divide(normal, length, where=length > 0.0, out=np.zeros_like(normal))
    return unit


def _scaled(e: FloatArray) -> FloatArray:
    size = np.abs(e).max(axis=1, keepdims=True)
    scaled: FloatArray = np.divide(e, size, where=size > 0.0, out=np.zeros_like(e))
    return scaled


def _curvature(vertices: FloatArray, corner: FloatArray) -> FloatArray:
    """(n,) the greatest difference of two corner normals over the length of the edge between them."""
    turn = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)
    length = np.linalg.norm(vertices - np.roll(vertices, 1, axis=1), axis=2)
    rate: FloatArray = np.divide(turn, length, where=length > 0.0, out=np.zeros_like(turn)).max(axis=1, initial=0.0)
    return rate
