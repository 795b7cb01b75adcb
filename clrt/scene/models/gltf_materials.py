"""Materials of a glTF file as the model's (Khronos, glTF 2.0, chapter 3.9, and the extensions that gltf_file.SUPPORTED lists)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from clrt.scene.model import Material, Texture
from clrt.scene.models.gltf_file import Document
from clrt.scene.models.gltf_json import Item
from clrt.scene.models.gltf_mesh import UvMap
from clrt.scene.models.gltf_textures import Textures, uv_map

_GLASS = 1.5  #: index of refraction that glTF takes for granted
_BLACKEST = 1e-6  #: of an attenuation colour: nothing is left after 14 times its distance, as good as nothing after 1


@dataclass(frozen=True, eq=False)
class GltfMaterials:
    """The file's materials: `placing` says where the pictures of each lie."""

    materials: tuple[Material, ...]
    placing: tuple[UvMap | None, ...]
    textures: tuple[Texture, ...]


def default_material() -> Material:
    """What a primitive without a material has: white, metallic and rough 1 (chapter 3.9.6)."""
    return Material((1.0, 1.0, 1.0), 0.0, 1.0, 0.0, 1.0, metal_rough=True, metallic=1.0, roughness=1.0)


def read_materials(document: Document) -> GltfMaterials:
    """All materials and the pictures that they ask for. Raises ModelError."""
    textures = Textures(document)
    found = [_Reader(document, item, textures) for item in document.root.items("materials")]
    materials = tuple(reader.read() for reader in found)
    return GltfMaterials(materials, tuple(reader.placing() for reader in found), tuple(textures.found))


class _Reader:
    """One material."""

    def __init__(self, document: Document, item: Item, textures: Textures) -> None:
        self._notes, self._item, self._textures = document.notes, item, textures
        self._maps: list[tuple[str, UvMap]] = []
        self._name = item.text("name", item.path)

    def read(self) -> Material:
        item, base = self._item, self._item.item("pbrMetallicRoughness")
        red, green, blue, alpha = base.vector("baseColorFactor", (1.0, 1.0, 1.0, 1.0), 0.0)
        mode = item.text("alphaMode", "OPAQUE")
        if mode not in ("OPAQUE", "MASK", "BLEND"):
            raise item.fault(f'the alphaMode "{mode}" is none of glTF (OPAQUE, MASK, BLEND)')
        material = replace(
            default_material(), color=(red, green, blue),
            metallic=base.number("metallicFactor", 1.0, 0.0, 1.0), roughness=base.number("roughnessFactor", 1.0, 0.0, 1.0),
            texture=self._map(base, "baseColorTexture", srgb=True), alpha=mode != "OPAQUE" and base.has("baseColorTexture"),
            metal_rough_map=self._map(base, "metallicRoughnessTexture"),
        )  # fmt: skip
        material = self._opacity(material, mode, alpha)
        material = self._normals(material)
        material = self._emission(material)
        if item.has("occlusionTexture"):
            self._notes.add("left out, not supported: occlusion maps; light that is blocked is computed")
        if item.extension("KHR_materials_unlit") is not None:
            return replace(material, metal_rough=False, ambient=1.0, diffuse=0.0)
        return self._transmission(material)

    def placing(self) -> UvMap | None:
        """Where the pictures lie: as the first of them; others have to lie there, too."""
        if not self._maps:
            return None
        first = self._maps[0][1]
        for key, other in self._maps[1:]:
            if other.texcoord != first.texcoord or not np.array_equal(other.matrix, first.matrix):
                self._notes.add(f"{self._name}: not supported: its {key} lies elsewhere than its {self._maps[0][0]}; it is put there, too")
        return first

    def _map(self, item: Item, key: str, *, srgb: bool = False) -> int:
        if not item.has(key):
            return -1
        info = item.item(key)
        self._maps.append((key, uv_map(info)))
        return self._textures.add(info, srgb=srgb)

    def _opacity(self, material: Material, mode: str, alpha: float) -> Material:
        """BLEND: the factor times the picture's alpha. MASK: nothing or all of it, as factor times alpha is below the cutoff or not."""
        if mode == "OPAQUE":
            return material
        if mode == "BLEND":
            return replace(material, opacity=min(alpha, 1.0))
        cutoff = self._item.number("alphaCutoff", 0.5, 0.0)
        if alpha < cutoff:
            return replace(material, opacity=0.0, alpha=False)
        return replace(material, alpha_cutoff=cutoff / alpha if material.alpha and alpha > 0.0 else 0.0)

    def _normals(self, material: Material) -> Material:
        place = self._map(self._item, "normalTexture")
        strength = self._item.item("normalTexture").number("scale", 1.0)
        return replace(material, normal_map=place, normal_strength=strength if place >= 0 else 1.0)

    def _emission(self, material: Material) -> Material:
        """In candela per square metre, as lights are in candela and lux: see docs/models.md for what that is in a picture."""
        factor = self._item.vector("emissiveFactor", (0.0, 0.0, 0.0), 0.0)
        strong = self._item.extension("KHR_materials_emissive_strength")
        strength = strong.number("emissiveStrength", 1.0, 0.0) if strong is not None else 1.0
        if not any(factor) or not strength:
            return material
        red, green, blue = (strength * channel for channel in factor)
        return replace(material, emission=(red, green, blue), emission_map=self._map(self._item, "emissiveTexture", srgb=True))

    def _transmission(self, material: Material) -> Material:
        """Glass: what is let through refracts by Fresnel's equations, blurred by the roughness; the rest is a diffuse base colour."""
        through = self._item.extension("KHR_materials_transmission")
        part = through.number("transmissionFactor", 0.0, 0.0, 1.0) * (1.0 - material.metallic) if through is not None else 0.0
        if through is None or not part > 0.0:
            return material
        if through.has("transmissionTexture"):
            self._notes.add(f"{self._name}: left out, not supported: a picture of what lets light through")
        index = self._item.extension("KHR_materials_ior")
        ior = index.number("ior", _GLASS, 0.0) if index is not None else _GLASS
        if material.color != (1.0, 1.0, 1.0) or material.texture >= 0:
            self._notes.add(f"{self._name}: the base colour does not tint what is seen through it (KHR_materials_volume does)")
        return replace(
            material, metal_rough=False, diffuse=1.0 - part, refract=part, ior=max(ior, 1.0), fresnel=True, gloss=material.roughness,
            absorb=self._absorption(),
        )  # fmt: skip

    def _absorption(self) -> tuple[float, float, float]:
        """Of `attenuationColor` is left after `attenuationDistance`: exp(-absorb * distance)."""
        volume = self._item.extension("KHR_materials_volume")
        if volume is None or not volume.number("thicknessFactor", 0.0, 0.0) > 0.0:
            self._notes.add(f"{self._name}: thin glass is not supported: it is taken as the surface of solid glass")
            return 0.0, 0.0, 0.0
        distance = volume.number("attenuationDistance", math.inf, 0.0)
        colour = volume.vector("attenuationColor", (1.0, 1.0, 1.0), 0.0, 1.0)
        red, green, blue = (0.0 - math.log(max(channel, _BLACKEST)) / distance if distance > 0.0 else 0.0 for channel in colour)
        return red, green, blue
