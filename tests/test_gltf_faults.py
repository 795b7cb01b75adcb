"""glTF files in which something is wrong: each fault with its place, and nothing else ever escapes."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import QUAD, TRIANGLE, Gltf, glb, loaded, quad, triangle
from PIL import Image

from clrt.errors import SceneError
from clrt.scene.build import load_scene


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
