"""Make the pictures, meshes and placements that the scenes of the gallery use, beside this file.

`python scenes/gallery/parts/make_parts.py` needs NumPy, Pillow and, for the two environments, OpenImageIO. Every
random number is seeded, so that the files come out alike each time.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

PARTS = Path(__file__).parent
Array = npt.NDArray[np.float64]
Patch = tuple[Array, npt.NDArray[np.int64], Array]  #: points (n, 3) in glTF's axes, faces (m, 3), places on the picture (n, 2)


# Pictures


def noise(size: int, cells: tuple[int, int], rng: np.random.Generator) -> Array:
    """Smooth noise (size, size) between -1 and 1 that repeats at its edges: `cells` knots across and down, blended by cubic steps."""
    knots = rng.uniform(-1, 1, (cells[1], cells[0]))
    down, across = (np.arange(size) * n / size for n in (cells[1], cells[0]))
    (y, ty), (x, tx) = ((c.astype(int), (c % 1) ** 2 * (3 - 2 * (c % 1))) for c in (down, across))
    rows = knots[y] * (1 - ty[:, None]) + knots[(y + 1) % cells[1]] * ty[:, None]
    mixed: Array = rows[:, x] * (1 - tx) + rows[:, (x + 1) % cells[0]] * tx
    return mixed


def normals_of(height: Array, strength: float) -> npt.NDArray[np.uint8]:
    """A normal map (h, w, 3) of a height field that repeats; y grows upwards in the picture."""
    dx = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) * strength
    dy = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) * strength
    n = np.stack([-dx, dy, np.ones_like(height)], -1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    return np.round((n + 1) * 127.5).astype(np.uint8)


def wood(size: int = 512) -> None:
    """Planks of a table: five boards, each with a grain and a tone of its own."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:size, 0:size] / size
    board = np.minimum((y * 5).astype(int), 4)
    shift = rng.uniform(0, 9, 5)[board]
    warp = noise(size, (3, 10), rng) * 0.05 + noise(size, (6, 60), rng) * 0.012
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * ((y + warp) * 26 + shift + 0.35 * np.sin(2 * np.pi * x + shift)))
    fibre = noise(size, (8, 256), rng) * 0.5 + noise(size, (20, 170), rng) * 0.5
    tone = 0.72 + 0.14 * rings + 0.10 * fibre + rng.uniform(-0.07, 0.07, 5)[board]
    gap = np.abs(y * 5 - np.round(y * 5)) < 0.012
    tone = np.where(gap, tone * 0.45, tone)
    rgb = np.clip(tone[..., None] * np.array([0.80, 0.56, 0.36]), 0, 1)
    Image.fromarray((rgb * 255).astype(np.uint8)).quantize(64).save(PARTS / "wood.png", optimize=True)


def weave(size: int = 64) -> None:
    """A normal map of woven threads: one over, one under."""
    y, x = np.mgrid[0:size, 0:size] / size * 4
    over = (np.floor(x) + np.floor(y)) % 2 == 0
    sx, sy = np.sin(np.pi * (x % 1)), np.sin(np.pi * (y % 1))
    height = np.where(over, sy * (0.5 + 0.5 * sx), sx * (0.5 + 0.5 * sy))
    Image.fromarray(normals_of(height, 3.0)).save(PARTS / "weave.png", optimize=True)


def flutes(size: int = 256) -> None:
    """A normal map of twelve slanted flutes, for the jug."""
    y, x = np.mgrid[0:size, 0:size] / size
    height = np.sqrt(np.abs(np.sin(np.pi * (12 * x + 3 * y))))
    Image.fromarray(normals_of(height, 2.5)).save(PARTS / "flutes.png", optimize=True)


def waves(size: int = 256) -> None:
    """A normal map of ripples: plane waves with whole numbers of periods, so that it repeats."""
    rng = np.random.default_rng(8)
    y, x = np.mgrid[0:size, 0:size] / size
    height = np.zeros((size, size))
    for _ in range(40):
        kx, ky = rng.integers(-9, 10), rng.integers(2, 15)
        height += np.sin(2 * np.pi * (kx * x + ky * y + rng.uniform())) / (kx * kx + ky * ky) ** 0.75
    Image.fromarray(normals_of(height, 3.0)).save(PARTS / "waves.png", optimize=True)


