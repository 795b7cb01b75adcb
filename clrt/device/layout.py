"""One NumPy dtype a struct, and the C text made from it: the two cannot drift apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

_C_NAMES = {
    np.dtype(np.int16): "short", np.dtype(np.int32): "int", np.dtype(np.int64): "long", np.dtype(np.float64): "double",
    np.dtype(np.float32): "float",
}  # fmt: skip

BOXES = 16  #: entries of leaves whose boxes are compared at once

Field = tuple[str, Any] | tuple[str, Any, int | tuple[int, ...]]


def struct_dtype(fields: Sequence[Field]) -> np.dtype[np.void]:
    """An aligned struct as C lays it out. An empty one gets a member, since C has no empty structs."""
    return np.dtype(list(fields) or [("unused", np.int32)], align=True)


def c_struct(name: str, dtype: np.dtype[np.void]) -> str:
    """The C definition of `dtype`, member by member; NumPy's aligned layout is that of C."""
    lines = []
    for member in dtype.names or ():
        kind = dtype.fields[member][0]  # type: ignore[index]
        base, shape = (kind.base, kind.shape)
        lines.append(f"    {_C_NAMES[base]} {member}{''.join(f'[{n}]' for n in shape)};")
    return "typedef struct {\n" + "\n".join(lines) + f"\n}} {name};\n"


def triangle(real: type) -> np.dtype[np.void]:
    """A triangle for rays of any origin: relative to the local origin, with the bounds of triangle.cl. Its normal is scaled by a power of
    two; `area` is what smooth.cl divides by. 64 bytes in float32.
    """
    vector: Any = (real, (3,))
    return struct_dtype([("v0", *vector), ("e1", *vector), ("e2", *vector), ("normal", *vector), ("bound", real), ("normal_bound", real),
                         ("area", real), ("unused", real)])  # fmt: skip


def edge_planes(real: type) -> np.dtype[np.void]:
    """A triangle for rays of one shared origin: planes through it and each edge. 64 bytes in float32."""
    vector: Any = (real, (3,))
    return struct_dtype([("u", *vector), ("v", *vector), ("w", *vector), ("normal", *vector), ("offset", real), ("bound", real),
                         ("normal_bound", real), ("t_bound", real)])  # fmt: skip


def parallel_planes(real: type) -> np.dtype[np.void]:
    """A triangle for rays of one shared direction: normals and constants of the planes through each edge along it. 64 bytes in float32."""
    plane: Any = (real, (4,))
    return struct_dtype([("u", *plane), ("v", *plane), ("w", *plane), ("bound", real), ("unused", real, (3,))])


def direction_boxes() -> np.dtype[np.void]:
    """Bounds of the directions in which BOXES triangles, or records of such, lie from a shared origin, in steps (directions.cl); how near
    they are; slots, or numbers of records. 320 bytes.
    """
    return struct_dtype([("lo", np.int16, (3, BOXES)), ("hi", np.int16, (3, BOXES)), ("near", np.float32, (BOXES,)),
                         ("item", np.int32, (BOXES,))])  # fmt: skip


def object_record(real: type) -> np.dtype[np.void]:
    """An object's box and the node its tree starts at; `extent` bounds |x| + |y| + |z| of its points plus its longest edge."""
    return struct_dtype([("lo", real, (3,)), ("hi", real, (3,)), ("extent", real), ("root", np.int32)])


def surface(real: type) -> np.dtype[np.void]:
    """What shading asks of a triangle: unit normals (of the surface, for shading), material, object, primitive id."""
    return struct_dtype(
        [("geometric", real, (3,)), ("normal", real, (3,)), ("material", np.int32), ("object", np.int32), ("prim", np.int32)]
    )


def material(real: type, extra: Sequence[Field]) -> np.dtype[np.void]:
    """A material: the members every scene needs, then those of the effects it calls for."""
    return struct_dtype([("color", real, (3,)), ("ambient", real), ("diffuse", real), ("specular", real), ("exponent", real), *extra])


def frame(real: type, extra: Sequence[Field]) -> np.dtype[np.void]:
    """What is one for the whole picture: camera, sizes, background; the material of all triangles, or -1; then the members of effects."""
    vector: Any = (real, (3,))
    return struct_dtype([
        ("eye", np.float64, (3,)), ("local_origin", np.float64, (3,)), ("eye_local", *vector), ("corner", *vector), ("along_row", *vector),
        ("along_column", *vector), ("twist", *vector), ("background", *vector), ("extent", real), ("width", np.int32), ("height", np.int32),
        ("object_count", np.int32), ("triangle_slots", np.int32), ("only_material", np.int32), *extra,
    ])  # fmt: skip


