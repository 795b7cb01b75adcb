"""Pictures on surfaces: what is read from files, what a scene text may say of them, and the kernels against the reference."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from device_pictures import Write, in_packets, writer
from PIL import Image

import clrt
from clrt.device.context import Device
from clrt.errors import SceneError
from clrt.features import Features
from clrt.precision import RUNGS
from clrt.reference import render as reference
from clrt.scene.build import load_scene
from clrt.scene.model import Scene

BOUND = 1e-5
MARGIN = 2e-5
HEAD = "E 0 0.2 -1\nV 0 0 1\nF 45\nR 64 64\nL 5 5 -5\nM 0.9 0.8 1 0.3 0.6 0 20 0 0 1\n"
THINGS = (
    "project axis=y scale=1.7\nT -9 -1 12 9 -1 12 9 -1 0.5\nT -9 -1 12 9 -1 0.5 -9 -1 0.5\nO\n"
    "T -1 -0.5 3 -0.2 0.8 3.3 0.1 -0.6 2.5\nuv -0.7 -0.3 1.4 0.2 0.5 1.9\nS 0.6 0.2 3 0.6\nS -1.5 0.5 5 0.7\n"
)
SQUARE = "T -1 -1 2 1 -1 2 1 1 2\nuv 0 0 1 0 1 1\nT -1 -1 2 1 1 2 -1 1 2\nuv 0 0 1 1 0 1\n"
FACING = "E 0 0 0\nV 0 0 1\nF 90\nR 32 32\nL 0 0 0\nM 1 1 1 1 0 0 1 0\n"


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Pictures of 7 x 5 texels of 8 bits and of 4 x 6 of 16 bits, and the scene of a text beside them."""
    rng = np.random.default_rng(1)
    Image.fromarray(rng.integers(0, 256, (5, 7, 3), dtype=np.uint8)).save(tmp_path / "eight.png")
    Image.fromarray(rng.integers(0, 65536, (6, 4)).astype(np.uint16)).save(tmp_path / "sixteen.png")

    return writer(tmp_path)


def _compare(scene: Scene, pixels: np.ndarray) -> None:
    expected = reference(scene)
    wrong = np.abs(pixels - expected.pixels).max(-1) > BOUND
    assert not (wrong & (expected.margin > MARGIN)).any()
    assert wrong.sum() <= 10
    assert expected.pixels.std() > 0.05


@pytest.mark.matrix(keep=4)
@pytest.mark.parametrize("picture", ["eight.png", "sixteen.png"])
@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
@pytest.mark.parametrize("look", ["filter=linear srgb=yes", "filter=nearest srgb=no"])
def test_picture_matches_reference(write: Write, picture: str, wrap: str, look: str) -> None:
    scene = write(HEAD + f"texture {picture} wrap={wrap} {look}\n" + THINGS)
    _compare(scene, clrt.render(scene).pixels)


@pytest.mark.matrix(keep=2)
@pytest.mark.parametrize(("precision", "lanes"), [*((name, 16) for name in sorted(RUNGS)), ("watertight", 8), ("exact", 4), ("double", 1)])
def test_every_rung_and_width_matches_reference(write: Write, device: Device, precision: str, lanes: int) -> None:
    scene = write(HEAD + "texture eight.png\n" + THINGS).with_size(32, 32)
    _compare(scene, in_packets(scene, device, lanes, precision))


def test_two_pictures_and_plain_materials_keep_apart(write: Write) -> None:
    plain = HEAD.splitlines()[-1] + "\n"
    text = HEAD + "texture eight.png\n" + THINGS + plain + "S -0.2 -0.5 2 0.3\n"
    text += plain + "texture sixteen.png srgb=no\nS 0.5 -0.5 2 0.3\n" + plain + "texture eight.png wrap=clamp\nS 0 1 2 0.3\n"
    scene = write(text)
    assert [m.texture for m in scene.materials] == [0, -1, 1, 2]
    assert scene.textures[0].picture is scene.textures[2].picture
    _compare(scene, clrt.render(scene).pixels)


