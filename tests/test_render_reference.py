"""The kernels' pictures against the float64 reference, pixel by pixel.

A pixel may differ by more than BOUND only where the reference says that one of its decisions lies within MARGIN of
falling the other way (an angle: distance from an edge over distance from the ray's origin); those are counted.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from device_pictures import in_packets

import clrt.reference
from clrt import renderer
from clrt.device.context import Device
from clrt.errors import LimitError
from clrt.features import Features
from clrt.generate import rabbit_like
from clrt.precision import RUNGS, rung
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.model import Scene

BOUND = 1e-4
MARGIN = 2e-5
CAMERA = "E 0 0 -1\nV 0 0 1\nF 45\nR 64 64\nL 5 5 -5\n"
PLAIN = "M 0.5 0.5 1.0 0.1 0.9 0.3 20 0 0 1.6\n"
FLOOR = "M 1 1 0.5 0.1 0.9 0.3 20 0.5 0 0\nT -9 -1 12 9 -1 12 9 -1 0.5\nT -9 -1 12 9 -1 0.5 -9 -1 0.5\nO\n"


def _triangle(*corners: tuple[float, ...]) -> str:
    return "T " + " ".join(str(x) for corner in corners for x in corner) + "\n"


BOX = "".join(
    _triangle(a, b, c) + _triangle(a, c, d)
    for a, b, c, d in (
        ((-1, -0.7, 3), (1, -0.7, 3), (1, 0.7, 3), (-1, 0.7, 3)), ((-1, -0.7, 4), (1, -0.7, 4), (1, 0.7, 4), (-1, 0.7, 4)),
        ((-1, -0.7, 3), (-1, 0.7, 3), (-1, 0.7, 4), (-1, -0.7, 4)), ((1, -0.7, 3), (1, 0.7, 3), (1, 0.7, 4), (1, -0.7, 4)),
        ((-1, -0.7, 3), (1, -0.7, 3), (1, -0.7, 4), (-1, -0.7, 4)), ((-1, 0.7, 3), (1, 0.7, 3), (1, 0.7, 4), (-1, 0.7, 4)),
    )
)  # fmt: skip
SCENES = {
    "spheres": CAMERA + "L -3 4 -2 0.5 0.2 0.1\n" + PLAIN + "S 0.2 0 3 0.8\nS -0.7 -0.5 2.2 0.3\n" + FLOOR,
    "spheres only": CAMERA + PLAIN + "S 0.2 0 3 0.8\nS -0.7 0.5 2.2 0.3\n",
    "inside a sphere": CAMERA + "L 0.5 0.5 0\n" + PLAIN + "S 0 0 0 4\n",
    "mirrors": CAMERA + "M 0.9 0.9 0.9 0.05 0.3 0.4 40 0.7 0 1\nS 0.4 0 3 0.7\nS -0.9 0.1 3.5 0.7\n" + FLOOR,
    "glass sphere": CAMERA + "background 0.2 0.3 0.5\n" + FLOOR + "M 1 1 1 0 0.1 0.5 60 0.1 0.8 1.5\nS 0 -0.2 2.5 0.7\n",
    "glass box": CAMERA + "background 0.2 0.3 0.5\n" + FLOOR
    + "M 1 1 1 0.02 0.1 0.5 60 0.1 0.8 1.5\n" + BOX + "O\n" + PLAIN + "S 1.2 0 6 1\n",
    "glass in glass": CAMERA + "background 0.1 0.2 0.3\n" + FLOOR + "M 1 1 1 0 0.1 0.5 60 0 0.9 1.33\nS 0 -0.1 3 0.9\n"
    + "M 1 1 1 0 0.1 0.5 60 0.1 0.8 1.6\nS 0.1 0 2.9 0.4\n",
    "total reflection": CAMERA + "depth 8\nbackground 0.4 0.3 0.2\n" + "M 1 1 1 0 0.1 0 1 0 1 2.4\n" + BOX + "O\n" + FLOOR,
    "smooth": CAMERA + PLAIN + "T -1 -1 3 1 -1 3 0 1 3.5 -0.5 -0.5 -0.7 0.5 -0.5 -0.7 0 0.6 -0.8\nT -1 -1 4 0 1 3.6 1 -1 5\n",
    "corners": "E 0 0 -1\nO -1 1 1 1.2 1 1 -1 -0.8 1 1.2 -0.9 1.3\nR 48 40\nL 1 3 -2\n" + PLAIN + "S 0 0 3 1\n" + FLOOR,
    "no light": "E 0 0 -1\nV 0 0 1\nF 45\nR 32 32\n" + PLAIN + "S 0 0 3 1\n",
    "far from zero": "E 20000 0 -99999\nV 0 0 1\nF 45\nR 48 48\nL 20005 5 -100005\n" + PLAIN
    + "T 19999 -1 -99996 20001 -1 -99996 20000 1 -99996\nT 19999 -1 -99995 20001 -1 -99995 20000 2 -99995\n",
}  # fmt: skip


def _compare(scene: Scene, pixels: np.ndarray, allowed: float = 0.02) -> None:
    reference = clrt.reference.render(scene)
    wrong = np.abs(pixels - reference.pixels).max(-1) > BOUND
    unexplained = wrong & (reference.margin > MARGIN)
    assert not unexplained.any(), f"{unexplained.sum()} pixels differ, the first at (row, column) {np.argwhere(unexplained)[0]}"
    assert wrong.sum() <= max(2, allowed * wrong.size), "too many pixels lie at an edge for the picture to be a test"
    assert reference.pixels.std() > 1e-3, "a picture of one colour tests nothing"


@pytest.mark.parametrize("name", SCENES)
def test_picture_matches_reference(name: str) -> None:
    scene = parse_scene(SCENES[name])
    _compare(scene, clrt.render(scene).pixels)


@pytest.mark.parametrize("precision", sorted(RUNGS))
def test_every_rung_matches_reference(precision: str) -> None:
    scene = parse_scene(SCENES["glass box"])
    _compare(scene, clrt.render(scene, precision=precision).pixels)


@pytest.mark.slow
@pytest.mark.parametrize("tree", ["sah", "median"])
def test_monkey_matches_reference(shared_scene: object, tree: str) -> None:
    scene = load_scene(shared_scene("monkey.txt")).with_size(128, 128)  # type: ignore[operator]
    _compare(scene, clrt.render(scene, tree=tree).pixels)


def test_rabbit_like_mesh_matches_reference() -> None:
    vertices, faces = rabbit_like(1000, seed=3)
    corners = vertices[faces]
    corners = (corners - corners.mean((0, 1))) / np.ptp(corners, (0, 1)).max() * 1.4 + (0, 0, 1.5)
    lines = "".join("T " + " ".join(map(repr, row)) + "\n" for row in corners.reshape(-1, 9).tolist())
    scene = parse_scene(CAMERA.replace("64 64", "72 72") + PLAIN + lines + "O\n" + FLOOR)
    _compare(scene, clrt.render(scene).pixels)


@pytest.mark.matrix(keep=2)
@pytest.mark.parametrize("lanes", [16, 8, 4, 1])
def test_every_packet_width_gives_the_same_picture(device: Device, lanes: int) -> None:
    """Widths differ only in how operations are fused, so pictures agree but for pixels at an edge."""
    scene = parse_scene(SCENES["glass in glass"]).with_size(61, 47)
    _compare(scene, in_packets(scene, device, lanes))


def test_picture_does_not_depend_on_launches(device: Device) -> None:
    scene = parse_scene(SCENES["mirrors"])
    whole = clrt.render(scene).pixels
    tracer = renderer.open_tracer(renderer.build_trees(scene, "sah", _quiet), Features.of(scene), rung("watertight"), device, _quiet)[1]
    for row in range(0, scene.camera.height, 8):
        tracer.run(row, row + 8)
    assert np.array_equal(tracer.picture(), whole)
    assert np.array_equal(clrt.render(scene).pixels, whole)


def test_counts_of_rays_and_tests() -> None:
    """One triangle that fills the view: a test a primary ray, a shadow ray a lit pixel at most, nothing else."""
    text = CAMERA + PLAIN + "T -50 -50 3 50 -50 3 0 90 3\n"
    stats = clrt.render(parse_scene(text), count=True).stats
    assert stats is not None
    assert stats.ray_counts == {"primary": 64 * 64}
    assert stats.tests_per_ray == 1.0
    two = clrt.render(parse_scene(text + "T -50 -50 -30 50 -50 -30 0 90 -30\n"), count=True).stats
    assert two is not None
    assert two.ray_counts == {"primary": 64 * 64, "shadow": 64 * 64}


@pytest.mark.slow
def test_counts_go_beyond_32_bits() -> None:
    """9,000 equal triangles that fill the view, behind each other's place: each primary ray tests all of them."""
    text = CAMERA.replace("64 64", "1024 512") + PLAIN + "T -50 -50 3 50 -50 3 0 90 3\n" * 9000
    stats = renderer.render(replace(parse_scene(text), lights=()), count=True).stats
    assert stats is not None
    assert stats.ray_counts == {"primary": 1024 * 512}
    assert stats.tests_per_ray == 9000.0


def test_picture_beyond_the_device_is_refused_before_the_work(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    side = int((device.handle.max_mem_alloc_size // 12) ** 0.5) + 2
    if side * side > renderer.MAX_PIXELS:
        pytest.skip("this device has room for the largest picture there is")
    monkeypatch.setattr(renderer, "build_trees", lambda *_: pytest.fail("work was begun"))
    with pytest.raises(LimitError, match="has room for"):
        renderer.render(parse_scene(SCENES["smooth"]), size=(side, side))


def test_depth_zero_leaves_the_mirror_out(tmp_path: Path) -> None:
    scene = parse_scene(SCENES["mirrors"])
    dump = tmp_path / "k.cl"
    image = renderer.render(scene, depth=0, dump_kernel=dump)
    assert "mirror" not in dump.read_text()
    _compare(replace(scene, depth=0), image.pixels)


def _quiet(phase: str, fraction: float) -> None:
    pass
