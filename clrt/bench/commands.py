"""From files to a picture: whole processes, clrt beside scripts for other programs that make the same picture of the same triangles.

First runs have an empty home and empty caches, so that nothing is left of earlier ones but what is installed; cached runs come after.
"""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.bench.machine import cores
from clrt.bench.peers import shadow_offset
from clrt.bench.worker import Missing
from clrt.errors import ClrtError
from clrt.scene.model import Scene
from clrt.scene.write import line, triangle_lines
from clrt.timing import Series, Told, interleave, paired

_SCRIPTS = Path(__file__).parent / "scripts"
_FIRST_FEWEST = 3  #: first runs that are timed
_CLOSE = 8  #: of 255: pixels of two pictures that differ by more are counted
_MIRROR = np.array([1.0, 1.0, -1.0])  #: from clrt's left-handed axes to those of others
CLRT = "clrt"


@dataclass(frozen=True)
class Program:
    """A command that makes the picture; `picture` in it stands for where."""

    name: str
    command: tuple[str, ...]

    def run(self, folder: Path, home: Path) -> None:
        """Raises ClrtError with what it said last where it fails or leaves no picture."""
        picture = picture_of(self.name, folder)
        picture.unlink(missing_ok=True)
        command = [word.replace("{picture}", str(picture)) for word in self.command]
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment(home), cwd=home)
        if done.returncode or not picture.is_file():
            said = [text for text in (done.stderr + done.stdout).strip().splitlines() if text.strip()]
            raise ClrtError(f"{self.name} made no picture, exit code {done.returncode}: {said[-1] if said else 'it said nothing'}")


def picture_of(name: str, folder: Path) -> Path:
    return folder / f"{name}.png"


def environment(home: Path) -> dict[str, str]:
    """As of this process, with a home and caches of its own: what PoCL, clrt and others keep between runs goes there.

    Compiled modules of Python belong to what is installed: each program may keep its own beside its source, if it does not have them.
    """
    own = {"HOME": home, "XDG_CACHE_HOME": home / "cache", "XDG_CONFIG_HOME": home / "config", "POCL_CACHE_DIR": home / "pocl"}
    for folder in own.values():
        folder.mkdir(parents=True, exist_ok=True)
    given = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**given, **{name: str(folder) for name, folder in own.items()}}


def programs(folder: Path, size: int) -> tuple[list[Program], list[Missing]]:
    """clrt and all others that this machine has."""
    clrt = (sys.executable, "-m", "clrt", str(folder / "view.txt"), "--size", f"{size}x{size}", "-o", "{picture}", "--quiet")
    found, missing = [Program(CLRT, clrt)], []
    tail = (str(folder), str(size), "{picture}")
    for name, package in (("Mitsuba", "mitsuba"), ("trimesh", "trimesh")):
        if importlib.util.find_spec(package):
            found.append(Program(name, (sys.executable, str(_SCRIPTS / f"{package}_picture.py"), *tail)))
        else:
            missing.append(Missing(name, f"{package} is not installed; `pip install 'clrt[bench]'` brings it"))
    povray, blender, script = shutil.which("povray"), shutil.which("blender"), str(_SCRIPTS / "blender_picture.py")
    if povray:
        options = (f"+W{size}", f"+H{size}", "-D", "-A", "+FN8", f"+WT{cores()}", "File_Gamma=1.0", "Display_Gamma=1.0")
        found.append(Program("POV-Ray", (povray, f"+I{folder / 'view.pov'}", "+O{picture}", *options)))
    else:
        missing.append(Missing("POV-Ray", "there is no povray; on Debian and Ubuntu: apt install povray"))
    if blender:
        found.append(Program("Blender", (blender, "--background", "--factory-startup", "--python", script, "--", *tail)))
    elif importlib.util.find_spec("bpy"):
        found.append(Program("Blender", (sys.executable, script, *tail)))
    else:
        missing.append(Missing("Blender", "there is no blender, and no package bpy; install either"))
    return found, missing


def write_files(scene: Scene, folder: Path) -> None:
    """view.txt for clrt, mesh.ply and view.json for the scripts, view.pov for POV-Ray: the same triangles, rounded to float32 in PLY."""
    objects = [item.vertices for item in scene.objects]
    camera, light = scene.camera, np.array(scene.lights[0].position)
    ahead = camera.corners.mean(axis=0)
    field = 2.0 * np.degrees(np.arctan(np.linalg.norm(camera.corners[1] - camera.corners[0]) / 2.0 / np.linalg.norm(ahead)))
    text = line("E", camera.eye) + line("V", ahead) + line("F", field) + line("R", camera.width, camera.height) + line("L", light)
    text += "M 1 1 1  0.1 0.9 0 1  0\n"
    text += "".join(triangle_lines(o.reshape(-1, 3), np.arange(3 * len(o)).reshape(-1, 3)) + "O\n" for o in objects)
    (folder / "view.txt").write_text(text)
    ul, ur, ll, _ = camera.corners * _MIRROR
    view = {"eye": camera.eye * _MIRROR, "corner": ul, "along_row": ur - ul, "along_column": ll - ul, "light": light * _MIRROR}
    numbers = {name: value.tolist() for name, value in view.items()} | {"offset": shadow_offset(scene)}
    (folder / "view.json").write_text(json.dumps(numbers))
    triangles = np.concatenate(objects) * _MIRROR
    points, faces = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = faces.reshape(-1, 3)
    (folder / "mesh.ply").write_bytes(_ply(points, faces))
    (folder / "view.pov").write_text(_pov(points, faces, view))


