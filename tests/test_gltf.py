"""glTF scenes: shapes, cameras and lights, in the scene's axes and units."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
import pytest
from gltf_files import QUAD, QUAD_ORDER, QUAD_UV, TRIANGLE, Gltf, loaded, quad, triangle

import clrt
from clrt.errors import SceneError
from clrt.scene.build import load_scene
from clrt.scene.models import direct
from clrt.scene.models.gltf_nodes import rotation

MIRROR = np.array([1.0, 1.0, -1.0])


# Geometry


def test_triangle_is_mirrored_in_z_and_keeps_its_outward_side(tmp_path: Path) -> None:
    scene = loaded(tmp_path, triangle(translation=[0, 0, 3]))
    (item,) = scene.objects
    np.testing.assert_array_equal(item.vertices, (TRIANGLE + np.array([0, 0, 3]))[None, [0, 2, 1]] * MIRROR)
    np.testing.assert_array_equal(item.normals, [[0, 0, -1]])  # +z towards the viewer becomes -z
    assert item.vertex_normals is None


@pytest.mark.parametrize("kind", ["u1", "u2", "u4"])
def test_indices_of_every_kind(tmp_path: Path, kind: str) -> None:
    made = Gltf()
    primitive = {"attributes": {"POSITION": made.array(QUAD)}, "indices": made.array(QUAD_ORDER, kind)}
    made.list("meshes", {"primitives": [primitive]})
    made.node(mesh=0)
    expected = QUAD[QUAD_ORDER].reshape(2, 3, 3)[:, [0, 2, 1]] * MIRROR
    np.testing.assert_array_equal(loaded(tmp_path, made).objects[0].vertices, expected)


@pytest.mark.parametrize(("mode", "faces"), [(5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]), (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0]])])
def test_strips_and_fans_keep_their_winding(tmp_path: Path, mode: int, faces: list[list[int]]) -> None:
    points = np.random.default_rng(5).normal(size=(5, 3)).astype(np.float32).astype(float)
    made = Gltf()
    made.node(mesh=made.mesh(points, mode=mode))
    np.testing.assert_array_equal(loaded(tmp_path, made).objects[0].vertices, points[faces][:, [0, 2, 1]] * MIRROR)


def test_interleaved_normalised_and_sparse_values(tmp_path: Path) -> None:
    made = Gltf()
    rows = np.zeros(4, np.dtype([("at", "<f4", 3), ("uv", "<u2", 2)]))
    rows["at"], rows["uv"] = QUAD, (QUAD_UV * 65535).astype(int)
    view = made.view(rows.tobytes(), byteStride=16)
    points = made.list("accessors", {"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3", "sparse": {
        "count": 1, "indices": {"bufferView": made.view(b"\x02"), "componentType": 5121},
        "values": {"bufferView": made.view(np.array([1, 1, 5], "<f4").tobytes())}}})  # fmt: skip
    pairs = {"bufferView": view, "byteOffset": 12, "componentType": 5123, "count": 4, "type": "VEC2", "normalized": True}
    uvs = made.list("accessors", pairs)
    made.picture(np.zeros((2, 2, 3)))
    made.list("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    made.list("meshes", {"primitives": [{"attributes": {"POSITION": points, "TEXCOORD_0": uvs}, "material": 0}]})
    made.root["meshes"][0]["primitives"][0]["indices"] = made.array(QUAD_ORDER, "u2")
    made.node(mesh=0)
    (item,) = loaded(tmp_path, made).objects
    moved = np.where(np.arange(4)[:, None] == 2, [1.0, 1.0, 5.0], QUAD)
    np.testing.assert_array_equal(item.vertices, moved[QUAD_ORDER].reshape(2, 3, 3)[:, [0, 2, 1]] * MIRROR)
    np.testing.assert_array_equal(item.uvs, (QUAD_UV * [1, -1] + [0, 1])[QUAD_ORDER].reshape(2, 3, 2)[:, [0, 2, 1]])


def test_hierarchy_multiplies_transforms(tmp_path: Path) -> None:
    """A quarter turn about y (z to x) of what is scaled and shifted first; the child's matrix is column by column."""
    made = Gltf()
    made.mesh(TRIANGLE)
    child = made.node(mesh=0, matrix=[2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1])
    half = math.sqrt(0.5)
    parent = made.node(children=[child], rotation=[0, half, 0, half], translation=[0, 0, 1])
    made.root["scenes"][0]["nodes"] = [parent]
    inner = TRIANGLE * [2, 3, 1] + [5, 6, 7]
    turned = np.stack([inner[:, 2], inner[:, 1], 1 - inner[:, 0]], axis=1)
    np.testing.assert_allclose(loaded(tmp_path, made).objects[0].vertices, turned[None, [0, 2, 1]] * MIRROR, atol=1e-14)