def test_mirrors_and_glass_show_pictures(write: Write) -> None:
    """In double precision: single precision magnifies the roundings of mirrored rays by the picture's steepness."""
    text = HEAD.replace("20 0 0 1", "20 0.3 0 1") + "texture eight.png\n" + THINGS + "M 1 1 1 0 0.1 0 1 0.1 0.8 1.5\nS 0 -0.2 2 0.4\n"
    scene = write(text)
    _compare(scene, clrt.render(scene, precision="double").pixels)


def test_far_coordinates_keep_their_digits(write: Write) -> None:
    """A thousand copies away: single precision alone would be off by 1e-4 of a copy."""
    shifted = SQUARE.replace("uv 0 0 1 0 1 1", "uv 1000 -2000 1001 -2000 1001 -1999")
    shifted = shifted.replace("uv 0 0 1 1 0 1", "uv 1000 -2000 1001 -1999 1000 -1999")
    near, far = (clrt.render(write(FACING + "texture eight.png\n" + text)).pixels for text in (SQUARE, shifted))
    np.testing.assert_allclose(far, near, rtol=0, atol=BOUND)


def test_upright_picture_lies_with_its_upper_left_texel_at_u_0_v_1(write: Write, tmp_path: Path) -> None:
    scene = write(FACING + "texture eight.png filter=nearest srgb=no\n" + SQUARE)
    code, pixels = np.asarray(Image.open(tmp_path / "eight.png")), clrt.render(scene).pixels
    # x/z = (2 column + 1) / 32 - 1 at the pixel, and the square goes from -1/2 to 1/2 of that.
    for column in range(8, 24):
        for row in range(8, 24):
            x, y = ((2 * p + 1) / 32 - 1 for p in (column, row))
            texel = code[math.floor((2 * y + 1) / 2 * 5), math.floor((2 * x + 1) / 2 * 7)] / 255
            np.testing.assert_allclose(pixels[row, column], texel, rtol=0, atol=1e-6)


def test_globe_shows_its_middle_to_minus_z_and_its_top_above(write: Write, tmp_path: Path) -> None:
    """By a picture with u in red and v in green: 256 x 256 texels, linear."""
    ramp = np.arange(256, dtype=np.uint8)
    picture = np.stack([*np.broadcast_arrays(ramp[None], ramp[::-1, None]), np.zeros((256, 256), np.uint8)], -1)
    Image.fromarray(picture).save(tmp_path / "ramp.png")
    scene = write(FACING.replace("32 32", "65 65") + "texture ramp.png srgb=no\nS 0 0 3 2\n")
    pixels = clrt.render(scene).pixels
    row, column = 20, 44
    d = np.array([(2 * column + 1) / 65 - 1, 1 - (2 * row + 1) / 65, 1.0])
    d /= np.linalg.norm(d)
    t = 3 * d[2] - math.sqrt(9 * d[2] ** 2 - 5)
    x, y, z = (t * d - (0, 0, 3)) / 2
    u, v = 0.5 + math.atan2(x, -z) / (2 * math.pi), 0.5 + math.asin(y) / math.pi
    assert u > 0.5 < v
    # Between the middles of texels the ramp is the line (256 u - 1/2) / 255.
    np.testing.assert_allclose(pixels[row, column, :2], [(256 * u - 0.5) / 255, (256 * v - 0.5) / 255], rtol=0, atol=BOUND)


def test_projection_follows_the_axes(write: Write) -> None:
    text = FACING + "texture eight.png\nproject axis={} scale=4\nT 1 2 3 4 5 6 7 8 10\n"
    for axis, first in (("x", (0.75, 0.5)), ("y", (0.25, 0.75)), ("z", (0.25, 0.5))):
        uvs = write(text.format(axis)).objects[0].uvs
        assert uvs is not None
        assert tuple(uvs[0, 0]) == first


