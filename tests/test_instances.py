"""Instances: pictures against the same scene written out, against the float64 reference, and what is refused."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image as PillowImage
import pytest
from device_pictures import in_packets

import clrt
import clrt.reference
from clrt import renderer
from clrt.device.context import Device
from clrt.device.session import Tracer
from clrt.errors import ClrtError, SceneError
from clrt.features import Features
from clrt.generate import rabbit_like
from clrt.precision import RUNGS, rung
from clrt.reference.expand import expanded
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.emitters import emitters_of
from clrt.scene.model import Scene
from clrt.scene.placed import seen

BOUND = 1e-5
MARGIN = 2e-5
CAMERA = "E 0 1 -5\nV 0 -0.15 1\nF 50\nR 48 48\nL 5 6 -5\nL -3 4 -6 0.5 0.4 0.3\nbackground 0.2 0.3 0.5\n"
FLOOR = "M 0.8 0.8 0.7 0.1 0.8 0.3 20 0.3\nT -9 -1 -5 -9 -1 15 9 -1 15\nT -9 -1 -5 9 -1 15 9 -1 -5\nO\n"


def _block(name: str, material: str, hidden: str = "yes") -> str:
    """A wedge, closed, of 8 flat triangles about (100, 50, -20): far from where its instances stand."""
    corners = np.array([(-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1), (0, 1, -0.5), (0.3, 1, 0.5)]) * 0.5 + (100, 50, -20)
    faces = ((0, 1, 2), (0, 2, 3), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (3, 5, 4), (3, 4, 0))
    triangles = "".join("T " + " ".join(f"{x:.17g}" for x in corners[list(face)].ravel()) + "\n" for face in faces)
    return f"{material}\nobject {name} hidden={hidden}\n{triangles}O\n"


def _at(x: float, y: float, z: float, name: str, keys: str = "") -> str:
    return f"instance {name} {x} {y} {z} {keys}\n"


def _centred(name: str) -> str:
    """An instance to be instanced, with the block's middle at the origin."""
    return f"instance {name} -100 -50 20 name={name}0 hidden=yes\n"


PLAIN = "M 0.9 0.5 0.3 0.1 0.8 0.4 20 0"
MIRROR = "M 0.9 0.9 0.9 0.05 0.3 0.4 40 0.6"
GLASS = "M 1 1 1 0.02 0.1 0.5 60 0.1 0.8 1.5"
THREE = (
    _at(-1.2, 0, 1, "block0", "turn_y=30 turn_x=20") + _at(1.3, 0.2, 0.4, "block0", "scale=1.3 turn_z=75")
    + _at(0.2, -0.2, -1, "block0", "scale=0.5")
)  # fmt: skip
SMOOTH = (
    "M 0.4 0.7 0.9 0.1 0.8 0.4 30 0\nobject dome hidden=yes\n"
    "T -1 0 -1  0 0.6 0  1 0 -1   -0.5 0.6 -0.5  0 1 0  0.5 0.6 -0.5\nT 1 0 -1  0 0.6 0  0 0 1.2   0.5 0.6 -0.5  0 1 0  0 0.6 0.5\n"
    "T 0 0 1.2  0 0.6 0  -1 0 -1   0 0.6 0.5  0 1 0  -0.5 0.6 -0.5\nO\n"
)
SCENES = {
    "plain": CAMERA + FLOOR + _block("block", PLAIN) + _centred("block") + THREE,
    "mirrors and spheres": CAMERA + FLOOR + _block("block", MIRROR) + _centred("block") + THREE + "S 0.9 -0.4 -1.5 0.4\n",
    "glass": CAMERA + FLOOR + _block("block", GLASS) + _centred("block") + THREE,
    "glass that overlaps and absorbs": CAMERA + FLOOR + _block("block", GLASS) + "absorb 0.5 0.2 0.1\n" + _centred("block")
    + _at(-0.3, 0, 0, "block0", "turn_y=30 scale=1.5") + _at(0.3, 0.1, 0.2, "block0", "scale=1.5 turn_z=20") + "S 0 0 -1 0.6\n",
    "three scales": CAMERA + FLOOR + _block("block", MIRROR) + _centred("block")
    + _at(0, 0, 0, "block0", "scale_x=2 scale_y=0.4 scale_z=1.4 turn_y=40"),
    "smooth": CAMERA + FLOOR + SMOOTH
    + "instance dome -1.2 -0.6 0 scale=1.2 turn_y=25\ninstance dome 1 0 0.5 scale=0.8 turn_x=-40 turn_z=20\n",
    "itself, too": CAMERA + FLOOR + _block("block", PLAIN, "no") + _centred("block") + THREE,
    "sun": CAMERA + "sun -1 2 -2\n" + FLOOR + SMOOTH
    + "instance dome 0 -0.6 0 scale=1.2 turn_y=25\ninstance dome 1 0 -0.8 scale=0.5 turn_z=20\n",
    "one triangle": CAMERA + PLAIN + "\nobject one\nT -1 -1 1 -1 1 1 1 -1 1\nO\n"
    + "instance one 0.3 0.2 -0.5\ninstance one -0.4 0 -1 turn_y=15 scale=0.7\n",
}  # fmt: skip


