"""Cases 34 to 38, 50 to 52 and 55: rays that start on surfaces, and what surfaces make of light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clrt.film import Film
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene
from clrt.verify import pictures
from clrt.verify.case import ALL, SAFE, Context, Outcome, case
from clrt.verify.pictures import camera, line, naive_hits

FloatArray = NDArray[np.float64]
SHADES = 1e-3  #: a pixel of the right rays is nearer to its closed form than this, a wrong ray is farther away
NAIVE_EPSILON = 1e-4  #: the distance by which careless ray tracers start off a surface, whatever its size


def _count(pixels: NDArray[np.float32], expected: FloatArray | float) -> int:
    """Pixels that are off by more than SHADES in any channel, or not numbers."""
    return int(np.count_nonzero(~(np.abs(pixels - expected) <= SHADES).all(-1)))


def _plane_hits(eye: FloatArray, directions: FloatArray, point: FloatArray, normal: FloatArray) -> FloatArray:
    """(..., 3) where rays meet a plane."""
    t = ((point - eye) @ normal) / (directions @ normal)
    return np.asarray(eye + t[..., None] * directions)


@case(34, "rays that start on triangles of sizes 1e-8 to 1e8", provokes="acne", oracle="S", promised=SAFE)
def respawned_rays(context: Context) -> Outcome:
    """A tilted mirror floor under a light and a sky: every pixel is N.L plus half the sky, unless a ray meets the floor that it left."""
    rng, size, sky = context.rng(34), 64, 4.0
    scales = 10.0 ** np.arange(-8, 9)
    scenes, naive = [], 0
    for scale in scales:
        turn = pictures.rotation(rng) * scale
        floor = pictures.grid(6) @ turn.T
        eye, light, normal = turn @ (0.5, -0.4, 0.45), turn @ (-0.7, 0.3, 0.6), turn[:, 2] / scale
        text = camera(eye, -eye / scale, 50.0, size, turn[:, 1] / scale) + line("L", light) + f"background {sky} {sky} {sky}\n"
        text += pictures.company(eye, -eye / scale, scale)
        scene = parse_scene(text + "M 1 1 1 0 1 0 1 0.5\n" + pictures.triangles(floor))
        points = _plane_hits(scene.camera.eye, scene.camera.directions(), np.zeros(3), normal)
        to_light = light - points
        inside = np.abs(points @ turn / scale**2).max(-1) < 0.999
        expected = (to_light @ normal / np.linalg.norm(to_light, axis=-1) + 0.5 * sky)[..., None]
        scenes.append((scene, expected, inside))
        sample = points[inside][::16]
        naive += int(np.count_nonzero(naive_hits(sample, light - sample, floor, NAIVE_EPSILON, 1.0)))
        away = (light - sample) / np.linalg.norm(light - sample, axis=-1, keepdims=True)
        naive += int(np.count_nonzero(naive_hits(sample, away, floor, NAIVE_EPSILON)))

    def wrong(rung: str) -> int:
        return sum(_count(context.render(s, rung)[inside], e[inside]) for s, e, inside in scenes)

    return Outcome(sum(int(i.sum()) for _, _, i in scenes), context.each_rung(wrong), naive, "shadow and mirror rays in one pixel")


@case(35, "rays that start inside a tilted closed cube, scales 1e-6 to 1e6", provokes="leak or acne", oracle="S", promised=SAFE)
def tilted_cube(context: Context) -> Outcome:
    """Mirrors inside a closed cube never show the sky outside; a light inside it lights every point."""
    rng, size = context.rng(35), 64
    mirror, lit, naive = [], [], 0
    for scale in 10.0 ** np.arange(-6, 7, 2):
        turn = pictures.rotation(rng) * scale
        offset = rng.normal(size=3) * scale * 1e5
        walls = pictures.cube() @ turn.T + offset
        eye, light = turn @ (0.3, -0.2, 0.1) + offset, turn @ (-0.5, 0.4, 0.6) + offset
        ahead = turn @ (-1.0, 0.3, 0.2) / scale
        view = camera(eye, ahead, 120.0, size) + line("L", light) + pictures.company(eye, ahead, scale)
        mirror.append(parse_scene(view + "background 9 9 9\nM 1 1 1 0 0 0 1 1\n" + pictures.triangles(walls)))
        scene = parse_scene(view + "background 9 9 9\nM 1 1 1 0 1 0 1 0\n" + pictures.triangles(walls))
        inner = scene.camera.directions() @ turn / scale**2
        start, shine = np.array((0.3, -0.2, 0.1)), np.array((-0.5, 0.4, 0.6))
        t = ((np.sign(inner) - start) / inner).min(-1)
        hit = start + t[..., None] * inner
        axis = np.abs(hit).argmax(-1)[..., None]
        to_light = shine - hit
        cosine = np.abs(np.take_along_axis(to_light, axis, -1)) / np.linalg.norm(to_light, axis=-1, keepdims=True)
        lit.append((scene, cosine))
        sample = (hit.reshape(-1, 3)[::16] @ turn.T) + offset
        naive += int(np.count_nonzero(naive_hits(sample, light - sample, walls, NAIVE_EPSILON, 1.0)))

    def wrong(rung: str) -> int:
        leaks = sum(int(np.count_nonzero(context.render(s, rung).any(-1))) for s in mirror)
        return leaks + sum(_count(context.render(s, rung), e) for s, e in lit)

    return Outcome(2 * len(lit) * size**2, context.each_rung(wrong), naive, "each cube is 1e5 times its size from zero")


@case(36, "sealed dark box, lit from outside, offsets 0 to 1e6, scales 1e-6 to 1e6", provokes="light leak", oracle="S", promised=SAFE)
def sealed_box(context: Context) -> Outcome:
    """Nothing glows inside, and no light gets in: every pixel is exactly 0."""
    rng, size, scenes, naive = context.rng(36), 64, [], 0
    pairs = [(o, 1.0) for o in (0.0, 1e2, 1e4, 1e6)] + [(0.0, s) for s in (1e-6, 1e-3, 1e3, 1e6)] + [(1e6, 1e-2), (1e4, 1e-6)]
    for offset, scale in pairs:
        turn, shift = pictures.rotation(rng) * scale, offset * rng.choice([-1.0, 1.0], 3)
        walls = np.concatenate([pictures.cube(), 0.25 * pictures.cube() @ pictures.rotation(rng).T + (0.1, -0.2, 0.3)]) @ turn.T + shift
        eye = turn @ (-0.7, 0.6, -0.75) + shift
        lights = [turn @ p + shift for p in rng.normal(size=(3, 3)) * 0.2 + 1.3 * np.diag((1.0, -1.0, 1.0))]
        lights += [turn @ (np.array(corner) * 1.01) + shift for corner in ((1, 1, 1), (-1, 1, -1), (1.0, 0.0, 1.0))]
        text = camera(eye, turn @ (0.7, -0.6, 0.8) / scale, 110.0, size) + "".join(line("L", p) for p in lights)
        text += pictures.company(eye, turn @ (0.7, -0.6, 0.8) / scale, scale)
        scenes.append(parse_scene(text + "M 1 1 1 0 1 1 5 0\n" + pictures.triangles(walls)))
        inner = np.stack([rng.uniform(-1, 1, 200), rng.uniform(-1, 1, 200), -np.ones(200)], -1)
        sample = inner @ turn.T + shift
        naive += sum(int(np.count_nonzero(~naive_hits(sample, p - sample, walls, NAIVE_EPSILON, 1.0 - NAIVE_EPSILON))) for p in lights[:2])

    def wrong(rung: str) -> int:
        return sum(int(np.count_nonzero(context.render(s, rung).any(-1))) for s in scenes)

    return Outcome(len(scenes) * size**2, context.each_rung(wrong), naive)


@case(37, "a light that lies on a surface", provokes="a hit at the end of a shadow ray", oracle="S", promised=SAFE)
def light_on_surface(context: Context) -> Outcome:
    """A light in the ceiling's own plane lights the floor: the segment to it is open."""
    rng, size, scenes, naive = context.rng(37), 48, [], 0
    for scale, offset in ((1.0, 0.0), (1e-3, 0.0), (1e4, 0.0), (1.0, 1e3), (1.0, 1e6), (3.0, 0.0), (7.0, 0.0), (1e-2, 1e2)):
        turn, shift = pictures.rotation(rng) * scale, offset * rng.normal(size=3)
        # Numbers of 28 bits, so that a corner plus quarters of edges is a float64: the light lies on the triangle to the last bit.
        step = 2.0 ** (np.ceil(np.log2(np.abs(shift).max() + 2 * scale)) - 28)
        floor = pictures.grid(2) @ turn.T + shift
        ceiling = np.rint(((pictures.grid(1) + np.array((0, 0, 0.8))) @ turn.T + shift) / step) * step
        corner, normal = ceiling[rng.integers(2)], turn[:, 2] / scale
        light = corner[0] + (corner[1] - corner[0]) * 0.25 + (corner[2] - corner[0]) * 0.5
        eye = turn @ (0.1, -0.2, 0.5) + shift
        text = camera(eye, -normal, 60.0, size, turn[:, 1] / scale) + line("L", light)
        text += pictures.company(eye, -normal, scale) + "M 1 1 1 0 1 0 1 0\n"
        scene = parse_scene(text + pictures.triangles(floor) + "O\n" + pictures.triangles(ceiling))
        points = _plane_hits(scene.camera.eye, scene.camera.directions(), shift, normal)
        to_light = light - points
        scenes.append((scene, (to_light @ normal / np.linalg.norm(to_light, axis=-1))[..., None]))
        sample = points.reshape(-1, 3)[::8]
        naive += int(np.count_nonzero(naive_hits(sample, light - sample, ceiling, NAIVE_EPSILON, 1.0 + NAIVE_EPSILON)))

    def wrong(rung: str) -> int:
        return sum(_count(context.render(s, rung), e) for s, e in scenes)

    return Outcome(len(scenes) * size**2, context.each_rung(wrong), naive, "on the triangle to the last bit")


