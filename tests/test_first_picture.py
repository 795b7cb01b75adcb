"""What a first picture costs beside tracing: modules imported, trees and kernels kept, threads. Counted, not timed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

from clrt import renderer
from clrt.device import ahead, kernel_cache, program
from clrt.device.context import POCL, Device
from clrt.errors import DeviceError, LimitError
from clrt.features import Features
from clrt.kdtree.saved import LEAST_TRIANGLES
from clrt.precision import rung
from clrt.renderer import with_options
from clrt.scene.build import parse_scene
from clrt.scene.saved import LEAST_CHARACTERS
from clrt.tasks import Task

HEAD = "E 0 0 -1\nV 0 0 1\nF 45\nR 32 24\nL 5 5 -5\nM 1 0.5 0.2 0.2 0.8 0 1 0\n"
NOT_FOR_ALL = {  # what most renders of a scene text have no use for
    "PIL", "rich", "trimesh", "pyopencl", "pytools", "importlib.metadata", "importlib.resources", "tempfile",
    "scipy", "jinja2", "matplotlib", "OpenImageIO", "fractions", "numpy.ma", "numpy.polynomial",
    "numpy.random", "clrt.adaptive.engine",
    "clrt.scene.models.gltf", "clrt.mesh", "clrt.kdtree.coverage", "clrt.explain", "clrt.study", "clrt.verify", "clrt.bench",
}  # fmt: skip


def scene_text(triangles: int) -> str:
    corners = np.random.default_rng(5).random((triangles, 1, 3)) * [2.0, 2.0, 1.0] + [-1.0, -1.0, 2.0]
    corners = corners + 0.05 * np.random.default_rng(6).normal(size=(triangles, 3, 3))
    return HEAD + "".join("T " + " ".join(f"{x:.6f}" for x in t.ravel()) + "\n" for t in corners)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """Of which what is read is kept, and the tree."""
    path = tmp_path / "scene.txt"
    text = scene_text(3500)
    assert len(text) > LEAST_CHARACTERS
    assert text.count("\nT") > LEAST_TRIANGLES
    path.write_text(text)
    return path


def imported(code: str, folder: Path) -> set[str]:
    """The modules that a process has imported at its end, however it ends."""
    at_end = "def end(code):\n    print('\\n' + '\\n'.join(sys.modules), flush=True)\n    leave(code)\n"
    program = f"import os, sys\nleave = os._exit\n{at_end}os._exit = end\n{code}\nend(0)"
    environment = os.environ | {"XDG_CACHE_HOME": str(folder / "cache")}
    done = subprocess.run([sys.executable, "-c", program], cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split("\n"))


def command(*arguments: str) -> str:
    return f"sys.argv = {['clrt', *arguments]!r}\nfrom clrt.cli.entry import main\nmain()"


def of_packages(modules: set[str]) -> set[str]:
    """The packages of modules outside Python's own library."""
    return {name.partition(".")[0] for name in modules} & {"numpy", "pyopencl", "PIL", "click", "rich", "trimesh", "scipy"}


def test_import_of_clrt_imports_no_package(tmp_path: Path) -> None:
    modules = imported("import clrt", tmp_path)
    assert of_packages(modules) == set()
    assert {name for name in modules if name.startswith("clrt")} == {"clrt", "clrt.errors"}


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_help_imports_click_alone(tmp_path: Path, option: str) -> None:
    modules = imported(command(option), tmp_path)
    assert of_packages(modules) == {"click"}
    assert "clrt.scene" not in modules


def test_render_imports_what_the_scene_needs_alone(tmp_path: Path, scene: Path) -> None:
    run = command(str(scene), "-o", str(tmp_path / "picture.png"))
    modules = imported(run, tmp_path)
    assert {"numpy", "pyopencl._cl", "clrt.forest.choose"} <= modules
    assert modules & NOT_FOR_ALL == set()
    again = imported(run, tmp_path)
    assert "clrt.forest.choose" not in again  # the tree was kept, so its builders are not even imported
    assert again & NOT_FOR_ALL == set()


