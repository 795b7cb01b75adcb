"""glTF scenes: what the file says, in the scene's axes and units; what it leaves open; whatever is wrong with it."""

from __future__ import annotations

import io
import json
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import clrt
from clrt.errors import SceneError
from clrt.scene.build import load_scene
from clrt.scene.model import Material, Scene
from clrt.scene.models import direct
from clrt.scene.models.gltf_nodes import rotation
from tests.gltf_files import QUAD, QUAD_ORDER, QUAD_UV, TRIANGLE, Gltf, glb, quad, triangle

MIRROR = np.array([1.0, 1.0, -1.0])


def loaded(tmp_path: Path, made: Gltf, **keys: Any) -> Scene:
    path = tmp_path / "model.glb"
    path.write_bytes(made.glb())
    return load_scene(path, **keys)


def material(tmp_path: Path, given: dict[str, Any]) -> Material:
    return loaded(tmp_path, quad(given)).materials[0]


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


# Materials


def test_metal_rough_material(tmp_path: Path) -> None:
    factors = {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.7, "roughnessFactor": 0.6}
    found = material(tmp_path, {"pbrMetallicRoughness": factors})
    assert (found.color, found.metal_rough, found.metallic, found.roughness) == ((0.1, 0.2, 0.3), True, 0.7, 0.6)
    assert found.opacity == 1.0, "the alpha of an opaque material means nothing"


def test_material_left_open_is_white_rough_metal(tmp_path: Path) -> None:
    found = material(tmp_path, {})
    assert (found.color, found.metallic, found.roughness) == ((1, 1, 1), 1, 1)


def test_pictures_and_how_they_lie(tmp_path: Path) -> None:
    texels = np.random.default_rng(1).integers(0, 256, (2, 3, 4))
    made = quad({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}},
        "normalTexture": {"index": 0, "scale": 0.5}, "emissiveTexture": {"index": 1}, "emissiveFactor": [1, 1, 0.5],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}},
    })  # fmt: skip
    made.picture(texels, sampler=made.list("samplers", {"wrapS": 33071, "wrapT": 33071, "magFilter": 9728}))
    made.picture(np.zeros((1, 1, 3)))
    scene = loaded(tmp_path, made)
    found, textures = scene.materials[0], scene.textures
    base, rough, normal, glow = (textures[i] for i in (found.texture, found.metal_rough_map, found.normal_map, found.emission_map))
    np.testing.assert_array_equal(base.picture.texels, texels)
    assert (base.srgb, rough.srgb, normal.srgb, glow.srgb) == (True, False, False, True)
    assert (base.wrap, base.linear, rough.wrap, rough.linear) == ("clamp", False, "repeat", True)
    assert base.picture is normal.picture, "a picture is held once"
    assert (found.normal_strength, found.emission) == (0.5, (3, 3, 1.5))
    expected = (QUAD_UV * [1, -1] + [0, 1])[QUAD_ORDER].reshape(2, 3, 2)[:, [0, 2, 1]]
    np.testing.assert_array_equal(scene.objects[0].uvs, expected)


@pytest.mark.parametrize(
    ("mode", "factor", "expected"),
    [
        ({"alphaMode": "OPAQUE"}, 0.5, (1.0, 0.0, False)),
        ({"alphaMode": "BLEND"}, 0.5, (0.5, 0.0, True)),
        ({"alphaMode": "MASK"}, 1.0, (1.0, 0.5, True)),
        ({"alphaMode": "MASK", "alphaCutoff": 0.2}, 0.5, (1.0, 0.4, True)),
        ({"alphaMode": "MASK", "alphaCutoff": 0.6}, 0.5, (0.0, 0.0, False)),
    ],
)
def test_alpha_modes(tmp_path: Path, mode: dict[str, Any], factor: float, expected: tuple[float, float, bool]) -> None:
    made = quad({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, factor], "baseColorTexture": {"index": 0}}, **mode})
    made.picture(np.full((1, 1, 4), 128))
    found = loaded(tmp_path, made).materials[0]
    assert (found.opacity, found.alpha_cutoff, found.alpha) == expected


