"""Packets of pixels that go together: what they see is what each sees alone, and nothing that a ray could meet is left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from device_pictures import in_packets, ray_counts
from numpy.typing import NDArray

from clrt import renderer
from clrt.device import layout, program, session
from clrt.device.context import Device
from clrt.device.pack import local_origin
from clrt.device.prepare import direction_scale, place_frame, prepare
from clrt.features import Features
from clrt.image.image import Image
from clrt.kdtree import build_tree
from clrt.kdtree.arrays import LEAF
from clrt.kdtree.joined import join
from clrt.kdtree.runs import leaf_runs
from clrt.kdtree.tree import KdTree
from clrt.precision import RUNGS, rung
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.model import Scene

SCENES = Path(__file__).parents[1] / "scenes"
_ALONE = 1 << 60  #: more triangles than any scene has


def silent(phase: str, part: float) -> None: ...


@pytest.fixture
def grouped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "GROUPS_FROM", 1)


def soup(count: int, seed: int = 3) -> NDArray[np.float64]:
    """(count, 3, 3): triangles of all sizes, some of them needles."""
    random = np.random.default_rng(seed)
    size = 10.0 ** random.uniform(-3.0, -0.3, (count, 1, 1))
    return random.uniform(-1.0, 1.0, (count, 1, 3)) + random.normal(0.0, 1.0, (count, 3, 3)) * size


def soup_scene(count: int, *more: str, camera: str = "E 0 0 -4\nV 0 0 1\nF 40\n") -> Scene:
    lines = [camera, "R 64 48", "L 3 4 -5", "L -2 3 -3", "M 0.8 0.7 0.6  0.2 0.6 0.2 8  0", *more]
    lines += ["T " + "  ".join(" ".join(f"{x:.6f}" for x in corner) for corner in t) for t in soup(count)]
    return parse_scene("\n".join([*lines, "O", ""]))


def picture(scene: Scene, monkeypatch: pytest.MonkeyPatch, together: bool, **options: object) -> Image:
    monkeypatch.setattr(program, "GROUPS_FROM", 1 if together else _ALONE)
    return renderer.render(scene, **options)  # type: ignore[arg-type]


# The order of triangles, and their blocks.


def walked(tree: KdTree) -> list[list[int]]:
    """The triangles of each leaf that no leaf before it names, depth first, by recursion."""
    seen: set[int] = set()
    leaves: list[list[int]] = []

    def visit(node: int) -> None:
        child = int(tree.child[node])
        if tree.split_axis[node] != LEAF:
            visit(child)
            visit(child + 1)
            return
        new = [int(t) for t in tree.indices[child : child + int(tree.count[node])] if int(t) not in seen]
        seen.update(new)
        leaves.append(new)

    visit(0)
    return leaves


@pytest.mark.parametrize(("count", "method"), [(1, "sah"), (17, "median"), (700, "sah"), (700, "median"), (90, "brute")])
def test_triangles_come_in_the_order_of_leaves_in_blocks_of_neighbours(count: int, method: str) -> None:
    tree = build_tree(soup(count), method)
    order, blocks = leaf_runs(join([tree], [count]), 16)
    leaves = walked(tree)
    assert order.tolist() == [t for leaf in leaves for t in leaf]
    assert blocks[:, 0].tolist() == np.concatenate([[0], np.cumsum(blocks[:, 1])[:-1]]).tolist()
    assert blocks[:, 1].sum() == len(order)
    assert blocks[:, 1].min() >= 1
    assert blocks[:, 1].max() <= 16
    # No leaf of up to 16 is cut in two.
    ends = set(np.cumsum(blocks[:, 1]).tolist()) | {0}
    place = 0
    for leaf in leaves:
        inside = [p for p in range(place + 1, place + len(leaf)) if p in ends]
        assert len(leaf) > 16 or not inside
        place += len(leaf)


def test_tree_without_triangles_has_no_blocks() -> None:
    order, blocks = leaf_runs(join([build_tree(np.zeros((0, 3, 3)), "sah")], [0]), 16)
    assert order.shape == (0,)
    assert blocks.shape == (0, 2)


# Boxes of directions.


def test_scale_of_directions_reaches_around_all_objects() -> None:
    objects = np.zeros(1, layout.object_record(np.float32))
    objects["lo"], objects["hi"] = [-1, -1, -1], [1, 1, 1]
    middle = direction_scale(np.array([0.0, 0.0, -10.0]), objects)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) - [0.0, 0.0, -10.0]
    steps = (corners / np.linalg.norm(corners, axis=1, keepdims=True) - middle[:3]) * middle[3]
    assert 16000 < np.abs(steps).max() <= 32000
    np.testing.assert_array_equal(direction_scale(np.array([0.5, 0.0, 0.0]), objects), [0, 0, 0, 32000])
    assert np.isfinite(direction_scale(np.array([1e30, 0.0, 0.0]), objects)).all()


def records(scene: Scene, device: Device, of: str = "eye") -> tuple[NDArray[np.void], NDArray[np.int32], NDArray[np.float64]]:
    """The records as seen from the eye or along suns, the first of each level, and the corners by slot."""
    import pyopencl as cl

    features, ladder = Features.of(scene), rung("watertight")
    trees = renderer.build_trees(scene, "sah", silent)
    buffers, source, _ = renderer.fill_buffers(trees, features, ladder, device)
    prepare(buffers, program.build(device, source))
    found = np.zeros(buffers.boxes[of].size // layout.direction_boxes().itemsize, layout.direction_boxes())
    cl.enqueue_copy(device.queue, found, buffers.boxes[of])
    levels = np.array([1, *(1 + np.cumsum(buffers.box_levels))], np.int32)
    return found, levels, buffers.packed.vertices


EYES = [(0.0, 0.0, -4.0), (0.1, 0.2, 0.05), (3e4, 1e4, -2e4), (1.0, 0.0, 0.0)]


@pytest.mark.parametrize("eye", EYES)
def test_every_direction_to_a_triangle_is_in_its_boxes(eye: tuple[float, float, float], grouped: None, device: Device) -> None:
    if rung("watertight").lanes(device.info.lanes) == 1:
        pytest.skip("packets of one ray do not go together")
    scene = soup_scene(500, camera=f"E {eye[0]} {eye[1]} {eye[2]}\nV 0 0 1\nF 40\n")
    found, levels, corners = records(scene, device)
    head = found[:1].view(np.float32)[:4]
    random = np.random.default_rng(11)
    weights = random.dirichlet([0.5, 0.5, 0.5], 40)
    weights[:3] = np.eye(3)
    inner = 0
    for number, record in enumerate(found[1:], 1):
        there = np.flatnonzero(record["item"] >= 0)
        if number >= levels[1]:
            # A record of records: the bounds of each.
            inner += 1
            for k in there:
                below = found[record["item"][k]]
                some = below["item"] >= 0
                np.testing.assert_array_equal(record["lo"][:, k], below["lo"][:, some].min(1))
                np.testing.assert_array_equal(record["hi"][:, k], below["hi"][:, some].max(1))
                assert record["near"][k] == below["near"][some].min()
            continue
        for k in there:
            points = weights @ corners[record["item"][k]] - np.array(eye)
            distance = np.linalg.norm(points, axis=1)
            assert (record["near"][k] <= distance).all()
            far = distance > 0
            steps = (points[far] / distance[far, None] - head[:3]) * np.float64(head[3])
            assert (steps >= record["lo"][:, k]).all()
            assert (steps <= record["hi"][:, k]).all()
        assert (record["lo"][:, record["item"] < 0] > record["hi"][:, record["item"] < 0]).all()
    assert inner == len(found) - levels[1] > 0


def test_boxes_of_triangles_seen_from_afar_are_tight(grouped: None, device: Device) -> None:
    """A triangle of 1/100 in a scene of 2 at a distance of 40,000 has a box of about 1/100 of the range: steps go by the scene's size."""
    if rung("watertight").lanes(device.info.lanes) == 1:
        pytest.skip("packets of one ray do not go together")
    found, levels, corners = records(soup_scene(500, camera="E 0 0 -40000\nV 0 0 1\nF 40\n"), device)
    blocks = found[1 : levels[1]]
    there = blocks["item"] >= 0
    size = np.ptp(corners[blocks["item"][there]], axis=1)[:, :2].max(1)
    wide = (blocks["hi"].astype(int) - blocks["lo"]).transpose(0, 2, 1)[there][:, :2].max(1) / 64000
    assert (wide[size < 0.02] < 0.06).all()