def test_few_triangles_beside_a_kept_tree_do_not_bring_the_kernels_that_build(tmp_path: Path, scene: Path) -> None:
    scene.write_text(scene.read_text() + "O\nT -9 -2 0 9 -2 0 0 -2 9\nO\n")
    run = command(str(scene), "-o", str(tmp_path / "picture.png"))
    for _ in range(2):
        modules = imported(run, tmp_path)
        assert "clrt.forest.choose" in modules
        assert modules & {"clrt.forest.build", "clrt.forest.machine"} == set()


def caches(folder: Path) -> dict[str, str]:
    """The environment of a first run ever."""
    return {"XDG_CACHE_HOME": str(folder), "POCL_CACHE_DIR": ""}


def run(scene: Path, where: dict[str, str], picture: str, *options: str) -> tuple[int, int, int]:
    """Renders, and gives the triangles, and the nodes and the depth of their trees, as the run tells them."""
    arguments = [sys.executable, "-m", "clrt", str(scene), "-o", str(scene.parent / picture), *options]
    done = subprocess.run(arguments, env=os.environ | where, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    _, triangles, nodes, depth, *_ = re.findall(r"^all .*", done.stdout, re.M)[0].replace(",", "").split()
    return int(triangles), int(nodes), int(depth)


def kept(cache: Path) -> set[str]:
    return {str(file.relative_to(cache)) for file in (cache / "clrt").rglob("*") if file.is_file() and file.stat().st_size}


@pytest.mark.usefixtures("device")  # whose kernels are kept where the environment of this process says from then on
def test_picture_is_the_same_with_trees_of_an_earlier_run_broken_ones_and_none(tmp_path: Path, scene: Path) -> None:
    where = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    first = run(scene, where, "first.png")
    (entry,) = (tmp_path / "cache" / "clrt" / "trees").iterdir()
    whole = entry.read_bytes()
    again = run(scene, where, "again.png")
    entry.write_bytes(whole[: len(whole) // 2])
    broken = run(scene, where, "broken.png")
    assert entry.read_bytes() == whole
    none = run(scene, where, "none.png", "--no-cache")
    pictures = {(tmp_path / f"{name}.png").read_bytes() for name in ("first", "again", "broken", "none")}
    assert len(pictures) == 1
    assert first == again == broken == none
    assert first[1] > 20


def test_no_cache_leaves_nothing(tmp_path: Path, scene: Path) -> None:
    cache, temporary = tmp_path / "cache", tmp_path / "temporary"
    temporary.mkdir()
    arguments = [sys.executable, "-m", "clrt", str(scene), "-o", str(tmp_path / "picture.png"), "--no-cache"]
    subprocess.run(arguments, env=os.environ | caches(cache) | {"TMPDIR": str(temporary)}, capture_output=True, check=True)
    assert (tmp_path / "picture.png").stat().st_size > 100
    assert kept(cache) == set()
    assert list(temporary.iterdir()) == []


def test_fault_of_the_scene_is_said_before_anything_is_kept(tmp_path: Path, scene: Path) -> None:
    scene.write_text(scene.read_text() + "T 1 2 x 4 5 6 7 8 9\n")
    arguments = [sys.executable, "-m", "clrt", str(scene), "-o", str(tmp_path / "picture.png")]
    done = subprocess.run(arguments, env=os.environ | caches(tmp_path / "cache"), capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith(f"{scene}:")
    assert "expected a number" in done.stderr
    assert not (tmp_path / "picture.png").exists()
    assert kept(tmp_path / "cache") == set()


def test_compiler_is_not_taken_apart_at_the_end(tmp_path: Path, scene: Path) -> None:
    """Which would take as long as a hundred thousand small objects need, in front of a user who has the picture."""
    code = "import clrt.cli.render, weakref\nfrom clrt.device import context\nseen, opened = [], context.open_device\n"
    code += "context.open_device = lambda *given: (device := opened(*given), seen.append(weakref.ref(device)))[0]\n"
    code += "def end(code):\n    print(len(seen), seen[0]() is not None, flush=True)\n    leave(code)\n"
    code = f"import os, sys\nleave = os._exit\n{code}os._exit = end\n{command(str(scene), '-q')}"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1", "True"]


def test_unknown_device_is_said_as_without_threads(tmp_path: Path, scene: Path) -> None:
    arguments = [sys.executable, "-m", "clrt", str(scene), "-o", str(tmp_path / "picture.png"), "--device", "no such device"]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("clrt: error: no OpenCL device is called 'no such device'")
    assert done.stderr.count("\n") == 1


def test_program_that_was_begun_is_the_one_that_is_used(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The program that is guessed before there is a tree is the one that is needed: it is built once, and its kernels all at that time."""
    sources: list[str] = []
    built = program.build
    monkeypatch.setattr(program, "build", lambda device, source, *more: (sources.append(source), built(device, source, *more))[1])
    scene = parse_scene(scene_text(200))
    renderer.render(scene, dump_kernel=tmp_path / "kernel.cl")
    assert sources == [(tmp_path / "kernel.cl").read_text()]


def test_kernels_are_compiled_for_the_sizes_of_later_launches(tmp_path: Path, scene: Path, device: Device) -> None:
    """PoCL compiles a kernel for each kind of launch: once is enough for each."""
    if device.info.platform != POCL:
        pytest.skip("the default device is not PoCL's")
    run(scene, caches(tmp_path / "cache"), "picture.png")
    names = sorted(file.name for file in (tmp_path / "cache" / "clrt" / "pocl").rglob("*.so"))
    assert names == ["prepare.so", "render.so"]


def test_all_kernels_of_a_picture_are_launched_over_nothing(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """A kernel with a parameter of a type that is not known there would wait for its first launch."""
    scene = with_options(parse_scene(scene_text(300)), None, None, None, 0)
    launched: list[str] = []
    call = cl.Kernel.__call__
    monkeypatch.setattr(
        cl.Kernel, "__call__", lambda kernel, *given, **more: (launched.append(kernel.function_name), call(kernel, *given, **more))[1]
    )
    renderer._begin_program(scene, Features.of(scene), rung("watertight"), device).result()
    assert sorted(launched) == (["prepare", "render"] if device.info.platform == POCL else [])


def test_error_of_the_compiler_comes_out_of_the_thread(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path))  # the folder that is emptied, as a broken entry may be the reason
    compilation = ahead.Compilation(device, "kernel void render(global int *x) { x[0] = nothing; }", 1)
    with pytest.raises(DeviceError, match="could not compile"):
        ahead.build(device, compilation.source, compilation)


def test_scene_without_room_on_the_stack_is_refused_before_anything_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "PRIVATE_LIMIT", 1)
    monkeypatch.setattr(program, "build", lambda *_: pytest.fail("something was compiled"))
    with pytest.raises(LimitError, match="private memory"):
        renderer.render(parse_scene(scene_text(3)))


def test_shape_before_there_are_trees_is_the_shape_with_them() -> None:
    scene = with_options(parse_scene(scene_text(3000)), None, None, None, 0)
    features = Features.of(scene)
    trees = renderer.build_trees(scene, "sah", lambda phase, fraction: None)
    assert max(tree.depth for tree in trees.trees) > 5
    assert renderer.program_shape(trees, features, True) == renderer.program_shape(renderer.Prepared(scene, (), ()), features, True)


def test_task_gives_its_value_and_its_error() -> None:
    caller = threading.get_ident()
    assert Task(lambda: threading.get_ident()).result() != caller

    def fail() -> None:
        raise KeyError("x")

    task = Task(fail)
    for _ in range(2):
        with pytest.raises(KeyError):
            task.result()


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="the system has no masks of signals")
def test_task_leaves_interrupts_to_the_main_thread() -> None:
    blocked = Task(lambda: signal.pthread_sigmask(signal.SIG_BLOCK, ())).result()
    assert signal.SIGINT in blocked
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_task_is_over_when_an_error_leaves_its_block() -> None:
    go, ended = threading.Event(), threading.Event()

    def work() -> None:
        go.wait(10)
        ended.set()

    def fail() -> None:
        with Task(work):
            threading.Timer(0.05, go.set).start()
            raise ValueError("of the caller")

    with pytest.raises(ValueError, match="of the caller"):
        fail()
    assert ended.is_set()
