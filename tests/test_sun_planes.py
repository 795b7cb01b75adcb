"""Rays along one direction: planes through each edge along it, and the rungs' promises for rays that are tested by them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pyopencl as cl
import pytest
from numpy.typing import NDArray

from clrt import renderer
from clrt.device import layout, program, session
from clrt.device.context import Device
from clrt.device.pack import local_origin
from clrt.device.prepare import prepare
from clrt.device.session import Buffers
from clrt.features import Features
from clrt.generate import needle_fan, uv_sphere
from clrt.precision import rung
from clrt.reference import exact
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene

PROBE = """
kernel void probe(global const Frame *frame, global const int2 *nodes, global const int *indices, global const Triangle *triangles,
                  global const EdgePlanes *eye_planes, global const double *vertices, global const Object *objects,
                  global const Surface *surfaces, global const Sun *suns, global const ParallelPlanes *sun_planes,
                  global const float *starts, int skip, volatile global int *decided, global int *found) {
    Geometry geometry = scene_geometry(frame, nodes, indices, triangles, eye_planes, vertices, objects, surfaces);
    geometry.parallel = sun_planes;
    DECIDED
    Rays rays;
    const int first = get_global_id(0) * LANES;
    real lane[LANES];
    for (int a = 0; a < 3; a++) {
        for (int k = 0; k < LANES; k++) lane[k] = starts[3 * (first + k) + a];
        rays.origin[a] = load_lanes(lane);
        rays.direction[a] = (real_n)suns[0].direction[a];
    }
    rays.t_min = (real_n)0;
    rays.t_max = (real_n)INFINITY;
    rays.skip = (mask_n)skip;
    rays.active = ~NO_LANES;
    rays_prepare(&rays, frame->extent);
    Hits hits;
    hits.t = (real_n)INFINITY;
    hits.slot = (mask_n)-1;
    LOW
    scene_trace(&geometry, &rays, SHARED_DIRECTION, 0, &hits);
    lane_int slot[LANES];
    store_lanes(hits.slot, slot);
    for (int k = 0; k < LANES; k++) found[first + k] = slot[k] < 0 ? -1 : surfaces[slot[k]].prim;
}
"""


def scene_of(corners: NDArray[np.float64], sun: str, *others: NDArray[np.float64]) -> Scene:
    """An object of triangles (n, 3, 3), and others."""
    lines = ["E 0 0 -9", "V 0 0 1", "F 40", "R 8 8", f"sun {sun}", "M 1 1 1  0 1 0 1  0"]
    for item in (corners, *others):
        lines += ["T " + "  ".join(" ".join(map(repr, corner)) for corner in t) for t in item.tolist()] + ["O"]
    return parse_scene("\n".join([*lines, ""]))


def filled(scene: Scene, precision: str, device: Device) -> tuple[Buffers, object, str]:
    """Buffers with all records made, the program, and its source."""
    trees = renderer.build_trees(scene, "sah", lambda phase, fraction: None)
    buffers, source, _ = renderer.fill_buffers(trees, Features.of(scene), rung(precision), device)
    of_exact = ("geometry.decided = decided;", "hits.low = hits.t;") if precision == "exact" else ("", "")
    source += PROBE.replace("DECIDED", of_exact[0]).replace("LOW", of_exact[1])
    built = program.build(device, source)
    prepare(buffers, built)
    return buffers, built, source


def hits(
    scene: Scene, starts: NDArray[np.float32], precision: str, device: Device, skip: int = -1
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Primitive ids of the first hits of rays to the sun: by the device, by rational arithmetic. `starts` : from the local origin."""
    buffers, built, _ = filled(scene, precision, device)
    starts = starts[: len(starts) // buffers.lanes * buffers.lanes]
    found = buffers.empty(4 * len(starts))
    decided = buffers.upload(np.zeros(2, np.int32), writable=True)
    nodes, indices, objects, surfaces, _materials = buffers.core
    given = buffers.frame, nodes, indices, buffers.triangles, buffers.eye_planes, buffers.vertices, objects, surfaces
    effects = buffers.effects["suns"], buffers.effects["sun_planes"]
    cl.Kernel(built, "probe")(
        device.queue, (len(starts) // buffers.lanes,), (1,), *given, *effects, buffers.upload(starts), np.int32(skip), decided, found
    )
    prims = np.empty(len(starts), np.int32)
    cl.enqueue_copy(device.queue, prims, found)
    direction = np.asarray(scene.suns[0].direction).astype(buffers.precision.real).astype(np.float64)
    origins = buffers.packed.origin + starts.astype(np.float64)
    expected, _ = exact.first_hit(scene.objects[0].vertices, origins, np.broadcast_to(direction, origins.shape))
    return prims, expected


def towards(scene: Scene, count: int, seed: int) -> NDArray[np.float32]:
    """(count, 3): starts of rays to the sun from the local origin, half of them at edges and corners as nearly as float32 can tell."""
    random = np.random.default_rng(seed)
    corners = scene.objects[0].vertices
    t = corners[random.integers(len(corners), size=count)]
    weights = random.dirichlet([1.0, 1.0, 1.0], count)
    kind = random.integers(4, size=count)
    weights[kind == 0] = np.eye(3)[random.integers(3, size=(kind == 0).sum())]
    weights[kind == 1, 0] = 0.0
    weights /= weights.sum(1, keepdims=True)
    way = random.uniform(0.0, 3.0, (count, 1)) * np.asarray(scene.suns[0].direction)
    return (np.einsum("nc,nca->na", weights, t) - way - local_origin(scene)).astype(np.float32)


def grid(n: int = 12) -> NDArray[np.float64]:
    """(2 n^2, 3, 3): squares of a plane at z = 1 in halves; every coordinate is a multiple of 1 / 16."""
    x = np.arange(n + 1) / 16 - 0.25
    points = np.stack([*np.meshgrid(x, x, indexing="ij"), np.ones((n + 1, n + 1))], -1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)])


