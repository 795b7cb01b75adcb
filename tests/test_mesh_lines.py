"""mesh FILE in a scene text: where its triangles stand, what they look like, what is wrong with the file or the line."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from gltf_files import QUAD_UV, Gltf, quad, triangle
from PIL import Image

import clrt
from clrt.cli.main import cli
from clrt.errors import SceneError
from clrt.scene.build import load_scene
from clrt.scene.model import Scene

pytest.importorskip("trimesh")

CAMERA = "E 0 0 -4\nV 0 0 1\nF 45\nR 32 24\nL 5 5 -5\n"  #: 5 lines
RED = "M 1 0 0 0.1 0.9 0.3 20 0\n"
SHARED = Path(__file__).parents[2] / "shared" / "meshes"

#: (1, 2, 3), (3, 2, 3), (1, 3, 3), and (1, 2, 4) behind: two faces
OBJ = "v 1 2 3\nv 3 2 3\nv 1 3 3\nv 1 2 4\nf 1 2 3\nf 1 3 4\n"
POINTS = np.array([[1, 2, 3], [3, 2, 3], [1, 3, 3], [1, 2, 4]], float)
FACES = np.array([[0, 1, 2], [0, 2, 3]])
MIRROR = np.array([1.0, 1.0, -1.0])


def scene(folder: Path, lines: str, right_handed: bool = False, **files: str | bytes) -> Scene:
    """The scene of CAMERA and `lines` beside these files, `_` in a name for the dot of its extension."""
    for name, content in files.items():
        (folder / ".".join(name.rsplit("_", 1))).write_bytes(content if isinstance(content, bytes) else content.encode())
    (folder / "scene.txt").write_text(CAMERA + lines)
    return load_scene(folder / "scene.txt", right_handed=right_handed)


def as_set(triangles: np.ndarray) -> np.ndarray:
    """Triangles in an order of their own, with their corners in cyclic order from the least."""
    turned = [t[np.roll(np.arange(3), -min(range(3), key=lambda i: tuple(t[i])))] for t in np.round(np.asarray(triangles), 6) + 0.0]
    return np.array(sorted(turned, key=lambda t: t.ravel().tolist()))


def stl() -> bytes:
    records = b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in POINTS[FACES])
    return b"\0" * 80 + struct.pack("<I", 2) + records


PLY = """ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z
element face 2\nproperty list uchar int vertex_indices\nend_header\n1 2 3\n3 2 3\n1 3 3\n1 2 4\n3 0 1 2\n3 0 2 3\n"""
OFF = "OFF\n4 2 0\n1 2 3\n3 2 3\n1 3 3\n1 2 4\n3 0 1 2\n3 0 2 3\n"


def glb() -> bytes:
    made = Gltf()
    made.node(mesh=made.mesh(POINTS, FACES.ravel()))
    return made.glb()


# Where it stands


@pytest.mark.parametrize(("name", "content"), [("obj", OBJ), ("stl", stl()), ("ply", PLY), ("off", OFF), ("glb", glb())])
def test_every_kind_of_file_gives_its_triangles_mirrored_in_z(tmp_path: Path, name: str, content: str | bytes) -> None:
    found = scene(tmp_path, RED + f"mesh a.{name}\n", **{f"a_{name}": content})
    np.testing.assert_array_equal(as_set(found.objects[0].vertices), as_set((POINTS * MIRROR)[FACES[:, [0, 2, 1]]]))


def test_mesh_is_scaled_turned_and_shifted(tmp_path: Path) -> None:
    """A turn of 90 degrees about y takes z to x, and x to -z; about z it takes x to y."""
    found = scene(tmp_path, RED + "mesh a.obj scale=2 turn_y=90 turn_z=90 x=5 y=6 z=7\n", a_obj=OBJ)
    x, y, z = (POINTS * MIRROR * 2).T
    x, z = z, -x
    x, y = -y, x
    placed = np.stack([x + 5, y + 6, z + 7], axis=1)
    np.testing.assert_allclose(as_set(found.objects[0].vertices), as_set(placed[FACES[:, [0, 2, 1]]]), atol=1e-12)


def test_right_handed_scene_takes_the_files_axes_as_its_own(tmp_path: Path) -> None:
    """The text's triangle and the file's lie in the same place, whichever hand turns both."""
    line = "T " + " ".join(map(str, POINTS[FACES[0]].ravel())) + "\n"
    found = scene(tmp_path, RED + line + "mesh a.obj\n", right_handed=True, a_obj=OBJ)
    own, mesh = found.objects
    assert as_set(own.vertices)[0].tolist() in as_set(mesh.vertices).tolist()


def test_triangles_are_numbered_behind_those_of_the_text(tmp_path: Path) -> None:
    found = scene(tmp_path, RED + "mesh a.obj\nT 0 0 0 1 0 0 0 1 0\nO\nmesh a.obj\nT 0 0 1 1 0 1 0 1 1\n", a_obj=OBJ)
    assert [(len(o), o.first_prim) for o in found.objects] == [(1, 0), (1, 1), (2, 2), (2, 4)]


def test_each_object_of_a_file_is_an_object(tmp_path: Path) -> None:
    parts = OBJ.replace("f 1 2 3", "o the_first\nf 1 2 3").replace("f 1 3 4", "o second one\nf 1 3 4")
    found = scene(tmp_path, RED + "mesh a.obj\n", a_obj=parts)
    assert [(o.name, len(o)) for o in found.objects] == [("the_first", 1), ("second one", 1)]


def test_name_makes_one_object_for_instances(tmp_path: Path) -> None:
    parts = OBJ.replace("f 1 3 4", "o second\nf 1 3 4")
    found = scene(tmp_path, RED + "mesh a.obj name=thing hidden=yes\ninstance thing 0 0 5\n", a_obj=parts)
    (item,), (instance,) = found.objects, found.instances
    assert (item.name, len(item), item.hidden, instance.object) == ("thing", 2, True, 0)
    np.testing.assert_array_equal(instance.world_from_object[:, 3], [0, 0, 5])


def test_picture_of_a_mesh_is_that_of_its_triangles_as_lines(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    points = np.round(rng.normal(size=(30, 3)), 3)
    obj = "".join(f"v {x} {y} {z}\n" for x, y, z in points.tolist()) + "".join(f"f {i} {i + 1} {i + 2}\n" for i in range(1, 29))
    lines = "".join("T " + " ".join(f"{x} {y} {-z}" for x, y, z in points[i : i + 3].tolist()) + "\n" for i in range(28))
    mesh = clrt.render(scene(tmp_path, RED + "mesh a.obj\n", a_obj=obj)).pixels
    assert mesh.std() > 0.05
    np.testing.assert_allclose(mesh, clrt.render(scene(tmp_path, RED + lines)).pixels, atol=1e-6)


# Normals


def test_smooth_takes_or_makes_normals(tmp_path: Path) -> None:
    """A ridge of two faces at a right angle: the mean of (0, 1, 1) and (0, 1, -1) at the ridge is (0, 1, 0)."""
    ridge = "v 0 1 0\nv 1 1 0\nv 0 0 1\nv 0 0 -1\nf 1 3 2\nf 1 2 4\n"
    flat = scene(tmp_path, RED + "mesh a.obj\n", a_obj=ridge).objects[0]
    made = scene(tmp_path, RED + "mesh a.obj smooth=yes\n", a_obj=ridge).objects[0]
    assert flat.vertex_normals is None
    at_ridge = made.vertices[..., 1] == 1
    np.testing.assert_allclose(np.abs(made.vertex_normals[at_ridge] @ [0, 1, 0]), 1, atol=1e-12)
    given = ridge.replace("f 1 3 2\nf 1 2 4", "vn 0 3 1\nf 1//1 3//1 2//1\nf 1//1 2//1 4//1")
    own = scene(tmp_path, RED + "mesh b.obj\n", b_obj=given).objects[0]
    np.testing.assert_allclose(np.abs(own.vertex_normals @ (np.array([0, 3, -1]) / np.sqrt(10))), 1, atol=1e-12)
    assert scene(tmp_path, RED + "mesh b.obj smooth=no\n").objects[0].vertex_normals is None


# Materials

MTL = "# two\nnewmtl green\nKd 0 0.5 0\nKs 0.25 0.25 0.25\nNs 30\nnewmtl half clear\nKd 0 0 1\nd 0.5\nKe 1 2 3\n"
COLOURED = "mtllib a.mtl\n" + OBJ.replace("f 1 2 3", "f 1 2 3\nusemtl green").replace("f 1 3 4", "f 1 3 4\nusemtl half clear\nf 2 3 4")


def test_materials_of_the_file_or_of_the_line_above(tmp_path: Path) -> None:
    files = {"a_obj": COLOURED, "a_mtl": MTL}
    found = scene(tmp_path, RED + "mesh a.obj\n", **files)
    used = [found.materials[i].color for i in found.objects[0].material_ids]
    assert sorted(used) == [(0, 0, 1), (0, 0.5, 0), (1, 0, 0)], "a face without a material has the one above"
    green, blue = found.materials[1:]
    assert (green.diffuse, green.specular, green.exponent, green.line) == (1, 0.5, 30, 7)
    assert (blue.opacity, blue.emission) == (0.5, (1, 2, 3))
    above = scene(tmp_path, RED + "mesh a.obj materials=above\n", a_obj=COLOURED)
    assert (len(above.materials), above.objects[0].material_ids.tolist()) == (1, [0, 0, 0])


def test_pictures_come_along(tmp_path: Path) -> None:
    for name in ("wood.png", "own.png"):
        Image.fromarray(np.full((2, 2, 3), len(name), np.uint8)).save(tmp_path / name)
    obj = "mtllib a.mtl\nusemtl m\n" + OBJ.replace("f 1 2 3\nf 1 3 4", "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3")
    mtl = "newmtl m\nmap_Kd -clamp on -s 1 1 1 wood.png\n"
    found = scene(tmp_path, RED + "texture own.png\nS 0 0 9 1\nmesh a.obj\n", a_obj=obj, a_mtl=mtl)
    texture = found.textures[found.materials[1].texture]
    assert (texture.picture.texels[0, 0, 0], texture.wrap, texture.srgb, texture.line) == (8, "clamp", True, 9)
    np.testing.assert_array_equal(found.objects[0].uvs[0][[0, 2, 1]], [[0, 0], [1, 0], [0, 1]])


def test_gltf_materials_come_behind_those_of_the_text(tmp_path: Path) -> None:
    made = quad({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 1, 1, 1]}})
    made.picture(np.zeros((1, 1, 3)))
    made.root["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1}}]
    made.node(camera=0)
    found = scene(tmp_path, RED + "S 0 0 9 1\nmesh a.glb\n", a_glb=made.glb())
    assert found.objects[0].material_ids.tolist() == [1, 1]
    assert (found.materials[1].color, found.materials[1].metal_rough, found.materials[1].texture) == ((0.5, 1, 1), True, 0)
    assert sorted(map(tuple, found.objects[0].uvs.reshape(-1, 2))) == sorted(map(tuple, (QUAD_UV * [1, -1] + [0, 1])[[0, 1, 2, 0, 2, 3]]))
    assert found.warnings == ("line 8: a.glb: left out: 1 camera; rendered by itself, the file shows them",)


def test_picture_above_needs_coordinates_or_a_projection(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((2, 2, 3), np.uint8)).save(tmp_path / "wood.png")
    with pytest.raises(SceneError, match=r'scene\.txt:8:6: error: "a\.obj" has no coordinates for the picture of the material above'):
        scene(tmp_path, RED + "texture wood.png\nmesh a.obj\n", a_obj=OBJ)
    found = scene(tmp_path, RED + "texture wood.png\nproject axis=z scale=2\nmesh a.obj\n").objects[0]
    np.testing.assert_array_equal(found.uvs, found.vertices[..., :2] / 2)


# What is wrong

NO_FACES = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
CUT = triangle().glb()


@pytest.mark.parametrize(
    ("lines", "files", "message"),
    [
        (RED + "mesh gone.obj", {}, r"7:6: error: there is no file gone\.obj"),
        (RED + "  mesh ../a.obj", {}, r"7:8: error: \.\./a\.obj leads out of the scene's folder; permit its folder with --allow-path"),
        (RED + "mesh a.blend", {"a_blend": "x"}, r"7:6: error: a\.blend: the extension '\.blend' is not one that is read; convert"),
        (RED + "mesh a.obj", {"a_obj": NO_FACES}, r"7:6: error: a\.obj: .*no faces"),
        (RED + "mesh a.obj", {"a_obj": OBJ + "f 1 2 9\n"}, r"7:6: error: a\.obj: cannot be read as OBJ"),
        (RED + "mesh a.obj", {"a_obj": OBJ + "f 1 0 2\n"}, r"7:6: error: a\.obj:7: a face asks for vertex 0; OBJ counts from 1"),
        (RED + "mesh a.obj", {"a_obj": OBJ.replace("v 1 2 4", "v 1 2 nan")}, r"7:6: error: a\.obj: face \d has vertex .* not finite"),
        (RED + "mesh a.obj", {"a_obj": NO_FACES + "vn 0 nan 1\nf 1//1 2//1 3//1"}, r"7:6: error: a\.obj: face 0 has normals .*not finite"),
        (RED + "mesh a.off", {"a_off": OFF[:-8]}, r"7:6: error: a\.off: "),
        (RED + "mesh a.glb", {"a_glb": CUT[:-10]}, r"7:6: error: a\.glb: its header tells of \d+ bytes, only \d+ are there: .*cut off"),
        (RED + "mesh a.gltf", {"a_gltf": "{\n 1}"}, r"7:6: error: a\.gltf:2:2: the JSON text is broken: "),
        (RED + "mesh a.gltf", {"a_gltf": triangle().gltf("gone.bin")}, r"7:6: error: a\.gltf: buffers\[0\]: there is no file gone\.bin"),
        (RED + "mesh a.obj", {"a_obj": COLOURED}, r"7:6: error: a\.obj: there is no file a\.mtl.* with materials=above"),
        (RED + "mesh a.obj", {"a_obj": COLOURED, "a_mtl": "newmtl green\n"}, r'a\.obj: the material "half clear" is used, but'),
        (RED + "mesh a.obj", {"a_obj": COLOURED, "a_mtl": MTL + "map_Kd gone.png"}, r"7:6: error: a\.obj: a\.mtl:10: there is no file"),
        (RED + "mesh a.obj", {"a_obj": COLOURED, "a_mtl": MTL + "Kd 1 x 0"}, r"a\.mtl:10: Kd takes numbers, found '1 x 0'"),
        ("mesh a.obj\n" + RED, {"a_obj": OBJ}, r"6:1: error: a mesh without materials of its own before any material; add a line"),
        (RED + "mesh a.obj hidden=yes", {"a_obj": OBJ}, r"7:1: error: hidden=yes without a name"),
        (RED + "mesh a.obj name=a\nmesh a.obj name=a", {"a_obj": OBJ}, r'8:1: error: a second "a"; the first is line 7'),
        (RED + "mesh a.obj scale=0", {"a_obj": OBJ}, r'7:18: error: scale must be greater than 0'),
        (RED + "mesh a.obj smoth=yes", {"a_obj": OBJ}, r'7:12: error: mesh has no key "smoth"; did you mean "smooth"\?'),
        (RED + "mesh a.obj smooth=si", {"a_obj": OBJ}, r'7:19: error: smooth must be file, yes or no, found "si"'),
        (RED + "mesh a.obj scale=1e30", {"a_obj": OBJ}, r"7:6: error: a\.obj: a: a vertex lies beyond 1e\+30"),
    ],
)  # fmt: skip
def test_fault_has_the_place_of_the_line_and_what_is_wrong(tmp_path: Path, lines: str, files: dict[str, str | bytes], message: str) -> None:
    (tmp_path / "scene").mkdir()
    (tmp_path / "a.obj").write_text(OBJ)
    with pytest.raises(SceneError, match=message):
        scene(tmp_path / "scene", lines + "\n", **files)


@pytest.mark.parametrize("name", ["scene.txt", "cut.glb", "broken.gltf"])
def test_command_refuses_with_code_2_and_writes_nothing(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scene.txt").write_text(CAMERA + RED + "mesh cut.glb\n")
    (tmp_path / "cut.glb").write_bytes(CUT[:-10])
    (tmp_path / "broken.gltf").write_text("{\n 1}")
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(cli, [name], prog_name="clrt")
    assert result.exit_code == 2, result.output
    assert "error:" in result.stderr
    assert "Traceback" not in result.stderr
    assert not list(tmp_path.glob("*.png"))


def test_without_trimesh_the_error_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """glTF needs nothing."""
    monkeypatch.setitem(sys.modules, "trimesh", None)
    assert len(scene(tmp_path, RED + "mesh a.glb\n", a_glb=glb()).objects) == 1
    with pytest.raises(SceneError, match=r"7:6: error: a\.obj: reading mesh files needs trimesh; install it: pip install 'clrt\[mesh\]'"):
        scene(tmp_path, RED + "mesh a.obj\n", a_obj=OBJ)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the meshes are not here")
def test_real_meshes_are_read_whole(tmp_path: Path) -> None:
    (tmp_path / "scene.txt").write_text(CAMERA + RED + "".join(f"mesh {path}\n" for path in sorted(SHARED.glob("*.obj"))))
    found = load_scene(tmp_path / "scene.txt", allow_paths=[SHARED])
    assert {o.name: len(o) for o in found.objects} == {"stanford-bunny": 69451, "suzanne": 968, "teapot": 6320}


def test_coordinates_of_a_file_without_pictures_serve_the_material_above(tmp_path: Path) -> None:
    Image.new("RGB", (2, 2), (200, 100, 50)).save(tmp_path / "p.png")
    found = scene(tmp_path, RED + "texture p.png\nmesh a.glb materials=above\n", a_glb=quad({}).glb())
    (item,) = found.objects
    assert item.uvs is not None
    # glTF counts v from the top: each corner's v turned round.
    corners = item.uvs.reshape(-1, 2)
    assert {tuple(c) for c in corners.tolist()} == {(u, 1.0 - v) for u, v in np.asarray(QUAD_UV).tolist()}
