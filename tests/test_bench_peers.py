"""Peers of `make bench`: the view and its files, processes that answer lines, Embree's driver, scripts that make the same picture."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clrt
from clrt.bench import commands, scenes, view, worker
from clrt.bench.peers import primary_rays, shadow_rays
from clrt.bench.versus import nearest_hits
from clrt.bench.worker import EMBREE, Missing, Peers, Worker
from clrt.device.context import open_device
from clrt.errors import ClrtError
from clrt.generate import uv_sphere
from clrt.scene.model import Scene

SIZE = 64
NEEDS_TRIMESH = pytest.mark.skipif(importlib.util.find_spec("embreex") is None, reason="embreex is not installed")


@pytest.fixture(scope="module")
def scene() -> Scene:
    points, faces = uv_sphere(500)
    return view.view_scene(points[faces], SIZE)


def test_most_rays_of_the_view_hit_whatever_the_mesh(scene: Scene, tmp_path: Path) -> None:
    rabbit = view.view_of(scenes.load(None, tmp_path, quick=True)[1], SIZE)
    for seen in (scene, rabbit):
        hits = nearest_hits(seen, primary_rays(seen), open_device(None))
        assert 0.85 < np.mean(hits.prim >= 0) < 0.95
        assert 0.2 < np.mean(hits.object == 0) < 0.7
        assert set(hits.object[hits.prim < 0]) <= {-1}


def test_nearest_hits_name_the_objects_own_triangle(scene: Scene) -> None:
    """By hand: the camera's ray through the sphere's middle, and one to the ground."""
    rays = primary_rays(scene)
    hits = nearest_hits(scene, rays, open_device(None))
    for pixel in (SIZE * SIZE // 2 + SIZE // 2, SIZE * SIZE - 1):
        corners = scene.objects[hits.object[pixel]].vertices[hits.prim[pixel]]
        a, b, c = (corners[i] - rays.origins[pixel] for i in range(3))
        inside = np.linalg.solve(np.stack([a, b, c], axis=1), rays.directions[pixel].astype(np.float64))
        assert (inside > 0.0).all(), "the direction is between those to the corners"
        assert hits.distance[pixel] == pytest.approx(1.0 / inside.sum(), rel=1e-6)


def test_packets_are_blocks_of_pixels(scene: Scene, tmp_path: Path) -> None:
    rays = view.lens_rays(view.with_lens(scene))
    view.write_packets(rays, SIZE, tmp_path / "rays.bin")
    packets = np.fromfile(tmp_path / "rays.bin", np.float32).reshape(-1, 6, 16)
    second = packets[1]  # columns 4 to 7 of rows 0 to 3
    pixels = [row * SIZE + column for row in range(4) for column in range(4, 8)]
    np.testing.assert_array_equal(second[:3].T, rays.origins[pixels])
    np.testing.assert_array_equal(second[3:].T, rays.directions[pixels])
    assert len(np.unique(rays.origins, axis=0)) > 0.99 * SIZE * SIZE, "each ray begins elsewhere"


_ECHO = """
import sys
print("1.2", flush=True)
for line in sys.stdin:
    if line == "die\\n":
        sys.exit("no more memory")
    print(*line.split()[::-1], flush=True)