@case(38, "contact gap of 4 ulp", provokes="an offset greater than the gap", oracle="D", promised=("exact", "double"))
def contact_gap(context: Context) -> Outcome:
    """A dark card under glass of index 1, a few float32 ulps of the coordinates apart: seen through the glass, in the glass's shadow."""
    scenes = [contact_scene(gap, place) for gap in (4, 16, 64) for place in (0.0, 0.37)]

    def wrong(rung: str) -> int:
        return sum(int(np.count_nonzero(context.render(s, rung).any(-1))) for s in scenes)

    gap = 4 * np.float64(np.spacing(np.float32(1.0)))
    points = np.stack([*context.rng(38).uniform(-0.9, 0.9, (2, 500)), np.zeros(500)], -1)
    lid = pictures.grid(2) + np.array((0, 0, gap))
    naive = int(np.count_nonzero(~naive_hits(points, np.array((0.3, 0.2, 2.0)) - points, lid, NAIVE_EPSILON, 1.0)))
    size = scenes[0].camera.width
    return Outcome(
        len(scenes) * size**2,
        context.each_rung(wrong),
        naive,
        "gaps of 4, 16 and 64 ulp of 1; points of fast and watertight are known to 48 here",
    )


def contact_scene(ulps: float, place: float, size: int = 32) -> Scene:
    """Lower card at height `place`, glass `ulps` float32 ulps of 1 above it; the sky is white, the pixel black."""
    gap = ulps * float(np.spacing(np.float32(1.0)))
    eye, down = np.array((0.1, 0.2, 1.5)), np.array((0.0, 0.0, -1.0))
    text = camera(eye, down, 40.0, size, np.array((0.0, 1.0, 0.0))) + pictures.company(eye, down)
    text += "L 0.3 0.2 2\nbackground 1 1 1\nM 1 1 1 0 1 0 1 0\n" + pictures.triangles(1.5 * pictures.grid(2) + (0, 0, place))
    return parse_scene(text + "O\nM 1 1 1 0 0 0 1 0 1 1\n" + pictures.triangles(pictures.grid(2) + np.array((0, 0, place + gap))))