def test_rotation_of_a_quaternion_is_orthogonal_and_turns_by_twice_its_angle() -> None:
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    matrix = rotation(np.append(axis * math.sin(0.4), math.cos(0.4)))
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(matrix @ axis, axis, atol=1e-15)
    assert np.trace(matrix) == pytest.approx(1.0 + 2.0 * math.cos(0.8))


def test_normals_follow_a_stretched_node(tmp_path: Path) -> None:
    """The plane x = y stretched by 4 along x: points (4, 1), normals (1, -4) / sqrt(17); corner normals a little off stay what they are."""
    points = np.array([[0, 0, 0], [1, 1, 0], [0, 0, 1]], float)
    made = Gltf()
    normals = np.array([[1, -1, 0], [1, -1, 0], [1, -1, 0.5]])
    made.node(mesh=made.mesh(points, normals=normals), scale=[4, 1, 1])
    corners = loaded(tmp_path, made).objects[0].vertex_normals
    expected = np.array([[1, -4, 0], [1, -4, -2.0], [1, -4, 0]])
    np.testing.assert_allclose(corners[0], expected / np.linalg.norm(expected, axis=1)[:, None], atol=1e-12)


def test_normals_that_are_those_of_the_faces_make_no_smooth_mesh(tmp_path: Path) -> None:
    made = Gltf()
    made.node(mesh=made.mesh(QUAD, QUAD_ORDER, normals=np.tile([0, 0, 1 - 1e-7], (4, 1))))
    assert loaded(tmp_path, made).objects[0].vertex_normals is None


def test_mesh_of_several_nodes_is_kept_once(tmp_path: Path) -> None:
    made = Gltf()
    made.mesh(TRIANGLE)
    for x in range(3):
        made.node(mesh=0, translation=[3 * x, 0, 2], rotation=[0, 0, math.sin(0.2 * x), math.cos(0.2 * x)])
    made.node(mesh=0, scale=[-1, 1, 1])
    scene = loaded(tmp_path, made)
    kept, mirrored = scene.objects
    assert (kept.hidden, mirrored.hidden, len(scene.instances)) == (True, False, 3)
    np.testing.assert_array_equal(mirrored.vertices[0], TRIANGLE * [-1, 1, -1])
    for x, instance in enumerate(scene.instances):
        turn = 0.4 * x
        inner = TRIANGLE @ np.array([[math.cos(turn), math.sin(turn), 0], [-math.sin(turn), math.cos(turn), 0], [0, 0, 1]]) + [3 * x, 0, 2]
        placed = kept.vertices[0] @ instance.world_from_object[:, :3].T + instance.world_from_object[:, 3]
        np.testing.assert_allclose(placed, inner[[0, 2, 1]] * MIRROR, atol=1e-14)