MESHES = {
    "sphere": lambda: _corners(uv_sphere(700)),
    "needles": lambda: _corners(needle_fan(300)),
    "sphere far from the origin": lambda: _corners(uv_sphere(300)) + np.array([1e4, -3e3, 2e4]),
}


def _corners(mesh: tuple[NDArray[np.float64], NDArray[np.int64]]) -> NDArray[np.float64]:
    vertices, faces = mesh
    return vertices[faces].astype(np.float64)


@pytest.mark.parametrize("sun", ["1 2 -1", "0 0 1", "1 0 1e-6"])
@pytest.mark.parametrize("mesh", list(MESHES))
def test_exact_rays_along_a_sun_meet_the_triangle_of_rational_arithmetic(mesh: str, sun: str, device: Device) -> None:
    scene = scene_of(MESHES[mesh](), sun)
    found, expected = hits(scene, towards(scene, 2048, 5), "exact", device)
    assert (expected >= 0).mean() > 0.2
    np.testing.assert_array_equal(found, expected)


def at_corners_and_edges(scene: Scene) -> NDArray[np.float32]:
    """Starts of rays along z through every corner and the middle of every edge of `grid`, exactly."""
    corners = scene.objects[0].vertices
    points = np.concatenate([corners.reshape(-1, 3), (corners + np.roll(corners, 1, axis=1)).reshape(-1, 3) / 2])
    points[:, 2] = -0.5
    return (points - local_origin(scene)).astype(np.float32)


def test_exact_rays_along_a_sun_through_corners_and_edges(device: Device) -> None:
    scene = scene_of(grid(), "0 0 1")
    found, expected = hits(scene, at_corners_and_edges(scene), "exact", device)
    assert (expected >= 0).all()
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("precision", ["watertight", "double"])
@pytest.mark.parametrize("mesh", ["grid", "sphere", "needles"])
def test_no_ray_to_a_sun_passes_between_triangles(mesh: str, precision: str, device: Device) -> None:
    corners = grid() if mesh == "grid" else MESHES[mesh]()
    scene = scene_of(corners, "0 0 1" if mesh == "grid" else "1 2 -1")
    starts = at_corners_and_edges(scene) if mesh == "grid" else towards(scene, 2048, 7)
    found, expected = hits(scene, starts, precision, device)
    assert (expected >= 0).sum() > 500
    assert (found[expected >= 0] >= 0).all()


