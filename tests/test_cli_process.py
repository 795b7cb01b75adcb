"""The command line as processes: exit codes, Ctrl-C, full disks, terminals. A child's renderer is a stand-in given as source."""

from __future__ import annotations

import json
import os
import re
import resource
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SCENE = "E 0 0 -1\nV 0 0 1\nF 45\nR 64 48\nL 5 5 -5\nM 0.5 0.5 1 0.1 0.9 0.3 20 0\nT -1 -1 2  1 -1 2  0 1 2\nO\n"

LONG_S = 120.0  #: what nothing here takes, however busy the machine
NEEDS_FULL = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="the system has no /dev/full")

#: a child that renders with the function `render` of the source put in
CHILD = """
import hashlib, sys, time, types
import numpy as np
from clrt.files import atomic_write
from clrt.image import png
from clrt.image.image import Image
from clrt.stats import ObjectStats, RunStats

def ready():
    print("ready", flush=True)

def block():
    "One call into C that no signal ends and that lasts far longer than the test waits."
    hashlib.pbkdf2_hmac("sha512", b"x", b"y", 60_000_000)

def picture(scene, **arguments):
    objects = [ObjectStats("an object with a name as long as a path " * 3, 970, 555, 278, 4321, 17, 0.02)]
    stats = RunStats(scene.source, 64, 48, "sah", "Imaginary CPU " * 8, "watertight", effects=["shadows"], objects=objects)
    return Image(np.full((48, 64, 3), 0.5, np.float32), stats)

{source}

module = types.ModuleType("clrt.renderer")
module.render = render
sys.modules["clrt.renderer"] = module
from clrt.cli.main import main
main()
"""

BLOCKED = """
def render(scene, **arguments):
    ready()
    block()
"""
SLOW = """
def render(scene, progress, **arguments):
    ready()
    for step in range(1000):
        progress("render", step / 1000)
        time.sleep(0.01)
"""
BLOCKED_IN_WRITING = """
render = picture
def write(file, pixels, srgb, comment):
    file.write(b"half of a picture")
    file.flush()
    ready()
    block()
import clrt.image.image
clrt.image.image._WRITERS[".png"] = write
"""
QUICK = "render = picture"


def start(folder: Path, source: str, *arguments: str, **options: object) -> subprocess.Popen[bytes]:
    (folder / "scene.txt").write_text(SCENE)
    command = [sys.executable, "-c", CHILD.replace("{source}", source), "scene.txt", *arguments]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.Popen(command, cwd=folder, env=child_environment(), **streams)  # type: ignore[call-overload, no-any-return]


def child_environment() -> dict[str, str]:
    """This one's, with the checkout first on the path and a terminal of 80 columns."""
    unset = {"CLRT_DEBUG", "NO_COLOR", "FORCE_COLOR", "LINES"}
    path = str(Path(__file__).parents[1])
    return {**{k: v for k, v in os.environ.items() if k not in unset}, "PYTHONPATH": path, "COLUMNS": "80", "TERM": "xterm"}


def files(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def interrupted(folder: Path, source: str) -> float:
    """Seconds from Ctrl-C to the end of a child, which leaves nothing."""
    child = start(folder, source)
    assert child.stdout is not None
    assert child.stderr is not None
    assert child.stdout.readline() == b"ready\n"
    began = time.monotonic()
    child.send_signal(signal.SIGINT)
    assert child.wait(LONG_S) == 130
    seconds = time.monotonic() - began
    assert b"clrt: interrupted" in child.stderr.read()
    assert files(folder) == ["scene.png", "scene.txt"]
    assert (folder / "scene.png").read_bytes() == b"old"
    return seconds


@pytest.mark.parametrize("source", [SLOW, BLOCKED, BLOCKED_IN_WRITING], ids=["slow", "blocked", "writing"])
def test_ctrl_c_ends_within_a_second_and_leaves_nothing(tmp_path: Path, source: str) -> None:
    """Other programs may hold up one of five ends, not all of them."""
    (tmp_path / "scene.png").write_bytes(b"old")
    assert any(interrupted(tmp_path, source) < 1.0 for _ in range(5))


def test_disk_that_is_full_is_one_line_and_2(tmp_path: Path) -> None:
    def small_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))  # the system refuses to let a file grow beyond it

    child = start(tmp_path, QUICK, "-o", "a.ppm", preexec_fn=small_files)
    out, error = child.communicate(timeout=LONG_S)
    assert (child.returncode, out) == (2, b"")
    assert re.fullmatch(rb"clrt: error: a\.ppm: File too large\n", error)
    assert files(tmp_path) == ["scene.txt"]


