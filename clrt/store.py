"""Arrays kept on disk from one run to the next, by the hash of what they were made of.

A store is a folder of files that are written whole under another name and then renamed, so that any number of processes may read and
write at once. Each file ends with a hash of its bytes: one that was cut off or changed is removed and made again. When the files exceed the
bound, those that were not read for the longest are removed. Nothing here raises: a store that cannot be used keeps nothing.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    from _blake2 import blake2b  # as hashlib has it, which also loads OpenSSL
except ImportError:
    from hashlib import blake2b

Arrays = Mapping[str, NDArray[Any]]

_SUFFIX = ".arrays"
_ALIGN = 64  #: bytes: where each array begins, for devices that read it where it lies
_DIGEST_BYTES = 16
_STALE_S = 3600.0  #: an unfinished file this old belongs to a process that is gone
LIMIT = 1 << 30  #: bytes of all files
_SHARE = 4  #: an entry above this part of the bound is not kept: it would drive out too many others


def digest(*parts: bytes | memoryview) -> str:
    """The name of what is made of these parts, in this order; their lengths count, too."""
    state = blake2b(digest_size=20)
    for part in parts:
        state.update(len(part).to_bytes(8, "little") if isinstance(part, bytes) else part.nbytes.to_bytes(8, "little"))
        state.update(part)
    return state.hexdigest()


class Store:
    """Arrays by name in the files of `folder`, at most `limit` bytes in all."""

    def __init__(self, folder: Path, limit: int = LIMIT) -> None:
        self.folder, self.limit = folder, limit

    def get(self, key: str) -> dict[str, NDArray[Any]] | None:
        """The arrays kept under `key`, not to be written to; None where there are none, or their file is broken."""
        path = self.folder / (key + _SUFFIX)
        try:
            data = path.read_bytes()
        except OSError:
            return None
        found = _unpacked(data)
        with suppress(OSError):
            if found is None:
                path.unlink()
            else:
                os.utime(path)
        return found

    def put(self, key: str, arrays: Arrays) -> None:
        """Keeps contiguous arrays under `key`, and removes what was not used for the longest where there is no more room."""
        size = sum(array.nbytes for array in arrays.values())
        if size * _SHARE > self.limit:
            return
        part = self.folder / f"{os.urandom(8).hex()}.part"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            part.write_bytes(_packed(arrays))
            part.replace(self.folder / (key + _SUFFIX))
        except OSError:
            with suppress(OSError):
                part.unlink(missing_ok=True)
        self._trim()

    def _trim(self) -> None:
        """Removes the files least recently used until the others are within the bound, and what dead processes left."""
        entries = []
        with suppress(OSError), os.scandir(self.folder) as files:
            for file in files:
                with suppress(OSError):
                    entries.append((file.stat().st_mtime, file.stat().st_size, file.path))
        newest = max((time for time, _, _ in entries), default=0.0)
        total = 0
        for time, size, path in sorted(entries, reverse=True):
            unfinished = path.endswith(".part")
            total += 0 if unfinished else size
            if (unfinished and time < newest - _STALE_S) or (path.endswith(_SUFFIX) and total > self.limit):
                with suppress(OSError):
                    os.unlink(path)


def _packed(arrays: Arrays) -> bytes:
    """A line of JSON that tells what follows, the arrays, a hash of all before it."""
    head = json.dumps([[name, array.dtype.str, list(array.shape)] for name, array in arrays.items()]).encode()
    parts = [len(head).to_bytes(8, "little") + head]
    for array in arrays.values():
        parts += [bytes(-sum(map(len, parts)) % _ALIGN), array.tobytes()]
    text = b"".join(parts)
    return text + blake2b(text, digest_size=_DIGEST_BYTES).digest()


def _unpacked(data: bytes) -> dict[str, NDArray[Any]] | None:
    """What `_packed` was given, read only; None where the hash is another."""
    text = memoryview(data)[:-_DIGEST_BYTES]
    if blake2b(text, digest_size=_DIGEST_BYTES).digest() != data[-_DIGEST_BYTES:] or len(data) < _DIGEST_BYTES + 8:
        return None
    place = 8 + int.from_bytes(text[:8], "little")
    arrays = {}
    for name, dtype, shape in json.loads(bytes(text[8:place])):
        place += -place % _ALIGN
        count = int(np.prod(shape, dtype=np.int64))
        arrays[name] = np.frombuffer(text, np.dtype(dtype), count, place).reshape(shape)
        place += arrays[name].nbytes
    return arrays