def _quiet(phase: str, fraction: float) -> None:
    pass


def _tracer(scene: Scene, device: Device) -> Tracer:
    features = Features.of(scene)
    return renderer.open_tracer(renderer.build_trees(scene, "sah", _quiet), features, rung("watertight"), device, _quiet)[1]


def _compare(scene: Scene, pixels: np.ndarray, margins: np.ndarray, reference: np.ndarray, bound: float) -> None:
    wrong = np.abs(pixels - reference).max(-1) > bound
    unexplained = wrong & (margins > MARGIN)
    assert not unexplained.any(), f"{unexplained.sum()} pixels differ, the first at (row, column) {np.argwhere(unexplained)[0]}"
    assert wrong.sum() <= max(2, 0.02 * wrong.size)
    assert reference.std() > 1e-2


QUICK = ("mirrors and spheres", "glass that overlaps and absorbs", "smooth")


def _slow(values: Iterable[Any], quick: Iterable[Any]) -> list[Any]:
    """All values for a test; all but the quick ones are for the long run: each is a program to compile."""
    return [value if value in quick else pytest.param(value, marks=pytest.mark.slow) for value in values]


@pytest.mark.matrix(keep=3)
@pytest.mark.parametrize("name", _slow(SCENES, QUICK))
def test_instances_match_reference_and_scene_written_out(name: str) -> None:
    scene = parse_scene(SCENES[name])
    reference = clrt.reference.render(scene)
    pixels = clrt.render(scene).pixels
    # Glass and mirrors magnify what rounding does to a hit.
    _compare(scene, pixels, reference.margin, reference.pixels, 1e-4)
    written = clrt.render(expanded(scene)).pixels
    _compare(scene, pixels, reference.margin, written, 1e-4 if "glass" in name or "mirror" in name else BOUND)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", _slow(sorted(RUNGS), ("exact",)))
def test_every_rung_matches_the_reference(precision: str) -> None:
    scene = parse_scene(SCENES["glass"]).with_size(32, 32)
    reference = clrt.reference.render(scene)
    _compare(scene, clrt.render(scene, precision=precision).pixels, reference.margin, reference.pixels, 1e-4)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("lanes", _slow((16, 8, 4, 1), (4,)))
def test_every_packet_width_matches_the_reference(device: Device, lanes: int) -> None:
    scene = parse_scene(SCENES["smooth"]).with_size(37, 29)
    reference = clrt.reference.render(scene)
    _compare(scene, in_packets(scene, device, lanes), reference.margin, reference.pixels, BOUND)


def test_textures_and_shining_triangles_go_with_the_instance() -> None:
    """What shines lights from where it is placed: emitters of the instance are those of the triangles written out."""
    text = CAMERA + FLOOR + "M 1 1 1 0 0 0 1 0\narealight 3 2 1\nobject lamp hidden=yes\nT 0 0 0 1 0 0 0 1 0\nO\n"
    text += "instance lamp 1 2 3 scale=2 turn_x=90\n"
    scene = parse_scene(text)
    found, written = emitters_of(scene), emitters_of(expanded(scene))
    np.testing.assert_allclose(found.vertices, [[[1, 2, 3], [3, 2, 3], [1, 2, 5]]], atol=1e-12)
    np.testing.assert_allclose(found.vertices, written.vertices, atol=1e-12)
    np.testing.assert_allclose(found.area, [2.0])