def rose(size: int = 512) -> None:
    """A rose window: stone of alpha 1, holes of alpha 0; twelve petals, twelve rounds, a star in the middle."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * 2 - 1
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    hole = (r < 0.15) & (r < 0.10 + 0.05 * np.cos(6 * angle))
    turn = np.mod(angle + np.pi / 12, np.pi / 6) - np.pi / 12  # within a twelfth, from its middle
    along, aside = r * np.cos(turn), np.abs(r * np.sin(turn))
    hole |= (along > 0.22) & (along < 0.62) & (aside < 0.035 + 0.12 * (along - 0.2))
    hole |= (along >= 0.62) & (np.hypot(along - 0.62, aside) < 0.085)
    half = np.mod(angle, np.pi / 6) - np.pi / 12
    hole |= np.hypot(r * np.cos(half) - 0.84, r * np.sin(half)) < 0.085
    alpha = np.where(hole, 0, 255).astype(np.uint8)
    stone = np.full((size, size), 255, np.uint8)
    Image.fromarray(np.stack([stone, alpha], -1), "LA").save(PARTS / "rose.png", optimize=True)


# Environments: rows from straight up to straight down, radiance


def write_hdr(name: str, radiance: Array) -> None:
    import OpenImageIO as oiio

    height, width, _ = radiance.shape
    out = oiio.ImageOutput.create(str(PARTS / name))
    assert out is not None, oiio.geterror()
    out.open(str(PARTS / name), oiio.ImageSpec(width, height, 3, "float"))
    out.write_image(np.ascontiguousarray(radiance, dtype=np.float32))
    out.close()


def gradient(elevation: Array, stops: list[tuple[float, tuple[float, float, float]]]) -> Array:
    """Colours (n, 3) between stops of rising elevation, degrees."""
    at, colors = [s[0] for s in stops], np.array([s[1] for s in stops])
    return np.stack([np.interp(elevation, at, colors[:, i]) for i in range(3)], -1)


def dusk(rows: int = 2048) -> None:
    """An evening sky, the same all round, so that sixteen columns do: a warm band above the horizon, violet, then deep blue."""
    elevation = 90 - (np.arange(rows) + 0.5) * 180 / rows
    ground, low, glow = (0.05, 0.045, 0.06), (1.15, 0.52, 0.22), (1.05, 0.66, 0.42)
    violet, blue, zenith = (0.66, 0.50, 0.52), (0.28, 0.32, 0.52), (0.07, 0.12, 0.30)
    stops = [(-90.0, ground), (-3.0, (0.12, 0.09, 0.11)), (0.0, low), (4.0, glow), (12.0, violet), (28.0, blue), (90.0, zenith)]
    write_hdr("dusk.hdr", np.repeat(gradient(elevation, stops)[:, None], 16, axis=1))


def studio(rows: int = 256) -> None:
    """A photographer's studio: a dim room, a large soft lamp to the left, a narrow one to the right, and one overhead."""
    elevation = 90 - (np.arange(rows) + 0.5) * 180 / rows
    room = gradient(elevation, [(-90, (0.03, 0.03, 0.035)), (-5, (0.07, 0.07, 0.08)), (10, (0.30, 0.32, 0.36)), (90, (0.16, 0.18, 0.24))])
    radiance = np.repeat(room[:, None], 2 * rows, axis=1)
    azimuth = (np.arange(2 * rows) + 0.5) * 180 / rows - 180  # 0 in the middle, straight ahead; to the right it grows
    boxes = [(-130, -65, 8, 66, (4.6, 4.2, 3.7)), (95, 118, -2, 62, (3.6, 4.2, 5.2)), (140, 220, 44, 76, (3.4, 3.4, 3.4))]
    for left, right, below, above, color in boxes:
        inside = ((azimuth >= left) & (azimuth <= right)) | ((azimuth + 360 >= left) & (azimuth + 360 <= right))
        radiance[np.ix_((elevation > below) & (elevation < above), inside)] = color
    write_hdr("studio.hdr", radiance)


# Meshes


def patch(function: Callable[[Array, Array], Array], nu: int, nv: int) -> Patch:
    """A surface (u, v) -> points, both from 0 to 1, as a grid of nu by nv cells."""
    v, u = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, nv + 1), np.linspace(0, 1, nu + 1), indexing="ij"))
    at = (np.arange(nv)[:, None] * (nu + 1) + np.arange(nu)).ravel()
    faces = np.concatenate([np.stack([at, at + 1, at + nu + 2], -1), np.stack([at, at + nu + 2, at + nu + 1], -1)])
    return function(u, v), faces, np.stack([u, 1 - v], -1)