def test_axes_of_a_sun_stand_at_right_angles_and_steps_span_the_scene() -> None:
    objects = np.zeros(2, layout.object_record(np.float32))
    objects["lo"], objects["hi"] = [[-3, 0, 0], [0, -1, 0]], [[0, 1, 2], [5, 0, 2]]
    for direction in np.random.default_rng(5).normal(size=(20, 3)):
        frame = place_frame(direction, objects).astype(np.float64)
        axes = frame[4:].reshape(3, 3)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=3e-7)
        np.testing.assert_allclose(axes[2], direction / np.linalg.norm(direction), atol=1e-7)
        corners = np.array([[x, y, z] for x in (-3, 5) for y in (-1, 1) for z in (0, 2)])
        steps = (corners - frame[:3]) @ axes.T * frame[3]
        assert 16000 < np.abs(steps).max() <= 32001


def test_every_point_of_a_triangle_is_in_its_box_along_a_sun(grouped: None, device: Device) -> None:
    if rung("watertight").lanes(device.info.lanes) == 1:
        pytest.skip("packets of one ray do not go together")
    found, levels, corners = records(soup_scene(400, "sun 1 2 -1", "sun 0 0 -1"), device, "suns")
    weights = np.random.default_rng(12).dirichlet([0.5, 0.5, 0.5], 30)
    weights[:3] = np.eye(3)
    origin = local_origin(soup_scene(400))
    for sun in range(2):
        of = found[sun * (len(found) // 2) :]
        frame = of[:1].view(np.float32)[:13].astype(np.float64)
        axes = frame[4:].reshape(3, 3)
        for record in of[1 : levels[1]]:
            for k in np.flatnonzero(record["item"] >= 0):
                steps = (weights @ corners[record["item"][k]] - origin - frame[:3]) @ axes.T * frame[3]
                assert (steps >= record["lo"][:, k]).all()
                assert (steps <= record["hi"][:, k]).all()
                assert (np.ptp(steps, axis=0) + 4 > record["hi"][:, k].astype(int) - record["lo"][:, k]).all()
                assert record["near"][k] == 0


# Pictures.


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("path", sorted(SCENES.glob("*.txt")), ids=lambda path: path.stem)
def test_picture_of_packets_together_is_that_of_packets_alone(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On the rung `exact` each ray meets one triangle, whatever way it goes; coincident ones aside, at a distance of the same bits."""
    scene = load_scene(path)
    options = {"size": (36, 28), "precision": "exact", "samples": 2 if scene.samples > 1 else None}
    together, alone = (picture(scene, monkeypatch, way, **options) for way in (True, False))
    np.testing.assert_array_equal(together.pixels, alone.pixels)


@pytest.mark.parametrize("precision", RUNGS)
def test_soup_is_seen_together_as_alone(precision: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, count = soup_scene(900), precision == "watertight"  # counts are of one rung: counting takes another program
    together, alone = (picture(scene, monkeypatch, way, precision=precision, count=count) for way in (True, False))
    np.testing.assert_array_equal(together.pixels, alone.pixels)
    if not count:
        return
    assert together.stats.ray_counts == alone.stats.ray_counts
    assert sum(o.tests_per_ray for o in together.stats.objects) < 0.75 * sum(o.tests_per_ray for o in alone.stats.objects)


@pytest.mark.parametrize("eye", EYES[1:])
def test_eye_amidst_or_far_from_triangles(eye: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch) -> None:
    """Directions all around, and pictures of a scene that is small in them. There the interval that t lies in
    depends on what was met before: float32 tells less of it than float64, which is asked only where float32 leaves a doubt."""
    to = -np.array(eye)
    field = 150 if np.linalg.norm(to) < 0.5 else 0.01 if np.linalg.norm(to) > 10 else 60
    camera = f"E {eye[0]} {eye[1]} {eye[2]}\nV {to[0]} {to[1]} {to[2]}\nF {field}\n"
    together, alone = (picture(soup_scene(900, camera=camera), monkeypatch, way, precision="exact") for way in (True, False))
    assert len(np.unique(alone.pixels)) > 50
    np.testing.assert_allclose(together.pixels, alone.pixels, rtol=2e-3)


def test_brute_force_leaves_no_test_out(grouped: None) -> None:
    image = renderer.render(soup_scene(300), tree="brute", count=True, without=["shadows"])
    assert image.stats.objects[0].tests_per_ray > 290  # but for packets that miss the object's box, each ray meets each triangle


@pytest.mark.parametrize(
    ("precision", "counted"), [("watertight", False), ("exact", False), pytest.param("exact", True, marks=pytest.mark.slow)]
)
def test_rays_to_suns_and_mirrored_ones_after_the_eyes_own_go_as_alone(
    precision: str, counted: bool, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One sun from the side, one behind the eye, one that grazes; and a floor far greater than the scene: rays start far away."""
    floor = "T -900 -1.5 -900  -900 -1.5 900  900 -1.5 900"
    mirror = ["M 0.8 0.7 0.6  0.2 0.6 0.2 8  0.5"] if precision == "exact" else []
    scene = soup_scene(700, "sun 1 2 -1", "sun 0 0 -1", "sun 1 0.02 0", *mirror, floor)
    together, alone = (picture(scene, monkeypatch, way, precision=precision) for way in (True, False))
    if counted:
        ways = []
        for least in (1, _ALONE):
            monkeypatch.setattr(program, "GROUPS_FROM", least)
            ways.append(ray_counts(scene, device, precision)[0])
        assert ways[0] == ways[1]
        assert ways[0]["mirror"] > 100
    different = (together.pixels != alone.pixels).any(2).sum()
    assert different == 0 if precision == "exact" else different <= 3  # of watertight, edges may be wider by their rounding
    dark = picture(soup_scene(700, floor), monkeypatch, True)
    assert (np.abs(dark.pixels - together.pixels).max(2) > 0.05).mean() > 0.1


def test_shadow_of_a_mesh_on_a_sphere_far_behind_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rays to the sun start 10^7 times as far away as the scene is large: on `double`, whose rounding is far below that of axes."""
    far = 1e7
    to_sun = np.array([1.0, 2.0, -1.0]) / np.sqrt(6.0)
    near, side = -far * to_sun, np.cross(to_sun, [0.0, 1.0, 0.0])
    center, eye = near - far * to_sun, near + 3.0 * to_sun + side
    text = lambda values: " ".join(map(repr, values.tolist()))  # noqa: E731
    lines = [f"E {text(eye)}", f"V {text(near - eye)}", "F 45", "R 160 120", "sun 1 2 -1"]
    lines += ["M 1 1 1  0 1 0 1  0", f"S {text(center)} {far!r}"]
    lines += ["T " + "  ".join(" ".join(f"{x:.6f}" for x in corner) for corner in t) for t in soup(500)]
    scene = parse_scene("\n".join([*lines, "O", ""]))
    together, alone = (picture(scene, monkeypatch, way, precision="double") for way in (True, False))
    assert 0.05 < (alone.pixels[..., 0] == 0).mean() < 0.95  # there is a shadow
    assert ((together.pixels - alone.pixels) > 0.01).sum() == 0


def test_more_lights_and_suns_than_go_together(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(9)
    around = [f"L {x:.3f} {y:.3f} {z:.3f} 0.05 0.05 0.05" for x, y, z in random.uniform(-4.0, 4.0, (34, 3))]
    suns = [f"sun {x:.3f} {y:.3f} {z:.3f} intensity=0.05" for x, y, z in random.uniform(-1.0, 1.0, (33, 3))]
    scene = soup_scene(300, *around, *suns, "M 0.8 0.7 0.6  0.2 0.6 0.2 8  0.5")
    together, alone = (picture(scene, monkeypatch, way, size=(20, 15), precision="exact") for way in (True, False))
    np.testing.assert_array_equal(together.pixels, alone.pixels)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("lanes", [4, 8])
def test_narrow_packets_together(lanes: int, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = soup_scene(500, "sun 1 2 -1")
    pictures = []
    for least in (1, _ALONE):
        monkeypatch.setattr(program, "GROUPS_FROM", least)
        pictures.append(in_packets(scene, device, lanes, "exact"))
    np.testing.assert_array_equal(*pictures)


def test_packets_go_alone_where_the_device_has_no_room_for_boxes(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = soup_scene(900)
    there = session.Buffers._box_levels
    alone = picture(scene, monkeypatch, False)
    monkeypatch.setattr(session.Buffers, "_box_levels", lambda buffers: [device.handle.max_mem_alloc_size // 256, *there(buffers)])
    np.testing.assert_array_equal(picture(scene, monkeypatch, True).pixels, alone.pixels)


@pytest.mark.parametrize("size", [(1, 1), (5, 3), (17, 9), (33, 40)])
def test_pictures_that_are_no_whole_groups(size: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    together, alone = (picture(soup_scene(300), monkeypatch, way, size=size) for way in (True, False))
    np.testing.assert_array_equal(together.pixels, alone.pixels)


def test_packets_go_alone_where_rays_share_no_origin_or_triangles_are_few() -> None:
    plain = Features.of(soup_scene(300))
    assert program.groups_pay(plain, 300)
    assert not program.groups_pay(plain, 20)
    for name in ("lens", "motion", "instance"):
        assert not program.groups_pay(Features.of(load_scene(SCENES / f"{name}.txt")), 300)
    shape = program.Shape(24, groups=True)
    assert "group_trace" in program.compose(plain, rung("watertight"), 16, shape)
    assert "group_trace" not in program.compose(plain, rung("watertight"), 1, shape)
    assert "group_trace" not in program.compose(plain, rung("watertight"), 16, program.Shape(24))
