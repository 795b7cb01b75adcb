"""Peers in processes of their own: started, asked, ended. What a machine lacks is told in a line and left out."""

from __future__ import annotations

import contextlib
import importlib.util
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from clrt.errors import ClrtError
from clrt.timing import Told

EMBREE = "Embree C++"
_SOURCE = Path(__file__).parent / "embree" / "driver.cpp"
_COMPILERS = ("c++", "g++", "clang++")
_FLAGS = ("-std=c++17", "-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-DNDEBUG", "-pthread")
_WIDE = "-mprefer-vector-width=512"  #: not every compiler knows it
_LIBRARIES = ("-lembree4", "-lembree3")
#: what a table calls it -> module of clrt.bench.workers, package that it needs
_PYTHON = {
    "Mitsuba": ("mitsuba_rays", "mitsuba"),
    "Open3D": ("open3d_rays", "open3d"),
    "trimesh": ("trimesh_rays", "trimesh"),
}


@dataclass(frozen=True)
class Missing:
    """A peer that is left out, and what would bring it."""

    name: str
    reason: str

    def to_json(self) -> dict[str, str]:
        return {"name": self.name, "reason": self.reason}


class Worker:
    """A process that answers a line with a line; `version` is its first. `cpu` : processor seconds over wall seconds of each run."""

    def __init__(self, name: str, command: Sequence[str], log: Path) -> None:
        self.name, self._log = name, log
        self.cpu: list[float] = []
        with log.open("wb") as errors:
            self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True, bufsize=1)
        try:
            self.version = self._answer()
        except ClrtError:
            self.close()
            raise

    def ask(self, *words: object) -> list[str]:
        """The answer to a line. Raises ClrtError where the process has ended, with what it said last."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # the answer tells
            print(*words, file=self._process.stdin, flush=True)
        return self._answer().split()

    def run(self, *words: object) -> Told:
        """A timed run: the seconds that the process took by its own clock."""
        wall, cpu = (float(word) for word in self.ask(*words))
        self.cpu.append(cpu / max(wall, 1e-9))
        return Told(wall)

    def _answer(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._process.wait()
            said = self._log.read_text(errors="replace").strip().splitlines()
            raise ClrtError(f"{self.name} ended with {self._process.returncode}: {said[-1] if said else 'it said nothing'}")
        return line.strip()

    def close(self) -> None:
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with contextlib.suppress(BrokenPipeError):  # it has ended by itself
                    pipe.close()
        try:
            self._process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class Peers:
    """All peers that this machine has, over the same triangles; a context that ends them. `missing` tells of the others."""

    def __init__(self, scene_file: Path, triangles_file: Path, threads: int, scratch: Path) -> None:
        self.workers: list[Worker] = []
        self.missing: list[Missing] = []
        driver = compile_driver(scratch)
        if isinstance(driver, Missing):
            self.missing.append(driver)
        else:
            self._start(EMBREE, [str(driver), str(threads), str(scene_file)], scratch)
        for name, (module, package) in _PYTHON.items():
            if importlib.util.find_spec(package) is None:
                self.missing.append(Missing(name, f"{package} is not installed; `pip install 'clrt[bench]'` brings it"))
            else:
                command = [sys.executable, "-m", f"clrt.bench.workers.{module}", str(triangles_file), str(threads)]
                self._start(name, command, scratch)

    def _start(self, name: str, command: list[str], scratch: Path) -> None:
        try:
            self.workers.append(Worker(name, command, scratch / f"{name.replace(' ', '-')}.log"))
        except (ClrtError, OSError) as error:
            self.missing.append(Missing(name, str(error)))

    def __enter__(self) -> Peers:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for worker in self.workers:
            worker.close()

    def drop(self, worker: Worker, reason: str) -> None:
        """Go on without one that failed."""
        worker.close()
        self.workers.remove(worker)
        self.missing.append(Missing(worker.name, reason))

    def get(self, name: str) -> Worker | None:
        return next((worker for worker in self.workers if worker.name == name), None)

    def describe(self) -> dict[str, Any]:
        """JSON: versions of those at hand, reasons of the others."""
        return {"versions": {w.name: w.version for w in self.workers}, "missing": [m.to_json() for m in self.missing]}


def compile_driver(folder: Path) -> Path | Missing:
    """The driver of Embree's C++ interface, compiled for this processor."""
    compiler = next((name for name in _COMPILERS if shutil.which(name)), None)
    if compiler is None:
        return Missing(EMBREE, "there is no C++ compiler; on Debian and Ubuntu: apt install g++ libembree-dev")
    target = folder / "embree-driver"
    for library in _LIBRARIES:
        for wide in ((_WIDE,), ()):
            command = [compiler, *_FLAGS, *wide, str(_SOURCE), "-o", str(target), library]
            if subprocess.run(command, capture_output=True, check=False).returncode == 0:
                return target
    return Missing(EMBREE, f"{compiler} finds no Embree to build {_SOURCE.name} with; on Debian and Ubuntu: apt install libembree-dev")
