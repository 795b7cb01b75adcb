"""Cases 43 to 49: refraction at its limits, and dielectrics inside of each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from clrt import renderer
from clrt.device.context import open_device
from clrt.features import Features
from clrt.precision import rung as rung_named
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene
from clrt.verify import pictures, probe
from clrt.verify.case import ALL, Context, Outcome, case
from clrt.verify.pictures import camera

FloatArray = NDArray[np.float64]
Wide = np.longdouble

_KERNEL = """
kernel void probe_snell(global const real *d, global const real *n, global const real *ratio, global real *turned, global int *passes) {
    const int i = get_global_id(0);
    real from[3], about[3], to[3] = {0, 0, 0};
    for (int a = 0; a < 3; a++) from[a] = d[3 * i + a], about[a] = n[3 * i + a];
    passes[i] = refraction_snell(from, about, ratio[i], to);
    for (int a = 0; a < 3; a++) turned[3 * i + a] = to[a];
}
kernel void probe_fresnel(global const real *cosine, global const real *n1, global const real *n2, global real *back,
                          global real *through) {
    const int i = get_global_id(0);
    back[i] = fresnel_dielectric(cosine[i], n1[i], n2[i]);
    through[i] = fresnel_transmitted(cosine[i], n1[i], n2[i]);
}
"""


def _snell(context: Context, rung: str, d: FloatArray, n: FloatArray, ratio: FloatArray) -> tuple[FloatArray, NDArray[np.int32]]:
    real = rung_named(rung).real
    turned, passes = np.zeros(d.shape, real), np.zeros(len(d), np.int32)
    arrays = [d.astype(real), n.astype(real), ratio.astype(real), turned, passes]
    _probe(context, rung, "probe_snell", len(d), arrays)
    return turned.astype(np.float64), passes


def _fresnel(context: Context, rung: str, cosine: FloatArray, n1: FloatArray, n2: FloatArray) -> tuple[FloatArray, FloatArray]:
    real = rung_named(rung).real
    back, through = np.zeros(len(cosine), real), np.zeros(len(cosine), real)
    _probe(context, rung, "probe_fresnel", len(cosine), [cosine.astype(real), n1.astype(real), n2.astype(real), back, through])
    return back.astype(np.float64), through.astype(np.float64)


def _probe(context: Context, rung: str, name: str, items: int, arrays: list[NDArray[np.generic]]) -> None:
    effects = ("refraction", "mirror", "bounce")
    probe.run(_KERNEL, name, items, arrays, device=context.device, precision=rung, effects=effects, files=("fresnel.cl",))


def _unit(rung: str) -> float:
    return 2.0 ** (-53 if rung_named(rung).bits == 64 else -24)


def _at_angle(sine: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Rays d and normals n, (m, 3) unit, with the given sine between them, turned at random."""
    m = len(sine)
    turn = np.stack([pictures.rotation(rng) for _ in range(64)])[np.arange(m) % 64]
    d = np.stack([sine, np.zeros(m), -np.sqrt(1.0 - sine**2)], -1)
    return np.einsum("mij,mj->mi", turn, d), np.ascontiguousarray(turn[..., 2])


@case(43, "refraction at the critical angle +- ulps", provokes="the root of a negative", oracle="S", promised=ALL)
def critical_angle(context: Context) -> Outcome:
    """Finite, F in [0, 1], unit directions along the surface; passing or total as the given numbers have it, but for 4 ulp of the sine."""
    rng, count = context.rng(43), context.share(0.1)
    ratio = rng.uniform(1.01, 2.5, count).astype(np.float32).astype(np.float64)
    steps = rng.integers(-64, 65, count)

    def inputs(rung: str) -> tuple[FloatArray, FloatArray]:
        real = rung_named(rung).real
        d, n = _at_angle(np.minimum((1.0 / ratio) * (1.0 + steps * _unit(rung)), 1.0), rng)
        d, n = (a / np.sqrt((a * a).sum(-1, keepdims=True)) for a in (d.astype(Wide), n.astype(Wide)))
        return d.astype(real).astype(np.float64), n.astype(real).astype(np.float64)

    def wrong(rung: str) -> int:
        d, n = inputs(rung)
        turned, passes = _snell(context, rung, d, n, ratio)
        wide_d, wide_n = d.astype(Wide), n.astype(Wide)
        rest = 1 - ratio.astype(Wide) ** 2 * (np.cross(wide_d, wide_n) ** 2).sum(-1)
        sure = np.abs(rest) > 16 * _unit(rung) * ratio**2  # 4 ulp of the sine, or of the lengths of d and n
        length = np.linalg.norm(turned, axis=-1)
        bad = ~np.isfinite(turned).all(-1) | (sure & (passes != (rest >= 0))) | ((passes == 1) & ~(np.abs(length - 1) < 16 * _unit(rung)))
        cosine = np.abs((d * n).sum(-1))
        for indices in ((ratio, np.ones(count)), (np.full(count, 1.5), 1.5 / ratio)):
            back, through = _fresnel(context, rung, cosine, *indices)
            bad |= ~((back >= 0) & (back <= 1) & (through >= 0) & (through <= 1))
        return int(np.count_nonzero(bad))

    d, n = (a.astype(np.float32) for a in inputs("watertight"))
    c = -(d * n).sum(-1, dtype=np.float32)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(1 - (ratio.astype(np.float32) ** 2) * (1 - c * c))
    return Outcome(count, context.each_rung(wrong), int(np.count_nonzero(np.isnan(root))), "within 64 ulp of it")