def _ply(points: NDArray[np.float64], faces: NDArray[np.int64]) -> bytes:
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.zeros(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    return head.encode() + points.astype("<f4").tobytes() + rows.tobytes()


def _pov(points: NDArray[np.float64], faces: NDArray[np.int64], view: dict[str, NDArray[np.float64]]) -> str:
    def vector(values: NDArray[np.float64]) -> str:
        return "<" + ",".join(f"{value:.9g}" for value in values) + ">"

    # Its camera is the image plane itself; its pixels' middles lie as everyone's.
    plane = {"direction": view["corner"] + (view["along_row"] + view["along_column"]) / 2.0, "right": view["along_row"],
             "up": -view["along_column"]}  # fmt: skip
    camera = " ".join(f"{name} {vector(values)}" for name, values in {"location": view["eye"], **plane}.items())
    corners = ",".join(f"<{x:.9g},{y:.9g},{z:.9g}>" for x, y, z in points.tolist())
    triples = ",".join(f"<{a},{b},{c}>" for a, b, c in faces.tolist())
    return (
        f"#version 3.7;\nglobal_settings {{ assumed_gamma 1 ambient_light rgb 1 }}\ncamera {{ {camera} }}\n"
        f"light_source {{ {vector(view['light'])} rgb 1 }}\n"
        f"mesh2 {{ vertex_vectors {{ {len(points)},{corners} }} face_indices {{ {len(faces)},{triples} }}\n"
        "texture { pigment { rgb 1 } finish { ambient 0.1 diffuse 0.9 } } }\n"
    )


def measure_commands(scene: Scene, name: str, size: int, rounds: int, scratch: Path) -> dict[str, Any]:
    """Seconds of first and of cached runs, in turns; the phases that clrt tells of itself; pixels that differ from clrt's."""
    folder = scratch / "commands"
    folder.mkdir()
    write_files(scene, folder)
    found, missing = programs(folder, size)
    homes = {program.name: folder / f"home-{program.name}" for program in found}
    first, working = _first_runs(found, missing, folder, min(rounds, _FIRST_FEWEST))
    cached = interleave({p.name: partial(p.run, folder, homes[p.name]) for p in working}, rounds)
    own = cached[CLRT].seconds
    return {
        "scene": name, "triangles": scene.triangle_count, "size": size, "missing": [m.to_json() for m in missing],
        "first": {n: s.to_json() for n, s in first.items()}, "cached": {n: s.to_json() for n, s in cached.items()},
        "ratios": {n: paired(s.seconds, own).to_json() for n, s in cached.items() if n != CLRT},
        "pixels_that_differ": {p.name: _differing(p.name, folder) for p in working if p.name != CLRT},
        "phases": _phases(working[0], folder, homes[CLRT]),
    }  # fmt: skip


def _first_runs(found: list[Program], missing: list[Missing], folder: Path, rounds: int) -> tuple[dict[str, Series], list[Program]]:
    """Each run with a home that nothing has used. A program that fails is left out, and told."""
    working = []
    for program in found:
        try:
            program.run(folder, folder / f"trial-{program.name}")
            working.append(program)
        except (ClrtError, OSError) as error:
            if program.name == CLRT:
                raise
            missing.append(Missing(program.name, str(error)))
    homes = (folder / f"first-{number}" for number in range(rounds * len(working)))
    contenders = {program.name: partial(_run_anew, program, folder, homes) for program in working}
    return interleave(contenders, rounds, warm_ups=0), working


def _run_anew(program: Program, folder: Path, homes: Iterator[Path]) -> None:
    program.run(folder, next(homes))


def _differing(name: str, folder: Path) -> int:
    """Pixels in which a picture differs from clrt's by more than _CLOSE of 255."""
    from PIL import Image

    theirs, own = (np.asarray(Image.open(picture_of(n, folder)).convert("L"), np.int16) for n in (name, CLRT))
    return int(np.count_nonzero(np.abs(theirs - own) > _CLOSE)) if theirs.shape == own.shape else theirs.size


def _phases(clrt: Program, folder: Path, home: Path) -> dict[str, float]:
    """What a cached run of clrt tells of itself, without the pass that counts rays."""
    figures = folder / "figures.json"
    Program(clrt.name, (*clrt.command, "--stats", str(figures))).run(folder, home)
    wanted = ("read_s", "build_s", "upload_s", "compile_s", "render_s", "write_s", "total_s")
    told = json.loads(figures.read_text())
    return {name: told[name] for name in wanted}


#: what is imported -> the statement; `python` is the interpreter alone, from start to end
_IMPORTS = {
    "clrt": "import clrt",
    "embreex": "from embreex import rtcore_scene",
    "Mitsuba": "import mitsuba; mitsuba.set_variant('llvm_ad_rgb')",
    "trimesh": "import trimesh",
    "Open3D": "import open3d",
    "Blender": "import bpy",
}
_CLOCK = "import time; start = time.perf_counter(); {}; print(time.perf_counter() - start)"


def measure_imports(rounds: int) -> dict[str, Any]:
    """Seconds of imports as Python counts them, and of `clrt --help` from start to end, in turns; what is not installed is left out."""
    contenders: dict[str, Callable[[], object]] = {}
    for name, statement in _IMPORTS.items():
        if importlib.util.find_spec(statement.replace(";", " ").split()[1].partition(".")[0]):
            contenders[f"import {name}"] = partial(_import, _CLOCK.format(statement))
    contenders["clrt --help"] = partial(_import, None, "-m", "clrt", "--help")
    contenders["python, nothing else"] = partial(_import, None, "-c", "pass")
    return {name: times.to_json() for name, times in interleave(contenders, rounds).items()}


def _import(code: str | None, *words: str) -> Told | None:
    command = [sys.executable, *(words if code is None else ("-c", code))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ClrtError(f"{' '.join(command)} ended with {done.returncode}: {done.stderr.strip()[-200:]}")
    return None if code is None else Told(done.stdout.split()[-1])
