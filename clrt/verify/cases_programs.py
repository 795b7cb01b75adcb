"""Cases 53, 54 and 56 to 58: sums of samples, random words, and what must not depend on how a program is built or launched."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from clrt import renderer
from clrt.device import program
from clrt.device.context import open_device
from clrt.device.session import Tracer
from clrt.errors import DeviceError
from clrt.features import Features
from clrt.film import Film
from clrt.precision import rung as rung_named
from clrt.scene.build import parse_scene
from clrt.scene.model import Scene
from clrt.verify import pictures, probe
from clrt.verify.case import ALL, Context, Outcome, case

_UNIFORM = """
kernel void probe_uniform(global const uint *word, global real *u, global real *logarithm) {
    const int i = get_global_id(0);
    real number[LANES];
    store_lanes(uniform_from_words((word_n)word[i]), number);
    u[i] = number[i % LANES];
    logarithm[i] = log(R(1.0) - u[i]);
}
"""
UNSAFE = (
    "-cl-fast-relaxed-math", "-cl-unsafe-math-optimizations", "-cl-finite-math-only", "-cl-mad-enable", "-cl-no-signed-zeros",
    "-cl-single-precision-constant", "-cl-denorms-are-zero", "-cl-std=CL1.2 -cl-fast-relaxed-math", "-ffast-math",
)  # fmt: skip


@case(53, "2^26 float samples", provokes="a stalled sum", oracle="S", promised=ALL)
def many_samples(context: Context) -> Outcome:
    """Samples m 2^-24 of a known sum, in pictures of one pixel: mean and variance within 1e-6."""
    total, block = 1 << 26, 1 << 20
    values = ((np.arange(block, dtype=np.int64) * 2_654_435_761) % block).astype(np.float64)  # an order in which 0 .. block - 1 come once
    pictures_ = (values / block + 2.0**-24).astype(np.float32).reshape(block, 1, 1, 1)
    mean = (block - 1) / 2 / block + 2.0**-24
    variance = (block**2 - 1) / 12 / block**2 * total / (total - 1)
    film, part = Film(1, 1, 1), Film(1, 1, 1)
    part.add(pictures_)
    for _ in range(total // block):
        film.merge(part)
    added = Film(1, 1, 1)
    for _ in range(4):
        added.add(pictures_)
    wrong = sum(abs(float(f.mean[0, 0, 0]) / mean - 1) > 1e-6 for f in (film, added)) + int(film.count[0, 0] != total)
    wrong += int(abs(float(film.variance[0, 0, 0]) / variance - 1) > 1e-6)
    running = np.float32(0)
    for _ in range(total // block):
        running = np.cumsum(np.concatenate([[running], pictures_.ravel()]), dtype=np.float32)[-1]
    naive = int(abs(float(running) / total / mean - 1) > 1e-6)
    return Outcome(total, context.each_rung(lambda rung: wrong), naive, "the film is the same for every rung")


@case(54, "extreme random words", provokes="u == 1", oracle="S", promised=ALL)
def extreme_words(context: Context) -> Outcome:
    """Below 1, at most 2^-24 below the word's fraction, and log(1 - u) finite."""
    ends = np.arange(2048, dtype=np.uint64)
    words = np.concatenate([ends, 2**32 - 1 - ends, 2**31 - 1024 + ends, context.rng(54).integers(0, 2**32, 4096, np.uint64)]).astype(
        np.uint32
    )
    exact = words.astype(np.float64) / 2.0**32

    def wrong(rung: str) -> int:
        u, logarithm = (np.zeros(len(words), rung_named(rung).real) for _ in range(2))
        arrays = [words, u, logarithm]
        probe.run(_UNIFORM, "probe_uniform", len(words), arrays, device=context.device, precision=rung, files=("sampler.cl",))
        fits = (u >= 0) & (u < 1) & np.isfinite(logarithm) & (u <= exact) & (exact - u < 2.0**-24)
        return int(np.count_nonzero(~fits))

    naive = int(np.count_nonzero(~(words.astype(np.float32) * np.float32(2.0**-32) < 1)))
    return Outcome(len(words), context.each_rung(wrong), naive)


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def _accepted(options: tuple[str, ...]) -> bool:
    try:
        program.check_options(options)
    except DeviceError:
        return False
    return True