@case(44, "equal indices, at normal incidence and every other", provokes="0/0", oracle="S", promised=ALL)
def equal_indices(context: Context) -> Outcome:
    """F = 0, T = 1, and the ray goes straight on."""
    rng, count = context.rng(44), context.share(0.1)
    sine = np.concatenate(
        [np.zeros(count // 4), rng.uniform(0, 1, count // 2), 1 - 10.0 ** rng.uniform(-12, -1, count - count // 4 - count // 2)]
    )
    index = rng.uniform(1, 2.5, count)

    def wrong(rung: str) -> int:
        d, n = _at_angle(sine, rng)
        turned, passes = _snell(context, rung, d, n, np.ones(count))
        cosine = np.sqrt((1 - sine) * (1 + sine))
        back, through = _fresnel(context, rung, cosine, index, index)
        # Along the surface to the last bit (0), or away from the viewer by rounding (-1): no side to pass to.
        straight = (np.abs(turned - d) <= 8 * _unit(rung)).all(-1) | ((passes != 1) & (cosine < 8 * _unit(rung)))
        return int(np.count_nonzero(~straight | (back != 0) | (through != 1)))

    i = np.arcsin(sine.astype(np.float32))
    t = np.arcsin(np.minimum(np.sin(i), np.float32(1)))
    with np.errstate(invalid="ignore", divide="ignore"):
        naive = (np.sin(i - t) / np.sin(i + t)) ** 2 + (np.tan(i - t) / np.tan(i + t)) ** 2
    return Outcome(count, context.each_rung(wrong), int(np.count_nonzero(~(naive == 0))))


def _exact_fresnel(cosine: FloatArray, n1: FloatArray, n2: FloatArray) -> tuple[NDArray[np.longdouble], NDArray[np.longdouble]]:
    """F and T in extended precision, from the amplitudes of both polarisations."""
    c, a, b = (x.astype(Wide) for x in (cosine, n1, n2))
    square = 1 - (a / b) ** 2 * (1 - c) * (1 + c)
    inner = np.sqrt(np.maximum(square, 0))
    through = 2 * a * c * b * inner * (1 / (a * c + b * inner) ** 2 + 1 / (b * c + a * inner) ** 2)
    across = (b - a) * (b + a) / (a * c + b * inner) ** 2
    along = (b * c - a * inner) / (b * c + a * inner)
    back = (across**2 + along**2) / 2
    return np.where(square <= 0, Wide(1), back), np.where(square <= 0, Wide(0), through)


@case(45, "Fresnel at cos 1e-8 and at nearly equal indices", provokes="lost digits", oracle="D", promised=ALL)
def fresnel_limits(context: Context) -> Outcome:
    """Both shares, reflected and transmitted, within 1e-5 of themselves."""
    rng, count = context.rng(45), context.share(0.2)
    cosine: NDArray[np.float32] = np.concatenate([10.0 ** rng.uniform(-8, 0, count // 2), rng.uniform(0, 1, count - count // 2)]).astype(
        np.float32
    )
    cosine[::7] = 1e-8
    n1 = rng.uniform(1, 2.5, count).astype(np.float32)
    n2 = np.where(rng.random(count) < 0.5, rng.uniform(1, 2.5, count).astype(np.float32), np.nextafter(n1, np.float32(9)))
    given = [a.astype(np.float64) for a in (cosine, n1, n2)]
    back, through = _exact_fresnel(*given)

    def off(f: NDArray[np.floating], t: NDArray[np.floating]) -> int:
        return int(np.count_nonzero(~((np.abs(f - back) <= 1e-5 * back) & (np.abs(t - through) <= 1e-5 * through))))

    counts = context.each_rung(lambda rung: off(*_fresnel(context, rung, *given)))
    ratio = n1 / n2
    square = 1 - ratio * ratio * (1 - cosine * cosine)
    inner = np.sqrt(np.maximum(square, 0))
    s, p = (n1 * cosine - n2 * inner) / (n1 * cosine + n2 * inner), (n2 * cosine - n1 * inner) / (n2 * cosine + n1 * inner)
    f = (s * s + p * p) / 2
    return Outcome(count, counts, off(f, 1 - f))


STRIPES = 24  #: cards behind the glass, each of a colour of its own
_HALF = 0.75  #: half the width of all cards


def _cards(z: float) -> str:
    """Vertical cards at height z, the k-th one of the colour ((k + 1) / STRIPES, 1 - (k + 1) / STRIPES, 1), glowing by themselves."""
    edges = np.linspace(-_HALF, _HALF, STRIPES + 1)
    lines = []
    for k in range(STRIPES):
        share = (k + 1) / STRIPES
        ring = np.array([[(edges[k], -9, z), (edges[k + 1], -9, z), (edges[k + 1], 9, z), (edges[k], 9, z)]])
        lines.append(f"M {share!r} {1 - share!r} 1 1 0 0 1 0\n" + pictures.triangles(pictures.quads(ring)))
    return "".join(lines) + "O\n"


def _slab(lo: float, hi: float, half: float) -> str:
    return pictures.triangles(pictures.box((-half, -half, lo), (half, half, hi))) + "O\n"


def _view(size: int, fov: float, z: float = 0.0) -> str:
    eye, up = np.array((0.013, 0.007, z)), np.array((0.0, 1.0, 0.0))
    view = np.array((0.0, 0.0, 1.0))
    return camera(eye, view, fov, size, up) + pictures.company(eye, view)


def _seen(scene: Scene, layers: list[tuple[float, float]], first: float, wall: float) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The colours behind plane layers, (thickness, index) each from the eye on, and which pixels are certain.

    By Snell, n sin is the same in every layer: `first` times the sine at the eye. A pixel that leads within 1e-3 of a card's edge or the
    critical angle of a layer, is not certain; where a layer reflects it totally it is black.
    """
    d = scene.camera.directions()
    sine = first * np.hypot(d[..., 0], d[..., 1])
    aside, total, sure = np.zeros(sine.shape), np.zeros(sine.shape, bool), np.ones(sine.shape, bool)
    for thickness, index in layers:
        sure &= np.abs(sine - index) > 1e-3
        total |= sine >= index
        aside += np.where(total, 0.0, thickness * sine / np.sqrt(np.maximum(index**2 - sine**2, 1e-12)))
    along = np.divide(d[..., 0], np.hypot(d[..., 0], d[..., 1]), out=np.zeros(sine.shape), where=sine > 0)
    place = (scene.camera.eye[0] + aside * along + _HALF) / (2 * _HALF) * STRIPES
    share = (np.floor(place) + 1) / STRIPES
    sure &= total | ((np.abs(place - np.rint(place)) > 1e-3 * STRIPES) & (place > 0.01) & (place < STRIPES - 0.01))
    color = np.stack([share, 1 - share, np.ones(share.shape)], -1)
    return np.where(total[..., None], 0.0, color) * wall, sure


def _off(pixels: NDArray[np.float32], expected: FloatArray, sure: NDArray[np.bool_]) -> int:
    return int(np.count_nonzero(sure & ~(np.abs(pixels - expected) <= 1e-4).all(-1)))


def _judge(context: Context, scenes: list[tuple[Scene, FloatArray, NDArray[np.bool_]]], naive: list[FloatArray], note: str = "") -> Outcome:
    counts = context.each_rung(lambda rung: sum(_off(context.render(s, rung), e, sure) for s, e, sure in scenes))
    wrong = sum(_off(n.astype(np.float32), e, sure) for n, (_, e, sure) in zip(naive, scenes, strict=True))
    return Outcome(sum(int(sure.sum()) for _, _, sure in scenes), counts, wrong, note)


def _glass(index: float) -> str:
    return f"M 1 1 1 0 0 0 1 0 1 {index!r}\n"


@case(46, "glass, water and air inside each other", provokes="the wrong index", oracle="S", promised=ALL)
def nested(context: Context) -> Outcome:
    """Boxes inside boxes, in every order of the text, and two that overlap: the cards behind them are where Snell's law puts them."""
    boxes = {1.5: (1.0, 3.0, 40.0), 1.33: (1.2, 2.6, 39.0), 1.0: (1.5, 2.2, 38.0)}
    layers = [(1.0, 1.0), (0.2, 1.5), (0.3, 1.33), (0.7, 1.0), (0.4, 1.33), (0.4, 1.5), (0.2, 1.0)]
    scenes, naive = [], []
    for order in ((1.5, 1.33, 1.0), (1.0, 1.33, 1.5), (1.33, 1.5, 1.0)):
        text = _view(64, 22.0) + _cards(3.2) + "".join(_glass(index) + _slab(*boxes[index]) for index in order)
        scene = parse_scene(text)
        scenes.append((scene, *_seen(scene, layers, 1.0, 1.0)))
        naive.append(_seen(scene, [(1.2, 1.0), (1.8, 1.5), (0.2, 1.0)], 1.0, 1.0)[0])  # the outermost index alone
    overlapping = {1.7: (1.0, 2.2, 40.0), 1.3: (1.8, 3.0, 40.0)}
    for first, second in ((1.7, 1.3), (1.3, 1.7)):  # the second has the say between 1.8 and 2.2
        text = _view(64, 22.0) + _cards(3.2) + "".join(_glass(index) + _slab(*overlapping[index]) for index in (first, second))
        scene = parse_scene(text)
        middle = [(0.8, 1.7), (1.2, 1.3)] if second == 1.3 else [(1.2, 1.7), (0.8, 1.3)]
        scenes.append((scene, *_seen(scene, [(1.0, 1.0), *middle, (0.2, 1.0)], 1.0, 1.0)))
        naive.append(_seen(scene, [(1.0, 1.0), (0.8, 1.7), (0.4, 1.0), (0.8, 1.3), (0.2, 1.0)], 1.0, 1.0)[0])  # no media between
    return _judge(context, scenes, naive)


@case(47, "the camera inside glass", provokes="the first medium", oracle="S", promised=ALL)
def camera_inside(context: Context) -> Outcome:
    """Out of a block of glass, and out of water in glass, to the cards; beyond the critical angle, nothing."""
    scenes, naive = [], []
    for text, layers, first in (
        (_glass(1.5) + _slab(-1.0, 0.5, 40.0), [(0.5, 1.5), (0.3, 1.0)], 1.5),
        (_glass(1.5) + _slab(-1.0, 0.5, 40.0) + _glass(1.33) + _slab(-0.5, 0.2, 39.0), [(0.2, 1.33), (0.3, 1.5), (0.3, 1.0)], 1.33),
    ):
        scene = parse_scene(_view(64, 100.0) + _cards(0.8) + text)
        scenes.append((scene, *_seen(scene, layers, first, 1.0)))
        naive.append(_seen(scene, layers, 1.0, 1.0)[0])  # the eye taken to be in air
    scenes = [(s, e, sure & ~(e == 0).all(-1)) for s, e, sure in scenes]
    return _judge(context, scenes, naive, "pixels of total reflection left out")


@case(48, "coincident nested walls", provokes="one event for two walls", oracle="S", promised=ALL)
def coincident(context: Context) -> Outcome:
    """Water that fills a glass to its very walls, in both orders of the text."""
    shell = (
        pictures.triangles(pictures.box((-40, -40, 1.0), (40, 40, 2.0)))
        + pictures.triangles(pictures.box((-39, -39, 1.2), (39, 39, 1.7)))
        + "O\n"
    )
    water = _slab(1.2, 1.7, 39.0)
    layers = [(1.0, 1.0), (0.2, 1.5), (0.5, 1.33), (0.3, 1.5), (0.2, 1.0)]
    scenes, naive = [], []
    for text in (_glass(1.5) + shell + _glass(1.33) + water, _glass(1.33) + water + _glass(1.5) + shell):
        scene = parse_scene(_view(64, 32.0) + _cards(2.2) + text)
        scenes.append((scene, *_seen(scene, layers, 1.0, 1.0)))
        naive.append(_seen(scene, [(1.0, 1.0), (0.2, 1.5), (0.5, 1.0), (0.3, 1.5), (0.2, 1.0)], 1.0, 1.0)[0])  # the second wall lost
    return _judge(context, scenes, naive)


REFLECTIONS = 100
KEPT = 0.99  #: of the light, at each total reflection


@case(49, "100 internal reflections", provokes="drift", oracle="S", promised=ALL)
def many_reflections(context: Context) -> Outcome:
    """Along a square rod of glass: what is left after the reflections on each pixel's way, counted by unfolding the rod: within 1e-4."""
    half, size = 0.025, 32
    rod = pictures.triangles(pictures.box((-half, -half, 0.5), (half, half, 6.0))) + "O\n"
    text = _view(size, 100.0, 0.499) + f"M 1 1 1 0 0 0 1 0 {KEPT!r} 1.6\n" + rod
    text += (
        "M 1 1 1 1 0 0 1 0\n"
        + pictures.triangles(pictures.quads(np.array([[(-1, -1, 6.1), (1, -1, 6.1), (1, 1, 6.1), (-1, 1, 6.1)]])))
        + "O\n"
    )
    scene = replace(parse_scene(text), depth=REFLECTIONS + 10)
    d = scene.camera.directions()
    inside = d * (1, 1, 0) / 1.6
    inside[..., 2] = np.sqrt(1 - (inside[..., :2] ** 2).sum(-1))
    start = scene.camera.eye[:2] + 0.001 * d[..., :2] / d[..., 2:]
    first = (start + half) / (2 * half)
    place = first + 5.5 * inside[..., :2] / inside[..., 2:] / (2 * half)
    turns = np.abs(np.floor(place)).sum(-1)
    sure = (
        (np.abs(place - np.rint(place)) > 0.01).all(-1)
        & (np.abs(start) < half).all(-1)
        & (turns <= REFLECTIONS + 4)
        & (_off_corners(first, place) > 1e-3)
    )
    expected = KEPT ** (turns + 2)

    def wrong(rung: str) -> int:
        tracer = renderer.open_tracer(
            renderer.build_trees(scene, "sah", _quiet), Features.of(scene), rung_named(rung), open_device(context.device), _quiet
        )[1]
        renderer.run_rows(tracer, "render", _quiet)
        return int(np.count_nonzero(sure[..., None] & ~(np.abs(tracer.picture() / expected[..., None] - 1) <= 1e-4)))

    return Outcome(
        int(sure.sum()), context.each_rung(wrong), _drifted(context, 1.6), f"up to {int(turns[sure].max())} reflections in a row"
    )


def _off_corners(first: FloatArray, last: FloatArray) -> FloatArray:
    """(h, w): how near the line from `first` to `last`, (h, w, 2) each, comes to a corner of the unit lattice: two walls at once."""
    nearest = np.full(first.shape[:2], np.inf)
    run = last - first
    for axis in (0, 1):
        for wall in range(-REFLECTIONS, REFLECTIONS + 1):
            with np.errstate(divide="ignore", invalid="ignore"):
                share = (wall - first[..., axis]) / run[..., axis]
                other = first[..., 1 - axis] + share * run[..., 1 - axis]
                gap = np.abs(other - np.rint(other))
            nearest = np.where((share > 0) & (share < 1), np.minimum(nearest, gap), nearest)
    return nearest


def _drifted(context: Context, index: float) -> int:
    """Rays whose weight is off by more than 1e-4 after REFLECTIONS, with a computed share in place of total reflection's 1."""
    cosine = context.rng(49).uniform(0.05, 0.2, 1000).astype(np.float32)
    sine = np.sqrt(1 - cosine * cosine) * np.float32(index)
    inner = np.sqrt(np.maximum(1 - sine * sine, np.float32(1e-8)))  # a negative root clamped to something small
    n = np.float32(index)
    s = (n * cosine - inner) / (n * cosine + inner)
    return int(np.count_nonzero(np.abs((s * s) ** REFLECTIONS - 1) > 1e-4))


def _quiet(phase: str, fraction: float) -> None:
    pass