@pytest.mark.parametrize("precision", ["watertight", "double"])
def test_signs_of_edge_functions_along_a_sun_are_right_beyond_their_bound(precision: str, device: Device) -> None:
    """From the records, for rays that pass edges as nearly as float32 can tell, against rational arithmetic."""
    random = np.random.default_rng(3)
    size = 10.0 ** random.uniform(-4.0, 0.0, (120, 1, 1))
    scene = scene_of(random.uniform(-1.0, 1.0, (120, 1, 3)) + random.normal(0.0, 1.0, (120, 3, 3)) * size, "1 2 -1")
    buffers, _, _ = filled(scene, precision, device)
    real = buffers.precision.real
    planes = np.empty(buffers.packed.slots, layout.parallel_planes(real))
    cl.enqueue_copy(device.queue, planes, buffers.effects["sun_planes"])
    corners, to_sun = buffers.packed.vertices.reshape(-1, 3, 3), np.asarray(scene.suns[0].direction).astype(real)
    along, origin = [Fraction(float(x)) for x in to_sun], [Fraction(float(x)) for x in buffers.packed.origin]
    extent = np.abs(corners - buffers.packed.origin).sum(2).max()
    wrong = []
    for slot, c in np.ndindex(len(planes), 3):
        plane, ends = planes["uvw"[c]][slot], corners[slot, [(c + 1) % 3, (c + 2) % 3]]
        for weight, way in random.uniform([0.0, -2.0], [1.0, 2.0], (4, 2)):
            p = (ends[0] + weight * (ends[1] - ends[0]) - way * to_sun - buffers.packed.origin).astype(real)
            at = [Fraction(float(x)) + o for x, o in zip(p, origin, strict=True)]
            b, e = ([Fraction(float(x)) - o for x, o in zip(end, at, strict=True)] for end in ends)
            true = sum(along[i] * (b[(i + 1) % 3] * e[(i + 2) % 3] - b[(i + 2) % 3] * e[(i + 1) % 3]) for i in range(3))
            computed = plane[3]
            for a in (2, 1, 0):
                computed = p[a] * plane[a] + computed
            if computed * np.sign(float(true)) <= 0.0:
                wrong.append(abs(computed) / (float(planes["bound"][slot]) * (np.abs(p).sum() + extent)))
    assert len(wrong) > 20
    assert max(wrong) <= 1.0
    assert max(wrong) > 0.01, "a bound a hundred times too wide would send every ray to float64"


#: size and place of a globe: so far from the world's origin that starts of rays are rounded there by more than float32 rounds
#: beside them; far smaller than the scene, so that products of its numbers have no room in float32
EXTREMES = {"far off": (1.0, [1e13, -3e13, 2e13]), "tiny": (1e-21, [0.0, 0.0, 0.0])}


