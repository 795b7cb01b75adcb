"""From Features and Precision to one OpenCL program: kernel files in an ordered list, nothing that is not called for.

Kernel files carry three kinds of marks, all C comments:

    //@ place                a place where effects add code
    //@hook place ... //@end at the end of an effect's file: the code it adds at `place`
    //@hook place_default    code that stands at `place` where no effect adds any there
    //@counting code         a line of the counting build alone

Every chunk of the composed text starts with `#line 1 "name.cl"`, so that a compiler's message names the file to open.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from clrt.device import kernel_cache, layout, lean, opencl
from clrt.device.context import POCL, Device
from clrt.errors import DeviceError, LimitError
from clrt.features import REAL, Features
from clrt.precision import Precision

_RAYS = ("rays.cl", "geometry.cl", "triangle.cl")
_TREES = ("box.cl",)
#: entry point -> files before effects that the traversal calls, between those and other effects, after all
_ENTRIES = {
    "render": (("kdtree.cl", "hit.cl"), ("scene.cl", "surface.cl"), ("camera.cl", "prepare.cl", "render.cl")),
    "cast": (("given.cl",), ("blocks.cl", "bundle.cl"), ("after.cl", "prepare.cl", "hit_record.cl", "cast.cl", "ray_sort.cl")),
}
PACKETS = {16: (4, 4), 8: (4, 2), 4: (2, 2), 1: (1, 1)}  #: lanes -> pixels of a packet, width and height
TILE = (16, 8)  #: pixels of a tile, width and height: whole packets of any size
GROUP = (4, 2)  #: packets of a work-item that go together, across and down
GROUPS_FROM = 256  #: triangles; measured: with few, the rest of the work is as much as the tests that are saved
LIGHTS_SEEN = 31  #: lights, and suns, whose shadow rays from what the eye sees go together: a bit of an int each
GROUP_STACK = 15 * 7 + 1  #: entries: for 7 levels of records, more than 2^27 blocks have
SHARED_NOTHING, SHARED_DIRECTION = 0, 2  #: what rays to suns share, by the numbers of rays.cl
LOCAL_SIZE = (8, 2)  #: measured fastest on PoCL among 1x1 to 64x1; one size, since PoCL compiles again for each
PRIVATE_LIMIT = 6 << 20  #: bytes a work-group may hold: PoCL keeps them on a thread's stack of 8 MiB and faults beyond
RUN = 32  #: rays of a work-item in arrays of rays
SORT_BITS = 3  #: an axis, of the grid of origins by which rays are sorted; measured: more bits save nothing
WIDE_STACK = 16  #: entries of the stack of wide trees, where none is deeper: with 16 children a node, few are
MEDIA_DEPTH = 8  #: nested dielectrics a ray remembers
#: what stands at a place where no effect adds anything
_DEFAULTS = {"trace": "        //@ eye_trace", "next": "        break;",
             "eye_trace": "        rays_invert(&rays);\n        scene_trace(&geometry, &rays, SHARED_ORIGIN, 0, &hits);",
             "shadow_trace": "    rays_invert(&rays);\n    scene_trace(&seen, &rays, SHADOW_SHARED_ORIGIN, 1, &hits);",
             "tie": "    closer |= is_equal(t, hits->t) & is_less((mask_n)slot, hits->slot);",
             "eye_rays": "    //@ camera", "camera": "    camera_rays(frame, column, row, &rays);",
             "surface": "        hit_surface(&geometry, frame, surfaces, &rays, &hits, &hit);",
             "launch": """\
    render_packet(column, row, frame, nodes, indices, triangles, eye_planes, vertices, objects, surfaces, materials, end_row, film
                  //@ arguments
                  //@ packet_arguments
    );""",
             "film_ahead": "    film_ahead(group_column, group_row, frame->width, end_row, film);",
             "film": "    film_store(out, column, row, frame->width, end_row, film);"}  # fmt: skip
_PLACE = re.compile(r"^[ \t]*//@ (\w+)[ \t]*$", re.M)
_HOOK = re.compile(r"^//@hook (\w+)\n(.*?)^//@end[ \t]*\n?", re.M | re.S)
_KERNEL = re.compile(r"^kernel\b[^{;]*?\bvoid (\w+)\(", re.M)
_COUNTING = re.compile(r"^([ \t]*)//@counting (.*)\n", re.M)


@dataclass(frozen=True)
class Shape:
    """The sizes a program is compiled for.

    stack : entries of the traversal stack, at least the depth of the deepest tree
    depth : greatest number of bounces
    shared_lights, shared_suns : whether edge planes as seen from the lights, along the suns are at hand
    tree : entries of the stack of the tree over boxes, at least its depth
    block : of arrays of rays, the triangles that are tested at once
    wide : entries of the stack of wide trees, at least the depth of the deepest
    groups : of pictures, whether packets go together, where they have more than one lane
    """

    stack: int
    depth: int = 0
    shared_lights: bool = True
    tree: int = 8
    block: int = 0
    wide: int = WIDE_STACK
    groups: bool = False
    shared_suns: bool = True


def bounce_stack(features: Features, depth: int) -> int:
    """Packets that may wait: each that is taken off puts on one for each branch, `depth` times in a row; and one to spare."""
    return (max(2, sum(f.branches for f in features.active)) - 1) * depth + 2


def block_width(lanes: int) -> int:
    """The triangles of a block, and the children of a wide node, on a device that holds `lanes` numbers in a vector."""
    return max(4, lanes)


def stack_size(tree_depth: int) -> int:
    """Stack entries for trees of this depth: rounded up to a multiple of 8, so that few programs serve all scenes."""
    return max(8, -(-(tree_depth + 1) // 8) * 8)


def groups_pay(features: Features, triangles: int) -> bool:
    """Whether packets of pixels are to go together (group.cl): where their rays share the eye, and there are many triangles."""
    alone = {"object tree", "wide eye"}
    return triangles >= GROUPS_FROM and not features.every and alone.isdisjoint(f.name for f in features.active)


def lights_grouped(features: Features, lanes: int, shape: Shape) -> bool:
    """Whether shadow rays of what the eye sees do, too (group_shadow.cl): where they depend on the hit alone."""
    names = {f.name for f in features.active}
    others = ("opacity shadows", "spot", "fog")
    return shape.groups and lanes > 1 and shape.shared_lights and "shadows" in names and names.isdisjoint(others)


def suns_grouped(features: Features, lanes: int, shape: Shape) -> bool:
    """The same of rays to suns (group_sun.cl)."""
    names = {f.name for f in features.active}
    return shape.groups and lanes > 1 and "sun shadows" in names and names.isdisjoint(("opacity shadows", "fog"))


def suns_share(features: Features, shared_suns: bool) -> bool:
    """Whether rays to suns are tested by planes along their direction (sun_visible.cl): not where objects have spaces of their own."""
    return shared_suns and "placed" not in {f.name for f in features.active}


def item_size(lanes: int, groups: bool) -> tuple[int, int]:
    """Pixels of a work-item of `render`: width and height."""
    width, height = PACKETS[lanes]
    return (width * GROUP[0], height * GROUP[1]) if groups and lanes > 1 else (width, height)


@cache
def kernel_folder() -> Path:
    """Where the kernel files are: inside the installed package, or at the top of a checkout."""
    inside = Path(__file__).resolve().parents[1] / "kernels"
    return inside if inside.is_dir() else inside.parents[1] / "kernels"


@cache
def kernel_source(name: str) -> tuple[str, tuple[tuple[str, str, int], ...]]:
    """A kernel file without its hooks, and its hooks: (place, code, line number)."""
    text = (kernel_folder() / name).read_text(encoding="utf-8")
    hooks = tuple((m[1], m[2], text.count("\n", 0, m.start()) + 2) for m in _HOOK.finditer(text))
    return _HOOK.sub("", text).rstrip("\n") + "\n", hooks


def _structs(features: Features, precision: Precision, lanes: int, shape: Shape, entry: str) -> str:
    real = precision.real
    names = [
        ("Triangle", layout.triangle(real)), ("EdgePlanes", layout.edge_planes(real)), ("Object", layout.object_record(real)),
        ("Surface", layout.surface(real)), ("Material", material_dtype(features, precision)), ("Frame", frame_dtype(features, precision)),
    ]  # fmt: skip
    declared = " ".join(declaration for f in features.active for _, declaration in f.parameters)
    optional = (
        ("ParallelPlanes", layout.parallel_planes), ("Light", partial(light_dtype, features)), ("Sphere", layout.sphere),
        ("Texture", layout.texture), ("Sun", layout.sun),
        ("Emitter", layout.emitter), ("Placement", layout.placement), ("EnvironmentRow", layout.environment_row),
    )  # fmt: skip
    names += [(name, make(real)) for name, make in optional if f" {name} " in declared]
    if entry == "render" and shape.groups and lanes > 1:
        names.append(("DirectionBoxes", layout.direction_boxes()))
    if entry == "cast" or " WideNode " in declared:
        block = shape.block or block_width(lanes)
        names += [("WideNode", layout.wide_node(real, block)), ("Block", layout.block(real, block))]
    if entry == "cast":
        names += [("GivenRay", layout.GIVEN_RAY), ("HitSource", layout.HIT_SOURCE), ("HitRecord", layout.HIT_RECORD)]
    return "".join(layout.c_struct(name, dtype) for name, dtype in names)


def material_dtype(features: Features, precision: Precision) -> np.dtype[np.void]:
    members = [(n, precision.real if t is REAL else t, *shape) for f in features.active for n, t, *shape in f.material]
    return layout.material(precision.real, members)


def light_dtype(features: Features, real: type) -> np.dtype[np.void]:
    return layout.light(real, [(n, real if t is REAL else t, *shape) for f in features.active for n, t, *shape in f.light])


def frame_dtype(features: Features, precision: Precision) -> np.dtype[np.void]:
    switches: list[layout.Field] = [(f.switch_name, np.int32) for f in features.switches]
    members = [(n, precision.real if t is REAL else t, *shape) for f in features.active for n, t, *shape, _ in f.frame]
    return layout.frame(precision.real, [*switches, *members])


def _defines(features: Features, precision: Precision, lanes: int, shape: Shape, counting: bool) -> str:
    width, height = PACKETS[lanes]
    values: dict[str, int] = {"REAL_BITS": precision.bits, "LANES": lanes, "PACKET_WIDTH": width, "PACKET_HEIGHT": height,
                              "STACK_SIZE": shape.stack}  # fmt: skip
    if shape.block:
        values |= {"BLOCK": shape.block, "WIDE_STACK": shape.wide, "SORT_BITS": SORT_BITS, "RUN": RUN}
    names = {f.name for f in features.active}
    values |= dict(zip(("ITEM_WIDTH", "ITEM_HEIGHT"), item_size(lanes, shape.groups), strict=True))
    if shape.groups and lanes > 1:
        values |= {"GROUP": GROUP[0] * GROUP[1], "BOXES": layout.BOXES, "GROUP_STACK": GROUP_STACK, "LIGHTS_SEEN": LIGHTS_SEEN}
    if "single rays" in names:
        values |= {"BLOCK": block_width(lanes), "WIDE_STACK": shape.wide}
    if "sampling" in names:
        values |= {"TILE_WIDTH": TILE[0], "TILE_HEIGHT": TILE[1]}
    if "shadows" in names:
        values["SHADOW_SHARED_ORIGIN"] = int(shape.shared_lights)
    if "sun shadows" in names:
        values["SUN_SHARED"] = SHARED_DIRECTION if suns_share(features, shape.shared_suns) else SHARED_NOTHING
    if "bounce" in names:
        values["BOUNCE_STACK"] = bounce_stack(features, shape.depth)
    if "object tree" in names:
        values["TREE_STACK"] = shape.tree
    if "refraction" in names:
        values["MEDIA_DEPTH"] = MEDIA_DEPTH
    if counting:
        values |= {f"COUNT_{kind.upper()}": i for i, kind in enumerate(features.ray_kinds)}
        values["COUNT_TESTS"] = len(features.ray_kinds)
    switches = {f.switch_name.upper(): f"(frame->{f.switch_name})" if features.every else "1" for f in features.active if f.switch}
    return "".join(f"#define {name} {value}\n" for name, value in {**values, **switches}.items())


def _insert(name: str, text: str, hooks: dict[str, list[tuple[str, str, int]]]) -> str:
    """`text` of the file `name` with the code of all hooks in their places; line directives keep messages true."""
    out: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        place = _PLACE.match(line)
        if not place:
            out.append(line)
            continue
        found = hooks.get(place[1]) or hooks.get(f"{place[1]}_default", [])
        for file, code, first in found:
            out += [f'#line {first} "{file}"', _insert(file, code, hooks).rstrip("\n")]
        if not found and place[1] in _DEFAULTS:
            out.append(_insert(name, _DEFAULTS[place[1]], hooks).rstrip("\n"))
        out.append(f'#line {number + 1} "{name}"')
    return "\n".join(out) + "\n"


def _files(features: Features, precision: Precision, lanes: int, shape: Shape, entry: str) -> Iterator[str]:
    before, between, after = _ENTRIES[entry]
    together = entry == "render" and shape.groups and lanes > 1
    instead = {f.replaces: f.kernel for f in features.active if f.replaces}
    yield from (*_RAYS, *precision.kernels, *_TREES)
    yield from ("directions.cl",) if together else ()
    yield from before
    yield from precision.surface_kernels if "hit.cl" in before else ()
    yield from (f.kernel for f in features.active if f.early and not f.replaces)
    yield from (instead.get(name, name) for name in between)
    yield from ("group_trace.cl",) if together else ()
    yield from (f.kernel for f in features.active if not f.early)
    yield from ("group.cl",) if together else ()
    lights, suns = (together and grouped(features, lanes, shape) for grouped in (lights_grouped, suns_grouped))
    yield from ("group_surface.cl",) if lights or suns else ()
    yield from ("group_shadow.cl",) if lights else ()
    yield from ("group_sun.cl",) if suns else ()
    yield from after


def compose(features: Features, precision: Precision, lanes: int, shape: Shape, *, counting: bool = False, entry: str = "render") -> str:
    """The whole source of the program for these features: a pure function of its arguments and the kernel files.

    entry : "render" for pictures, "cast" for arrays of rays
    """
    files = list(_files(features, precision, lanes, shape, entry))
    if counting:
        files.insert(0, "count.cl")
    if features.every:
        files.insert(0, "switches.cl")
    hooks: dict[str, list[tuple[str, str, int]]] = {
        "parameters": [("features", f"                   , {c}\n", 1) for f in features.active for _, c in f.parameters],
        "arguments": [("features", f"                  , {name}\n", 1) for f in features.active for name, _ in f.parameters],
    }
    for name in files:
        for place, code, line in kernel_source(name)[1]:
            hooks.setdefault(place, []).append((name, code, line))
    chunks = [_defines(features, precision, lanes, shape, counting), f'#line 1 "lanes.cl"\n{kernel_source("lanes.cl")[0]}']
    chunks.append(f'#line 1 "structs"\n{_structs(features, precision, lanes, shape, entry)}')
    for name in files:
        chunks.append(f'#line 1 "{name}"\n' + _insert(name, kernel_source(name)[0], hooks))
    return _COUNTING.sub(r"\1\2\n" if counting else "\n", "".join(chunks))


def private_bytes(precision: Precision, lanes: int, shape: Shape, features: Features) -> int:
    """An upper estimate of the private memory of one work-item, in bytes: its stacks, one a copy of the traversal, and 16 KiB."""
    lane_bytes = lanes * precision.bits // 8
    names = {f.name for f in features.active}
    entry = lane_bytes * (9 + (2 * MEDIA_DEPTH + 1 if "refraction" in names else 0) + (3 if "absorption" in names else 0)) + 64
    # Refraction: for coincident walls.
    tracing = ("bounce", "shadows", "sun shadows", "area shadows", "environment shadows", "opacity shadows", "refraction")
    copies = 1 + sum(name in names for name in tracing)
    traversal = shape.stack * (2 * lane_bytes + 4) * copies
    if "object tree" in names:
        traversal += shape.tree * (lane_bytes + 4) * copies + ("placed" in names) * shape.stack * (2 * lane_bytes + 4) * copies
    if "single rays" in names:
        traversal += shape.wide * (block_width(lanes) * (precision.bits // 8 + 4) + 4)
    if shape.groups and lanes > 1:
        traversal += GROUP[0] * GROUP[1] * (lane_bytes * 100 + 256) + 16 * GROUP_STACK
    return traversal + (entry * (bounce_stack(features, shape.depth) + 2) if "bounce" in names else 0) + (16 << 10)


def check_limits(precision: Precision, lanes: int, shape: Shape, features: Features) -> None:
    """Raises LimitError where a work-group's private memory would not fit a thread's stack, on which PoCL keeps it."""
    need = private_bytes(precision, lanes, shape, features) * LOCAL_SIZE[0] * LOCAL_SIZE[1]
    if need > PRIVATE_LIMIT:
        raise LimitError(
            f"a ray depth of {shape.depth} with trees of depth {shape.stack} needs {need >> 20} MiB of private memory, "
            f"more than the {PRIVATE_LIMIT >> 20} MiB that a device thread holds; lower --depth"
        )


OPTIONS = ("-cl-std=CL1.2",)
_UNSAFE = (
    "fast-relaxed-math", "unsafe-math", "finite-math", "ffast-math", "no-signed-zeros", "mad-enable", "single-precision-constant",
    "denorms-are-zero",
)  # fmt: skip


def check_options(options: tuple[str, ...]) -> None:
    """Refuses build options that break NaN tests and error bounds. Raises DeviceError."""
    for option in options:
        if any(word in option for word in _UNSAFE):
            raise DeviceError(f"the build option '{option}' breaks the error bounds that the pictures rest on; leave it out")


def cached_as(device: Device, source: str) -> tuple[str, ...]:
    """All that decides which entry of PoCL's cache is that of `source`: two of clrt's environments may share the cache, not the entries.

    The text as it is compiled, with its options, to which pyopencl adds its own folder; PoCL, its LLVM, the device, and what the
    environment asks them for.
    """
    info = device.info
    text, more = next(lean.attempts(kernel_folder(), source, pocl=info.platform == POCL))
    asked = (f"{name}={os.environ[name]}" for name in sorted(os.environ) if name.startswith("POCL_") and name != kernel_cache.VARIABLE)
    return (
        text, *OPTIONS, *more, os.environ.get("PYOPENCL_BUILD_OPTIONS", ""), str(opencl.extension_file().parent),
        info.name, info.platform, device.handle.platform.version, info.version, info.driver, *asked,
    )  # fmt: skip


def build(device: Device, source: str, options: tuple[str, ...] = OPTIONS) -> Any:
    """Compiles `source` on `device`; a pyopencl Program.

    A broken entry of PoCL's cache can fail here; so a build that fails is tried once more, from a text that no cache knows, with the
    cache emptied first unless somebody else is loading from it. Raises DeviceError with the compiler's message.
    """
    cl = opencl.api()
    check_options((*options, *os.environ.get("PYOPENCL_BUILD_OPTIONS", "").split()))  # pyopencl adds these to ours
    error: Exception | None = None
    for text, more in lean.attempts(kernel_folder(), source, pocl=device.info.platform == POCL):
        try:
            with warnings.catch_warnings(), kernel_cache.loading():
                warnings.simplefilter("ignore", cl.CompilerWarning)
                built = cl.Program(device.context, text).build(options=[*options, *more])
                for name in _KERNEL.findall(source):  # what a broken entry lacks is missed only when it is asked for
                    cl.Kernel(built, name)
            return built
        except cl.Error as failure:
            error = failure
            if not (more and lean.lacks(failure)):
                kernel_cache.suspect()
    if wrong := kernel_cache.unwritable_folder():
        raise DeviceError(wrong) from error
    raise DeviceError(f"the device '{device.info.name}' could not compile the program: {error}") from error