def lathe(profile: list[tuple[float, float]], around: int, steps: int) -> Patch:
    """A profile (radius, height) turned about y; between its points it is a Catmull-Rom spline."""
    p = np.array([profile[0], *profile, profile[-1]])

    def surface(u: Array, v: Array) -> Array:
        t = v * (len(profile) - 1)
        i = np.minimum(t.astype(int), len(profile) - 2)
        f = (t - i)[:, None]
        a, b, c, d = (p[i + k] for k in range(4))
        r, y = (0.5 * (2 * b + (c - a) * f + (2 * a - 5 * b + 4 * c - d) * f**2 + (3 * b - a - 3 * c + d) * f**3)).T
        return np.stack([np.maximum(r, 0) * np.sin(2 * np.pi * u), y, np.maximum(r, 0) * np.cos(2 * np.pi * u)], -1)

    return patch(surface, around, steps)


def joined(patches: list[Patch]) -> Patch:
    starts = np.cumsum([0, *(len(p[0]) for p in patches)])
    faces = np.concatenate([p[1] + start for p, start in zip(patches, starts[:-1], strict=True)])
    return np.concatenate([p[0] for p in patches]), faces, np.concatenate([p[2] for p in patches])


def normals(points: Array, faces: npt.NDArray[np.int64]) -> Array:
    """The mean normal of the faces around each place, whichever vertices lie there."""
    _, same = np.unique(np.round(points, 5), axis=0, return_inverse=True)
    a, b, c = (points[faces[:, k]] for k in range(3))
    total = np.zeros((same.max() + 1, 3))
    for k in range(3):
        np.add.at(total, same.ravel()[faces[:, k]], np.cross(b - a, c - a))
    n = total[same.ravel()]
    length = np.linalg.norm(n, axis=1, keepdims=True)
    up: Array = np.where(length > 1e-12, n / np.maximum(length, 1e-12), [[0.0, 1.0, 0.0]])
    return up


