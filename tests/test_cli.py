"""The command line in this process: arguments, messages, exit codes. What traces rays is a stand-in that records how it is called."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import clrt
from clrt.cli.main import cli
from clrt.image.image import Image
from clrt.precision import DEFAULT, RUNGS
from clrt.stats import ObjectStats, RunStats

SCENE = """\
E 0 0 -1
V 0 0 1
F 45
R 8 6
L 5 5 -5
M 0.5 0.5 1 0.1 0.9 0.3 20 0
T -1 -1 2  1 -1 2  0 1 2
O
"""


class FakeRenderer(ModuleType):
    """Stands for clrt.renderer: remembers the arguments, raises what it is told to, else returns a grey picture."""

    def __init__(self) -> None:
        super().__init__("clrt.renderer")
        self.calls: list[dict[str, Any]] = []
        self.error: BaseException | None = None
        self.level = 0.5

    def render(self, scene: Any, **arguments: Any) -> Image:
        self.calls.append({"scene": scene, **arguments})
        if self.error is not None:
            raise self.error
        width, height = arguments["size"] or (scene.camera.width, scene.camera.height)
        counted = arguments["count"]
        objects = [ObjectStats(o.name, len(o), 1, 1, len(o), 0, 0.001, 1.25 if counted else None) for o in scene.objects]
        counts = {"primary": width * height, "shadow": 5, "mirror": 0, "refracted": 0} if counted else None
        stats = RunStats(scene.source, width, height, arguments["tree"], "Imaginary CPU", "watertight")
        stats.effects, stats.objects, stats.ray_counts = ["shadows"], objects, counts
        stats.render_s, stats.build_s, stats.compile_s, stats.count_s = 0.5, 0.001, 0.25, 0.125
        return Image(np.full((height, width, 3), self.level, np.float32), stats)


Run = Callable[..., Result]


@pytest.fixture
def renderer(monkeypatch: pytest.MonkeyPatch) -> FakeRenderer:
    fake = FakeRenderer()
    monkeypatch.setitem(sys.modules, "clrt.renderer", fake)
    return fake


@pytest.fixture
def run(renderer: FakeRenderer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs `clrt` with the arguments in a folder that holds scene.txt alone."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("CLRT_DEBUG", raising=False)
    (tmp_path / "scene.txt").write_text(SCENE)
    return lambda *args: CliRunner().invoke(cli, [str(a) for a in args])


def one_error(result: Result) -> str:
    """The message of a run that the user can mend: exit code 2, one line, no traceback."""
    lines = result.stderr.splitlines()
    assert (result.exit_code, len(lines), result.stdout) == (2, 1, ""), result.output
    assert lines[0].startswith("clrt: error: ")
    return lines[0]


def test_scene_alone_writes_its_name_as_png_here(run: Run, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "scene.txt").rename(tmp_path / "sub" / "monkey.txt")
    result = run("sub/monkey.txt")
    assert (result.exit_code, result.stderr) == (0, "")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["monkey.png", "sub"]


def test_no_argument_renders_input_txt(run: Run, tmp_path: Path) -> None:
    (tmp_path / "scene.txt").rename(tmp_path / "input.txt")
    assert run().exit_code == 0
    assert (tmp_path / "input.png").exists()


def test_no_argument_without_input_txt_shows_help(run: Run, renderer: FakeRenderer) -> None:
    result = run()
    assert result.exit_code == 0
    assert result.stdout.startswith("Usage: clrt")
    assert renderer.calls == []


def test_options_without_scene_or_input_txt_is_an_error(run: Run) -> None:
    assert "no input.txt" in one_error(run("--quiet"))


@pytest.mark.parametrize("flag", ["-h", "--help"])
def test_help_lists_options_of_rendering_and_commands(run: Run, flag: str) -> None:
    text = run(flag).stdout
    for word in ("--size WxH", "--stats", "--dump-kernel", "--srgb", "--right-handed", "--split-objects", "devices", "convert", "make"):
        assert word in text


def test_version_is_the_packages(run: Run) -> None:
    assert run("--version").stdout == f"clrt {clrt.__version__}\n"


def test_options_reach_the_renderer(run: Run, renderer: FakeRenderer, tmp_path: Path) -> None:
    result = run("--size", "12x5", "scene.txt", "--tree", "median", "--device", "cpu", "--depth", 3, "--dump-kernel", "k.cl", "-o", "a.ppm")
    assert result.exit_code == 0, result.output
    (call,) = renderer.calls
    expected = {"size": (12, 5), "tree": "median", "device": "cpu", "precision": "watertight", "depth": 3, "count": False}
    assert {k: call[k] for k in expected} == expected
    assert call["dump_kernel"] == Path("k.cl")
    assert (tmp_path / "a.ppm").read_bytes() == b"P6\n12 5\n255\n" + b"\x80" * 12 * 5 * 3


def test_without_options_the_scene_decides(run: Run, renderer: FakeRenderer) -> None:
    run("scene.txt")
    (call,) = renderer.calls
    assert (call["size"], call["device"], call["depth"], call["tree"], call["dump_kernel"]) == (None, None, None, "sah", None)


def test_right_handed_mirrors_x(run: Run, renderer: FakeRenderer) -> None:
    run("scene.txt")
    run("scene.txt", "--right-handed")
    left, right = (call["scene"].lights[0].position for call in renderer.calls)
    assert (left, right) == ((5, 5, -5), (-5, 5, -5))


def test_srgb_is_brighter(run: Run, tmp_path: Path) -> None:
    run("scene.txt", "-o", "a.ppm", "--srgb")
    assert (tmp_path / "a.ppm").read_bytes().endswith(b"\xbc" * 8 * 6 * 3)  # sRGB of 0.5 is 188


def test_file_called_like_a_command_is_rendered_by_its_path(run: Run, tmp_path: Path) -> None:
    (tmp_path / "scene.txt").rename(tmp_path / "devices")
    assert run("./devices").exit_code == 0
    assert (tmp_path / "devices.png").exists()


def test_stats_are_counted_and_written(run: Run, renderer: FakeRenderer, tmp_path: Path) -> None:
    result = run("scene.txt", "--stats", "s.json")
    data = json.loads((tmp_path / "s.json").read_text())
    assert renderer.calls[0]["count"] is True
    assert (data["rays"], data["tests_per_ray"], data["width"], data["compile_s"]) == (53, 1.25, 8, 0.25)
    assert data["read_s"] > 0.0
    assert data["write_s"] > 0.0
    assert "tests/ray" in result.stdout
    assert "1.25" in result.stdout


def test_stats_to_standard_output_are_json_in_place_of_the_figures(run: Run, tmp_path: Path) -> None:
    for quiet in ([], ["--quiet"]):
        result = run("scene.txt", "--stats", "-", *quiet)
        assert (result.exit_code, result.stderr) == (0, "")
        assert json.loads(result.stdout)["rays"] == 53
    assert sorted(p.name for p in tmp_path.iterdir()) == ["scene.png", "scene.txt"]


def test_file_called_minus_is_one_by_its_path(run: Run, tmp_path: Path) -> None:
    result = run("scene.txt", "--stats", "./-")
    assert "Imaginary CPU" in result.stdout
    assert json.loads((tmp_path / "-").read_text())["rays"] == 53


def test_size_goes_as_far_as_that_of_a_scene(run: Run, renderer: FakeRenderer) -> None:
    assert run("scene.txt", "--size", "65536x1").exit_code == 0
    assert renderer.calls[0]["size"] == (65536, 1)


def test_help_names_all_precisions_and_the_default(run: Run) -> None:
    text = " ".join(run("--help").stdout.split())
    assert f"How rays meet triangles: {', '.join(RUNGS)}. [default: {DEFAULT}]" in text


def test_report_without_stats_hints_and_shows_no_tests(run: Run) -> None:
    text = run("scene.txt").stdout
    for word in ("object", "all", "Imaginary CPU", "shadows", "scene.png, 8 x 6", "250.0 ms", "--stats FILE"):
        assert word in text
    assert "tests/ray" not in text
    assert text.isascii()
    assert not any(line != line.rstrip() for line in text.splitlines())


def test_quiet_prints_nothing(run: Run, tmp_path: Path) -> None:
    result = run("scene.txt", "-q")
    assert result.output == ""
    assert (tmp_path / "scene.png").exists()


def test_warnings_of_scene_and_picture_go_to_stderr(run: Run, renderer: FakeRenderer, tmp_path: Path) -> None:
    (tmp_path / "scene.txt").write_text(SCENE.replace("O\n", "T 0 0 1  0 0 1  0 0 1\nO\n"))
    renderer.level = float("nan")
    result = run("scene.txt", "-q")
    assert result.exit_code == 0
    assert result.stdout == ""
    assert all(line.startswith("clrt: warning: ") for line in result.stderr.splitlines())
    assert "scene.txt: line 8: " in result.stderr
    assert "48 pixels are not a number" in result.stderr


@pytest.mark.parametrize(
    ("argument", "says"),
    [
        ("scen.txt", "did you mean scene.txt?"),
        ("device", "did you mean `clrt devices`?"),
        ("nowhere/scene.txt", "no folder nowhere"),
        ("quite-another-name.text", "no such file"),
        (".", "folder"),
        ("", "the name of the file is empty"),
        ("-", "no standard input or output"),
    ],
)
def test_missing_scene_names_the_nearest(run: Run, argument: str, says: str) -> None:
    assert says in one_error(run(argument))


def test_mesh_instead_of_a_scene_says_how_to_convert(run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.obj").touch()
    assert "clrt convert" in one_error(run("a.obj"))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["-o", "no/a.png"], "no folder"),
        (["-o", "a.jpg"], ".png, .ppm or .exr"),
        (["-o", "a"], ".png, .ppm or .exr"),
        (["-o", "folder"], "folder"),
        (["--stats", "no/s.json"], "no folder"),
        (["--dump-kernel", "no/k.cl"], "no folder"),
        (["-o", "scene.txt"], "this is the scene"),
        (["--stats", "./scene.png"], "this is the picture"),
        (["--size", "0x5"], "from 1 to"),
        (["--size", "65537x5"], "from 1 to 65536"),
        (["--size", "5"], "640x480"),
        (["--depth", "-1"], "'-1': this is a whole number of at least 0"),
        (["--depth", "x"], "'x': this is a whole number of at least 0"),
        (["--depth", "2.0"], "'2.0': this is a whole number"),
        (["-o", "-"], "no standard input or output"),
        (["-o", ""], "the name of the file is empty"),
        (["--stats", ""], "the name of the file is empty"),
        (["--dump-kernel", "-"], "no standard input or output"),
        (["--tree", "oak"], "sah"),
        (["--precision", "perfect"], "watertight"),
        (["--sise", "5x5"], "--size"),
        (["second.txt"], "second.txt"),
    ],
)
def test_bad_arguments_are_said_before_anything_is_rendered(
    run: Run, renderer: FakeRenderer, tmp_path: Path, arguments: list[str], says: str
) -> None:
    (tmp_path / "folder").mkdir()
    assert says in one_error(run("scene.txt", *arguments))
    assert renderer.calls == []
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder", "scene.txt"]


def test_scene_errors_are_printed_as_they_are(run: Run, tmp_path: Path) -> None:
    (tmp_path / "scene.txt").write_text(SCENE.replace("M 0.5", "M zero").replace("F 45", "F 450"))
    result = run("scene.txt")
    lines = result.stderr.splitlines()
    assert result.exit_code == 2
    assert [line.split(":")[:2] for line in lines] == [["scene.txt", "3"], ["scene.txt", "6"]]
    assert not (tmp_path / "scene.png").exists()


@pytest.mark.parametrize("error", [clrt.DeviceError("no such device"), clrt.LimitError("too large"), MemoryError()])
def test_what_the_user_can_mend_is_one_line_and_2(run: Run, renderer: FakeRenderer, tmp_path: Path, error: Exception) -> None:
    renderer.error = error
    assert str(error) in one_error(run("scene.txt"))
    assert not (tmp_path / "scene.png").exists()


@pytest.mark.parametrize("error", [ZeroDivisionError("by us"), OSError("no file in it"), EOFError()])
def test_a_fault_of_ours_is_a_traceback_and_1(run: Run, renderer: FakeRenderer, error: Exception) -> None:
    renderer.error = error
    result = run("scene.txt")
    assert result.exit_code == 1
    assert type(error).__name__ in result.stderr
    assert "Traceback" in result.stderr
    assert "please report it" in result.stderr.splitlines()[-1]


def test_interrupt_is_130_and_leaves_no_picture(run: Run, renderer: FakeRenderer, tmp_path: Path) -> None:
    renderer.error = KeyboardInterrupt()
    result = run("scene.txt")
    assert result.exit_code == 130
    assert "Traceback" not in result.output
    assert [p.name for p in tmp_path.iterdir()] == ["scene.txt"]


def test_debug_shows_the_traceback_of_an_error(run: Run, renderer: FakeRenderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLRT_DEBUG", "1")
    renderer.error = clrt.DeviceError("no such device")
    result = run("scene.txt")
    assert result.exit_code == 2
    assert "Traceback" in result.stderr
    assert result.stderr.endswith("clrt: error: no such device\n")


def test_many_objects_show_the_largest_and_the_rest_as_one_row(run: Run, tmp_path: Path) -> None:
    triangle = "T -1 -1 2  1 -1 2  0 1 2\n"
    (tmp_path / "scene.txt").write_text(SCENE + "".join(triangle * (i + 1) + "O\n" for i in range(40)))
    text = run("scene.txt").stdout
    assert "(18 smaller objects)" in text
    assert "821" in text  # triangles in all: 1 + 40 * 41 / 2


def test_devices_lists_what_there_is(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    context = ModuleType("clrt.device.context")
    device = SimpleNamespace(name="CPU [red]", platform="Imaginary", version="OpenCL 1.2", driver="3.0", compute_units=2, lanes=16,
                             fp64=True, global_mem=3 * 2**30, default=True)  # fmt: skip
    context.list_devices = lambda: [device]  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "clrt.device.context", context)
    text = run("devices").stdout
    for word in ("*", "CPU [red]", "Imaginary", "OpenCL 1.2", "16", "yes", "3.0 GiB"):
        assert word in text