def test_coordinates_follow_their_triangles_into_split_objects(write: Write) -> None:
    lines = [f"T {x} 0 3 {x + 1} 0 3 {x} 1 3\nuv {x} 0 0 0 0 0\n" for x in (0, 5, 1, 6, 2)]
    scene = write(FACING + "texture eight.png\n" + "".join(lines), split_objects=True)
    assert len(scene.objects) == 2
    for item in scene.objects:
        assert item.uvs is not None
        assert np.array_equal(item.uvs[:, 0, 0], item.vertices[:, 0, 0])


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "CMYK"])
def test_kinds_of_pictures_are_read_as_pillow_converts_them(write: Write, tmp_path: Path, mode: str) -> None:
    picture = Image.open(tmp_path / "eight.png").convert(mode)
    name = "kind.tiff" if mode == "CMYK" else "kind.png"
    picture.save(tmp_path / name)
    scene = write(FACING + f"texture {name}\n" + SQUARE)
    assert np.array_equal(scene.textures[0].picture.texels, np.asarray(picture.convert("RGBA")))


def test_sixteen_bits_of_grey_are_kept(write: Write) -> None:
    codes = np.random.default_rng(1)
    codes.integers(0, 256, (5, 7, 3), dtype=np.uint8)
    grey = codes.integers(0, 65536, (6, 4))
    texels = write(FACING + "texture sixteen.png\n" + SQUARE).textures[0].picture.texels
    assert texels.dtype == np.uint16
    assert np.array_equal(texels[..., 1], grey)


def test_alpha_is_kept_beside_the_colour(write: Write, tmp_path: Path) -> None:
    texels = np.random.default_rng(2).integers(0, 256, (3, 3, 4), dtype=np.uint8)
    Image.fromarray(texels).save(tmp_path / "alpha.png")
    assert np.array_equal(write(FACING + "texture alpha.png\n" + SQUARE).textures[0].picture.texels, texels)


def _deep_color_png(path: Path) -> None:
    """A colour PNG with 16 bits a channel: Pillow writes none, so by hand, chunk by chunk."""
    import struct
    import zlib

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", 2, 2, 16, 2, 0, 0, 0)
    rows = zlib.compress((b"\0" + bytes(12)) * 2)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b""))


@pytest.fixture
def bad(tmp_path: Path) -> Path:
    """A folder with pictures that cannot be used."""
    noise = Image.fromarray(np.random.default_rng(3).integers(0, 256, (40, 40, 3), dtype=np.uint8))
    noise.save(tmp_path / "whole.png")
    (tmp_path / "cut.png").write_bytes((tmp_path / "whole.png").read_bytes()[:2000])
    (tmp_path / "text.png").write_text("no picture")
    (tmp_path / "none.ppm").write_bytes(b"P6\n0 0\n255\n")
    noise.save(tmp_path / "moving.png", save_all=True, append_images=[noise.rotate(90), noise.rotate(180)])
    noise.save(tmp_path / "moving.gif", save_all=True, append_images=[noise.rotate(90)])
    Image.new("F", (2, 2)).save(tmp_path / "float.tiff")
    noise.save(tmp_path / "page.eps")
    _deep_color_png(tmp_path / "deep.png")
    (tmp_path / "folder").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("texture whol.png", '7:9: error: there is no file whol.png; did you mean "whole.png"?'),
        ("texture cut.png", "7:9: error: cut.png is damaged or cut off"),
        ("texture text.png", "7:9: error: text.png is no picture that can be read, or has no pixels; save it as PNG or JPEG"),
        ("texture none.ppm", "7:9: error: none.ppm is no picture that can be read, or has no pixels"),
        ("texture moving.png", "7:9: error: moving.png is animated: it has 3 frames"),
        ("texture   moving.gif", "7:11: error: moving.gif is animated: it has 2 frames"),
        ("texture float.tiff", "7:9: error: float.tiff has pixels of the kind F"),
        ("texture deep.png", "7:9: error: deep.png has colours of 16 bits a channel; save it with 8, or in greyscale with 16"),
        ("texture page.eps", "7:9: error: page.eps is no picture that can be read, or has no pixels; save it as PNG or JPEG"),
        ("texture folder", "7:9: error: folder is a folder"),
        ("texture ../whole.png", "7:9: error: ../whole.png leads out of the scene's folder; permit its folder with --allow-path"),
        ("texture /etc/passwd", "7:9: error: /etc/passwd leads out of the scene's folder"),
        ("texture whole.png wrap=klamp", '7:24: error: wrap must be repeat, clamp or mirror, found "klamp"; did you mean "clamp"?'),
        ("texture whole.png filter=2", '7:26: error: filter must be linear or nearest, found "2"'),
        ("texture whole.png gamma=2", '7:19: error: texture has no key "gamma" (its keys: wrap, filter, srgb, alpha, cutoff)'),
        ("texture", '7:1: error: texture takes 1 value, as in "texture wood.png wrap=mirror", found 0'),
        ("texture whole.png\ntexture whole.png", "8:1: error: a second texture line for the material of line 6; the first is line 7"),
        ("texture whole.png\nT 0 0 2 1 0 2 0 1 2", "7:1: error: the triangle of line 8 has no place on the picture; add a line such as"),
        ("uv 0 0 1 0 1 1", "7:1: error: uv before any triangle"),
        ("T 0 0 2 1 0 2 0 1 2\nuv 0 0 1 0 1", '8:4: error: uv takes 6 values, as in "uv 0 0 1 0 1 1", found 5'),
        ("T 0 0 2 1 0 2 0 1 2\nuv 0 0 1 0 1 x", '8:14: error: expected a number (v of corner 3), found "x"'),
        ("T 0 0 2 1 0 2 0 1 2\nuv 0 0 1 0 1 1\nuv 0 0 1 0 1 1", "9:1: error: a second uv line for the triangle of line 7; the first is"),
        ("project axis=y", "7:1: error: project has no effect on a material without a texture"),
        ("texture whole.png\nproject scale=0", "8:15: error: scale must be greater than 0"),
    ],
)
def test_malformed_line_is_told_with_its_place(bad: Path, lines: str, message: str) -> None:
    scene = bad / "scene.txt"
    scene.write_text(FACING + lines + "\nS 0 0 3 1\n")
    with pytest.raises(SceneError) as caught:
        load_scene(scene)
    assert f"{scene}:{message}" in str(caught.value)


