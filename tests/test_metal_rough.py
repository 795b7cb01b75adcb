"""Metal-rough materials: glTF's formulas in float64 against the device, white furnaces, the path reference, maps; wrong lines."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from microfacets import alpha_of, cosine_mean, means, metal_rough, pixel_views
from ztest import assert_same, device_batches

import clrt
from clrt.device.context import Device
from clrt.device.ggx_albedo import share_table
from clrt.errors import SceneError
from clrt.features import Features
from clrt.reference.paths import render_paths
from clrt.scene.build import load_scene, parse_scene
from clrt.scene.model import Picture, Scene, Texture

SCENES = Path(__file__).parents[1] / "scenes"
BALL = "E 0 0 -4\nV 0 0 1\nF 24\nR 12 12\nbackground 1 1 1\n"
ROOM = (
    "E 0 0.6 -4\nV 0 -0.1 1\nF 40\nR 10 8\ndepth 3\nbackground 0.3 0.5 0.8\n"
    "M 0.8 0.7 0.6 0.1 0.7 0.2 5 0\nT -6 -1 6 6 -1 6 6 -1 -6\nT -6 -1 6 6 -1 -6 -6 -1 -6\n"
)
LIGHT = "M 0 0 0 0 0 0 1 0\narealight 6 5 4\nT -1 2.5 0 1 2.5 0 0 2.5 1.5\nO\n"
BALLS = "S -0.8 0 0 1\nS 1.2 -0.2 0.4 0.8\n"
WALL = "E 0 0 -4\nV 0 0 1\nF 1\nR 1 1\ndepth 0\nM 0.9 0.45 0.1 0.3 0.4 0.5 20 0.6\n{word}\nT -9 -9 0 9 -9 0 0 9 0\n{light}\n"
MEAN = re.compile(r"^# mean \((\d+),(\d+)\) is (\S+) (\S+) (\S+)$", re.MULTILINE)
COLOR = np.array([0.9, 0.45, 0.1])


@pytest.mark.parametrize("angle", [0.0, 30.0, 70.0])
@pytest.mark.parametrize(("metallic", "roughness"), [(0.0, 1.0), (0.0, 0.2), (1.0, 0.5), (0.4, 0.7)])
def test_sun_on_a_wall_is_pi_times_the_formula(device: Device, angle: float, metallic: float, roughness: float) -> None:
    """One pixel of a small angle, met square on; a sun of colour (1, 2, 3)."""
    to_light = np.array([np.sin(np.radians(angle)), 0.0, -np.cos(np.radians(angle))])
    word = f"material metallic={metallic} roughness={roughness}"
    scene = parse_scene(WALL.format(word=word, light=f"sun {to_light[0]} 0 {to_light[2]} red=1 green=2 blue=3"))
    expected = np.pi * np.array([1, 2, 3]) * metal_rough(
        np.array([0.0, 0.0, 1.0]), np.array([[to_light[0], 0.0, -to_light[2]]]), COLOR, metallic, roughness
    )[0]  # fmt: skip
    np.testing.assert_allclose(clrt.render(scene).pixels[0, 0], expected, rtol=2e-3)


def test_published_figures_of_the_formulas() -> None:
    """Straight on, glTF's dielectric reflects 4%, and D of alpha = 1 is 1 / pi: f cos = (0.96 C + 0.04 / (4 E)) / pi at N = V = L."""
    n = np.array([0.0, 0.0, 1.0])
    whole, _ = means(1.0, 1.0)
    assert whole == pytest.approx(1.0 - np.log(2.0), abs=1e-4), "the integral of 2 z / (1 + z) dz / 2 over the cap's directions"
    value = metal_rough(n, n[None], COLOR, 0.0, 1.0)[0]
    np.testing.assert_allclose(value, (0.96 * COLOR + 0.04 / (4.0 * whole)) / np.pi, rtol=1e-3)