def test_texture_on_an_instance_matches_the_reference(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    PillowImage.fromarray(rng.integers(0, 256, (8, 8, 3), np.uint8)).save(tmp_path / "picture.png")
    text = (
        CAMERA + FLOOR + "M 1 1 1 0.2 0.8 0 1 0\ntexture picture.png\nobject board hidden=yes\n"
        "T 99 49 -20 99 51 -20 101 51 -20\nuv 0 0 0 1 1 1\nT 99 49 -20 101 51 -20 101 49 -20\nuv 0 0 1 1 1 0\nO\n"
        "instance board -100 -50 20 name=here hidden=yes\ninstance here 0 0.4 1 turn_y=25 scale=1.3\n"
    )
    (tmp_path / "scene.txt").write_text(text)
    scene = load_scene(tmp_path / "scene.txt")
    reference = clrt.reference.render(scene)
    _compare(scene, clrt.render(scene).pixels, reference.margin, reference.pixels, 1e-4)


FAULTS = {
    "instance blok0 0 0 1\n": '10: error: no object is called "blok0"; did you mean "block0"?',
    "object block\nT 0 0 0 1 0 0 0 1 0\nO\n": ':8: error: a second "block"; the first is line',
    "object other\n": ":1: error: object names triangles, and there are none",
    "instance self 0 0 0 name=self\n": ":10: error: an instance of itself; name an object",
    "instance a 0 0 0 name=b\ninstance b 0 0 0 name=a\n": "by way of line",
    "instance block 0 0 0 scale=0\n": ":28: error: scale must be between 0.0001 and 10000",
    "instance block 0 0 0 scale=-2\n": ':28: error: scale must be between 0.0001 and 10000, found "-2"',
    "instance block 0 0 0 scale_y=1e5\n": ":1: error: the instance is 100000 times as large as its object",
    "instance block 0 0 0 turn=3\n": "instance has no key \"turn\"",
    "instance block 0 0\n": "instance takes 4 values",
}  # fmt: skip


@pytest.mark.parametrize("line", FAULTS)
def test_faults_of_instances_tell_their_place(line: str) -> None:
    text = SCENES["plain"]
    number = text.count("\n") + 1
    with pytest.raises(SceneError) as caught:
        parse_scene(text + line, "scene.txt")
    assert FAULTS[line] in str(caught.value)
    assert f"scene.txt:{number}:" in str(caught.value)


def test_two_scales_of_a_smooth_object_are_refused() -> None:
    with pytest.raises(SceneError, match="has normals at its corners"):
        parse_scene(SCENES["smooth"] + "instance dome 0 0 0 scale_x=2\n")


def test_scene_in_which_everything_is_hidden_is_refused() -> None:
    with pytest.raises(SceneError, match="everything is hidden"):
        parse_scene(CAMERA + _block("block", PLAIN))


def test_rays_refuse_a_scene_with_instances() -> None:
    with pytest.raises(ClrtError, match="instances"):
        clrt.RayCaster(parse_scene(SCENES["plain"]))


def test_transforms_of_instances_of_instances_are_put_together() -> None:
    """(1, 0, 0), doubled, turned from x to y, shifted; then turned from y to z and shifted: by hand."""
    text = CAMERA + PLAIN + "\nobject one\nT 1 0 0 0 0 0 0 1 0\nO\ninstance one 5 0 0 scale=2 turn_z=90 name=first\n"
    text += "instance first 0 0 1 turn_x=90\n"
    first, second = parse_scene(text).instances
    point = np.array([1.0, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(first.world_from_object @ point, [5, 2, 0], atol=1e-15)
    np.testing.assert_allclose(second.world_from_object @ point, [5, 0, 3], atol=1e-15)


def test_right_handed_files_place_instances_in_their_own_axes() -> None:
    text = CAMERA + PLAIN + "\nobject one\nT 1 0 0 0 0 0 0 1 0\nO\ninstance one 5 1 2 scale=2 turn_z=30 turn_y=20\n"
    scene, mirrored = expanded(parse_scene(text)), expanded(parse_scene(text, right_handed=True))
    np.testing.assert_allclose(mirrored.objects[1].vertices, scene.objects[1].vertices * (-1, 1, 1), atol=1e-14)


def test_without_instances_only_what_is_shown_remains() -> None:
    scene = parse_scene(SCENES["plain"])
    left = clrt.renderer.render(scene, without=("instances",)).pixels
    assert np.array_equal(left, clrt.render(parse_scene(CAMERA + FLOOR)).pixels)


def _rabbits(count: int, triangles: int) -> Scene:
    vertices, faces = rabbit_like(triangles, seed=1)
    vertices = (vertices - vertices.mean(0)) / np.ptp(vertices, axis=0).max()
    corners = "".join("T " + " ".join(f"{x:.9g}" for x in row) + "\n" for row in vertices[faces].reshape(-1, 9).tolist())
    rng, side = np.random.default_rng(2), int(np.ceil(np.sqrt(count)))
    lines = "".join(
        f"instance rabbit {i % side - side / 2} 0 {i // side} turn_y={rng.uniform(0, 360):.1f} scale={rng.uniform(0.6, 1.1):.2f}\n"
        for i in range(count)
    )
    camera = "E 0 4 -8\nV 0 -0.3 1\nF 50\nR 64 64\nL 50 60 -50\n"
    return parse_scene(camera + PLAIN + "\nobject rabbit hidden=yes\n" + corners + "O\n" + lines)


def _size(scene: Scene, device: Device) -> int:
    """Bytes of the scene's buffers, which need no program."""
    prepared = renderer.build_trees(scene, "sah", _quiet)
    return renderer.fill_buffers(prepared, Features.of(scene), rung("watertight"), device)[0].size


def test_memory_grows_by_the_transforms_alone(device: Device) -> None:
    """A record of 144 bytes and two nodes of 32 in the tree above: whatever an instance consists of."""
    few, many = (_size(_rabbits(count, 1000), device) for count in (10, 1010))
    assert many - few <= 1000 * 208


@pytest.mark.slow
def test_ten_thousand_rabbits_take_the_memory_of_one(device: Device) -> None:
    """700 million triangles."""
    ten, all_of_them = (_tracer(_rabbits(count, 70_000), device) for count in (10, 10_000))
    assert all_of_them.buffers.size - ten.buffers.size <= 9_990 * 208
    renderer.run_rows(all_of_them, "render", _quiet)
    assert all_of_them.picture().std() > 0.05


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", _slow(("watertight", "exact"), ("watertight",)))
def test_tree_over_many_objects_gives_the_picture_of_the_loop(monkeypatch: pytest.MonkeyPatch, precision: str) -> None:
    """Objects and spheres that overlap, some of them twice in the same place: of equal distances the lowest id counts in either."""
    rng = np.random.default_rng(5)
    text = CAMERA + FLOOR
    for number in range(24):
        centre = rng.uniform((-2, -0.8, -1), (2, 1, 4))
        corners = centre + rng.uniform(-0.5, 0.5, (3, 3))
        for _ in range(2):
            text += f"M {rng.uniform():.3f} 0.5 0.3 0.1 0.8 0.3 20 0.2\nT " + " ".join(map(repr, corners.ravel().tolist())) + "\nO\n"
            text += f"S {centre[0] + 0.5:.3f} {centre[1]:.3f} {centre[2]:.3f} 0.2\n" if number % 3 == 0 else ""
    scene = parse_scene(text)
    pictures = []
    for many in (16, 10**9):
        monkeypatch.setattr("clrt.features.placed.MANY", many)
        pictures.append(clrt.render(scene, precision=precision).pixels)
    assert "object tree" not in {f.name for f in Features.of(scene).active}, "the second picture is the loop's"
    if precision == "exact":  # the last digits of a distance depend on which stage decided it, and that on what was met before
        assert (np.abs(pictures[0] - pictures[1]).max(-1) > BOUND).mean() < 0.002
    else:
        assert np.array_equal(*pictures)


def test_few_objects_keep_the_loop() -> None:
    assert "object tree" not in {f.name for f in Features.of(parse_scene(CAMERA + FLOOR + PLAIN + "\nS 0 0 0 1\n" * 14)).active}
    assert "object tree" in {f.name for f in Features.of(parse_scene(CAMERA + FLOOR + PLAIN + "\nS 0 0 0 1\n" * 15)).active}


@pytest.mark.slow
def test_ten_thousand_spheres_are_faster_by_the_tree(monkeypatch: pytest.MonkeyPatch, device: Device) -> None:
    rng = np.random.default_rng(6)
    centres = rng.uniform((-4, -1, 0), (4, 3, 8), (10_000, 3)).tolist()
    balls = "".join("S " + " ".join(f"{x:.4f}" for x in row) + " 0.05\n" for row in centres)
    scene, seconds = parse_scene(CAMERA + FLOOR + PLAIN + "\n" + balls).with_size(64, 64), []
    for many in (16, 10**9):
        monkeypatch.setattr("clrt.features.placed.MANY", many)
        tracer = _tracer(scene, device)
        start = time.process_time()
        renderer.run_rows(tracer, "render", _quiet)
        seconds.append(time.process_time() - start)
    assert seconds[0] < seconds[1] / 4


def test_scene_without_instances_is_itself() -> None:
    """Else its trees would be built again, by another builder than the one that was asked for."""
    scene = load_scene(Path(__file__).parents[1] / "scenes" / "first.txt")
    assert seen(scene, False, False) is scene
