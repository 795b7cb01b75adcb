"""Small glTF files, made by hand for tests: arrays in a buffer, the JSON around them, both containers."""

from __future__ import annotations

import base64
import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from clrt.scene.build import load_scene
from clrt.scene.model import Material, Scene

KINDS = {"f4": 5126, "u4": 5125, "u2": 5123, "u1": 5121, "i2": 5122, "i1": 5120}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}

TRIANGLE = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0]], float)
QUAD = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
QUAD_ORDER = np.array([0, 1, 2, 0, 2, 3])
QUAD_UV = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)  #: v down: the picture stands upright


class Gltf:
    """A glTF file while it is put together; `root` is its JSON."""

    def __init__(self) -> None:
        self.root: dict[str, Any] = {"asset": {"version": "2.0"}}
        self.data = b""

    def list(self, key: str, item: dict[str, Any]) -> int:
        """Append to a list of the root; the place."""
        self.root.setdefault(key, []).append(item)
        return len(self.root[key]) - 1

    def view(self, data: bytes, **keys: Any) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        self.data += data
        return self.list("bufferViews", {"buffer": 0, "byteOffset": len(self.data) - len(data), "byteLength": len(data), **keys})

    def array(self, values: Any, kind: str = "f4", **keys: Any) -> int:
        """An accessor of an array (n,) or (n, width)."""
        rows = np.atleast_2d(np.asarray(values).T).T
        view = self.view(rows.astype(f"<{kind}").tobytes())
        item = {"bufferView": view, "componentType": KINDS[kind], "count": len(rows), "type": TYPES[rows.shape[1]], **keys}
        return self.list("accessors", item)

    def mesh(self, points: Any, order: Any = None, uv: Any = None, normals: Any = None, **primitive: Any) -> int:
        attributes = {"POSITION": self.array(points)}
        attributes |= {} if uv is None else {"TEXCOORD_0": self.array(uv)}
        attributes |= {} if normals is None else {"NORMAL": self.array(normals)}
        given = {"attributes": attributes, **primitive}
        if order is not None:
            given["indices"] = self.array(order, "u2")
        return self.list("meshes", {"primitives": [given]})

    def node(self, **keys: Any) -> int:
        """A node, which also becomes a root of the scene; take it out of `root["scenes"]` to make it a child."""
        place = self.list("nodes", keys)
        scenes = self.root.setdefault("scenes", [{"nodes": []}])
        scenes[0]["nodes"].append(place)
        return place

    def picture(self, texels: Any, **texture: Any) -> int:
        """A texture of texels (h, w, 3 or 4) uint8."""
        stream = io.BytesIO()
        Image.fromarray(np.asarray(texels, np.uint8)).save(stream, "PNG")
        image = self.list("images", {"bufferView": self.view(stream.getvalue()), "mimeType": "image/png"})
        return self.list("textures", {"source": image, **texture})

    def glb(self) -> bytes:
        if self.data:
            self.root["buffers"] = [{"byteLength": len(self.data)}]
        return glb(json.dumps(self.root).encode(), self.data)

    def gltf(self, uri: str | None = None) -> str:
        """The text form; the buffer within, or in a file of the name `uri`."""
        inside = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        self.root["buffers"] = [{"byteLength": len(self.data), "uri": uri or inside}]
        return json.dumps(self.root, indent=1)


def glb(text: bytes, chunk: bytes) -> bytes:
    """A GLB of JSON and buffer."""
    text += b" " * (-len(text) % 4)
    chunk += b"\0" * (-len(chunk) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", len(chunk), b"BIN\0") + chunk if chunk else b""
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def triangle(**node: Any) -> Gltf:
    """One triangle at z = 0."""
    made = Gltf()
    made.node(mesh=made.mesh(TRIANGLE), **node)
    return made


def quad(material: dict[str, Any] | None = None, **node: Any) -> Gltf:
    """A square of side 2 at z = 0 with a picture's coordinates, and a material."""
    made = Gltf()
    keys = {} if material is None else {"material": made.list("materials", material)}
    made.node(mesh=made.mesh(QUAD, QUAD_ORDER, QUAD_UV, **keys), **node)
    return made


def loaded(tmp_path: Path, made: Gltf, **keys: Any) -> Scene:
    """The scene that a file is read as."""
    path = tmp_path / "model.glb"
    path.write_bytes(made.glb())
    return load_scene(path, **keys)


def material(tmp_path: Path, given: dict[str, Any]) -> Material:
    """What a material of a file is read as."""
    return loaded(tmp_path, quad(given)).materials[0]
