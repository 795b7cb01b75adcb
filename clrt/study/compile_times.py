"""How long programs compile: with no cache, and with what that left in it.

The child process is `python -m clrt.study.compile_times FILE`. PoCL reads the place of its cache once a process, so each measurement
is one of its own. It compiles the rungs one after the other, in an order that turns from process to process; what it is given is a
pickle that the parent wrote to its own temporary folder.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from clrt.errors import ClrtError
from clrt.features import Features
from clrt.precision import RUNGS, rung
from clrt.study.numbers import Number, measured
from clrt.study.subject import Subject, silent


def compile_times(subject: Subject) -> dict[str, tuple[Number, Number]]:
    """Seconds of compiling, cold and warm, of each rung of the plan. Raises ClrtError where a process fails."""
    names = subject.plan.compiled or tuple(RUNGS)
    cold: dict[str, list[float]] = {name: [] for name in names}
    warm: dict[str, list[float]] = {name: [] for name in names}
    rounds = subject.plan.compile_rounds
    with tempfile.TemporaryDirectory(prefix="clrt-study-") as folder:
        for turn in range(rounds):
            first = turn % len(names)
            order = [*names[first:], *names[:first]]
            task = Path(folder, "task.pickle")
            task.write_bytes(pickle.dumps((subject.prepared, subject.device.info.name, order)))
            for number, taken in enumerate((cold, warm)):
                subject.tell("precision: compiling, cold and warm", (turn + number / 2) / rounds)
                for name, seconds in _child(task, Path(folder, f"cache-{turn}")).items():
                    taken[name].append(seconds)
    return {name: (measured(cold[name], "s"), measured(warm[name], "s")) for name in names}


def _child(task: Path, cache: Path) -> dict[str, float]:
    places = {"POCL_CACHE_DIR": str(cache / "pocl"), "XDG_CACHE_HOME": str(cache)}
    (cache / "pocl").mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "clrt.study.compile_times", str(task)]
    done = subprocess.run(command, env=os.environ | places, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ClrtError(f"a process that was to compile the programs ended with {done.returncode}: {done.stderr.strip()[-500:]}")
    found: dict[str, float] = json.loads(done.stdout)
    return found


def main(task: Path) -> dict[str, float]:
    """Seconds of composing and building the programs of a task, by rung."""
    from clrt.device.context import open_device
    from clrt.renderer import open_tracer

    prepared, device_name, order = pickle.loads(task.read_bytes())
    device, taken = open_device(device_name), {}
    for name in order:
        start = time.perf_counter()
        opened: Any = open_tracer(prepared, Features.of(prepared.scene), rung(name), device, silent)
        taken[name] = time.perf_counter() - start - opened[3]
    return taken


if __name__ == "__main__":
    print(json.dumps(main(Path(sys.argv[1]))))