def test_share_of_the_matte_part_is_that_of_its_definition() -> None:
    table = share_table()
    for roughness in (0.125, 0.5, 1.0):
        for root in (0.25, 0.5, 0.75, 1.0):
            _, grazing = means(root**2, alpha_of(roughness))
            expected = min(1.0, (1.0 - grazing) / (1.0 - cosine_mean(root**2)))
            assert table[round(roughness * (table.shape[0] - 1)), round(root * (table.shape[1] - 1))] == pytest.approx(expected, abs=2e-3)


def furnace(material: str, extra: str = "") -> tuple[float, float]:
    scene = parse_scene(f"{BALL}{extra}{material}\nS 0 0 0 1\n")
    seen = device_batches(scene, 256, range(6)).mean(axis=(1, 2))[:, 0]
    return float(seen.mean()), float(seen.std(ddof=1) / np.sqrt(6))


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("roughness", [0.0, 0.4, 1.0])
def test_white_furnace_white_metal_loses_nothing(device: Device, roughness: float) -> None:
    mean, sigma = furnace(f"M 1 1 1 0 0 0 1 0\nmaterial metallic=1 roughness={roughness}")
    assert abs(mean - 1.0) < 3.0 * sigma + 4e-4


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("metallic", [0.0, 0.5])
@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.5, 1.0])
def test_white_furnace_gives_back_one_at_most(device: Device, roughness: float, metallic: float) -> None:
    """White, the most there is; with S = 1 a smooth dielectric would give back 1.1 over the ball, 1.9 at its rim."""
    scene = parse_scene(f"{BALL}indirect\nM 1 1 1 0 0 0 1 0\nmaterial metallic={metallic} roughness={roughness}\nS 0 0 0 1\n")
    batches = device_batches(scene, 256, range(6))[..., 0]
    sigma = batches.std(axis=0, ddof=1) / np.sqrt(6)
    assert (batches.mean(axis=0) < 1.0 + 5.0 * sigma + 2e-3).all()
    # glTF weights the matte part by (1 - F) (1 - m): of what is half a metal a part is lost.
    least = 0.97 if metallic == 0.0 else 0.52 + 0.48 * 0.5 - 0.01
    assert batches.mean() > least


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("word", ["metallic=0.6 roughness=0.5", "metallic=0 roughness=0.2"])
def test_lamps_on_balls_are_those_of_the_path_reference(device: Device, word: str) -> None:
    lamps = "L 2 3 -3 1 0.9 0.8\nsun 1 1 -1\nspot -3 3 -2 2 -3 2 30 softness=0.5\n"
    scene = parse_scene(ROOM + lamps + f"M 0.9 0.6 0.2 0 0 0 1 0\nmaterial {word}\n" + BALLS)
    reference = render_paths(scene, 600, 3)
    assert_same(device_batches(scene, 64, range(8)), reference.mean, reference.variance_of_mean)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize(
    ("word", "extra"),
    [("metallic=1 roughness=0.4", ""), pytest.param("metallic=0.1 roughness=0.6", "indirect\n", marks=pytest.mark.slow)],
    ids=["metal", "indirect"],
)
def test_area_light_on_balls_is_that_of_the_path_reference(device: Device, word: str, extra: str) -> None:
    scene = parse_scene(ROOM + extra + LIGHT + f"M 0.9 0.6 0.2 0 0 0 1 0\nmaterial {word}\n" + BALLS)
    reference = render_paths(scene, 1500, 5)
    assert_same(device_batches(scene, 64, range(8)), reference.mean, reference.variance_of_mean)


