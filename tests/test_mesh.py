"""Mesh files in, scene texts out: what is read is what the file says, what is wrong with it is said."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
import pytest

from clrt.convert import convert, fit_to_view
from clrt.errors import MeshError, SceneError
from clrt.mesh import check_mesh, load_mesh, vertex_normals
from clrt.reference import render
from clrt.scene.build import load_scene
from clrt.scene.write import line, point_texts, triangle_lines, write_text

pytest.importorskip("trimesh")

SHARED = Path(__file__).parents[2] / "shared"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
PLY_HEAD = """ply
format ascii 1.0
element vertex {vertices}
property float x
property float y
property float z
element face {faces}
property list uchar int vertex_indices
end_header
"""


def placed(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def binary_stl(triangles: np.ndarray) -> bytes:
    records = b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in triangles)
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + records


def test_obj_with_decimals_reads_exactly(tmp_path: Path) -> None:
    path = placed(tmp_path, "a.obj", "v 0.1 -2.5e-3 7\nv 1e3 0.3333333333333333 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\nf 2/1/1 4/2/2 3/3/3\n")
    vertices, faces = load_mesh(path)
    points = np.array([[0.1, -2.5e-3, 7], [1e3, 0.3333333333333333, 0], [0, 1, 0], [5, 5, 5]])
    expected = points[[[0, 1, 2], [1, 3, 2]]]
    assert vertices.dtype == np.float64
    assert faces.dtype == np.int64
    np.testing.assert_array_equal(vertices[faces], expected)


def test_near_vertices_are_not_merged(tmp_path: Path) -> None:
    path = placed(tmp_path, "a.obj", TRIANGLE + "v 1e-12 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n")
    vertices, faces = load_mesh(path)
    np.testing.assert_array_equal(vertices[faces][:, 0, 0], [0.0, 1e-12])


def test_polygon_becomes_triangles_of_the_same_area(tmp_path: Path) -> None:
    path = placed(tmp_path, "a.obj", "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5\n")
    vertices, faces = load_mesh(path)
    crossed = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    np.testing.assert_allclose(crossed.sum(axis=0) / 2.0, [0.0, 0.0, 5.0])
    assert len(faces) == 3
    assert (crossed[:, 2] > 0).all()


@pytest.mark.parametrize("line_end", ["\r\n", "\n"])
def test_obj_with_tabs_and_continued_lines(tmp_path: Path, line_end: str) -> None:
    text = "v\t0 0\t0\nv 1 0 0\nv 0 1 0\nf 1 \\\n 2 3\n".replace("\n", line_end)
    vertices, faces = load_mesh(placed(tmp_path, "a.obj", text))
    np.testing.assert_array_equal(vertices[faces], [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])


def test_ply_stl_off_give_the_same_triangles(tmp_path: Path) -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0.5], [0, 1, 0]]], np.float64)
    points = "0 0 0\n1 0 0\n0 1 0\n1 1 0.5\n"
    files = [
        placed(tmp_path, "a.ply", PLY_HEAD.format(vertices=4, faces=2) + points + "3 0 1 2\n3 1 3 2\n"),
        placed(tmp_path, "a.off", "OFF\n4 2 0\n" + points + "3 0 1 2\n3 1 3 2\n"),
        placed(tmp_path, "a.stl", binary_stl(corners)),
        placed(tmp_path, "A.OBJ", "".join(f"v {p}\n" for p in points.splitlines()) + "f 1 2 3\nf 2 4 3\n"),
    ]
    for path in files:
        vertices, faces = load_mesh(path)
        np.testing.assert_array_equal(vertices[faces], corners, err_msg=path.name)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.obj", "", "is empty"),
        ("a.obj", TRIANGLE, "no faces"),
        ("a.obj", "not a mesh at all\n", "no faces"),
        ("a.obj", TRIANGLE + "f 1 2 4\n", "cannot be read as OBJ"),
        ("a.obj", TRIANGLE + "f 0 1 2\n", r"a\.obj:4: .*vertex 0"),
        ("a.obj", TRIANGLE + "f 1 2 0/1\n", r"a\.obj:4: .*vertex 0"),
        ("a.obj", TRIANGLE + "f 1 2 3\nf 1 2", r"a\.obj:5: .*fewer than 3 corners"),
        ("a.obj", TRIANGLE + "f -3 -2 -1\nv 5 5 5\nv 6 6 6\nv 7 7 9\nf -3 -2 -1\n", r"a\.obj:4: .*backwards"),
        ("a.obj", "v 0 0 0\nv 1 0\nv 0 1 0 7\nf 1 2 3\n", r"a\.obj:2: .*'v 1 0'"),
        ("a.obj", "v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", r"a\.obj:1: .*3 numbers"),
        ("a.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 1 .*not finite"),
        ("a.obj", "v 0 0 0\nv 1e400 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 1 .*not finite"),
        ("a.obj", "v 0 0 0\nv 1 x 0\nv 0 1 0\nf 1 2 3\n", "cannot be read as OBJ"),
        ("a.obj", bytes(range(256)) * 8, "OBJ|no faces"),
        ("a.ply", "nothing of the kind", "cannot be read as PLY"),
        ("a.ply", PLY_HEAD.format(vertices=3, faces=1) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 9\n", "vertex 9, but there are 3"),
        ("a.ply", PLY_HEAD.format(vertices=3, faces=1) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", "vertex -1, but there are 3"),
        ("a.ply", PLY_HEAD.format(vertices=3, faces=3) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "cut off"),
        ("a.off", "OFF\n3 4 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "4 faces, only 1"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "OFF"),
        ("a.stl", binary_stl(np.ones((4, 3, 3)))[:-30], "cannot be read as STL: it is cut off"),
        ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n", "endsolid"),
        ("a.xyz", "1 2 3\n", r"'\.xyz' is not one that is read; convert"),
        ("mesh", "1 2 3\n", "no extension"),
    ],
)  # fmt: skip
def test_broken_file_is_refused_by_name(tmp_path: Path, name: str, content: str | bytes, says: str) -> None:
    path = placed(tmp_path, name, content)
    with pytest.raises(MeshError, match=says) as caught:
        load_mesh(path)
    assert str(caught.value).startswith(str(path))


def test_directory_and_missing_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="is a directory"):
        load_mesh(tmp_path)
    with pytest.raises(MeshError, match=r"none\.obj: cannot be read: No such file"):
        load_mesh(tmp_path / "none.obj")


def test_without_the_loader_the_message_says_how_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    with pytest.raises(MeshError, match=re.escape("pip install 'clrt[mesh]'")):
        load_mesh(placed(tmp_path, "a.obj", TRIANGLE + "f 1 2 3\n"))


@pytest.mark.parametrize(
    ("vertices", "faces", "says"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], r"vertices have the shape \(3, 2\)"),
        (np.zeros((3, 3)), [[0, 1, 2, 2]], r"faces have the shape \(1, 4\)"),
        (np.zeros((3, 3)), [[0.0, 1.0, 2.0]], "faces hold float64"),
        (np.zeros((3, 3), complex), [[0, 1, 2]], "vertices hold complex128"),
        (np.zeros((3, 3)), np.zeros((0, 3), int), "no faces"),
        (np.zeros((3, 3)), [[0, 1, 3]], "vertex 3, but there are 3"),
        (np.full((3, 3), np.inf), [[0, 1, 2]], "not finite"),
        ([[0, 0, 0], [1]], [[0, 1, 2]], "rectangular"),
    ],
)
def test_check_mesh_refuses_arrays(vertices: object, faces: object, says: str) -> None:
    with pytest.raises(MeshError, match="^given: .*" + says):
        check_mesh(vertices, faces, "given")  # type: ignore[arg-type]


def test_check_mesh_ignores_vertices_without_a_face() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 0, 0]])
    vertices, faces = check_mesh(points, np.array([[0, 1, 2]], np.uint8))
    assert faces.dtype == np.int64
    np.testing.assert_array_equal(vertices, points)


def test_vertex_normals_of_a_cube_are_its_diagonals() -> None:
    # By symmetry of the angles, whichever way each face is cut in two; corners are stored thrice, once a face
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    vertices = cube[quads].reshape(-1, 3)
    faces = np.array([[4 * k, 4 * k + i, 4 * k + i + 1] for k in range(6) for i in (1, 2)])
    np.testing.assert_allclose(vertex_normals(vertices, faces), vertices / np.sqrt(3.0), atol=1e-15)


def test_vertex_normals_beside_a_degenerate_face_stay_finite() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], float)
    normals = vertex_normals(vertices, np.array([[0, 1, 2], [0, 1, 3]]))
    np.testing.assert_allclose(normals[:3], [[0, 0, 1]] * 3, atol=1e-15)
    np.testing.assert_array_equal(normals[3], 0.0)


def letter_f(folder: Path, name: str = "f.obj") -> Path:
    """A flat F as one sees it from +z, with a plate behind it: right-handed, counter-clockwise towards the viewer."""
    boxes = [(0, 0, 1, 5, 0.5), (1, 4, 3, 5, 0.5), (1, 2, 2, 3, 0.5), (-1, -1, 4, 6, -2)]
    text = ""
    for k, (x0, y0, x1, y1, z) in enumerate(boxes):
        text += f"v {x0} {y0} {z}\nv {x1} {y0} {z}\nv {x1} {y1} {z}\nv {x0} {y1} {z}\n"
        text += f"f {4 * k + 1} {4 * k + 2} {4 * k + 3}\nf {4 * k + 1} {4 * k + 3} {4 * k + 4}\n"
    return placed(folder, name, text)


@pytest.mark.parametrize("smooth", [False, True])
def test_converted_letter_reads_from_left_to_right(tmp_path: Path, smooth: bool) -> None:
    convert(letter_f(tmp_path), tmp_path / "f.txt", smooth)
    scene = load_scene(tmp_path / "f.txt").with_size(80, 80)
    seen = render(scene).prim_id
    letter = (seen >= 0) & (seen < 6)  # the plate behind has triangles 6 and 7
    rows = np.flatnonzero(letter.any(axis=1))
    left, right = np.flatnonzero(letter.any(axis=0))[[0, -1]]
    widths = letter[rows].sum(axis=1) / letter.sum(axis=1).max()
    # Five rows of squares from the top: ### # ## # #
    fifths = [float(np.median(part)) for part in np.array_split(widths, 5)]
    np.testing.assert_allclose(fifths, [1.0, 1 / 3, 2 / 3, 1 / 3, 1 / 3], atol=0.07)
    assert letter[rows, left].all()
    assert not letter[rows[-1], (left + right) // 2]
    assert (scene.objects[0].normals[:, 2] < 0).all(), "outward is towards the eye"


def test_converted_mesh_spans_four_fifths_of_the_view() -> None:
    random = np.random.default_rng(4)
    for stretch in ((1, 1, 1), (3, 1, 1), (1, 4, 0.2), (2, 2, 1)):
        vertices = random.normal(size=(200, 3)) * stretch * 10.0 ** random.integers(-9, 9) + 1.0
        placed_mesh = fit_to_view(vertices, np.arange(198).reshape(-1, 3))[:198]
        seen = np.abs(placed_mesh[:, :2]) / (placed_mesh[:, 2:] + 1.0)
        assert seen.max() == pytest.approx(0.8 * np.tan(np.radians(22.5)), rel=1e-6)


def test_converted_needle_along_the_view_stays_before_the_eye() -> None:
    vertices = np.array([[0, 0, -50], [0.01, 0, 50], [0, 0.01, 0]], float)
    assert fit_to_view(vertices, np.array([[0, 1, 2]]))[:, 2].min() >= -1e-12


def test_convert_of_a_point_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"a\.obj: the mesh has no extent"):
        convert(placed(tmp_path, "a.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n"), tmp_path / "a.txt")
    assert not (tmp_path / "a.txt").exists()


def test_convert_onto_itself_or_a_directory_is_refused(tmp_path: Path) -> None:
    mesh = letter_f(tmp_path)
    before = mesh.read_bytes()
    for target in (mesh, tmp_path, tmp_path / "none" / "f.txt"):
        with pytest.raises(SceneError, match=re.escape(str(target))):
            convert(mesh, target)
    assert mesh.read_bytes() == before
    assert list(tmp_path.iterdir()) == [mesh]


def test_convert_replaces_a_scene_whole(tmp_path: Path) -> None:
    target = placed(tmp_path, "f.txt", "x" * 100_000)
    summary = convert(letter_f(tmp_path), target)
    assert "8 triangles" in summary
    assert len(load_scene(target).objects[0]) == 8


def test_written_numbers_read_back_bit_for_bit(tmp_path: Path) -> None:
    random = np.random.default_rng(7)
    vertices = random.normal(size=(300, 3)) * 10.0 ** random.integers(-6, 6, (300, 3))
    vertices[:4] = [[0.1, 1 / 3, 2.0], [5e-8, 123456.789, -1.0], [1e-5, 100.0, 0.30000000000000004], [10.0, 20.0, 30.0]]
    faces = random.permutation(300).reshape(-1, 3)
    camera = "E 0 0 -1\nV 0 0 1\nF 45\nR 8 8\nL 0 0 0\nM 1 1 1 1 1 1 1 0\n"
    write_text(tmp_path / "a.txt", camera + triangle_lines(vertices, faces) + "O\n")
    np.testing.assert_array_equal(load_scene(tmp_path / "a.txt").objects[0].vertices, vertices[faces])


def test_written_lines_are_short() -> None:
    assert line("S", [0, -0.0, 1.5], 2) == "S 0 0 1.5 2\n"
    assert point_texts(np.array([[1.0, -2.0, 1e-7], [0.5, 100.0, 3.0]])).tolist() == ["1 -2 1e-07", "0.5 100 3"]
    assert triangle_lines(np.eye(3), np.zeros((0, 3), np.int64)) == ""
    assert triangle_lines(np.eye(3), np.array([[0, 1, 2]]), -np.eye(3)) == "T 1 0 0 0 1 0 0 0 1 -1 0 0 0 -1 0 0 0 -1\n"


@pytest.mark.parametrize("name", ["suzanne.obj", "teapot.obj", "stanford-bunny.obj"])
def test_known_mesh_reads_as_its_lines_say(name: str) -> None:
    path = SHARED / "meshes" / name
    if not path.exists():
        pytest.skip("needs the shared meshes")
    points, corners = [], []
    for words in map(str.split, path.read_text().splitlines()):
        if words[:1] == ["v"]:
            points.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            ids = [int(w.split("/")[0]) - 1 for w in words[1:]]
            corners += [[ids[0], ids[i], ids[i + 1]] for i in range(1, len(ids) - 1)]
    vertices, faces = load_mesh(path)
    expected = np.array(points)[np.array(corners)]
    assert len(faces) == len(expected)

    def ordered(triangles: np.ndarray) -> np.ndarray:
        # Each triangle from its least corner on, the triangles in order: the winding stays
        start = np.lexsort(triangles.transpose(2, 0, 1)[::-1], axis=1)[:, :1]
        turned = np.take_along_axis(triangles, (start + np.arange(3))[..., None] % 3, axis=1).reshape(-1, 9)
        return turned[np.lexsort(turned.T)]

    # A quad may be cut along either diagonal; then only the corners in use can be compared
    if {len(w) for w in map(str.split, path.read_text().splitlines()) if w[:1] == ["f"]} == {4}:
        np.testing.assert_array_equal(ordered(vertices[faces]), ordered(expected))
    np.testing.assert_array_equal(np.unique(vertices[faces].reshape(-1, 3), axis=0), np.unique(expected.reshape(-1, 3), axis=0))