@pytest.mark.parametrize(
    ("arguments", "code"),
    [(["scene.txt", "-q"], 0), (["missing.txt"], 2), (["scene.txt", "--size", "1"], 2), (["--help"], 0), (["--version"], 0)],
)
def test_exit_codes_of_processes(tmp_path: Path, arguments: list[str], code: int) -> None:
    (tmp_path / "scene.txt").write_text(SCENE)
    command = [sys.executable, "-c", CHILD.replace("{source}", QUICK), *arguments]
    done = subprocess.run(command, cwd=tmp_path, env=child_environment(), capture_output=True, check=False)
    assert done.returncode == code
    assert b"Traceback" not in done.stderr


def test_python_m_clrt_is_the_command(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "clrt", "--version"]
    done = subprocess.run(command, cwd=tmp_path, env=child_environment(), capture_output=True, check=True)
    assert done.stdout.startswith(b"clrt ")


@pytest.mark.parametrize("arguments", [[], ["--help"]], ids=["figures", "help"])
def test_reader_that_stops_reading_is_no_error(tmp_path: Path, arguments: list[str]) -> None:
    child = start(tmp_path, QUICK, *arguments)
    assert child.stdout is not None
    assert child.stderr is not None
    child.stdout.close()
    assert child.wait(LONG_S) == 0
    assert child.stderr.read() == b""
    assert ("scene.png" in files(tmp_path)) == (not arguments)


def through_shell(folder: Path, source: str, redirection: str, *arguments: str) -> tuple[int, str]:
    """Exit code and standard error of a child that a shell starts with redirected streams."""
    (folder / "scene.txt").write_text(SCENE)
    (folder / "child.py").write_text(CHILD.replace("{source}", source))
    command = ["sh", "-c", f'exec "$@" {redirection}', "sh", sys.executable, "child.py", *arguments]
    done = subprocess.run(command, cwd=folder, env=child_environment(), stderr=subprocess.PIPE, text=True, check=False)
    return done.returncode, done.stderr


@pytest.mark.parametrize("redirection", [">&-", pytest.param(">/dev/full", marks=NEEDS_FULL)])
def test_standard_output_that_cannot_be_written_is_one_line_and_2(tmp_path: Path, redirection: str) -> None:
    code, error = through_shell(tmp_path, QUICK, redirection, "scene.txt")
    assert code == 2
    assert re.fullmatch(r"clrt: error: standard output: .*\n", error)
    assert "scene.png" in files(tmp_path)
    assert through_shell(tmp_path, QUICK, redirection, "scene.txt", "--quiet") == (0, "")


@NEEDS_FULL
def test_help_on_a_full_disk_is_one_line_and_2(tmp_path: Path) -> None:
    code, error = through_shell(tmp_path, QUICK, ">/dev/full", "--help")
    assert (code, error) == (2, "clrt: error: standard output: No space left on device\n")


@pytest.mark.parametrize(("argument", "code"), [("scene.txt", 0), ("missing.txt", 2)])
@pytest.mark.parametrize("redirection", ["2>&-", pytest.param("2>/dev/full", marks=NEEDS_FULL)])
def test_standard_error_that_cannot_be_written_changes_no_exit_code(tmp_path: Path, redirection: str, argument: str, code: int) -> None:
    assert through_shell(tmp_path, QUICK, f">out {redirection}", argument)[0] == code
    picture = tmp_path / "scene.png"
    assert not picture.exists() or picture.read_bytes().startswith(b"\x89PNG")