def expected_material(scene: Scene, column: int, row: int, steps: int = 4) -> np.ndarray:
    """What the floor of scenes/material.txt shows in a pixel."""
    total, lamp = np.zeros(3), scene.lights[0]
    for d in pixel_views(scene, column, row, steps):
        point = scene.camera.eye - d * scene.camera.eye[1] / d[1]
        metallic, roughness = ((0.0, 0.9), (0.0, 0.3), (1.0, 0.3), (1.0, 0.9))[int(np.floor(point[0] + 2.0))]
        way = np.array(lamp.position) - point
        light = (way / np.linalg.norm(way))[[0, 2, 1]]
        total += np.pi * np.array(lamp.color) * metal_rough(np.array([-d[0], -d[2], -d[1]]), light[None], COLOR, metallic, roughness)[0]
    return total / steps**2


def test_scene_comment_holds_by_quadrature_and_on_the_device(device: Device) -> None:
    scene = load_scene(SCENES / "material.txt")
    found = MEAN.findall((SCENES / "material.txt").read_text())
    assert len(found) == 4
    picture = device_batches(scene, 64, range(1))[0]
    for c, r, *color in found:
        value = np.array(list(map(float, color)))
        np.testing.assert_allclose(expected_material(scene, int(c), int(r)), value, rtol=3e-3, atol=1e-4)
        np.testing.assert_allclose(picture[int(r), int(c)], value, rtol=4e-3, atol=1e-4)


def test_letters_of_the_m_above_but_the_color_do_not_count(device: Device) -> None:
    word = "material metallic=0.3 roughness=0.6"
    wild = parse_scene(WALL.format(word=word, light="sun 0 0 -1"))
    tame = parse_scene(WALL.replace("0.3 0.4 0.5 20 0.6", "0 0 0 1 0").format(word=word, light="sun 0 0 -1"))
    assert np.array_equal(clrt.render(wild).pixels, clrt.render(tame).pixels)
    assert {"mirror", "gloss"}.isdisjoint(Features.of(wild).effects)


def test_map_scales_roughness_by_green_and_metallic_by_blue(device: Device) -> None:
    text = WALL.replace("T -9 -9 0 9 -9 0 0 9 0", "texture x\nT -9 -9 0 9 -9 0 0 9 0").replace("texture x\n", "")
    light = "sun 0.3 0.2 -1"
    plain = parse_scene(text.format(word="material metallic=0.8 roughness=1", light=light))
    mesh = replace(plain.objects[0], uvs=np.zeros((1, 3, 2)))
    texels = np.zeros((1, 1, 4), np.uint8)
    texels[..., 1], texels[..., 2], texels[..., 3] = 102, 51, 255  # 0.4, 0.2
    texture = Texture(Picture(texels), srgb=False)
    mapped = replace(
        plain, objects=(mesh,), textures=(texture,),
        materials=tuple(replace(m, metal_rough_map=0) for m in plain.materials),
    )  # fmt: skip
    same = parse_scene(text.format(word="material metallic=0.16 roughness=0.4", light=light))
    np.testing.assert_allclose(clrt.render(mapped).pixels, clrt.render(same).pixels, rtol=1e-5)
    assert np.abs(clrt.render(mapped).pixels - clrt.render(plain).pixels).max() > 0.01