@case(55, "one sample of 1e30, NaN or infinity", provokes="an infinite picture", oracle="S", promised=ALL)
def one_bad_sample(context: Context) -> Outcome:
    """Such a sample is flagged at its pixel; every mean stays that of the good samples."""
    rng, height, width, samples = context.rng(55), 16, 16, 32
    wrong = naive = 0
    for bad in (1e30, -1e30, np.nan, np.inf, -np.inf):
        stack = rng.uniform(0.0, 2.0, (samples, height, width, 3)).astype(np.float32)
        good = stack.astype(np.float64)
        n, row, column = int(rng.integers(samples)), int(rng.integers(height)), int(rng.integers(width))
        stack[n, row, column, rng.integers(3)] = bad
        expected = good.mean(0)
        expected[row, column] = np.delete(good[:, row, column], n, axis=0).mean(0)
        film = Film(width, height)
        for picture in stack:
            film.add(picture)
        flagged = np.zeros((height, width), bool)
        flagged[row, column] = True
        wrong += int(np.count_nonzero((film.flagged != flagged) | ~(np.abs(film.mean - expected) < 1e-6).all(-1)))
        with np.errstate(all="ignore"):
            naive += int(np.count_nonzero(~(np.abs(stack.sum(0, dtype=np.float32) / samples - expected) < 1e-3).all(-1)))
    return Outcome(5 * height * width, context.each_rung(lambda rung: wrong), naive)