@pytest.mark.slow
def test_shared_mesh_looks_like_copies_of_it(tmp_path: Path) -> None:
    pictures = []
    for shared in (True, False):
        made = Gltf()
        made.root["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 3}]}}
        for x in range(3):
            mesh = 0 if shared and x else made.mesh(QUAD, QUAD_ORDER)
            turn = 0.3 * x
            made.node(mesh=mesh, translation=[2 * x - 2, 0, -x], rotation=[0, math.sin(turn), 0, math.cos(turn)], scale=[1, 1 + x, 1])
        made.node(extensions={"KHR_lights_punctual": {"light": 0}}, rotation=[0.2, 0.3, 0, 0.9])
        made.list("cameras", {"type": "perspective", "perspective": {"yfov": 0.9}})
        made.node(camera=0, translation=[0, 0, 8])
        scene = loaded(tmp_path, made)
        assert len(scene.instances) == (3 if shared else 0)
        pictures.append(clrt.render(scene, size=(40, 30), samples=1).pixels)
    assert pictures[0].std() > 0.01
    assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 1e-5).mean() < 0.01, "but for pixels on an edge"


def test_primitives_of_a_mesh_are_one_object_with_its_materials(tmp_path: Path) -> None:
    made = Gltf()
    for _ in range(2):
        made.list("materials", {})
    primitives = [{"attributes": {"POSITION": made.array(TRIANGLE + np.array([0, 0, z]))}, "material": z} for z in (1, 0)]
    primitives.append({"attributes": {"POSITION": made.array(TRIANGLE)}})
    made.list("meshes", {"primitives": primitives})
    made.node(mesh=0)
    scene = loaded(tmp_path, made)
    assert scene.objects[0].material_ids.tolist() == [1, 0, 2]
    assert scene.materials[2] == scene.materials[0], "a primitive without a material has glTF's default one"


def test_text_form_with_data_within_and_in_a_file_reads_as_the_binary(tmp_path: Path) -> None:
    made = quad({"name": "m"})
    whole = loaded(tmp_path, made).objects[0].vertices
    (tmp_path / "inside.gltf").write_text(made.gltf())
    (tmp_path / "beside.gltf").write_text(made.gltf("the%20data.bin"))
    (tmp_path / "the data.bin").write_bytes(made.data)
    for name in ("inside.gltf", "beside.gltf"):
        np.testing.assert_array_equal(load_scene(tmp_path / name).objects[0].vertices, whole)


