"""Cases 50 to 52: energy, and smooth normals on coarse meshes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.scene.build import parse_scene
from clrt.scene.model import Scene
from clrt.verify import pictures
from clrt.verify.case import ALL, Context, Outcome, case
from clrt.verify.pictures import camera

FloatArray = NDArray[np.float64]
ROUNDINGS = 2e-6  #: what float32 may add to a sum of weights along a path


def _smooth(corners: FloatArray, normals: FloatArray) -> str:
    """T lines of 18 numbers."""
    rows = np.concatenate([corners.reshape(-1, 9), normals.reshape(-1, 9)], 1)
    return "".join("T " + " ".join(map(repr, row)) + "\n" for row in rows.tolist())


def _ahead(size: int, fov: float) -> str:
    eye, view = np.array((0.03, 0.02, -3.0)), np.array((0.0, 0.0, 1.0))
    return camera(eye, view, fov, size, np.array((0.0, 1.0, 0.0))) + pictures.company(eye, view)


def _glass_sphere(reflect: float, refract: float, depth: int) -> float:
    """What a glass sphere in a furnace shows: a ray enters once, and inside is reflected again and again, `depth` events at most."""
    inside = sum(reflect**k * refract for k in range(depth - 1))
    return reflect + refract * inside


@case(50, "white furnace, each material", provokes="gain or loss", oracle="S", promised=ALL)
def white_furnace(context: Context) -> Outcome:
    """In a white surrounding nothing is brighter than 1, and what loses nothing is 1."""
    size, depth, white = 48, pictures.DEPTH, "background 1 1 1\n"
    ball, tilted = "S 0 0 0 1\n", pictures.triangles(0.7 * pictures.cube() @ pictures.rotation(context.rng(50)).T)
    view = _ahead(size, 50.0)
    lossless = [("M 1 1 1 1 0 0 1 0\n", 1.0), ("M 1 1 1 0 0 0 1 1\n", 1.0), ("M 1 1 1 0 0 0 1 0 1 1.5\n", 1.0)]
    exact = [(view + white + m + ball, value) for m, value in lossless]
    exact += [(view + white + m + tilted, value) for m, value in lossless[:2]]
    mixed = _glass_sphere(0.25, 0.75, depth)
    glass_like = ("M 1 1 1 0 0 0 1 0 1 1.5\n", "M 1 1 1 0 0 0 1 0.25 0.75 1.5\n", "M 1 1 1 0 0 0 1 0.25 0.75 0.7\n")
    bounded = [(view + white + m + tilted, 1.0) for m in glass_like]
    lit, plain = _ahead(size, 35.0) + "L 1 2 -3\n", ("M 1 1 1 0 1 0 1 0\n", "M 1 1 1 0 0 1 7 0\n", "M 1 1 1 0 0 1 0 0\n")
    bounded += [(lit + m + shape, 1.0) for m in plain for shape in (ball, tilted)]
    scenes = [(parse_scene(text), value, True) for text, value in exact] + [(parse_scene(text), value, False) for text, value in bounded]
    glass = parse_scene(view + white + "M 1 1 1 0 0 0 1 0.25 0.75 1.5\n" + ball)

    def wrong(rung: str) -> int:
        count = 0
        for scene, value, tight in scenes:
            pixels = context.render(scene, rung)
            good = (pixels >= 0) & (pixels <= value + ROUNDINGS) & ((pixels >= value - ROUNDINGS) | (not tight))
            count += int(np.count_nonzero(~good.all(-1)))
        pixels = context.render(glass, rung)
        near = np.minimum(np.abs(pixels - mixed), np.abs(pixels - 1.0)) <= ROUNDINGS  # the sphere, or the surrounding
        return count + int(np.count_nonzero(~near.all(-1)))

    cosine = context.rng(50).uniform(0, 1, 10_000)
    total = 1.5**2 * (1 - cosine**2) > 1  # careless: what is reflected totally is refracted, too, with the root of a negative as 0
    return Outcome((len(scenes) + 1) * size**2, context.each_rung(wrong), int(np.count_nonzero(0.25 + 0.75 * total + 0.75 > 1)))


@case(51, "interpolated normals that face away", provokes="black or NaN", oracle="S", promised=ALL)
def facing_away(context: Context) -> Outcome:
    """A mirror with corner normals up to 85 degrees off its own: it never shows what is below it, and every pixel is a number."""
    rng, size, scenes = context.rng(51), 64, []
    naive = 0
    for tilt in (10.0, 45.0, 70.0, 85.0):
        floor = 8.0 * pictures.grid(2)[:, :, [0, 2, 1]]
        around = rng.uniform(0, 2 * np.pi, floor.shape[:2])
        sine, cosine = np.sin(np.radians(tilt)), np.cos(np.radians(tilt))
        normals = np.stack([sine * np.cos(around), np.full(around.shape, cosine), sine * np.sin(around)], -1)
        view = np.array((0.0, -0.25, 1.0))
        eye = np.array((0.0, 0.4, -6.0))
        text = camera(eye, view, 25.0, size, np.array((0.0, 1.0, 0.0))) + pictures.company(eye, view) + "background 0 0 1\n"
        text += "L 0 9 -3\nM 1 1 1 0 0.5 0.5 3 1\n" + _smooth(floor, normals) + "O\n"
        text += "M 1 0 0 1 0 0 1 0\n" + pictures.triangles(90.0 * pictures.grid(1)[:, :, [0, 2, 1]] - (0, 0.05, 0)) + "O\n"
        scene = parse_scene(text)
        scenes.append((scene, _red(scene)))
        d = scene.camera.directions().reshape(-1, 3)[::4].astype(np.float32)
        n = normals.reshape(-1, 3)[np.arange(len(d)) % 24].astype(np.float32)
        reflected = d - 2 * (d * n).sum(-1, keepdims=True) * n
        naive += int(np.count_nonzero((d[:, 1] < 0) & (reflected[:, 1] <= 0)))

    def wrong(rung: str) -> int:
        count = 0
        for scene, floor in scenes:
            pixels = context.render(scene, rung)
            # The light is white: what the floor itself adds is as much red as green.
            below = np.abs(pixels[..., 0] - pixels[..., 1]) > 1e-5
            sky = np.abs(pixels[..., 2] - pixels[..., 0] - 1.0) > 1e-4
            count += int(np.count_nonzero(~np.isfinite(pixels).all(-1) | (floor & (below | sky))))
        return count

    return Outcome(sum(int(f.sum()) for _, f in scenes), context.each_rung(wrong), naive)


def _red(scene: Scene) -> NDArray[np.bool_]:
    """(h, w) pixels that look at the mirror: rays that meet the plane y = 0 within its 8 units, and not within 1e-3 of its edge."""
    d = scene.camera.directions()
    with np.errstate(divide="ignore", invalid="ignore"):
        place = scene.camera.eye + (-scene.camera.eye[1] / d[..., 1])[..., None] * d
    return np.asarray((d[..., 1] < 0) & (np.abs(place[..., [0, 2]]) < 7.999).all(-1))


def _coarse_sphere(around: int, rows: int) -> tuple[FloatArray, FloatArray]:
    """(n, 3, 3) corners of a sphere of radius 1 about y, also its normals there."""
    longitude = np.linspace(0, 2 * np.pi, around + 1)
    longitude[-1] = 0.0
    latitude = np.linspace(-np.pi / 2, np.pi / 2, rows + 1)
    at = np.stack(np.broadcast_arrays(np.cos(latitude)[:, None] * np.cos(longitude), np.sin(latitude)[:, None],
                                      np.cos(latitude)[:, None] * np.sin(longitude)), -1)  # fmt: skip
    at[0], at[-1] = (0, -1, 0), (0, 1, 0)
    ring = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], 2).reshape(-1, 4, 3)
    faces = pictures.quads(ring)
    area = np.linalg.norm(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]), axis=-1)
    faces = faces[area > 1e-9]
    return faces, faces / np.linalg.norm(faces, axis=-1, keepdims=True)


def _steps(row: FloatArray, ball: FloatArray, where: NDArray[np.bool_]) -> int:
    """Neighbours in a row, dark to bright, of which the second is darker, or brighter by more than 1.5 of the true ball's slope there.

    Facets of 15 degrees change the slope by a few per cent. A pixel at the terminator may take the slope of its bright neighbour.
    """
    rise, slope = np.diff(row), np.abs(np.diff(ball))
    slope = np.maximum(slope, np.maximum(np.roll(slope, 1), np.roll(slope, -1)))
    return int(np.count_nonzero(where[1:] & where[:-1] & ((rise < -1e-4) | (rise > 1.5 * slope + 0.005))))


@case(52, "coarse smooth sphere at the terminator", provokes="a step", oracle="S", promised=ALL)
def terminator(context: Context) -> Outcome:
    """Along its equator a ball of 24 by 13 facets, lit from the side, darkens evenly: never brighter again, and nowhere by a step."""
    size, scenes = 96, []
    corners, normals = _coarse_sphere(24, 13)
    for angle in (64.0, 81.0, 99.0, 116.0):  # the terminator inside a facet of 15 degrees
        x, z = float(20 * np.sin(np.radians(angle))), float(-20 * np.cos(np.radians(angle)))
        eye, view = np.array((0.0, 0.0, -8.0)), np.array((0.0, 0.0, 1.0))
        text = camera(eye, view, 16.0, size, np.array((0.0, 1.0, 0.0))) + pictures.company(eye, view)
        text += f"L {x!r} 0 {z!r}\nM 1 1 1 0 1 0 1 0\n"
        for part in np.array_split(np.arange(len(corners)), 16):  # an object each: small trees, and so the program of other cases
            text += _smooth(corners[part], normals[part]) + "O\n"
        scenes.append((parse_scene(text), np.array((x, 0.0, z))))

    def steps(row: FloatArray, light: FloatArray) -> int:
        """Pixels, from where the light is highest to the dark edge, that fall the wrong way or by more than a true ball and a half does."""
        across = ((np.arange(size) + 0.5) / size * 2 - 1) * np.tan(np.radians(8.0)) * 8.0
        normal = np.stack([across, np.zeros(size), -np.sqrt(np.maximum(1 - across**2, 0))], -1)
        towards = light / np.linalg.norm(light)
        return _steps(row, np.maximum(normal @ towards, 0), (np.abs(across) < 0.95) & (across < towards[0] - 0.1))

    def wrong(rung: str) -> int:
        return sum(steps(context.render(s, rung)[size // 2, :, 0].astype(np.float64), light) for s, light in scenes)

    turn = -np.arange(size) / size * np.pi
    facet = np.floor(turn / 0.25) * 0.25 + 0.125
    ball = np.maximum(np.cos(turn), 0)[::-1]
    careless = np.where(np.cos(facet[::-1]) > 0, ball, 0)  # dark where the facet is
    naive = _steps(careless, ball, np.ones(size, bool))
    return Outcome(len(scenes) * size, context.each_rung(wrong), naive)