@pytest.mark.parametrize("precision", ["watertight", "exact"])
@pytest.mark.parametrize("extreme", list(EXTREMES))
def test_no_ray_along_a_sun_is_lost_far_from_the_origin_or_on_what_is_tiny(extreme: str, precision: str, device: Device) -> None:
    size, place = EXTREMES[extreme]
    globe = _corners(uv_sphere(200)) * size + np.array(place)
    around = np.array([[[-1.0, 9.0, -1.0], [1.0, 9.0, -1.0], [0.0, 9.0, 1.0]], [[-1.0, -9.0, -1.0], [1.0, -9.0, -1.0], [0.0, -9.0, 1.0]]])
    scene = scene_of(globe, "1 2 -1", around + np.array(place))
    random = np.random.default_rng(8)
    weights = random.dirichlet([0.4, 0.4, 0.4], 16384)
    weights[:, 0] = 0.0
    points = np.einsum("nc,nca->na", weights / weights.sum(1, keepdims=True), globe[random.integers(len(globe), size=len(weights))])
    rounded = max(np.spacing(np.abs(place).max()), 1e-7 * size)
    points += rounded * random.normal(size=points.shape) * 10.0 ** random.uniform(-4.0, 1.0, (len(points), 1))
    way = size * random.uniform(0.5, 3.0, (len(weights), 1)) * np.asarray(scene.suns[0].direction)
    found, expected = hits(scene, (points - way - local_origin(scene)).astype(np.float32), precision, device)
    assert (expected >= 0).mean() > 0.8
    assert (found[expected >= 0] >= 0).all()
    if precision == "exact":
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("width", [1e-3, 1e-4, 3e-5])
def test_watertight_needles_do_not_reach_beyond_their_tips(width: float, device: Device) -> None:
    """Of rays beside the tip of a needle of length 1, none that passes by farther than a fiftieth of it is stopped."""
    needle = np.array([[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, width, 1.0]], [[-3.0, -3.0, 1.5], [-2.9, -3.0, 1.5], [-3.0, -2.9, 1.5]]])
    scene = scene_of(needle, "0 0 1")
    beyond = np.linspace(-0.2, -0.02, 1600)
    starts = np.stack([beyond, np.random.default_rng(2).uniform(-2e-6, 2e-6, 1600), np.zeros(1600)], axis=1)
    found, expected = hits(scene, (starts - local_origin(scene)).astype(np.float32), "watertight", device)
    assert (expected < 0).all()
    assert (found < 0).all()


@pytest.mark.parametrize("precision", ["fast", "watertight", "exact"])
def test_a_ray_passes_by_the_triangle_that_it_starts_on(precision: str, device: Device) -> None:
    """Started just below it, where it is met for sure."""
    triangle = np.array([[-1.0, -1.0, 1.0], [3.0, -1.0, 1.0], [-1.0, 3.0, 1.0]])
    scene = scene_of(np.stack([triangle, triangle + 9.0]), "0 0 1")
    starts = (np.random.default_rng(4).uniform(-0.9, 0.9, (64, 3)) * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.999]) - local_origin(scene)
    for skip, met in ((-1, 0), (0, -1)):
        found, _ = hits(scene, starts.astype(np.float32), precision, device, skip)
        np.testing.assert_array_equal(found, met)


def test_triangles_at_an_edge_have_the_same_plane_along_a_sun_with_the_other_sign(device: Device) -> None:
    scene = scene_of(_corners(uv_sphere(300)), "1 2 -1")
    buffers, _, _ = filled(scene, "watertight", device)
    planes = np.empty(buffers.packed.slots, layout.parallel_planes(np.float32))
    cl.enqueue_copy(device.queue, planes, buffers.effects["sun_planes"])
    corners = buffers.packed.vertices.reshape(-1, 3, 3)
    edges = {}
    for slot, t in enumerate(corners):
        for c, name in enumerate("uvw"):
            edges[tuple(t[(c + 1) % 3]), tuple(t[(c + 2) % 3])] = planes[name][slot]
    pairs = [(plane, edges[end, begin]) for (begin, end), plane in edges.items() if (end, begin) in edges]
    assert len(pairs) > 600
    for one, other in pairs:
        np.testing.assert_array_equal(one, -other)


def test_without_room_for_planes_rays_to_suns_are_as_all_others(monkeypatch: pytest.MonkeyPatch, device: Device) -> None:
    ground = np.array([[[-2.0, -1.5, -2.0], [-2.0, -1.5, 5.0], [4.0, -1.5, 0.0]]])
    scene = scene_of(np.concatenate([_corners(uv_sphere(200)), ground]), "1 2 -1")
    pictures = [renderer.render(scene, precision="exact", size=(64, 48)).pixels]
    for module in (session, renderer):
        monkeypatch.setattr(module, "shares_suns", lambda *given: False)
    buffers, _, source = filled(scene, "exact", device)
    assert f"#define SUN_SHARED {program.SHARED_NOTHING}\n" in source
    assert buffers.effects["sun_planes"].size == layout.parallel_planes(np.float32).itemsize
    pictures.append(renderer.render(scene, precision="exact", size=(64, 48)).pixels)
    np.testing.assert_array_equal(*pictures)
    assert len(np.unique(pictures[0])) > 3
