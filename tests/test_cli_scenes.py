"""`clrt convert` and `clrt make` from the command line."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
from click.testing import CliRunner, Result

from clrt.cli.main import cli
from clrt.scene.build import load_scene

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"

Run = Callable[..., Result]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs `clrt` with the arguments in a folder that holds mesh.obj alone."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("CLRT_DEBUG", raising=False)
    (tmp_path / "mesh.obj").write_text(TETRAHEDRON)
    return lambda *args: CliRunner().invoke(cli, [str(a) for a in args])


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[tuple[object, ...]]:
    """Stands for clrt.generate: what it is asked to make."""
    calls: list[tuple[object, ...]] = []
    fake = ModuleType("clrt.generate")
    fake.KINDS = {"bumps": "a bumpy sphere", "grid": "a flat grid"}  # type: ignore[attr-defined]
    fake.make = lambda *arguments: calls.append(arguments) or "made"  # type: ignore[attr-defined, func-returns-value]
    monkeypatch.setitem(sys.modules, "clrt.generate", fake)
    return calls


def one_error(result: Result) -> str:
    lines = result.stderr.splitlines()
    assert (result.exit_code, len(lines), result.stdout) == (2, 1, ""), result.output
    return lines[0]


def test_convert_mesh_becomes_a_scene_that_can_be_read(run: Run, tmp_path: Path) -> None:
    result = run("convert", "mesh.obj", "scene.txt")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "4 triangles" in result.stdout
    (mesh,) = load_scene(tmp_path / "scene.txt").objects
    assert len(mesh) == 4
    assert mesh.vertex_normals is None


def test_convert_smooth_gives_corner_normals(run: Run, tmp_path: Path) -> None:
    assert run("convert", "mesh.obj", "scene.txt", "--smooth").exit_code == 0
    (mesh,) = load_scene(tmp_path / "scene.txt").objects
    assert mesh.vertex_normals is not None


@pytest.mark.parametrize(
    ("mesh", "scene", "says"),
    [
        ("mesh.obj", "-", "no standard input or output"),
        ("mesg.obj", "scene.txt", "mesg.obj: no such file; did you mean mesh.obj?"),
        ("mesh.obj", "no/scene.txt", "no folder"),
        ("mesh.obj", "./mesh.obj", "this is the mesh"),
    ],
)
def test_convert_bad_files_are_one_line_and_write_nothing(run: Run, tmp_path: Path, mesh: str, scene: str, says: str) -> None:
    assert says in one_error(run("convert", mesh, scene))
    assert [p.name for p in tmp_path.iterdir()] == ["mesh.obj"]
    assert (tmp_path / "mesh.obj").read_text() == TETRAHEDRON


def test_make_passes_kind_file_count_and_seed(run: Run, made: list[tuple[object, ...]]) -> None:
    result = run("make", "bumps", "-o", "scene.txt", "--triangles", "500", "--seed", "7")
    assert (result.exit_code, result.stdout) == (0, "made\n")
    assert made == [("bumps", Path("scene.txt"), 500, 7)]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["bump", "-o", "a.txt"], "did you mean bumps?"),
        (["xyz", "-o", "a.txt"], "bumps, grid"),
        (["bumps"], "-o"),
        (["bumps", "-o", "no/a.txt"], "no folder"),
        (["bumps", "-o", "a.txt", "--triangles", "0"], "--triangles"),
    ],
)
def test_make_bad_arguments_are_one_line(run: Run, made: list[tuple[object, ...]], arguments: list[str], says: str) -> None:
    assert says in one_error(run("make", *arguments))
    assert made == []


def test_make_help_lists_the_kinds(run: Run, made: list[tuple[object, ...]]) -> None:
    assert "a bumpy sphere" in run("make", "--help").stdout