def test_texture_before_any_material_is_told(bad: Path) -> None:
    (bad / "scene.txt").write_text("texture whole.png\n" + FACING + "S 0 0 3 1\n")
    with pytest.raises(SceneError, match="1:1: error: texture before any material; put it after the M line that it is for"):
        load_scene(bad / "scene.txt")


def test_files_elsewhere_and_links_to_them_are_refused_until_permitted(
    write: Write, tmp_path_factory: pytest.TempPathFactory, tmp_path: Path
) -> None:
    other = tmp_path_factory.mktemp("other")
    Image.new("RGB", (2, 2)).save(other / "there.png")
    (tmp_path / "link.png").symlink_to(other / "there.png")
    for name in (other / "there.png", "link.png"):
        text = FACING + f'texture "{name}"\nS 0 0 3 1\n'
        with pytest.raises(SceneError, match="--allow-path"):
            write(text)
        assert write(text, allow_paths=[other]).textures[0].picture.texels.shape == (2, 2, 4)


def test_allow_path_on_the_command_line(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    from click.testing import CliRunner

    from clrt.cli.main import cli

    other = tmp_path_factory.mktemp("other")
    Image.new("RGB", (2, 2)).save(other / "there.png")
    (tmp_path / "scene.txt").write_text(FACING + f"texture {other / 'there.png'}\nS 0 0 3 1\n")
    arguments = [str(tmp_path / "scene.txt"), "-o", str(tmp_path / "out.png"), "-q"]
    assert CliRunner().invoke(cli, arguments).exit_code != 0
    assert not (tmp_path / "out.png").exists()
    done = CliRunner().invoke(cli, [*arguments, "--allow-path", str(other)])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "out.png").exists()


def test_textured_material_without_primitives_calls_for_nothing(write: Write) -> None:
    plain = HEAD.splitlines()[-1]
    scene = write(HEAD + "texture eight.png\n" + plain + "\nS 0 0 3 1\n")
    assert "textures" not in Features.of(scene).effects
