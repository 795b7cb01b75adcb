"""What the lines of a scene text mean together: camera, materials, objects, normals, warnings."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.grammar import LETTERS
from clrt.scene.model import Camera, PointLight, Scene
from clrt.scene.triangles import unit
from clrt.scene.words import WORDS

DATA = Path(__file__).parent / "data"
DOCS = Path(__file__).parents[1] / "docs" / "scene-format.md"
SHARED = Path(__file__).parents[2] / "shared" / "scenes"

CAMERA = "E 0 0 -1\nV 0 0 1\nF 45\nR 4 4\nL 5 5 -5\n"
MATERIAL = "M 1 1 1 0.1 0.9 0.3 20 0\n"
HEAD = CAMERA + MATERIAL  # six lines
FLAT = "T 0 0 1 1 0 1 0 1 1"  # in the plane z = 1, counter-clockwise seen from +z


def build(*lines: str, right_handed: bool = False, split_objects: bool = False) -> Scene:
    text = HEAD + "\n".join(lines)
    return parse_scene(text, "scene.txt", right_handed=right_handed, split_objects=split_objects)


# Camera


@pytest.mark.parametrize("fov", [1.0, 45.0, 90.0, 179.0])
def test_camera_looks_along_z_with_x_to_the_right(fov: float) -> None:
    camera = parse_scene(f"E 1 2 3\nV 0 0 5\nF {fov}\nR 8 2\n" + MATERIAL + "S 0 0 9 1").camera
    half = math.tan(math.radians(fov) / 2)
    quarter = half / 4
    expected = [[-half, quarter, 1], [half, quarter, 1], [-half, -quarter, 1], [half, -quarter, 1]]
    np.testing.assert_allclose(camera.corners, expected, rtol=1e-14, atol=1e-15)
    assert (camera.eye.tolist(), camera.width, camera.height) == ([1.0, 2.0, 3.0], 8, 2)


def test_camera_turns_with_its_up_vector() -> None:
    # Looking down with the picture's top towards +z, +x stays at the right.
    camera = parse_scene("E 0 9 0\nV 0 -1 0 0 0 1\nF 90\nR 4 4\n" + MATERIAL + "S 0 0 0 1").camera
    np.testing.assert_allclose(camera.corners, np.array([[-1, -1, 1], [1, -1, 1], [-1, -1, -1], [1, -1, -1]]), atol=1e-15)


@pytest.mark.parametrize("scale", ["1e-30", "1e-200", "1e30"])
def test_camera_takes_directions_of_any_length(scale: str) -> None:
    line = f"V {scale} 0 {scale} 0 {scale} 0"
    camera = parse_scene(f"E 0 0 0\n{line}\nF 90\nR 4 4\n" + MATERIAL + "S 0 0 9 1").camera
    expected = Camera.from_view(np.zeros(3), np.array([1.0, 0, 1]), np.array([0.0, 1, 0]), 90.0, 4, 4)
    np.testing.assert_allclose(camera.corners, expected.corners, rtol=1e-14, atol=1e-15)


def test_image_corners_are_points_of_the_scene() -> None:
    camera = load_scene(DATA / "variants" / "corners.txt").camera
    assert camera.eye.tolist() == [1.0, 2.0, 3.0]
    assert camera.corners.tolist() == [[-1, 1, 2], [1, 1, 2], [-1, -1, 2], [1, -1, 2]]
    assert (camera.width, camera.height) == (6, 6)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("V 0 0 0", '2:3: error: the view direction is zero; expected a direction, such as "V 0 0 1"'),
        ("V 0 0 1 0 0 0", '2:9: error: the up vector is zero; expected a direction, such as "0 1 0"'),
        ("V 1 1 0 -2 -2 0", "2:9: error: the up vector is parallel to the view direction; expected one towards the picture's top"),
        ("V 0 3 0", '2:3: error: the view direction is parallel to the up vector 0 1 0; add another, as in "V 0 3 0 0 0 1"'),
    ],
)
def test_view_without_sides_is_refused(line: str, expected: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_scene(HEAD.replace("V 0 0 1", line) + FLAT, "scene.txt")
    assert str(caught.value) == f"scene.txt:{expected}"


@pytest.mark.parametrize(("letter", "what"), [("E", "eye"), ("V", "view direction"), ("F", "field of view"), ("R", "resolution")])
def test_camera_line_missing_is_named(letter: str, what: str) -> None:
    text = "".join(line + "\n" for line in HEAD.split("\n") if not line.startswith(letter)) + FLAT
    with pytest.raises(SceneError, match=rf'^scene.txt:1:1: error: there is no {what} \({letter}\); add a line such as "{letter} .*"$'):
        parse_scene(text, "scene.txt")


@pytest.mark.parametrize(("letter", "bad"), [("E", "E 0 0"), ("V", "V a b c"), ("F", "F 0"), ("R", "r 4 4"), ("V", "O 1 2 3")])
def test_camera_line_at_fault_is_not_called_missing_too(letter: str, bad: str) -> None:
    text = "\n".join(bad if line.startswith(letter) else line for line in HEAD.split("\n")) + FLAT
    with pytest.raises(SceneError) as caught:
        parse_scene(text, "scene.txt")
    assert "there is no" not in str(caught.value)


def test_picture_of_the_most_pixels_is_accepted_and_one_row_more_refused() -> None:
    assert parse_scene(HEAD.replace("R 4 4", "R 65536 4096") + FLAT).camera.height == 4096
    with pytest.raises(SceneError, match="at most 268435456 pixels, found 65536 x 4097"):
        parse_scene(HEAD.replace("R 4 4", "R 65536 4097") + FLAT)


def test_resolution_may_be_written_as_a_real_number() -> None:
    assert parse_scene(HEAD.replace("R 4 4", "R 256.0 1e2") + FLAT).camera.width == 256


# Materials, lights, words


def test_homework_variant_is_read_whole() -> None:
    scene = load_scene(DATA / "variants" / "homework.txt")
    red, glass = scene.materials
    assert (red.color, red.ambient, red.diffuse, red.specular, red.exponent) == ((1, 0, 0), 0.1, 0.9, 0.3, 20)
    assert (red.reflect, red.refract, red.ior, red.line) == (0.25, 0.0, 1.0, 7)
    assert (glass.color, glass.ambient, glass.diffuse, glass.specular, glass.exponent) == ((0, 0.5, 1), 0.1, 0.9, 0.3, 20)
    assert (glass.reflect, glass.refract, glass.ior, glass.line) == (0.0, 0.75, 1.5, 9)
    assert scene.spheres.material_ids.tolist() == [0, 1]
    assert (scene.spheres.centers.tolist(), scene.spheres.radii.tolist(), scene.spheres.line) == ([[0, 0, 5], [2, 0, 5]], [1.5, 1], 8)
    assert scene.lights == (PointLight((5, 5, -5), (1, 1, 1), 11), PointLight((-5, 5, -5), (0.5, 0.25, 0), 12))
    assert (scene.background, scene.depth) == ((0.1, 0.2, 0.3), 7)
    assert (scene.warnings, scene.objects) == ((), ())


def test_defaults_of_what_the_text_leaves_out() -> None:
    scene = build(FLAT)
    assert (scene.background, scene.depth, scene.warnings, len(scene.spheres)) == ((0, 0, 0), 5, (), 0)
    assert (scene.lights[0].color, scene.source) == ((1, 1, 1), "scene.txt")


@pytest.mark.parametrize("depth", [0, 128])
def test_depth_takes_its_bounds(depth: int) -> None:
    assert build(FLAT, f"depth {depth}").depth == depth


def test_index_of_refraction_zero_is_accepted_where_nothing_is_refracted() -> None:
    scene = build("M 1.0 1.0 0.5 0.1 0.9 0.3 20 0.5 0.0 0.0", FLAT)
    assert scene.materials[1].ior == 0.0


def test_scene_without_light_is_warned_of() -> None:
    scene = parse_scene(HEAD.replace("L 5 5 -5", "") + FLAT)
    assert scene.warnings == ("there is no light (L); only the ambient part of the materials is seen",)


@pytest.mark.parametrize(("primitive", "what"), [(FLAT, "a triangle"), ("S 0 0 3 1", "a sphere")])
def test_primitive_before_any_material_names_the_line_to_add(primitive: str, what: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_scene(CAMERA + f" {primitive}\n{primitive}\n" + MATERIAL + FLAT, "scene.txt")
    fix = 'add a line above it, such as "M 1 1 1 0.1 0.9 0.3 20 0"'
    assert str(caught.value) == f"scene.txt:6:2: error: {what} before any material; {fix}"


def test_material_at_fault_is_not_called_missing_too() -> None:
    with pytest.raises(SceneError) as caught:
        parse_scene(CAMERA + "M 1 1\n" + FLAT, "scene.txt")
    assert str(caught.value) == "scene.txt:6:3: error: M takes 8 or 10 numbers, found 2"


# Objects and primitive ids


def test_objects_end_at_their_o_lines() -> None:
    scene = load_scene(DATA / "variants" / "corners.txt")
    assert [(o.name, len(o), o.first_prim) for o in scene.objects] == [("object 1", 1, 0), ("object 2", 3, 1)]
    assert [o.vertices[:, 0, 2].tolist() for o in scene.objects] == [[8], [9, 7, 6]]
    assert [o.material_ids.tolist() for o in scene.objects] == [[0], [0, 0, 1]]
    assert [o.material_ids.dtype for o in scene.objects] == [np.int32, np.int32]
    assert scene.spheres.material_ids.tolist() == [0]
    assert scene.warnings == (
        "line 8: O closes no triangles and is left out",
        "line 13: a vertex normal is zero; the plane's normal is used instead",
    )


def test_text_without_o_lines_is_one_object() -> None:
    scene = build(FLAT, "T 5 0 1 6 0 1 5 1 1", "S 0 0 1 1")
    assert [len(o) for o in scene.objects] == [2]


def test_empty_objects_are_counted() -> None:
    scene = build("O", FLAT, "O", "O", "O")
    assert (len(scene.objects), scene.warnings) == (1, ("3 O lines close no triangles and are left out (the first: line 7)",))


def test_o_below_spheres_alone_is_no_cause_for_a_warning() -> None:
    assert build("S 0 0 1 1", "O").warnings == ()
    assert build(FLAT, "O", "S 0 0 1 1", "O").warnings == ()
    assert build("S 0 0 1 1", "O", FLAT, "O", "O").warnings == ("line 11: O closes no triangles and is left out",)


@pytest.mark.parametrize("lines", [["S 0 0 1 1"], ["S 0 0 1 1", "O"]])
def test_spheres_alone_make_a_scene_without_objects(lines: list[str]) -> None:
    scene = build(*lines)
    assert (scene.objects, len(scene.spheres), scene.triangle_count) == ((), 1, 0)


@pytest.mark.parametrize("lines", [["O"], ["O", "depth 3"]])
def test_nothing_to_render_is_refused(lines: list[str]) -> None:
    with pytest.raises(SceneError, match=r"^scene.txt:1:1: error: there is nothing to render; add a triangle"):
        build(*lines)


def test_split_objects_by_shared_vertices() -> None:
    # Triangles 0, 2 and 4 hang together through one vertex each (-0 equals 0); 1 stands alone; 3 repeats a vertex of 1.
    lines = ["T 0 0 1 1 0 1 0 1 1", "T 9 9 1 8 9 1 9 8 1", "T 1 -0 1 2 0 1 1 1 1", "T 9 8 1 7 7 1 6 7 1", "T 5 5 5 6 6 6.5 1 1 1"]
    scene = build(*lines, "S 9 9 9 1", split_objects=True)
    assert [o.vertices[:, 0, 0].tolist() for o in scene.objects] == [[0, 1, 5], [9, 9]]
    assert [(o.name, o.first_prim) for o in scene.objects] == [("object 1", 0), ("object 2", 3)]
    assert scene.warnings == ("the triangles are split by shared vertices into 2 objects",)
    assert [len(o) for o in build(*lines).objects] == [5]


def test_split_objects_leaves_marked_objects_alone() -> None:
    scene = build(FLAT, "T 5 0 1 6 0 1 5 1 1", "O", split_objects=True)
    assert [len(o) for o in scene.objects] == [2]
    assert scene.warnings == ("line 9: O lines mark the objects of this scene; it is not split any further",)


# Normals


@pytest.mark.parametrize(("given", "sign"), [("0 0 2", 1), ("0 0 -1e-30", -1), ("0 0 1e30", 1)])
def test_face_normal_that_fits_is_kept_with_its_side(given: str, sign: int) -> None:
    scene = build(f"{FLAT} {given}")
    assert (scene.objects[0].normals.tolist(), scene.warnings) == ([[0, 0, sign]], ())


@pytest.mark.parametrize("degrees", [0.0, 30.0, 59.9, 120.1, 180.0])
def test_face_normal_within_sixty_degrees_is_kept(degrees: float) -> None:
    normal = [math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees))]
    scene = build(FLAT + " " + " ".join(map(repr, normal)))
    np.testing.assert_allclose(scene.objects[0].normals, [normal], atol=1e-15)
    assert scene.warnings == ()


@pytest.mark.parametrize("degrees", [60.1, 90.0, 119.9])
def test_face_normal_beyond_sixty_degrees_is_replaced(degrees: float) -> None:
    normal = [math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees))]
    scene = build(FLAT + " " + " ".join(map(repr, normal)))
    assert scene.objects[0].normals.tolist() == [[0, 0, 1]]
    said = "line 7: the face normal is zero or more than 60 degrees off the triangle's plane normal, which is used instead"
    assert scene.warnings == (said,)


def test_wrong_and_zero_face_normals_are_counted_together() -> None:
    scene = build(f"{FLAT} 0 0 1", f"{FLAT} 0 0 0", f"{FLAT} 1 0 0.1", FLAT)
    assert scene.objects[0].normals.tolist() == [[0, 0, 1]] * 4
    assert scene.warnings == (
        "2 face normals are zero or more than 60 degrees off the triangle's plane normal, which is used instead (the first: line 8)",
    )


def test_vertex_normals_make_their_object_smooth() -> None:
    smooth = f"{FLAT} 0 0 2 0 3 4 0 0 0"
    scene = build(FLAT, "O", f"{FLAT} 0 0 -1", smooth, f"{FLAT} 0 0 -1 -1 0 -1 0 0 0")
    flat, mesh = scene.objects
    assert (flat.vertex_normals, flat.line, mesh.line) == (None, 0, 10)
    assert mesh.vertex_normals is not None
    # A zero normal takes the plane's normal on the side of the others; a face without any repeats its own.
    assert mesh.vertex_normals[0].tolist() == [[0, 0, -1]] * 3
    np.testing.assert_allclose(mesh.vertex_normals[1], np.array([[0, 0, 1], [0, 0.6, 0.8], [0, 0, 1]]), atol=1e-16)
    np.testing.assert_allclose(mesh.vertex_normals[2], np.array([[0, 0, -1], [-(0.5**0.5), 0, -(0.5**0.5)], [0, 0, -1]]), atol=1e-15)
    assert mesh.normals.tolist() == [[0, 0, -1], [0, 0, 1], [0, 0, 1]]
    said = "2 triangles have a vertex normal of zero; the plane's normal is used instead (the first: line 10)"
    assert scene.warnings == (said,)


def test_triangles_without_area_are_kept_and_counted() -> None:
    lines = [FLAT, "T 0 0 1 0 0 1 0 1 1", "T 0 0 0 1 1 1 3 3 3 0 0 1", "T 2 2 2 2 2 2 2 2 2", FLAT]
    scene = build(*lines)
    assert scene.objects[0].normals.tolist() == [[0, 0, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 1]]
    assert scene.warnings == ("3 triangles have zero area and are never hit (the first: line 8)",)


# Handedness


def test_right_handed_mirrors_everything() -> None:
    text = (
        "E 1 2 3\nV 1 0 1 0.5 1 0\nF 45\nR 4 4\nL 5 6 7\n" + MATERIAL
        + "T 1 2 3 4 5 6 7 8 10 \nT 0 0 1 1 0 1 0 1 1 0.1 0 1\nT 0 0 1 1 0 1 0 1 1 1 0 1 0 0 1 0 1 1\nS 3 4 5 1\n"
    )  # fmt: skip
    left, right = parse_scene(text), parse_scene(text, right_handed=True)
    assert right.camera.eye.tolist() == [-1, 2, 3]
    assert right.lights[0].position == (-5, 6, 7)
    assert right.spheres.centers.tolist() == [[-3, 4, 5]]
    turned = parse_scene(text.replace("V 1 0 1 0.5 1 0", "V -1 0 1 -0.5 1 0"))
    assert np.array_equal(right.camera.corners, turned.camera.corners)
    (mesh,), (original,) = right.objects, left.objects
    assert mesh.vertex_normals is not None
    assert original.vertex_normals is not None
    pairs = [(mesh.vertices, original.vertices), (mesh.normals, original.normals), (mesh.vertex_normals, original.vertex_normals)]
    for found, plain in pairs:
        assert np.array_equal(found, plain * [-1.0, 1.0, 1.0])
        assert not np.signbit(found[found == 0.0]).any()


def test_right_handed_image_corners_are_mirrored() -> None:
    scene = load_scene(DATA / "variants" / "corners.txt", right_handed=True)
    assert scene.camera.eye.tolist() == [-1, 2, 3]
    assert scene.camera.corners.tolist() == [[1, 1, 2], [-1, 1, 2], [1, -1, 2], [-1, -1, 2]]


@pytest.mark.parametrize(("right_handed", "columns"), [(False, {5, 6, 7, 8}), (True, {0, 1, 2, 3})])
def test_handedness_decides_on_which_side_plus_x_is_seen(right_handed: bool, columns: set[int]) -> None:
    """Looking along +z with y up, the right hand is +x in left-handed axes, and forward x up = -x in right-handed ones."""
    text = "E 0 0 0\nV 0 0 1\nF 90\nR 9 9\n" + MATERIAL + "S 1 0 2 0.1\n"
    scene = parse_scene(text, right_handed=right_handed)
    center = unit(scene.spheres.centers)[0]
    row, column = np.unravel_index(np.argmax(scene.camera.directions() @ center), (9, 9))
    assert row == 4
    assert int(column) in columns


# The homework's scenes


@pytest.mark.parametrize(("name", "triangles", "size"), [("monkey", 970, 1024), ("rabbit", 69_453, 256)])
def test_homework_scene_reads_without_warnings(name: str, triangles: int, size: int) -> None:
    path = SHARED / f"{name}.txt"
    if not path.exists():
        pytest.skip("the homework's scenes are not here")
    scene = load_scene(path)
    assert [len(o) for o in scene.objects] == [triangles - 2, 2]
    assert [o.first_prim for o in scene.objects] == [0, triangles - 2]
    assert [set(o.material_ids.tolist()) for o in scene.objects] == [{0}, {1}]
    assert (scene.camera.width, scene.camera.height, scene.warnings) == (size, size, ())
    written = [line.split()[1:] for line in path.read_text().split("\n") if line.startswith("T")]
    numbers = np.array([[float(n) for n in fields] for fields in written])
    assert np.concatenate([o.vertices for o in scene.objects]).tobytes() == numbers[:, :9].tobytes()
    given = numbers[:, 9:] / np.linalg.norm(numbers[:, 9:], axis=1, keepdims=True)
    np.testing.assert_allclose(np.concatenate([o.normals for o in scene.objects]), given, atol=1e-15)


# The documentation


def test_examples_of_the_documentation_are_read() -> None:
    blocks = DOCS.read_text(encoding="utf-8").split("```\n")[1::2]
    example, corners, words, _ = blocks
    scene = parse_scene(example)
    assert ([len(o) for o in scene.objects], len(scene.spheres), len(scene.materials), scene.warnings) == ([2], 1, 2, ())
    assert parse_scene(corners + "L 0 0 0\n" + MATERIAL + FLAT).camera.corners.tolist() == [[-1, 1, 2], [1, 1, 2], [-1, -1, 2], [1, -1, 2]]
    assert build(FLAT, words).depth == 10


def test_every_letter_and_word_is_documented() -> None:
    text = DOCS.read_text(encoding="utf-8")
    assert all(f"\n| `{letter}" in text for letter in LETTERS)
    assert all(f"\n| `{word} " in text or f"\n| `{word}` " in text for word in WORDS)