def test_texture_transform_of_the_extensions_own_example(tmp_path: Path) -> None:
    """Offset (0, 1), a quarter turn, scale 0.5: the lower left quadrant of the picture alone, turned clockwise by 90 degrees."""
    transform = {"offset": [0, 1], "rotation": math.pi / 2, "scale": [0.5, 0.5]}
    made = quad({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": transform}}}})
    made.picture(np.zeros((2, 2, 3)))
    uvs = loaded(tmp_path, made).objects[0].uvs
    # The corners below left, below right, above right of the square: clockwise by 90 degrees, its left side shows the quadrant's lower one.
    np.testing.assert_allclose(uvs[0][[0, 2, 1]], [[0.5, 0.0], [0.5, 0.5], [0.0, 0.5]], atol=1e-15)


def test_glass_refracts_by_fresnel_and_absorbs(tmp_path: Path) -> None:
    """Of the attenuation colour is left after the attenuation distance."""
    found = material(tmp_path, {
        "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.25},
        "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 0.75}, "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [0.25, 0.5, 1]},
        },
    })  # fmt: skip
    assert (found.refract, found.ior, found.fresnel, found.gloss, found.diffuse) == (0.75, 1.33, True, 0.25, 0.25)
    np.testing.assert_allclose(found.absorb, [math.log(4) / 2, math.log(2) / 2, 0], atol=1e-15)


