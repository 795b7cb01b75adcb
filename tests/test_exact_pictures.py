"""The rung `exact` in pictures: what each pixel shows is the triangle of rational arithmetic, for the directions the camera made.

Every triangle gets a colour of its own and there is no light, so a picture tells primitive ids. Rays here share the eye, and
with it the edge planes; tests/test_rays.py covers rays of any origin.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyopencl as cl
import pytest

from clrt import renderer
from clrt.device import program
from clrt.device.context import Device
from clrt.features import Features
from clrt.generate import grid_mesh, needle_fan, uv_sphere
from clrt.precision import rung
from clrt.reference import exact
from clrt.scene.model import Camera, Material, MeshObject, Scene

PROBE = """
kernel void probe(global const Frame *frame, global float *out) {
    const int column = get_global_id(0) * PACKET_WIDTH, row = get_global_id(1) * PACKET_HEIGHT;
    Rays rays;
    camera_rays(frame, column, row, &rays);
    float lane[LANES];
    for (int a = 0; a < 3; a++) {
        store_lanes(rays.direction[a], lane);
        for (int k = 0; k < LANES; k++)
            out[3 * ((row + k / PACKET_WIDTH) * frame->width + column + k % PACKET_WIDTH) + a] = lane[k];
    }
}
"""


def _scene(vertices: np.ndarray, faces: np.ndarray, eye: np.ndarray, target: np.ndarray, size: int, fov: float) -> Scene:
    corners = vertices[faces].astype(np.float64)
    count = len(corners)
    materials = tuple(Material(((i + 1) / 2**16, 1.0, 0.0), 1.0, 0.0, 0.0, 1.0) for i in range(count))
    item = MeshObject(corners, np.zeros((count, 3)), np.arange(count, dtype=np.int32), 0)
    camera = Camera.from_view(eye, target - eye, np.array([0.0, 1.0, 0.0]), fov, size, size)
    return Scene(camera, (), materials, (item,))


def _visible(scene: Scene, device: Device, precision: str) -> tuple[np.ndarray, np.ndarray]:
    """Primitive ids of the picture, (n,), and the float32 directions of its rays, (n, 3)."""
    quiet = lambda phase, fraction: None  # noqa: E731
    features, ladder = Features.of(scene), rung(precision)
    prepared = renderer.build_trees(scene, "sah", quiet)
    buffers, tracer, source, _ = renderer.open_tracer(prepared, features, ladder, device, quiet)
    renderer.run_rows(tracer, "render", quiet)
    seen = np.rint(tracer.picture()[..., 0] * 2**16).astype(np.int64).ravel() - 1
    directions = np.empty((scene.camera.width * scene.camera.height, 3), np.float32)
    out = buffers.empty(directions.nbytes)
    width, height = program.PACKETS[buffers.lanes]
    kernel = cl.Kernel(program.build(device, source + PROBE), "probe")
    kernel(device.queue, (scene.camera.width // width, scene.camera.height // height), None, buffers.frame, out)
    cl.enqueue_copy(device.queue, directions, out)
    return seen, directions


def _meshes() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    sphere, fan, grid = uv_sphere(900), needle_fan(400), grid_mesh(800, seed=2)
    doubled = (np.concatenate([grid[0], grid[0]]), np.concatenate([grid[1], grid[1] + len(grid[0])]))
    return {"sphere": sphere, "needles": fan, "grid": grid, "every triangle twice": doubled}


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6])
@pytest.mark.parametrize("name", ["sphere", "needles", "grid", "every triangle twice"])
def test_exact_picture_shows_the_triangle_of_rational_arithmetic(device: Device, name: str, offset: float) -> None:
    vertices, faces = _meshes()[name]
    shift = np.array([offset, -offset / 3, offset * 2])
    eye = np.array([0.3, 0.4, -2.5]) + shift
    scene = _scene(vertices + shift, faces, eye, shift.copy(), 48, 50.0)
    seen, directions = _visible(scene, device, "exact")
    expected, _ = exact.first_hit(scene.objects[0].vertices, np.broadcast_to(eye, directions.shape), directions)
    assert (expected >= 0).sum() > 200
    assert np.array_equal(seen, expected)


@pytest.mark.parametrize("size", [1e-20, 1e-21, 1e-22])
def test_exact_picture_of_what_is_tiny_in_a_large_scene(device: Device, size: float) -> None:
    """Seen from as near: products of its numbers have no room in float32. A triangle far greater stands behind it."""
    vertices, faces = uv_sphere(900)
    behind = np.array([[-3.0, -3.0, 3.0], [3.0, -3.0, 3.0], [0.0, 6.0, 3.0]])
    faces = np.concatenate([faces, len(vertices) + np.arange(3)[None]])
    vertices = np.concatenate([vertices * size, behind])
    eye = np.array([0.3, 0.4, -2.5]) * size
    scene = _scene(vertices, faces, eye, np.zeros(3), 48, 50.0)
    seen, directions = _visible(scene, device, "exact")
    expected, _ = exact.first_hit(scene.objects[0].vertices, np.broadcast_to(eye, directions.shape), directions)
    assert (expected < 900).sum() > 200
    assert np.array_equal(seen, expected)


def test_exact_picture_through_vertices_and_edges(device: Device) -> None:
    """A grid in front of the eye whose every vertex lies on a pixel's ray: all decisions are ties, which `fast` gets wrong."""
    n = 16
    x = (np.arange(n + 1) - n / 2) / n
    points = np.stack(np.meshgrid(x, x, indexing="xy"), -1).reshape(-1, 2)
    vertices = np.concatenate([points, np.ones((len(points), 1))], 1)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="xy"))
    a, b, c, d = (k * (n + 1) + m for k, m in ((j, i), (j, i + 1), (j + 1, i + 1), (j + 1, i)))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    scene = _scene(vertices, faces, np.zeros(3), np.array([0.0, 0.0, 1.0]), 64, np.degrees(2 * np.arctan(0.5)))
    # Pixel centres at (i + 0.5) / 64 - 0.5: shifted by half a pixel they fall onto the grid's vertices and edges.
    corners = scene.camera.corners + np.array([0.5 / 64, 0.5 / 64, 0.0])
    scene = replace(scene, camera=replace(scene.camera, corners=corners))
    seen, directions = _visible(scene, device, "exact")
    expected, _ = exact.first_hit(scene.objects[0].vertices, np.zeros_like(directions), directions)
    assert np.array_equal(seen, expected)
    assert (_visible(scene, device, "fast")[0] != expected).any(), "the case must bite"


def test_few_lanes_leave_the_filter(device: Device) -> None:
    vertices, faces = uv_sphere(5000)
    scene = _scene(vertices, faces, np.array([0.3, 0.4, -2.5]), np.zeros(3), 256, 50.0)
    image = renderer.render(scene, precision="exact")
    assert image.stats is not None
    assert image.stats.decided is not None
    assert 0 < sum(image.stats.decided.values()) < 0.05 * 256 * 256