def test_ctrl_c_while_the_program_is_loaded_is_130_without_a_traceback(tmp_path: Path) -> None:
    # A module that the command imports first stands still, in place of one that takes its time.
    (tmp_path / "click.py").write_text('import time\nprint("ready", flush=True)\ntime.sleep(300)\n')
    environment = child_environment()
    environment["PYTHONPATH"] = os.pathsep.join([str(tmp_path), environment["PYTHONPATH"]])
    command = [sys.executable, "-m", "clrt", "--version"]
    child = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert child.stdout is not None
    assert child.stdout.readline() == b"ready\n"
    child.send_signal(signal.SIGINT)
    _, error = child.communicate(timeout=LONG_S)
    assert (child.returncode, error) == (130, b"clrt: interrupted\n")


def test_background_job_keeps_ignoring_ctrl_c(tmp_path: Path) -> None:
    (tmp_path / "click.py").write_text('import signal\nprint(signal.getsignal(signal.SIGINT) is signal.SIG_IGN)\nraise SystemExit\n')
    environment = child_environment()
    environment["PYTHONPATH"] = os.pathsep.join([str(tmp_path), environment["PYTHONPATH"]])
    command = ["sh", "-c", 'trap "" INT; exec "$@"', "sh", sys.executable, "-m", "clrt"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, check=True)
    assert done.stdout == b"True\n"


def on_terminal(folder: Path, source: str) -> tuple[str, str]:
    """Standard output and error of a child that has terminals for both."""
    readers, writers = zip(os.openpty(), os.openpty(), strict=True)
    child = start(folder, source, stdout=writers[0], stderr=writers[1])
    for end in writers:
        os.close(end)
    texts = dict.fromkeys(readers, b"")
    left = set(readers)
    while left:
        ready, _, _ = select.select(left, [], [], LONG_S)
        assert ready, "the child says nothing"
        for end in ready:
            try:
                data = os.read(end, 65536)
            except OSError:  # Linux says so at the end of a terminal
                data = b""
            texts[end] += data
            if not data:
                left.discard(end)
                os.close(end)
    assert child.wait(LONG_S) == 0
    out, error = (texts[end].decode() for end in readers)
    return out, error


def test_terminal_long_render_shows_a_bar_that_goes_away(tmp_path: Path) -> None:
    source = """
def render(scene, progress, **arguments):
    for step in range(30):
        progress("render", step / 30)
        time.sleep(0.05)
    return picture(scene)
"""
    _, error = on_terminal(tmp_path, source)
    assert "rendering" in error
    assert re.search(r"\d\d%", error)
    assert error.index("\x1b[?25l") < error.rindex("\x1b[?25h")  # the cursor is hidden, then shown again
    assert "\x1b[2K" in error  # the line is erased


def test_terminal_quick_render_shows_no_bar_and_80_columns_hold(tmp_path: Path) -> None:
    out, error = on_terminal(tmp_path, QUICK)
    assert "rendering" not in error
    plain = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", out)
    assert max(len(line) for line in plain.splitlines()) <= 80
    assert "970" in plain
    assert "\x1b[" in out


def test_terminal_compiling_is_said_at_once(tmp_path: Path) -> None:
    source = """
def render(scene, progress, **arguments):
    progress("compile", 0.0)
    time.sleep(0.4)
    return picture(scene)
"""
    assert "compiling" in on_terminal(tmp_path, source)[1]


def test_piped_output_is_plain(tmp_path: Path) -> None:
    out, error = start(tmp_path, QUICK).communicate(timeout=LONG_S)
    assert error == b""
    assert b"\x1b" not in out
    assert out.isascii()


def clrt(folder: Path, *arguments: str) -> subprocess.CompletedProcess[bytes]:
    """The real program, renderer and all."""
    command = [sys.executable, "-m", "clrt", *arguments]
    return subprocess.run(command, cwd=folder, env=child_environment(), capture_output=True, check=False)


