"""What `import clrt` costs and offers, what a wheel holds, what the helper files promise."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import clrt

ROOT = Path(__file__).parents[1]
HEAVY = {"numpy", "PIL", "pyopencl", "rich", "trimesh"}


def python(code: str, folder: Path, path: Path = ROOT) -> str:
    """What a fresh Python prints that imports from `path` and runs in `folder`."""
    environment = {**os.environ, "PYTHONPATH": str(path)}
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.parametrize("module", ["clrt", "clrt.errors", "clrt.files", "clrt.stats", "clrt.cli.main"])
def test_import_is_light(module: str, tmp_path: Path) -> None:
    loaded = python(f"import {module}, sys; print(' '.join({HEAVY!r} & set(sys.modules)))", tmp_path)
    assert loaded == ""


def test_help_is_light(tmp_path: Path) -> None:
    code = f"""
import sys, contextlib
from clrt.cli.main import cli
with contextlib.suppress(SystemExit), contextlib.redirect_stdout(None):
    cli.main(["--help"])
print(" ".join({HEAVY!r} & set(sys.modules)))
"""
    assert python(code, tmp_path) == ""


def test_every_public_name_is_there() -> None:
    for name in clrt.__all__:
        assert name in dir(clrt)
        assert getattr(clrt, name).__module__.startswith("clrt")


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'rendr'"):
        clrt.rendr  # noqa: B018


def test_render_stays_a_function_after_submodules_are_imported(tmp_path: Path) -> None:
    code = "import clrt, clrt.cli.render, clrt.renderer, clrt.device.context; print(callable(clrt.render), callable(clrt.load))"
    assert python(code, tmp_path) == "True True"


def test_errors_are_clrt_errors() -> None:
    for error in (clrt.SceneError, clrt.MeshError, clrt.DeviceError, clrt.LimitError):
        assert issubclass(error, clrt.ClrtError)


def test_make_help_lists_every_target() -> None:
    text = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert re.findall(r"^make (\S+)", text, re.M) == ["help", "run", "test", "test-all", "lint", "bench", "asm", "study", "docs", "clean"]


@pytest.mark.parametrize(
    ("script", "says"),
    [
        ("echo 3.8; exit 1", ["needs Python 3.10 or later", "is 3.8", "PYTHON="]),
        ("exit 127", ["needs Python 3.10 or later", "is missing", "PYTHON="]),
        ('case "$2" in *ensurepip*) exit 1;; *) echo 3.12;; esac', ["apt install python3.12-venv"]),
    ],
    ids=["old", "missing", "without venv"],
)
def test_make_with_a_python_that_will_not_do_says_what_is_needed(tmp_path: Path, script: str, says: list[str]) -> None:
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\n{script}\n")
    python.chmod(0o755)
    command = ["make", "run", f"PYTHON={python}", f"VENV={tmp_path}/venv"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert all(text in done.stdout for text in says), done.stdout
    assert not (tmp_path / "venv").exists()


def test_wheel_holds_kernels_and_types_and_works_by_itself(tmp_path: Path) -> None:
    pytest.importorskip("hatchling")
    build = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "--no-index", "-w", str(tmp_path), str(ROOT)]
    subprocess.run(build, check=True)
    (wheel,) = tmp_path.glob("clrt-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        archive.extractall(tmp_path / "site")
    kernels = {f"clrt/kernels/{path.name}" for path in (ROOT / "kernels").glob("*.cl")}
    assert kernels
    assert kernels <= names
    assert {"clrt/py.typed", "clrt/cli/main.py"} <= names
    assert not any(name.startswith(("tests/", "scenes/", "kernels/")) for name in names)
    assert python("import clrt; print(clrt.__file__)", tmp_path, tmp_path / "site") == str(tmp_path / "site/clrt/__init__.py")
    (tmp_path / "scene.txt").write_text("E 0 0 -1\nV 0 0 1\nF 45\nR 8 8\nL 0 0 -9\nM 1 1 1 1 0 0 1 0\nT -9 -9 2 9 -9 2 0 9 2\n")
    render = "import clrt; print(clrt.render('scene.txt').to_uint8().min())"
    assert python(render, tmp_path, tmp_path / "site") == "255"  # a white wall, lit by its ambient part alone