def _built_with(context: Context, name: str, value: str) -> bool:
    """Whether a program is built while the environment asks for unsafe mathematics."""
    with _environment(name, value):
        try:
            program.build(open_device(context.device), "kernel void nothing(global float *x) { x[0] = 1; }\n")
        except DeviceError:
            return False
    return True


@case(56, "build options with unsafe math", provokes="cases 31 and 53 undone", oracle="S", promised=ALL)
def unsafe_options(context: Context) -> Outcome:
    """Refused, as options and where the environment slips them in; safe ones are taken."""
    wrong = sum(_accepted(("-cl-std=CL1.2", option)) for option in UNSAFE)
    wrong += sum(not _accepted((option,)) for option in ("-cl-std=CL1.2", "-cl-fp32-correctly-rounded-divide-sqrt", "-w"))
    wrong += int(_built_with(context, "PYOPENCL_BUILD_OPTIONS", "-cl-fast-relaxed-math"))
    naive = sum(option != "-cl-fast-relaxed-math" for option in UNSAFE)  # a check for the one name that everybody knows
    return Outcome(len(UNSAFE) + 4, context.each_rung(lambda rung: wrong), naive, "one check for every rung")


def _busy_scene(size: int = 64) -> Scene:
    """Every effect but smooth normals in one picture."""
    text = pictures.camera(np.array((0.0, 0.5, -3.0)), np.array((0.0, -0.1, 1.0)), 50.0, size, np.array((0.0, 1.0, 0.0)))
    text += f"depth {pictures.DEPTH}\nL 3 4 -4\nL -2 3 0 0.5 0.4 0.3\nbackground 0.2 0.3 0.5\nM 0.9 0.8 0.7 0.1 0.7 0.4 30 0.3\n"
    text += pictures.triangles(pictures.grid(2)[:, :, [0, 2, 1]] * (3, 1, 3) - (0, 0.6, 0)) + "O\n"
    text += pictures.triangles(0.4 * pictures.cube() @ np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]) + (-0.9, 0, 0.5)) + "O\n"
    return parse_scene(text + "M 1 1 1 0 0.1 0.5 60 0.1 0.8 1.5\nS 0.5 0 0 0.5\nM 0.3 0.9 0.4 0.1 0.8 0.3 9 0.2\nS 0.1 -0.3 -1 0.2\n")


def _tracer(context: Context, scene: Scene, rung: str, features: Features | None = None) -> Tracer:
    prepared = renderer.build_trees(scene, "sah", _quiet)
    device = open_device(context.device)
    return renderer.open_tracer(prepared, features or Features.of(scene), rung_named(rung), device, _quiet)[1]


def _quiet(phase: str, fraction: float) -> None:
    pass


@contextmanager
def _local_size(size: tuple[int, int]) -> Iterator[None]:
    before = program.LOCAL_SIZE
    program.LOCAL_SIZE = size
    try:
        yield
    finally:
        program.LOCAL_SIZE = before


def _in_bands(tracer: Tracer, rows: list[int], height: int) -> NDArray[np.float32]:
    for row in rows:
        tracer.run(row, min(row + height, tracer.height))
    return tracer.picture()


_CHILD = """
import hashlib, sys
from clrt.verify.case import Context
from clrt.verify.cases_programs import _busy_scene
context = Context(device=sys.argv[1] or None)
for rung in sys.argv[2:]:
    print(hashlib.sha256(context.render(_busy_scene(), rung).tobytes()).hexdigest())
"""


