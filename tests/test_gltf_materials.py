"""glTF scenes: materials and their pictures; what is left out, and named."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import QUAD_ORDER, QUAD_UV, loaded, material, quad

import clrt


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
