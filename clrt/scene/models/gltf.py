"""glTF and GLB: the scene of a file as a Model (Khronos, glTF 2.0; KHR_lights_punctual)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from clrt.scene.model import FloatArray, PointLight, SpotLight, SunLight
from clrt.scene.models.gltf_file import Document, open_document
from clrt.scene.models.gltf_json import Item
from clrt.scene.models.gltf_materials import read_materials
from clrt.scene.models.gltf_mesh import read_mesh
from clrt.scene.models.gltf_nodes import corner_order, normal_matrix, placed_nodes
from clrt.scene.models.model_file import Model, ModelError, Part, View
from clrt.scene.picture import Folders
from clrt.scene.words.instances import MOST_SCALE

_SAME_SCALE = 1e-6  #: relative difference of scales that counts as none: quaternions in files are rounded to float32


def read_gltf(data: bytes, folders: Folders) -> Model:
    """What a file's scene shows. folders : where the files that it names may be. Raises ModelError."""
    document = open_document(data, folders)
    materials = read_materials(document)
    apart = [material.refract > 0.0 for material in materials.materials]
    meshes, standing = document.root.items("meshes"), dict[int, list[tuple[str, FloatArray]]]()
    placed = _Placed(document)
    for node, world_from_node in placed_nodes(document):
        if node.has("mesh"):
            standing.setdefault(node.refer("mesh", meshes, "mesh"), []).append((node.text("name"), world_from_node))
        placed.add(node, world_from_node)
    parts: list[Part] = []
    for index, places in standing.items():
        for part in read_mesh(document, meshes[index], materials.placing, apart):
            parts += _standing(part, places)
    if not parts:
        raise ModelError("has no faces; there is nothing to render (no mesh with triangles stands in its scene)")
    _note_unread(document)
    return Model(
        tuple(parts), materials.materials, materials.textures, tuple(placed.views), tuple(placed.lights), tuple(placed.spots),
        tuple(placed.suns), tuple(document.notes.told),
    )  # fmt: skip


def _standing(part: Part, places: list[tuple[str, FloatArray]]) -> list[Part]:
    """The part where nodes put it: kept once, with its copies, where several do by turns, shifts and scales; else each for itself."""
    copies = tuple(matrix for _, matrix in places if _makes_copies(part, matrix[:3, :3]))
    if len(copies) < 2:
        return [moved(part, matrix, name or part.name) for name, matrix in places]
    others = [(name, matrix) for name, matrix in places if not _makes_copies(part, matrix[:3, :3])]
    return [replace(part, copies=copies), *(moved(part, matrix, name or part.name) for name, matrix in others)]


def _makes_copies(part: Part, linear: FloatArray) -> bool:
    """Whether an Instance may have this transform: no mirror, no extreme scale, one for all axes where there are normals at corners."""
    scales = np.linalg.svd(linear, compute_uv=False)
    even = part.normals is None or scales.max() <= scales.min() * (1.0 + _SAME_SCALE)
    return bool(even and scales.min() >= 1.0 / MOST_SCALE and scales.max() <= MOST_SCALE and np.linalg.det(linear) > 0.0)


def moved(part: Part, world_from_part: FloatArray, name: str) -> Part:
    """The part where its node puts it."""
    linear = world_from_part[:3, :3]
    order = corner_order(linear)
    vertices = part.vertices[:, order] @ linear.T + world_from_part[:3, 3]
    normals = None if part.normals is None else part.normals[:, order] @ normal_matrix(linear).T
    return replace(part, vertices=vertices, normals=normals, uvs=None if part.uvs is None else part.uvs[:, order], name=name)


def _note_unread(document: Document) -> None:
    for key, what in (("animations", "animations: the scene is shown at rest"), ("skins", "skins: meshes are shown at rest")):
        if document.root.items(key):
            document.notes.add(f"left out, not supported: {what}")


class _Placed:
    """Cameras and lights, as nodes bring them."""

    def __init__(self, document: Document) -> None:
        self._document = document
        punctual = document.root.extension("KHR_lights_punctual")
        self._lights = punctual.items("lights") if punctual is not None else []
        self._cameras = document.root.items("cameras")
        self.views: list[View | None] = []
        self.lights: list[PointLight] = []
        self.spots: list[SpotLight] = []
        self.suns: list[SunLight] = []

    def add(self, node: Item, world_from_node: FloatArray) -> None:
        if node.has("camera"):
            camera = self._cameras[node.refer("camera", self._cameras, "camera")]
            self.views.append(self._view(camera, world_from_node, node.text("name", camera.text("name", camera.path))))
        light = node.extension("KHR_lights_punctual")
        if light is not None:
            self._light(self._lights[light.refer("light", self._lights, "light")], world_from_node)

    def _view(self, camera: Item, world_from_node: FloatArray, name: str) -> View | None:
        if camera.text("type") != "perspective":
            self._document.notes.add(f'left out, not supported: the orthographic camera "{name}"')
            return None
        lens = camera.item("perspective")
        yfov = lens.number("yfov", 0.0, 0.0, math.pi)
        if not 0.0 < yfov < math.pi:
            raise lens.fault(f"the yfov {yfov:g} is none; it lies between 0 and pi radians")
        return View(world_from_node, yfov, lens.number("aspectRatio", 0.0, 0.0), name)

    def _light(self, light: Item, world_from_node: FloatArray) -> None:
        """Intensities are lux (directional) and candela: an irradiance of E is ours of a light of colour E / pi, of I / d^2 of I / pi."""
        intensity = light.number("intensity", 1.0, 0.0) / math.pi
        red, green, blue = (intensity * channel for channel in light.vector("color", (1.0, 1.0, 1.0), 0.0))
        x, y, z = world_from_node[:3, 3].tolist()
        kind = light.text("type")
        if light.has("range"):
            self._document.notes.add("left out, not supported: the range of lights, beyond which they would end")
        if kind == "point":
            self.lights.append(PointLight((x, y, z), (red, green, blue), falloff=True))
            return
        back = world_from_node[:3, 2]
        length = float(np.linalg.norm(back))
        if not length > 0.0:
            raise light.fault("stands in a node without a direction: its scale is zero")
        bx, by, bz = (back / length).tolist()
        if kind == "directional":
            self.suns.append(SunLight((bx, by, bz), (red, green, blue)))
        elif kind == "spot":
            cone = light.item("spot")
            outer = cone.number("outerConeAngle", math.pi / 4.0, 0.0, math.pi / 2.0)
            inner = min(cone.number("innerConeAngle", 0.0, 0.0, math.pi / 2.0), outer)
            self.spots.append(SpotLight((x, y, z), (0.0 - bx, 0.0 - by, 0.0 - bz), outer, inner, (red, green, blue), falloff=True))
        else:
            raise light.fault(f'the type "{kind}" is none of KHR_lights_punctual (directional, point, spot)')