def _digests(context: Context, threads: int) -> list[str]:
    """Hashes of the busy scene's picture, a rung each, from a process of its own with so many device threads."""
    environment = os.environ | {name: str(threads) for name in ("POCL_MAX_PTHREAD_COUNT", "POCL_CPU_MAX_CU_COUNT")}
    command = [sys.executable, "-c", _CHILD, context.device or "", *context.rungs]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=300)
    return done.stdout.split()


@case(57, "work-group sizes, orders of tiles, one and two threads", provokes="dependence on order", oracle="X", promised=ALL)
def launches(context: Context) -> Outcome:
    """The picture is the same to the last bit, however its rows are launched."""
    rng, scene = context.rng(57), _busy_scene()
    rows = list(range(0, 64, 8))
    orders = [rows[::-1], [int(r) for r in rng.permutation(rows)]]
    one, two = _digests(context, 1), _digests(context, 2)
    sizes = ((4, 4), (1, 1), (16, 1)) if context.full else ((4, 4),)  # each is a program to compile

    def wrong(rung: str) -> int:
        tracer = _tracer(context, scene, rung)
        whole = _in_bands(tracer, [0], 64)
        count = sum(int((_in_bands(tracer, order, 8) != whole).any(-1).sum()) for order in orders)
        for size in sizes:
            with _local_size(size):
                count += int((_in_bands(tracer, [0], 64) != whole).any(-1).sum())
        at = context.rungs.index(rung)
        return count + int(one[at] != two[at])

    samples = rng.uniform(0, 1, (64, 64, 64)).astype(np.float32)
    forwards, backwards = (np.cumsum(s, axis=0, dtype=np.float32)[-1] for s in (samples, samples[::-1]))
    naive = int(np.count_nonzero(forwards != backwards))
    return Outcome((3 + len(sizes)) * 64 * 64, context.each_rung(wrong), naive, "orders, local sizes, processes of 1 and 2 threads")


@case(58, "specialised against all-effects kernel", provokes="an effect that leaks into others", oracle="X", promised=ALL)
def all_effects(context: Context) -> Outcome:
    """A program with every effect draws a scene that calls for few, to the last bit like the one made for it."""
    text = pictures.camera(np.array((0.4, 0.7, -3.0)), np.array((0.0, -0.2, 1.0)), 45.0, 64, np.array((0.0, 1.0, 0.0)))
    text += f"depth {pictures.DEPTH}\nL 3 4 -4\nM 0.9 0.8 0.7 0.1 0.7 0.4 30 0\n"  # of the busy scene's depth: both share the long program
    lone = parse_scene(text + pictures.triangles(0.6 * pictures.cube() @ pictures.rotation(context.rng(58))))

    def differences(rung: str, scene: Scene, fused: bool = False) -> int:
        plain, full = _tracer(context, scene, rung), _tracer(context, scene, rung, Features.of(scene).with_every())
        if fused:
            plain.kernel = _contracted(plain)
        one, other = (_in_bands(t, [0], 64) for t in (plain, full))
        return int((one != other).any(-1).sum())

    counts = context.each_rung(lambda rung: sum(differences(rung, scene) for scene in (lone, _busy_scene())))
    naive = differences("fast", _busy_scene(), fused=True)
    return Outcome(2 * 64 * 64, counts, naive, "naive: one of the two contracts as it likes")


def _contracted(tracer: Tracer):  # type: ignore[no-untyped-def]
    """The tracer's kernel with the compiler free to fuse what it likes, as it is by default."""
    import pyopencl as cl

    buffers = tracer.buffers
    shape = program.Shape(program.stack_size(23), buffers.packed.scene.depth, buffers.shared_lights)
    source = program.compose(buffers.features, buffers.precision, tracer.buffers.lanes, shape)
    return cl.Kernel(program.build(buffers.device, source.replace("FP_CONTRACT OFF", "FP_CONTRACT ON")), "render")