def test_triangles_are_those_that_another_reader_finds(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    made = Gltf()
    rng = np.random.default_rng(3)
    made.mesh(rng.normal(size=(40, 3)), rng.integers(0, 40, 60))
    made.mesh(rng.normal(size=(9, 3)))
    turn = rng.normal(size=4)
    made.node(mesh=0, rotation=(turn / np.linalg.norm(turn)).tolist(), scale=[1, 2, 3])
    child = made.node(mesh=1, translation=[1, 2, 3])
    made.root["nodes"][0]["children"] = [child]
    made.root["scenes"][0]["nodes"] = [0]
    scene = loaded(tmp_path, made)
    other = trimesh.load_scene(io.BytesIO(made.glb()), file_type="glb", process=False).to_mesh()
    ours = np.concatenate([item.vertices for item in scene.objects])[:, [0, 2, 1]] * MIRROR
    theirs = np.asarray(other.vertices)[np.asarray(other.faces)]
    key = [np.lexsort(np.round(t.reshape(-1, 9), 4).T) for t in (ours, theirs)]
    np.testing.assert_allclose(ours[key[0]], theirs[key[1]], atol=1e-5)


# Cameras


def test_camera_looks_as_the_file_says(tmp_path: Path) -> None:
    """Half a turn about y: it looks along +z of the file, -z of the scene; its right is -x."""
    made = triangle()
    made.list("cameras", {"type": "perspective", "perspective": {"yfov": 0.8, "aspectRatio": 2.0, "znear": 0.1}})
    made.node(camera=0, translation=[1, 2, 3], rotation=[0, 1, 0, 0])
    camera = loaded(tmp_path, made).camera
    assert (camera.width, camera.height) == (1024, 512)
    np.testing.assert_array_equal(camera.eye, [1, 2, -3])
    half = math.tan(0.4)
    np.testing.assert_allclose(camera.corners[0], [2 * half, half, -1], atol=1e-12)
    np.testing.assert_allclose(camera.corners[3], [-2 * half, -half, -1], atol=1e-12)


def test_cameras_are_chosen_by_number(tmp_path: Path) -> None:
    made = triangle()
    for name, kind in (("flat", "orthographic"), ("one", "perspective"), ("two", "perspective")):
        camera = made.list("cameras", {"type": kind, "name": name, "perspective": {"yfov": 0.8}})
        made.node(camera=camera, translation=[camera, 0, 5])
    assert loaded(tmp_path, made).camera.eye[0] == 1
    assert loaded(tmp_path, made, camera=3).camera.eye[0] == 2
    assert any('orthographic camera "flat"' in warning for warning in loaded(tmp_path, made).warnings)
    with pytest.raises(SceneError, match="camera 1 is orthographic"):
        loaded(tmp_path, made, camera=1)
    with pytest.raises(SceneError, match=r'no camera 4 in the file; they are 1 \(orthographic\), 2 "one", 3 "two"'):
        loaded(tmp_path, made, camera=4)


def test_file_without_camera_is_framed(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    made = Gltf()
    points = rng.normal(size=(300, 3)) * [1, 3, 0.5] + [40, 0, -7]
    made.node(mesh=made.mesh(points))
    scene = loaded(tmp_path, made)
    camera = scene.camera
    vertices = scene.objects[0].vertices.reshape(-1, 3) - camera.eye
    right, down = camera.corners[1] - camera.corners[0], camera.corners[2] - camera.corners[0]
    middle = camera.corners.mean(axis=0)
    seen = vertices / (vertices @ middle)[:, None] * (middle @ middle)
    across, up = 2 * (seen @ right) / (right @ right), 2 * (seen @ down) / (down @ down)
    assert max(np.abs(across).max(), np.abs(up).max()) == pytest.approx(0.85, abs=1e-5)
    assert any("no camera in the file" in warning for warning in scene.warnings)


def test_many_instances_are_framed_by_their_boxes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Corners of boxes reach as far as points that fill them, and no farther."""
    made = Gltf()
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 2)], float)
    made.mesh(corners, [0, 3, 6, 1, 2, 5, 4, 7, 0, 5, 3, 6])
    for x in range(4):
        made.node(mesh=0, translation=[2 * x, x, 0])
    exact = loaded(tmp_path, made).camera
    monkeypatch.setattr(direct, "_MOST_POINTS", 10)
    np.testing.assert_allclose(loaded(tmp_path, made).camera.eye, exact.eye, atol=1e-12)


# Lights


def test_lights_have_the_irradiance_that_the_file_says(tmp_path: Path) -> None:
    """Lux E is our colour E / pi, candela I is I / pi at distance 1; a directional light shines along its node's -z."""
    made = triangle()
    made.root["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"type": "directional", "intensity": math.pi, "color": [1, 0.5, 0]},
        {"type": "point", "intensity": 2 * math.pi},
        {"type": "spot", "intensity": 4 * math.pi, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.3}, "range": 9},
    ]}}  # fmt: skip
    half = math.sqrt(0.5)
    for light in range(3):
        made.node(extensions={"KHR_lights_punctual": {"light": light}}, rotation=[-half, 0, 0, half], translation=[1, 2, 3])
    scene = loaded(tmp_path, made)
    (sun,), (point,), (spot,) = scene.suns, scene.lights, scene.spots
    # A turn of -90 degrees about x takes -z to -y: the lights shine straight down.
    np.testing.assert_allclose(sun.direction, [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(sun.color, [1, 0.5, 0])
    assert (point.position, point.falloff, spot.falloff) == ((1, 2, -3), True, True)
    np.testing.assert_allclose(point.color, [2, 2, 2])
    np.testing.assert_allclose(spot.direction, [0, -1, 0], atol=1e-15)
    assert (spot.inner, spot.outer, spot.color) == (0.1, 0.3, pytest.approx((4, 4, 4)))
    assert scene.environment is None
    assert any("range of lights" in warning for warning in scene.warnings)


def test_file_without_light_has_a_sky(tmp_path: Path) -> None:
    scene = loaded(tmp_path, triangle())
    assert scene.environment is not None
    assert any("no light in the file; an overcast sky" in warning for warning in scene.warnings)
