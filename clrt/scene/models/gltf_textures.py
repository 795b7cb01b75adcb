"""Pictures of a glTF file: images, samplers, and how textures are placed (Khronos, glTF 2.0, chapter 3.8; KHR_texture_transform)."""

from __future__ import annotations

import io
import math

import numpy as np

from clrt.scene.model import Picture, Texture
from clrt.scene.models.gltf_file import Document
from clrt.scene.models.gltf_json import Item
from clrt.scene.models.gltf_mesh import UvMap
from clrt.scene.picture import PictureError, read_picture

_WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_NEAREST = 9728


class Textures:
    """The textures that materials ask for, each kept once; `found` is what becomes `Scene.textures`."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._pictures: dict[int, Picture] = {}
        self._places: dict[tuple[int, str, bool, bool], int] = {}
        self.found: list[Texture] = []

    def add(self, info: Item, *, srgb: bool) -> int:
        """Place among `found` of the texture that a textureInfo names."""
        root = self._document.root
        texture = root.items("textures")[info.refer("index", root.items("textures"), "texture")]
        image = self._image(texture)
        sampler = Item({}, "")
        if texture.has("sampler"):
            sampler = root.items("samplers")[texture.refer("sampler", root.items("samplers"), "sampler")]
        wrap, linear = self._wrap(sampler), sampler.count("magFilter", 9729) != _NEAREST
        key = (image, wrap, linear, srgb)
        if key not in self._places:
            self._places[key] = len(self.found)
            self.found.append(Texture(self._picture(image), wrap, linear, srgb))
        return self._places[key]

    def _image(self, texture: Item) -> int:
        images = self._document.root.items("images")
        webp = texture.extension("EXT_texture_webp")
        if webp is not None and webp.has("source"):
            return webp.refer("source", images, "image")
        if not texture.has("source"):
            raise texture.fault("has no source that is read (PNG, JPEG, WebP); export the file with such pictures")
        return texture.refer("source", images, "image")

    def _wrap(self, sampler: Item) -> str:
        codes = [sampler.count(key, 10497) for key in ("wrapS", "wrapT")]
        for code in codes:
            if code not in _WRAPS:
                raise sampler.fault(f"the wrap mode {code} is none of glTF ({', '.join(map(str, _WRAPS))})")
        if codes[0] != codes[1]:
            self._document.notes.add(f"{sampler.path} wraps differently along u and v, which is not supported: along both as along u")
        return _WRAPS[codes[0]]

    def _picture(self, image: int) -> Picture:
        if image not in self._pictures:
            self._pictures[image] = self._read(self._document.root.items("images")[image])
        return self._pictures[image]

    def _read(self, image: Item) -> Picture:
        uri = image.text("uri")
        name = uri if uri and not uri.startswith("data:") else image.text("name", image.path)
        if image.has("uri"):
            data = self._document.bytes_of(image)
        else:
            data = self._document.view(image.refer("bufferView", self._document.root.items("bufferViews"), "buffer view"))[1]
        try:
            return read_picture(io.BytesIO(data), name)
        except PictureError as problem:
            raise image.fault(str(problem)) from None


def uv_map(info: Item) -> UvMap:
    """Where the texture of a textureInfo lies. Coordinates are scaled, then turned, then moved; a positive turn is counter-clockwise,
    seen with v down: (u, v) to (u cos + v sin, v cos - u sin)."""
    texcoord, matrix = info.count("texCoord"), np.eye(2, 3)
    transform = info.extension("KHR_texture_transform")
    if transform is not None:
        (du, dv), (su, sv) = transform.vector("offset", (0.0, 0.0)), transform.vector("scale", (1.0, 1.0))
        angle = transform.number("rotation", 0.0)
        cos, sin = math.cos(angle), math.sin(angle)
        matrix = np.array([[cos * su, sin * sv, du], [-sin * su, cos * sv, dv]])
        texcoord = transform.count("texCoord", texcoord)
    return UvMap(texcoord, matrix)
