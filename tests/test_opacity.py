"""Opacity and cut-outs: what a scene text may say of them; pictures and shadows against closed forms and the reference; their rays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from device_pictures import Write, compare, in_packets, writer
from PIL import Image

import clrt
from clrt.device.context import Device
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS
from clrt.scene.build import parse_scene

HEAD = "E 0 0.2 -1\nV 0 0 1\nF 45\nR 32 32\nbackground 0.2 0.3 0.5\n"
LIGHTS = "L 5 5 -5\nL -3 4 1 0.5 0.4 0.3\nsun 1 3 -1 intensity=0.4\n"
FLOOR = "M 1 1 1 0.1 0.8 0 20 0\nT -9 -1 12 9 -1 12 9 -1 0.5\nT -9 -1 12 9 -1 0.5 -9 -1 0.5\nO\n"
MATERIAL = "M 0.9 0.8 1 0.3 0.6 0.2 20 0.1\n"
THINGS = "T -1 -0.5 3 -0.2 0.8 3.3 0.1 -0.6 2.5\nuv -0.7 -0.3 1.4 0.2 0.5 1.9\nS 0.6 0.2 3 0.6\nS -1.5 0.5 5 0.7\n"
PLAIN = THINGS.replace("uv -0.7 -0.3 1.4 0.2 0.5 1.9\n", "")
CURVED = "T -1 -0.5 2.6 0 0.9 3 1 -0.5 2.6  -0.5 -0.2 -1 0 0.5 -1 0.5 -0.2 -1\n"
#: a floor y = 0 with its light at (0, 4, 0); what lies between is in its way. The sphere is not seen: with it, all are of one program
BELOW = "E 0 1 -3\nV 0 -1 1\nF 60\nR 1 1\nL 0 4 0\nM 1 1 1 0 1 0 1 0\nT -50 0 -50 50 0 -50 0 0 90\nO\nS 0 -9 0 1\nM 1 1 1 0 0 0 1 0\n"


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """A picture of 7 x 5 texels with gentle alpha, `soft.png`, one of all kinds, `rough.png`, and the scene of a text beside them."""
    rng = np.random.default_rng(2)
    Image.fromarray(rng.integers(0, 256, (5, 7, 4), dtype=np.uint8)).save(tmp_path / "rough.png")
    Image.fromarray(rng.integers(100, 140, (3, 4, 4), dtype=np.uint8)).save(tmp_path / "soft.png")

    return writer(tmp_path)


@pytest.mark.matrix(keep=2)
@pytest.mark.parametrize(
    "look",
    [
        "opacity 0.4\n" + PLAIN,
        "opacity 0.7 of=shadow\n" + PLAIN,
        "opacity 0\n" + PLAIN,
        "texture rough.png alpha=yes filter=nearest\n" + THINGS,
        "texture soft.png alpha=yes\n" + THINGS,
        "opacity 0.8\ntexture rough.png alpha=yes cutoff=0.4 filter=nearest wrap=mirror\n" + THINGS,
        "texture soft.png alpha=yes cutoff=0.47 wrap=clamp\n" + THINGS,
        "opacity 0.6\n" + CURVED + CURVED.replace("2.6", "4"),
    ],
)
def test_picture_matches_reference(write: Write, look: str) -> None:
    scene = write(HEAD + LIGHTS + MATERIAL + look + FLOOR)
    compare(scene, clrt.render(scene).pixels)


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize(("precision", "lanes"), [*((name, 16) for name in sorted(RUNGS)), ("watertight", 8), ("exact", 4), ("double", 1)])
def test_every_rung_and_width_matches_reference(write: Write, device: Device, precision: str, lanes: int) -> None:
    scene = write(HEAD + LIGHTS + MATERIAL + "opacity 0.4\ntexture soft.png alpha=yes\n" + THINGS + FLOOR).with_size(16, 16)
    compare(scene, in_packets(scene, device, lanes, precision))


@pytest.mark.slow
def test_glass_with_opacity_of_shadow_lets_light_through(write: Write) -> None:
    glass = "M 1 1 1 0 0 0.5 60 0.1 0.8 1.5\n"
    scene = write(HEAD + LIGHTS + glass + "opacity 0.3 of=shadow\nS 0 0 3 0.8\n" + FLOOR)
    compare(scene, clrt.render(scene).pixels)
    dark = write(HEAD + LIGHTS + glass + "S 0 0 3 0.8\n" + FLOOR)
    assert (clrt.render(scene).pixels - clrt.render(dark).pixels).max() > 0.1


@pytest.mark.slow
def test_glass_seen_through_takes_no_medium_along(write: Write) -> None:
    scene = write(HEAD + LIGHTS + "M 0.5 0.8 1 0 0.2 0.5 60 0.1 0.8 1.5\nabsorb 0.5 0.2 0.1\nopacity 0.6\nS 0 0 3 0.8\n" + FLOOR)
    compare(scene, clrt.render(scene).pixels)


@pytest.mark.slow
def test_instances_match_reference(write: Write) -> None:
    things = "object leaf\n" + THINGS.replace("S 0.6", "O\nS 0.6") + "instance leaf 1.2 0.1 0.3 scale=1.3 turn_z=20\n"
    things += "instance leaf 0.5 0.2 0.4 turn_y=15 scale_x=0.8\n"
    scene = write(HEAD + LIGHTS + MATERIAL + "opacity 0.9\ntexture soft.png alpha=yes\n" + things + FLOOR)
    compare(scene, clrt.render(scene).pixels)


def _pixel(text: str, precision: str = "watertight") -> float:
    return float(clrt.render(parse_scene(text), precision=precision).pixels[0, 0, 0])


def _lit() -> float:
    """The floor where the ray of BELOW meets it, (0, 0, -2), with nothing in the way: N.L = 4 / sqrt(4^2 + 2^2)."""
    return 4.0 / np.sqrt(20.0)


@pytest.mark.matrix(keep=2)
@pytest.mark.parametrize("precision", sorted(RUNGS))
@pytest.mark.parametrize("count", [1, 2, 5])
def test_panes_in_the_way_multiply(precision: str, count: int) -> None:
    panes = "".join(f"T -3 {y} -3 3 {y} -3 0 {y} 5\n" for y in np.linspace(2.0, 3.0, count))
    assert abs(_pixel(BELOW + "opacity 0.3\n" + panes, precision) - 0.7**count * _lit()) < 2e-6


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", sorted(RUNGS))
def test_panes_in_one_place_count_each(precision: str) -> None:
    pane = "T -3 2 -3 3 2 -3 0 2 5\n"
    assert abs(_pixel(BELOW + "opacity 0.3\n" + pane + "O\n" + pane + pane, precision) - 0.7**3 * _lit()) < 2e-6


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("precision", sorted(RUNGS))
def test_sphere_in_the_way_is_two_surfaces(precision: str) -> None:
    assert abs(_pixel(BELOW + "opacity 0.3\nS 0 3 -0.5 0.4\n", precision) - 0.7**2 * _lit()) < 2e-6


def test_opaque_thing_behind_a_pane_hides_the_light() -> None:
    assert _pixel(BELOW + "opacity 0.3\nT -3 2 -3 3 2 -3 0 2 5\nM 1 1 1 0 0 0 1 0\nT -3 3 -3 3 3 -3 0 3 5\n", "double") == 0.0


def test_more_surfaces_than_a_ray_follows_let_nothing_through() -> None:
    panes = "".join(f"T -3 {y} -3 3 {y} -3 0 {y} 5\n" for y in np.linspace(2.0, 3.0, 1030).tolist())
    assert _pixel(BELOW + "opacity 1e-4\n" + panes) == 0.0


CEILING = "T -90 9 -90 90 9 -90 0 9 90\n"
PANE = "T -90 2 -90 90 2 -90 0 2 90\n"


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize(
    ("light", "metal"),
    [("L 0 4 0\n", "material roughness=0.4\n"), ("sun 0 1 -0.5\n", "material metallic=1 roughness=0.5\n"), ("sun 0 1 -0.5\n", "")],
)
def test_pane_before_everything_dims_all_lights_alike(light: str, metal: str) -> None:
    """The same random numbers are drawn with it and without, so the pictures are in proportion."""
    text = BELOW.replace("L 0 4 0\n", light).replace("M 1 1 1 0 1 0 1 0\n", "M 1 1 1 0 1 0.3 5 0\n" + metal)
    clear, dim = (_pixel(text + "opacity 0.3\nS 0 -9 0 1\n" + things) for things in ("", PANE))
    assert clear > 0.1
    assert abs(dim - 0.7 * clear) < 1e-6 * clear


@pytest.mark.matrix(keep=1)
@pytest.mark.parametrize("metal", ["", "material roughness=0.4\n"])
def test_pane_dims_area_lights_and_environments(write: Write, metal: str) -> None:
    text = BELOW.replace("L 0 4 0\n", "").replace("M 1 1 1 0 1 0 1 0\n", "M 1 1 1 0 1 0.3 5 0\n" + metal)
    lamp = "M 0 0 0 0 0 0 1 0\narealight 2 3 4\n" + CEILING
    for scene in (text + lamp, text + "environment soft.png\n"):
        shaded = scene + "M 1 1 1 0 0 0 1 0\nopacity 0.3\nS 0 -9 0 1\n"
        shell = PANE if "arealight" in scene else "S 0 1 -3 40\n"
        clear, dim = (clrt.render(write(shaded + things)).pixels[0, 0] for things in ("", shell))
        assert clear.min() > 0.05
        assert dim == pytest.approx(0.7 * clear, rel=1e-5)


def test_rays_of_the_straight_way_count_towards_the_depth() -> None:
    text = "E 0 0 0\nV 0 0 1\nF 45\nR 1 1\nbackground 1 1 1\nM 1 1 1 0 0 0 1 0\ndepth 2\nopacity 0.5\n"
    for count, seen in ((1, 0.5), (2, 0.25), (3, 0.0)):
        assert _pixel(text + "".join(f"T -9 -9 {z} 9 -9 {z} 0 9 {z}\n" for z in range(2, 2 + count))) == seen


def test_opaque_materials_call_for_nothing() -> None:
    scene = parse_scene(BELOW + "opacity 1\nS 0 3 -0.5 0.4\n")
    assert "opacity" not in Features.of(scene).effects
    used = parse_scene(BELOW + "S 0 3 -0.5 0.4\nM 1 1 1 0 0 0 1 0\nopacity 0.5\n")
    assert "opacity" not in Features.of(used).effects


def test_opacity_of_shadows_alone_sends_no_ray_on() -> None:
    scene = parse_scene(BELOW + "opacity 0.5 of=shadow\nS 0 3 -0.5 0.4\n")
    assert "passed" not in Features.of(scene).ray_kinds
    assert "passed" in Features.of(parse_scene(BELOW + "opacity 0.5\nS 0 3 -0.5 0.4\n")).ray_kinds


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("opacity", '11:1: error: opacity takes 1 value, as in "opacity 0.5 of=shadow", found 0'),
        ("opacity 1.5", '11:9: error: opacity must be from 0 to 1, found "1.5"'),
        ("opacity -0.1", '11:9: error: opacity must be from 0 to 1, found "-0.1"'),
        ("opacity half", '11:9: error: expected a number (opacity), found "half"'),
        ("opacity 0.5 of=light", '11:16: error: of must be all or shadow, found "light"'),
        ("opacity 0.5\nopacity 0.5", "12:1: error: a second opacity of one material; the first is line 11, remove one of the two"),
        ("texture soft.png alpha=0.5", '11:24: error: alpha must be no or yes, found "0.5"'),
        ("texture soft.png cutoff=0.5", "11:1: error: cutoff has no effect without alpha=yes; add that, or leave it out"),
        ("texture soft.png alpha=yes cutoff=2", '11:35: error: cutoff must be from 0 to 1, found "2"'),
    ],
)
def test_malformed_line_is_told_with_its_place(write: Write, lines: str, message: str) -> None:
    with pytest.raises(SceneError) as refused:
        write(BELOW + lines + "\nS 0 3 -0.5 0.4\n")
    assert message in str(refused.value)


def test_opacity_before_any_material_is_told() -> None:
    with pytest.raises(SceneError, match="1:1: error: opacity before any material"):
        parse_scene("opacity 0.5\n" + BELOW)