def write_glb(name: str, parts: list[tuple[Patch, dict[str, object]]]) -> None:
    """A GLB of one mesh: a primitive with a glTF material for each part."""
    views: list[dict[str, int]] = []
    accessors: list[dict[str, object]] = []
    data = b""

    def put(values: npt.NDArray[np.generic], kind: int, shape: str, **keys: object) -> int:
        nonlocal data
        data += b"\0" * (-len(data) % 4)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        accessors.append({"bufferView": len(views) - 1, "componentType": kind, "count": len(values), "type": shape, **keys})
        data += values.tobytes()
        return len(accessors) - 1

    primitives = []
    for place, ((points, faces, uv), _) in enumerate(parts):
        a, b, c = (points[faces[:, k]] for k in range(3))
        kept = faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-9]  # a lathe's poles have none of an area
        p = points.astype("<f4")
        position = put(p, 5126, "VEC3", min=p.min(0).tolist(), max=p.max(0).tolist())
        normal = put(normals(points, kept).astype("<f4"), 5126, "VEC3")
        attributes = {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": put(uv.astype("<f4"), 5126, "VEC2")}
        primitives.append({"attributes": attributes, "indices": put(kept.ravel().astype("<u2"), 5123, "SCALAR"), "material": place})
    root: dict[str, object] = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": primitives}],
        "materials": [m for _, m in parts], "textures": [{"source": 0}], "images": [{"uri": "flutes.png"}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    if not any("normalTexture" in m for _, m in parts):
        del root["textures"], root["images"]
    text = json.dumps(root, separators=(",", ":")).encode()
    text, data = text + b" " * (-len(text) % 4), data + b"\0" * (-len(data) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    (PARTS / name).write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body)


def plain(red: float, green: float, blue: float, roughness: float) -> dict[str, object]:
    """A glTF material without metal; linear base colour."""
    return {"pbrMetallicRoughness": {"baseColorFactor": [red, green, blue, 1], "metallicFactor": 0, "roughnessFactor": roughness}}


def tulip(name: str, color: tuple[float, float, float], opened: float, seed: int) -> None:
    """A tulip of height 1: six petals about a cup, a stem, two leaves."""
    rng = np.random.default_rng(seed)

    def petal(turn: float, inner: float) -> Patch:
        def surface(u: Array, v: Array) -> Array:
            width = 0.105 * np.sin(np.pi * (0.06 + 0.94 * v) ** 0.75) ** 0.8 * 1.25
            side = (u * 2 - 1) * width
            cup = (0.115 - 0.02 * inner) * np.sin(np.pi * np.minimum(v * 0.62 + 0.05, 1)) + opened * v**3 * 0.09
            out = cup - 1.6 * side**2 / 0.115 * 0.55
            y = 0.74 + 0.27 * v - 0.012 * inner
            a = turn
            return np.stack([out * np.cos(a) - side * np.sin(a), y, out * np.sin(a) + side * np.cos(a)], -1)

        return patch(surface, 4, 7)

    def leaf(turn: float, long: float) -> Patch:
        def surface(u: Array, v: Array) -> Array:
            width = 0.055 * np.sin(np.pi * np.clip(v * 0.97 + 0.03, 0, 1)) ** 0.7
            side, out = (u * 2 - 1) * width, 0.015 + 0.20 * v**1.6
            y = long * (v - 0.28 * v**3) + 0.5 * np.abs(side)
            return np.stack([out * np.cos(turn) - side * np.sin(turn), y, out * np.sin(turn) + side * np.cos(turn)], -1)

        return patch(surface, 2, 6)

    petals = [petal(np.pi / 3 * k + rng.uniform(-0.1, 0.1), float(k % 2)) for k in range(6)]
    stem = lathe([(0.016, 0), (0.013, 0.4), (0.013, 0.74), (0.04, 0.755)], 6, 3)
    leaves = [leaf(rng.uniform(0, 6), 0.62), leaf(rng.uniform(0, 6), 0.5), leaf(rng.uniform(0, 6), 0.42)]
    write_glb(name, [(joined(petals), plain(*color, 0.45)), (joined([stem, *leaves]), plain(0.10, 0.25, 0.05, 0.5))])


def still_life() -> None:
    jug = [(0.0, 0.0), (0.30, 0.0), (0.36, 0.06), (0.47, 0.32), (0.48, 0.58), (0.36, 0.86), (0.21, 1.04), (0.19, 1.16)]
    jug += [(0.26, 1.30), (0.235, 1.31), (0.17, 1.17), (0.17, 1.0)]
    glaze = {**plain(0.03, 0.12, 0.26, 0.2), "normalTexture": {"index": 0, "scale": 0.9}}
    write_glb("jug.glb", [(lathe(jug, 40, 44), glaze)])
    bowl = [(0.0, 0.05), (0.22, 0.05), (0.24, 0.0), (0.30, 0.01), (0.34, 0.08), (0.60, 0.24), (0.74, 0.46), (0.72, 0.47)]
    bowl += [(0.56, 0.27), (0.3, 0.13), (0.0, 0.1)]
    write_glb("bowl.glb", [(lathe(bowl, 48, 36), plain(0.75, 0.72, 0.66, 0.3))])
    pear = [(0.0, 0.03), (0.10, 0.0), (0.24, 0.08), (0.30, 0.24), (0.25, 0.42), (0.15, 0.58), (0.10, 0.70), (0.05, 0.755), (0.0, 0.745)]
    pear_stem = [(0.012, 0.72), (0.012, 0.80), (0.018, 0.90), (0.0, 0.905)]
    write_glb("pear.glb", [(lathe(pear, 28, 28), plain(0.62, 0.60, 0.10, 0.45)), (lathe(pear_stem, 6, 6), plain(0.10, 0.05, 0.02, 0.7))])
    apple = [(0.0, 0.05), (0.08, 0.0), (0.20, 0.05), (0.285, 0.25), (0.25, 0.42), (0.14, 0.485), (0.05, 0.455), (0.0, 0.40)]
    apple_stem = [(0.01, 0.40), (0.011, 0.48), (0.018, 0.58), (0.0, 0.582)]
    write_glb("apple.glb", [(lathe(apple, 28, 26), plain(0.58, 0.04, 0.03, 0.3)), (lathe(apple_stem, 6, 6), plain(0.10, 0.05, 0.02, 0.7))])


def field(first: float = 1.2) -> None:
    """The placements of the tulips: rows that run away from the viewer, four of one colour side by side, thinner where they are far."""
    rng = np.random.default_rng(12)
    lines = ["# Made by make_parts.py: each letter is a tulip, turned and scaled by tulips.txt."]
    for row in range(-26, 27):
        z = first + rng.uniform(0, 0.3)
        color = "rypw"[(row + 28) // 4 % 4]
        while z < 30:
            x = row * 0.36 + rng.uniform(-0.09, 0.09)
            if abs(x) < 0.62 * z + 0.5:
                lines.append(f"instance {color}{rng.integers(1, 4)} {x:.2f} 0 {z:.2f}")
            z += rng.uniform(0.26, 0.40) * (1 + z / 14)
    (PARTS / "tulips.inc").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    for make in (wood, weave, flutes, waves, rose, dusk, studio, still_life, field):
        make()
    tulip("tulip_red.glb", (0.62, 0.03, 0.02), 0.2, 1)
    tulip("tulip_yellow.glb", (0.80, 0.50, 0.03), 0.0, 2)
    tulip("tulip_pink.glb", (0.80, 0.22, 0.34), 0.5, 3)
    tulip("tulip_white.glb", (0.82, 0.76, 0.66), 0.1, 4)