def test_real_render_counts_every_ray_of_a_scene_whose_rays_are_known(tmp_path: Path) -> None:
    # A wall that fills the view, lit, with nothing that could shadow or mirror: a primary ray a pixel and one test of each.
    (tmp_path / "scene.txt").write_text(SCENE.replace("-1 -1 2  1 -1 2  0 1 2", "-90 -90 2  90 -90 2  0 90 2"))
    done = clrt(tmp_path, "scene.txt", "--size", "40x24", "--stats", "s.json", "--dump-kernel", "k.cl")
    assert (done.returncode, done.stderr) == (0, b"")
    stats = json.loads((tmp_path / "s.json").read_text())
    assert (stats["primary_rays"], stats["rays"], stats["tests_per_ray"]) == (960, 960, 1.0)
    assert (stats["width"], stats["height"], stats["nodes"], stats["objects"][0]["triangles"]) == (40, 24, 1, 1)
    assert b"kernel" in (tmp_path / "k.cl").read_bytes()
    assert files(tmp_path) == ["k.cl", "s.json", "scene.png", "scene.txt"]


def test_interrupt_that_the_interpreter_loses_leaves_no_traceback(tmp_path: Path) -> None:
    # Weak references' callbacks, as imports have them, cannot raise.
    program = "import os, signal, time, weakref\nfrom clrt.cli import interrupt\ninterrupt.watch()\nclass Thing: ...\nthing = Thing()\n"
    program += "held = weakref.ref(thing, lambda _: os.kill(os.getpid(), signal.SIGINT))\ndel thing\ntime.sleep(300)\n"
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=tmp_path, env=child_environment(), capture_output=True, timeout=LONG_S, check=False)
    assert (done.returncode, done.stderr) == (130, b"clrt: interrupted\n")


def test_real_render_of_a_device_that_is_not_there_is_one_line_and_2(tmp_path: Path) -> None:
    (tmp_path / "scene.txt").write_text(SCENE)
    done = clrt(tmp_path, "scene.txt", "--device", "no such device")
    assert (done.returncode, done.stdout) == (2, b"")
    assert re.fullmatch(rb"clrt: error: .*\n", done.stderr)
    assert files(tmp_path) == ["scene.txt"]


@pytest.mark.slow
@pytest.mark.parametrize("wait_s", [0.6, 1.5, 3.0])
def test_real_render_ctrl_c_ends_within_a_second(tmp_path: Path, wait_s: float) -> None:
    # Two mirrors face each other around the eye, so that most of 16 million rays are reflected 64 times.
    mirrors = "M 1 1 1 0.1 0.1 0 1 0.99\nT -50 -50 2  50 -50 2  0 90 2\nT -50 -50 -2  50 -50 -2  0 90 -2\nO\n"
    (tmp_path / "scene.txt").write_text("E 0 0 0\nV 0 0.1 1\nF 45\nR 4096 4096\nL 0 0 1\n" + mirrors)
    ends = (real_end(tmp_path, wait_s) for _ in range(5))
    assert any(seconds < 1.0 for seconds in ends), "other programs may hold up one of five ends, not all of them"


def real_end(folder: Path, wait_s: float) -> float:
    """Seconds from Ctrl-C, `wait_s` after its start, to the end of a long render."""
    command = [sys.executable, "-m", "clrt", "scene.txt", "--depth", "64"]
    child = subprocess.Popen(command, cwd=folder, env=child_environment(), stderr=subprocess.PIPE)
    assert child.stderr is not None
    time.sleep(wait_s)
    assert child.poll() is None
    began = time.monotonic()
    child.send_signal(signal.SIGINT)
    assert child.wait(LONG_S) == 130
    seconds = time.monotonic() - began
    assert b"clrt: interrupted" in child.stderr.read()
    assert files(folder) == ["scene.txt"]
    return seconds