def test_scene_without_it_holds_nothing_of_it() -> None:
    scene = parse_scene(BALL + "M 1 1 1 0.1 0.7 0.2 10 0.5\nS 0 0 0 1\nL 1 1 -5\n")
    assert not {"metal rough", "metal shine", "facets"} & {f.name for f in Features.of(scene).active}


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("material metallic=1\nM 1 1 1 0 0 0 1 0\nS 0 0 3 1\n", r":6:1: error: material before any material"),
        ("M 1 1 1 0 0 0 1 0\nmaterial metallic=2\nS 0 0 3 1\n", r":7:19: error: .*metallic.* 0 to 1"),
        ("M 1 1 1 0 0 0 1 0\nmaterial roughness=-1\nS 0 0 3 1\n", r":7:20: error: .*roughness"),
        ("M 1 1 1 0 0 0 1 0\nmaterial gloss=1\nS 0 0 3 1\n", r":7:10: error: .*gloss"),
        ("M 1 1 1 0 0 0 1 0\nmaterial 1 0.5\nS 0 0 3 1\n", r":7:10: error"),
        ("M 1 1 1 0 0 0 1 0\nmaterial\nmaterial\nS 0 0 3 1\n", r":8:1: error: a second material of one material; the first is line 7"),
        ("M 1 1 1 0 0 0 1 1\nmaterial\ngloss 0.3\nS 0 0 3 1\n", r":8:1: error: gloss and material \(line 7\) do not go together"),
        ("M 1 1 1 0 0 0 1 0 1 1.5\nfresnel\nmaterial\nS 0 0 3 1\n", r":8:1: error: material and fresnel \(line 7\) do not go together"),
    ],
)
def test_wrong_line_is_refused_where_it_is_wrong(lines: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        parse_scene(BALL + lines)


def test_picture_of_emission_multiplies_what_is_seen_of_it(device: Device) -> None:
    """Nothing else lights the wall: it shows emission times texel, seen directly and by a mirror."""
    plain = parse_scene(
        "E 0 0 -4\nV 0 0 1\nF 1\nR 1 1\nM 1 1 1 0 0 0 1 0\narealight 2 3 4\nT -9 -9 0 9 -9 0 0 9 0\nO\n"
        "M 1 1 1 0 0 0 1 0.5\nT -9 -9 -5 9 -9 -5 0 9 -5\n"
    )  # fmt: skip
    texels = np.full((1, 1, 4), (51, 102, 255, 255), np.uint8)
    mesh = tuple(replace(o, uvs=np.zeros((1, 3, 2))) for o in plain.objects)
    lit = tuple(replace(m, emission_map=0 if max(m.emission) > 0 else -1) for m in plain.materials)
    mapped = replace(plain, objects=mesh, textures=(Texture(Picture(texels), srgb=False),), materials=lit)
    np.testing.assert_allclose(clrt.render(mapped).pixels[0, 0], [0.4, 1.2, 4.0], rtol=1e-6)
    behind = replace(mapped, camera=replace(mapped.camera, corners=-mapped.camera.corners))
    np.testing.assert_allclose(clrt.render(behind).pixels[0, 0], [0.2, 0.6, 2.0], rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("picture", ["metal_rough_map", "emission_map"])
def test_pictures_lie_on_an_instance_as_on_the_object(picture: str, device: Device) -> None:
    """A picture of four texels on an object far from where its instance stands: as if the triangles stood there themselves."""
    head = "E 0 0 -3\nV 0 0 1\nF 60\nR 32 32\nsamples 1\nL 2 3 -4\nM 1 1 1 0 0 0 1 0\nmaterial metallic=1\n"
    wall = "T {0} -1 0 {1} -1 0 {1} 1 0\nT {0} -1 0 {1} 1 0 {0} 1 0\n"
    texels = np.array([[(0, 200, 255, 255), (255, 30, 10, 255)], [(80, 120, 90, 255), (160, 255, 0, 255)]], np.uint8)

    def pixels(text: str) -> np.ndarray:
        scene = parse_scene(head + text)
        uvs = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], np.float64)
        glow = {"emission": (1.0, 1.0, 1.0)} if picture == "emission_map" else {}
        materials = tuple(replace(m, roughness=1.0, **{picture: 0}, **glow) for m in scene.materials)
        objects = tuple(replace(o, uvs=uvs) for o in scene.objects)
        textures = (Texture(Picture(texels), linear=False, srgb=False),)
        return clrt.render(replace(scene, objects=objects, materials=materials, textures=textures)).pixels

    placed = pixels("object wall hidden=yes\n" + wall.format(49.25, 51.25) + "O\ninstance wall -50 0 0\n")
    np.testing.assert_allclose(placed, pixels(wall.format(-0.75, 1.25) + "O\n"), rtol=1e-5, atol=1e-6)
    assert placed.std() > 0.05
