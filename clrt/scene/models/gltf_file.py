"""The container of a glTF file: text or GLB, its JSON, its buffers wherever they lie (Khronos, glTF 2.0, chapters 3.6 and 4)."""

from __future__ import annotations

import base64
import binascii
import re
import struct
from dataclasses import dataclass, field
from urllib.parse import unquote

from clrt.scene.models.gltf_json import Item, parse
from clrt.scene.models.model_file import ModelError, Notes
from clrt.scene.picture import Folders, PictureError

_MAGIC, _JSON, _BIN = b"glTF", b"JSON", b"BIN\0"
_DATA_URI = re.compile(r"data:([^,;]*)((?:;[^,;]*)*),", re.IGNORECASE)

#: extensions that are read
SUPPORTED = frozenset((
    "EXT_texture_webp", "KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_transmission",
    "KHR_materials_unlit", "KHR_materials_volume", "KHR_mesh_quantization", "KHR_texture_transform",
))  # fmt: skip


@dataclass(eq=False)
class Document:
    """A glTF file: the root of its JSON, and where its bytes are.

    chunk : the binary chunk of a GLB, None where there is none
    folders : where the files that it names may be
    """

    root: Item
    chunk: bytes | None
    folders: Folders
    notes: Notes = field(default_factory=Notes)
    _buffers: dict[int, bytes] = field(default_factory=dict)

    def view(self, index: int) -> tuple[Item, bytes]:
        """A buffer view and its bytes."""
        views = self.root.items("bufferViews")
        item = views[index]
        buffer = item.refer("buffer", self.root.items("buffers"), "buffer")
        data, start, length = self._buffer(buffer), item.count("byteOffset"), item.count("byteLength")
        if start + length > len(data):
            raise item.fault(f"reaches to byte {start + length} of buffer {buffer}, which has {len(data)}: the file is cut off or wrong")
        return item, data[start : start + length]

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            item = self.root.items("buffers")[index]
            data = self.bytes_of(item) if item.has("uri") else self._own_chunk(item, index)
            told = item.count("byteLength")
            if len(data) < told:
                raise item.fault(f"should have {told} bytes, but only {len(data)} are there: the file is cut off")
            self._buffers[index] = data[:told]
        return self._buffers[index]

    def _own_chunk(self, item: Item, index: int) -> bytes:
        if index or self.chunk is None:
            raise item.fault("has no uri, and there is no binary chunk that it could be; export the file again")
        return self.chunk

    def bytes_of(self, item: Item) -> bytes:
        """What the `uri` of a buffer or an image stands for: data within, or a file beside."""
        uri = item.text("uri")
        head = _DATA_URI.match(uri)
        try:
            if head is None:
                return self.folders.find(unquote(uri)).read_bytes()
            rest = uri[head.end() :]
            return base64.b64decode(rest, validate=True) if ";base64" in head[2].lower() else unquote(rest).encode("latin-1")
        except (binascii.Error, ValueError) as problem:
            raise item.fault(f"its data is no base64 text ({problem}); export the file again") from None
        except (PictureError, OSError) as problem:
            raise item.fault(str(problem)) from None


def open_document(data: bytes, folders: Folders) -> Document:
    """Check the container and the JSON of a file's bytes. Raises ModelError."""
    binary = data[:4] == _MAGIC
    text, chunk = _chunks(data) if binary else (data, None)
    root = parse(text, "the JSON chunk" if binary else "the JSON text")
    document = Document(root, chunk, folders)
    asset = root.item("asset")
    version = asset.text("minVersion", asset.text("version", "none"))
    if not re.fullmatch(r"2\.\d+", version):
        raise ModelError(f"is glTF of version {version}; version 2.0 is read: export the file again")
    missing = [name for name in root.texts("extensionsRequired") if name not in SUPPORTED]
    if missing:
        raise ModelError(f"requires {', '.join(missing)}, which clrt does not read; export the file without")
    unread = sorted(set(root.texts("extensionsUsed")) - SUPPORTED)
    if unread:
        document.notes.add(f"left out, not supported: the extension{'s' if len(unread) > 1 else ''} {', '.join(unread)}")
    return document


def _chunks(data: bytes) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk of a GLB."""
    if len(data) < 20:
        raise ModelError(f"is a GLB of {len(data)} bytes, fewer than its header has: the file is cut off; export it again")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise ModelError(f"is a GLB of version {version}; version 2 is read: export the file again")
    if length > len(data):
        raise ModelError(f"its header tells of {length} bytes, only {len(data)} are there: the file is cut off; export it again")
    found: list[tuple[bytes, bytes]] = []
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, at)
        if at + 8 + size > length:
            raise ModelError(f"a chunk of {size} bytes does not fit into its {length}: the file is cut off; export it again")
        found.append((kind, data[at + 8 : at + 8 + size]))
        at += 8 + size
    if not found or found[0][0] != _JSON:
        raise ModelError("does not begin with a JSON chunk; is this a GLB file?")
    return found[0][1], next((chunk for kind, chunk in found[1:] if kind == _BIN), None)
