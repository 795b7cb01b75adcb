"""Accessors of a glTF file as arrays: strides, normalised integers, sparse values (Khronos, glTF 2.0, chapter 3.6.2)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.scene.models.gltf_file import Document
from clrt.scene.models.gltf_json import Item, check_place

_COMPONENTS: dict[int, np.dtype[Any]] = {5120: np.dtype("i1"), 5121: np.dtype("u1"), 5122: np.dtype("<i2"), 5123: np.dtype("<u2"),
                                         5125: np.dtype("<u4"), 5126: np.dtype("<f4")}  # fmt: skip
_MOST_ZEROS = 1 << 24  #: elements of an accessor without data, of which there may be any number at no cost to the file
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def read_floats(document: Document, index: int, width: int, path: str) -> NDArray[np.float64]:
    """(n, width) float64, all finite; normalised integers as numbers from 0 (or -1) to 1. Raises ModelError."""
    item, values = _read(document, index, width, path)
    if values.dtype.kind != "f":
        return _plain(values, item.flag("normalized"))
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise item.fault(f"({path}) element {bad[0]} is {values[bad[0]].tolist()}, and {len(bad) - 1} more are not finite; "
                         "repair the mesh in the program that made it")  # fmt: skip
    return values.astype(np.float64)


def read_indices(document: Document, index: int, path: str) -> NDArray[np.int64]:
    """(n,) int64. Raises ModelError for numbers that are not whole."""
    item, values = _read(document, index, 1, path)
    if values.dtype.kind != "u":
        raise item.fault(f"({path}) indices are unsigned integers; found the componentType {item.value.get('componentType')}")
    return values[:, 0].astype(np.int64)


def _plain(values: NDArray[Any], normalised: bool) -> NDArray[np.float64]:
    numbers = values.astype(np.float64)
    return np.maximum(numbers / np.iinfo(values.dtype).max, -1.0) if normalised else numbers


def _read(document: Document, index: int, width: int, path: str) -> tuple[Item, NDArray[Any]]:
    """The accessor and its values, (n, width) of the file's own kind; `path` says what it is for."""
    accessors = document.root.items("accessors")
    item = accessors[check_place(index, len(accessors), "accessor", path)]
    found = _WIDTHS.get(item.text("type"), 0)
    if found != width:
        wanted = next(name for name, w in _WIDTHS.items() if w == width)
        raise item.fault(f"({path}) expected the type {wanted}, found {item.text('type', 'none')}")
    kind = _component(item)
    count = item.count("count")
    if item.has("bufferView"):
        values = _strided(document, item, "bufferView", item.count("byteOffset"), kind, count, width)
    elif count <= _MOST_ZEROS:
        values = np.zeros((count, width), kind)
    else:
        raise item.fault(f"has {count} elements and no bufferView; export the file again")
    if item.has("sparse"):
        values = _overwrite(document, values.copy(), item.item("sparse"))
    return item, values


def _component(item: Item) -> np.dtype[Any]:
    kind = _COMPONENTS.get(item.count("componentType"))
    if kind is None:
        raise item.fault(f"the componentType {item.count('componentType')} is none of glTF ({', '.join(map(str, _COMPONENTS))})")
    return kind


def _strided(document: Document, item: Item, key: str, offset: int, kind: np.dtype[Any], count: int, width: int) -> NDArray[Any]:
    """(count, width) out of a buffer view."""
    index = item.refer(key, document.root.items("bufferViews"), "buffer view")
    view, data = document.view(index)
    size = kind.itemsize * width
    stride = view.count("byteStride") or size
    if stride < size:
        raise view.fault(f"a byteStride of {stride} is less than the {size} bytes of an element")
    if count and offset + stride * (count - 1) + size > len(data):
        raise item.fault(f"{count} elements reach beyond the {len(data)} bytes of its buffer view {index}: the file is cut off or wrong")
    if not count:
        return np.zeros((0, width), kind)
    strided: NDArray[Any] = np.ndarray((count, width), kind, data, offset, (stride, kind.itemsize))
    return strided


def _overwrite(document: Document, values: NDArray[Any], sparse: Item) -> NDArray[Any]:
    """The values with those of a sparse accessor in their places."""
    count, where, what = sparse.count("count"), sparse.item("indices"), sparse.item("values")
    places = _strided(document, where, "bufferView", where.count("byteOffset"), _component(where), count, 1)[:, 0].astype(np.int64)
    if len(places) and int(places.max()) >= len(values):
        raise where.fault(f"asks for element {places.max()}, but there are {len(values)}; export the file again")
    values[places] = _strided(document, what, "bufferView", what.count("byteOffset"), values.dtype, count, values.shape[1])
    return values