def test_unlit_material_shows_its_colour(tmp_path: Path) -> None:
    made = quad({"pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.5, 0.75, 1]}, "extensions": {"KHR_materials_unlit": {}}})
    made.root["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "directional"}]}}
    made.node(extensions={"KHR_lights_punctual": {"light": 0}})
    made.list("cameras", {"type": "perspective", "perspective": {"yfov": 0.5}})
    made.node(camera=0, translation=[0, 0, 3])
    image = clrt.render(loaded(tmp_path, made), size=(8, 6), samples=1)
    np.testing.assert_allclose(image.pixels, np.broadcast_to([0.25, 0.5, 0.75], (6, 8, 3)), atol=1e-6)


# What is left out is named


def test_warnings_name_what_is_left_out(tmp_path: Path) -> None:
    made = quad({"occlusionTexture": {"index": 0}, "extensions": {"KHR_materials_clearcoat": {}}})
    made.picture(np.zeros((1, 1, 3)))
    made.root["extensionsUsed"] = ["KHR_materials_clearcoat", "KHR_texture_transform"]
    made.root["animations"], made.root["skins"] = [{}], [{}]
    made.list("meshes", {"primitives": [{"mode": 1, "attributes": {"POSITION": 0}}]})
    made.root["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 0}]
    made.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 0
    made.node(mesh=1)
    told = "\n".join(loaded(tmp_path, made).warnings)
    for what in ("KHR_materials_clearcoat", "animations", "skins", "morph targets", "occlusion", "points and lines", "colours of vertices"):
        assert told.count(what) == 1, what
    assert "KHR_texture_transform" not in told


# What is wrong


def broken(change: Any) -> Gltf:
    made = quad({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    made.picture(np.zeros((2, 2, 3)))
    change(made.root)
    return made


def nan_point() -> Gltf:
    made = Gltf()
    made.node(mesh=made.mesh(np.where(np.arange(9).reshape(3, 3) == 4, np.nan, TRIANGLE)))
    return made


def far_index() -> Gltf:
    made = Gltf()
    made.node(mesh=made.mesh(QUAD, [0, 1, 4]))
    return made


FAULTS: dict[str, tuple[Gltf, str]] = {
    "nan": (nan_point(), r"accessors\[0\]: \(meshes\[0\].primitives\[0\].attributes.POSITION\) element 1 is .*nan.* not finite"),
    "index": (far_index(), r"meshes\[0\].primitives\[0\]: index 2 asks for vertex 4, but there are 4 \(0 to 3\)"),
    "no faces": (broken(lambda root: root.update(meshes=[{"primitives": []}])), r"meshes\[0\]: has no primitives"),
    "no mesh": (broken(lambda root: root["nodes"][0].pop("mesh")), "has no faces; there is nothing to render"),
    "no such mesh": (broken(lambda root: root["nodes"][0].update(mesh=7)), r"nodes\[0\].mesh: asks for mesh 7, but there are 1 \(0 to 0\)"),
    "no such texture": (broken(lambda root: root.pop("textures")), r"baseColorTexture.index: asks for texture 0, but there are none"),
    "two corners": (broken(lambda root: root["accessors"][2].update(count=2)), r"primitives\[0\]: has 2 corners"),
    "long accessor": (broken(lambda root: root["accessors"][0].update(count=99)), r"accessors\[0\]: 99 elements reach beyond the 48 bytes"),
    "wrong kind": (broken(lambda root: root["nodes"][0].update(mesh="a")), r'nodes\[0\].mesh: expected a whole number, found "a"'),
    "wrong vector": (broken(lambda root: root["nodes"][0].update(scale=[1, 2])), r"nodes\[0\].scale: expected 3 numbers, found 2"),
    "own child": (broken(lambda root: root["nodes"][0].update(children=[0])), r"nodes\[0\]: is the child of two nodes, or of itself"),
    "version": (broken(lambda root: root.update(asset={"version": "1.0"})), "is glTF of version 1.0; version 2.0 is read"),
    "required": (broken(lambda root: root.update(extensionsRequired=["KHR_draco"])), "requires KHR_draco, which clrt does not read"),
    "metallic": (broken(lambda root: root["materials"][0]["pbrMetallicRoughness"].update(metallicFactor=2)), "a number from 0 to 1"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_named_with_its_place(tmp_path: Path, name: str) -> None:
    made, message = FAULTS[name]
    with pytest.raises(SceneError, match=r"model\.glb: error: .*" + message):
        loaded(tmp_path, made)


@pytest.mark.parametrize("length", [3, 15, 30, 200, -1])
def test_binary_that_is_cut_off(tmp_path: Path, length: int) -> None:
    path = tmp_path / "cut.glb"
    path.write_bytes(quad({}).glb()[:length])
    with pytest.raises(SceneError, match=r"cut\.glb.*error: .*(cut off|is this a glTF file|broken)"):
        load_scene(path)


def test_binary_whose_chunk_or_buffer_is_too_short(tmp_path: Path) -> None:
    whole = quad({}).glb()
    size = struct.unpack_from("<I", whole, 12)[0]
    (tmp_path / "chunk.glb").write_bytes(whole[:12] + struct.pack("<I", size + len(whole)) + whole[16:])
    made = quad({})
    made.root["buffers"] = [{"byteLength": len(made.data)}]
    (tmp_path / "buffer.glb").write_bytes(glb(json.dumps(made.root).encode(), made.data[:-40]))
    for name, message in (("chunk", "a chunk of .* does not fit"), ("buffer", r"buffers\[0\]: should have \d+ bytes, but only \d+")):
        with pytest.raises(SceneError, match=rf"{name}\.glb: error: {message}.*cut off"):
            load_scene(tmp_path / f"{name}.glb")


def test_broken_json_is_told_with_line_and_column(tmp_path: Path) -> None:
    path = tmp_path / "broken.gltf"
    path.write_text('{"asset": {"version": "2.0"},\n  "nodes": [}\n')
    with pytest.raises(SceneError, match=r"broken\.gltf:2:13: error: the JSON text is broken: Expecting value"):
        load_scene(path)


def test_number_that_json_does_not_have(tmp_path: Path) -> None:
    path = tmp_path / "nan.gltf"
    path.write_text(triangle(translation=[0, 0, float("nan")]).gltf())
    with pytest.raises(SceneError, match=r"its JSON holds NaN"):
        load_scene(path)


def test_external_files_have_to_be_there_and_in_the_folder(tmp_path: Path) -> None:
    folder = tmp_path / "inside"
    folder.mkdir()
    made = triangle()
    (tmp_path / "data.bin").write_bytes(made.data)
    (folder / "missing.gltf").write_text(made.gltf("dat.bin"))
    (folder / "outside.gltf").write_text(made.gltf("../data.bin"))
    with pytest.raises(SceneError, match=r"missing\.gltf: error: buffers\[0\]: there is no file dat\.bin"):
        load_scene(folder / "missing.gltf")
    with pytest.raises(SceneError, match=r"outside\.gltf: error: buffers\[0\]: \.\./data\.bin leads out .* --allow-path"):
        load_scene(folder / "outside.gltf")
    assert len(load_scene(folder / "outside.gltf", allow_paths=[tmp_path]).objects) == 1


def test_picture_that_is_missing_or_damaged(tmp_path: Path) -> None:
    made = quad({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    made.list("textures", {"source": made.list("images", {"uri": "wood.png"})})
    (tmp_path / "a.gltf").write_text(made.gltf())
    with pytest.raises(SceneError, match=r"a\.gltf: error: images\[0\]: there is no file wood\.png"):
        load_scene(tmp_path / "a.gltf")
    stream = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (40, 40, 3)).astype(np.uint8)).save(stream, "PNG")
    (tmp_path / "wood.png").write_bytes(stream.getvalue()[:500])
    with pytest.raises(SceneError, match=r"a\.gltf: error: images\[0\]: wood\.png is damaged or cut off"):
        load_scene(tmp_path / "a.gltf")


def rich() -> Gltf:
    """A file with something of everything."""
    made = quad({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"rotation": 1}}},
                                 "baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0},
        "normalTexture": {"index": 0, "scale": 2}, "emissiveFactor": [1, 1, 1], "alphaMode": "MASK", "alphaCutoff": 0.25, "name": "m",
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.5},
                       "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 1, "attenuationColor": [1, 1, 1]},
                       "KHR_materials_emissive_strength": {"emissiveStrength": 2}},
    }, rotation=[0, 0, 0, 1], scale=[1, 1, 1])  # fmt: skip
    made.picture(np.zeros((2, 2, 3)), sampler=made.list("samplers", {"wrapS": 10497, "wrapT": 10497, "magFilter": 9728}))
    made.list("cameras", {"type": "perspective", "perspective": {"yfov": 0.8, "aspectRatio": 1.5}})
    lights = [{"type": "spot", "intensity": 2, "color": [1, 1, 1], "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}}]
    made.root["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    made.node(camera=0, extensions={"KHR_lights_punctual": {"light": 0}}, matrix=np.eye(4).ravel().tolist())
    made.root["accessors"][0]["sparse"] = {
        "count": 1, "indices": {"bufferView": made.view(b"\x02"), "componentType": 5121},
        "values": {"bufferView": made.view(np.ones(3, "<f4").tobytes())},
    }  # fmt: skip
    made.root["scene"] = 0
    return made


def places(value: Any) -> list[tuple[Any, Any]]:
    """Each container of a JSON value and each key in it."""
    pairs = list(value.items()) if isinstance(value, dict) else list(enumerate(value)) if isinstance(value, list) else []
    return [(value, key) for key, _ in pairs] + [place for _, inner in pairs for place in places(inner)]


def refusal_of(path: Path) -> str | None:
    """The message of the error with which a file is refused; None if it is not."""
    try:
        load_scene(path)
    except SceneError as problem:
        return str(problem)
    return None


def test_any_wrong_value_anywhere_is_a_fault_or_harmless(tmp_path: Path) -> None:
    whole = rich()
    assert loaded(tmp_path, whole).objects
    refused = 0
    values = [None, -1, 10**15, 0.5, "x", [], {}, True, [0, 0, 0]]
    for number in range(len(places(whole.root))):
        for wrong in (values[number % 9], values[(number * 5 + 4) % 9]):
            root = json.loads(json.dumps(whole.root))
            container, key = places(root)[number]
            container[key] = wrong
            (tmp_path / "wrong.glb").write_bytes(glb(json.dumps(root).encode(), whole.data))
            refusal = refusal_of(tmp_path / "wrong.glb")
            assert refusal is None or "wrong.glb: error: " in refusal
            refused += refusal is not None
    assert refused > 100


def test_options_for_scene_texts_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="--right-handed is for scene texts"):
        loaded(tmp_path, triangle(), right_handed=True)
    (tmp_path / "scene.txt").write_text("E 0 0 0\n")
    with pytest.raises(SceneError, match="--camera chooses among the cameras of a glTF file"):
        load_scene(tmp_path / "scene.txt", camera=1)