def light(real: type, extra: Sequence[Field] = ()) -> np.dtype[np.void]:
    """A point light: where it is as given, and relative to the local origin; then the members of effects."""
    return struct_dtype([("given", np.float64, (3,)), ("position", real, (3,)), ("color", real, (3,)), *extra])


def sun(real: type) -> np.dtype[np.void]:
    """A light infinitely far away: the unit vector to it."""
    return struct_dtype([("direction", real, (3,)), ("color", real, (3,))])


def emitter(real: type) -> np.dtype[np.void]:
    """What shines, relative to the local origin: a triangle, or a sphere about `corner` where there is a radius."""
    vector: Any = (real, (3,))
    return struct_dtype([("corner", *vector), ("e1", *vector), ("e2", *vector), ("normal", *vector), ("radiance", *vector),
                         ("luminance", real), ("area", real), ("sum", real), ("radius", real), ("bound", real)])  # fmt: skip


def environment_row(real: type) -> np.dtype[np.void]:
    """A row of the environment: cosines of its edges, the chance of a cell per word of its own, its first word, its cells up to
    the last lit.
    """
    return struct_dtype([("top", np.float64), ("bottom", np.float64), ("density", real), ("begin", np.int32), ("lit", np.int32)])


def placement(real: type) -> np.dtype[np.void]:
    """An object seen through a transform (placed.cl): rows of it; the greatest that it stretches a vector by; which object; its medium."""
    return struct_dtype([("object_from_world", np.float64, (12,)), ("motion", np.float64, (3,)), ("stretch", np.float64),
                         ("object", np.int32), ("medium", np.int32)])  # fmt: skip


def sphere(real: type) -> np.dtype[np.void]:
    """A sphere relative to the local origin, rounded, and as it is: centre and radius."""
    return struct_dtype([("given", np.float64, (4,)), ("center", real, (3,)), ("radius", real), ("material", np.int32)])


def texture(real: type) -> np.dtype[np.void]:
    """A picture and how it is looked up: where its texels begin, in bytes, and the values of its codes; wrap as texture.cl has it."""
    return struct_dtype([("first", np.int64), ("values", np.int32), ("code_bytes", np.int32), ("width", np.int32), ("height", np.int32),
                         ("wrap", np.int32), ("linear", np.int32)])  # fmt: skip


def wide_node(real: type, width: int) -> np.dtype[np.void]:
    """A node of the wide tree (blocks.cl): planes of its children's boxes, by axis first the lower, then the upper ones; which node or
    block each child is; the children from near to far, four bits an octant.
    """
    return struct_dtype([("planes", real, (6, width)), ("child", np.int32, (width,)), ("order", np.int32, (width,))])


def block(real: type, width: int) -> np.dtype[np.void]:
    """Triangles side by side: the members of `triangle`, the slot of each; and the planes of their box. 1 KiB for 16 in float32."""
    vector: Any = (real, (3, width))
    words = np.dtype(real).itemsize // 4  # every row is as long as the others, so that all are aligned
    return struct_dtype([("v0", *vector), ("e1", *vector), ("e2", *vector), ("normal", *vector), ("bound", real, (width,)),
                         ("normal_bound", real, (width,)), ("slot", np.int32, (width * words,)),
                         ("box", real, (max(8, width),))])  # fmt: skip


_F8_VECTOR: Any = (np.float64, (3,))

#: a ray as given, in float64, its direction at about unit length: `scale` is the power of two that made it so
GIVEN_RAY = struct_dtype(
    [("origin", *_F8_VECTOR), ("direction", *_F8_VECTOR), ("t_min", np.float64), ("t_max", np.float64), ("scale", np.float64)]
)
#: what the record of a hit tells of the triangle
HIT_SOURCE = struct_dtype([("prim_id", np.int64), ("object_id", np.int64), ("normal", *_F8_VECTOR)])
#: a first hit, as callers get it
HIT_RECORD = struct_dtype(
    [("t", np.float64), ("u", np.float64), ("v", np.float64), ("prim_id", np.int64), ("object_id", np.int64), ("normal", *_F8_VECTOR)]
)