"""


def test_a_process_is_asked_and_believed(tmp_path: Path) -> None:
    echo = Worker("echo", [sys.executable, "-c", _ECHO], tmp_path / "log")
    assert echo.version == "1.2"
    assert echo.ask("a", 1) == ["1", "a"]
    assert (float(echo.run("0.5", "0.25")), echo.cpu) == (0.25, [2.0])
    with pytest.raises(ClrtError, match="echo ended with 1: no more memory"):
        echo.ask("die")
    with pytest.raises(ClrtError, match="echo ended"):
        echo.ask("still there?")
    echo.close()


def test_a_process_that_does_not_start_says_why(tmp_path: Path) -> None:
    with pytest.raises(ClrtError, match=r"broken ended with 1: .*this_is_no_module"):
        Worker("broken", [sys.executable, "-c", "import this_is_no_module"], tmp_path / "log")


def test_a_machine_without_peers_is_told_in_a_line_each(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with Peers(tmp_path / "none", tmp_path / "none", 1, tmp_path) as peers:
        assert peers.workers == []
        assert [missing.name for missing in peers.missing] == [EMBREE, "Mitsuba", "Open3D", "trimesh"]
        assert "apt install g++ libembree-dev" in peers.missing[0].reason
        assert all("\n" not in missing.reason for missing in peers.missing)


def test_without_embree_the_driver_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "_COMPILERS", ("false",))
    found = worker.compile_driver(tmp_path)
    assert isinstance(found, Missing)
    assert "libembree-dev" in found.reason


@pytest.mark.slow
def test_embree_driver_finds_what_the_exact_rung_finds(scene: Scene, tmp_path: Path) -> None:
    driver = worker.compile_driver(tmp_path)
    if isinstance(driver, Missing):
        pytest.skip(driver.reason)
    view.write_scene(scene, tmp_path / "scene.bin")
    lens = view.lens_rays(view.with_lens(scene))
    view.write_packets(lens, SIZE, tmp_path / "rays.bin")
    embree = Worker(EMBREE, [str(driver), "2", str(tmp_path / "scene.bin")], tmp_path / "log")
    assert embree.ask("load", tmp_path / "rays.bin") == [str(SIZE * SIZE)]
    seen = []
    for runs in (("picture",), ("primary", "shadow"), ("primary", "light")):
        seconds = [embree.run(run, SIZE, SIZE) for run in runs]
        assert min(seconds) > 0.0
        embree.run("general")
        seen.append([int(word) for word in embree.ask("hits")])
    embree.close()
    hits = nearest_hits(scene, primary_rays(scene), open_device(None))
    shadow, _ = shadow_rays(scene, hits)
    caster = clrt.RayCaster(scene, "exact")
    assert shadow.distances is not None
    blocked = np.count_nonzero(caster.any_hit(shadow.origins, shadow.directions, 0.0, shadow.distances))
    through = np.count_nonzero(caster.any_hit(lens.origins, lens.directions))
    expected = np.array([np.count_nonzero(hits.prim >= 0), len(shadow), blocked, through])
    for found in seen:
        np.testing.assert_allclose(found, expected, atol=3)


@NEEDS_TRIMESH
def test_a_script_makes_the_picture_that_clrt_makes(scene: Scene, tmp_path: Path) -> None:
    commands.write_files(scene, tmp_path)
    written = clrt.load(tmp_path / "view.txt")
    assert [len(item) for item in written.objects] == [len(item) for item in scene.objects]
    np.testing.assert_array_equal(written.objects[0].vertices, scene.objects[0].vertices)
    clrt.render(written, size=(SIZE, SIZE)).save(commands.picture_of(commands.CLRT, tmp_path))
    found, _ = commands.programs(tmp_path, SIZE)
    trimesh = next(program for program in found if program.name == "trimesh")
    trimesh.run(tmp_path, tmp_path / "home")
    assert commands._differing("trimesh", tmp_path) <= 8, "of 4,096 pixels: along edges of shadows"
    clrt.render(replace(written, lights=()), size=(SIZE, SIZE)).save(commands.picture_of(commands.CLRT, tmp_path))
    assert commands._differing("trimesh", tmp_path) > 1000, "another picture is told apart"


def test_a_program_that_fails_is_told_and_left_out(tmp_path: Path) -> None:
    broken = commands.Program("broken", (sys.executable, "-c", "raise SystemExit('no such licence')"))
    silent = commands.Program("silent", (sys.executable, "-c", "pass"))
    works = commands.Program("works", (sys.executable, "-c", "open(r'{picture}', 'w')"))
    missing: list[Missing] = []
    first, working = commands._first_runs([works, broken, silent], missing, tmp_path, 2)
    assert [program.name for program in working] == list(first) == ["works"]
    assert len(first["works"].seconds) == 2
    assert [m.reason for m in missing] == ["broken made no picture, exit code 1: no such licence",
                                           "silent made no picture, exit code 0: it said nothing"]  # fmt: skip


def test_first_runs_find_nothing_of_earlier_ones(tmp_path: Path) -> None:
    keeps = "import os, pathlib; p = pathlib.Path.home() / 'kept'; open(r'{picture}', 'w').write(str(p.exists())); p.touch()"
    program = commands.Program("keeps", (sys.executable, "-c", keeps))
    commands._first_runs([program], [], tmp_path, 2)
    assert commands.picture_of("keeps", tmp_path).read_text() == "False"
    for expected in ("False", "True"):
        program.run(tmp_path, tmp_path / "home")
        assert commands.picture_of("keeps", tmp_path).read_text() == expected
    own = commands.environment(tmp_path / "home")
    assert all(Path(own[name]).is_relative_to(tmp_path / "home") for name in ("HOME", "XDG_CACHE_HOME", "POCL_CACHE_DIR"))


def test_programs_may_keep_compiled_modules_as_installed_ones_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a checkout's modules would be compiled again in each run, which those of peers are not."""
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    assert "PYTHONDONTWRITEBYTECODE" not in commands.environment(tmp_path)


def test_scripts_know_nothing_of_clrt() -> None:
    for path in sorted(commands._SCRIPTS.glob("*_picture.py")):
        assert "clrt" not in path.read_text(), path.name
        subprocess.run([sys.executable, "-m", "py_compile", str(path)], check=True)
