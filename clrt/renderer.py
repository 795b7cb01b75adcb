"""From a checked scene to a picture: trees, buffers, program, bands of rows."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from clrt.adaptive import request as accuracy
from clrt.adaptive.request import Foretell, Request
from clrt.device import ahead, kernel_cache, program
from clrt.device.ahead import Compilation
from clrt.device.context import Device, open_device
from clrt.device.pack import pack, tree_origins
from clrt.device.prepare import prepare
from clrt.device.session import Buffers, Tracer, check_picture, shares_lights, shares_suns
from clrt.errors import ClrtError, LimitError
from clrt.features import Features
from clrt.features.choice import effect_names, not_called_for
from clrt.files import atomic_write
from clrt.image.image import Image
from clrt.kdtree.boxtree import depth_limit
from clrt.kdtree.common import F64, default_max_depth
from clrt.kdtree.saved import saved_trees
from clrt.kdtree.tree import KdTree
from clrt.precision import DEFAULT, Precision, rung
from clrt.scene.model import Scene
from clrt.scene.placed import placement_count, seen
from clrt.scene.scale import at_working_size
from clrt.scene.words.frame import MOST_SAMPLES
from clrt.stats import ObjectStats, RunStats
from clrt.store import Store
from clrt.tasks import Task

if TYPE_CHECKING:
    from clrt.adaptive.replicates import Replicates

Progress = Callable[[str, float], None]

MAX_PIXELS = 1 << 28
MAX_DEPTH = 128
DEFAULT_SAMPLES = 16  #: of a pixel, where a scene holds sampled effects and does not say how many
_LAUNCH_S = 0.15  #: a launch is to take about this long, so that Ctrl-C and progress come between launches
_FIRST_LAUNCH = 1 << 20  #: rays at most, by a rough count, in the first launch, whose speed is not known yet


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene with its trees, ready for any number of renders. `tree_s`: seconds of each tree."""

    scene: Scene
    trees: tuple[KdTree, ...]
    tree_s: tuple[float, ...]


def render(
    scene: Scene,
    *,
    size: tuple[int, int] | None = None,
    tree: str = "sah",
    device: str | None = None,
    precision: str = DEFAULT,
    depth: int | None = None,
    samples: int | None = None,
    seed: int = 0,
    count: bool = False,
    without: Iterable[str] = (),
    progress: Progress | None = None,
    dump_kernel: Path | None = None,
    error: float | None = None,
    within: float | None = None,
    standard_error: bool = False,
    deadline: float | None = None,
    foretell: Foretell | None = None,
    cache: bool = False,
    opening: Task[Device] | None = None,
) -> Image:
    """The picture of `scene`, with the figures of the run in its `stats`.

    size : (width, height) in pixels; depth : reflections and refractions in a row, 0 to 128; count : run a second, counting pass
    samples : rays through each pixel, instead of the scene's own; seed : of all random numbers, 0 to 2^32 - 1
    without : names of effects to leave out, with what needs them; a RuntimeWarning tells of one that the scene does not call for
    dump_kernel : where to write the OpenCL program
    error, within : samples where they bring most until the relative error is below `error`, or `within` seconds from the call on have gone
    standard_error : the picture has one, also with `samples`, which are split over independent sequences then
    deadline : time.perf_counter() at which `within` ends, where it counts from another moment; foretell : called with the forecast
    cache : keep trees in the user's cache folder, and take them from there; opening : the device, which another thread opens
    Raises DeviceError, LimitError, ClrtError, OSError.
    """
    start = time.perf_counter()
    request = Request.of(error, within, samples, standard_error, deadline)
    tell = progress or (lambda phase, fraction: None)
    names = effect_names(without)
    scene = with_options(scene, size, depth, request.samples(samples), seed)
    ladder, opened = rung(precision), open_device(device) if opening is None else opening.result()
    check_picture(opened, scene.camera.width, scene.camera.height)
    features = _features(scene, names)
    if request:
        accuracy.check_sampled(features)
        request.goal(scene.samples)
    with _begin_program(scene, features, ladder, opened, helped=opening is not None) as begun:
        prepared = build_trees(scene, tree, tell, opened, Store(kernel_cache.own_folder("trees")) if cache else None)
        build_end = time.perf_counter()
        buffers, tracer, source, upload_s = open_tracer(prepared, features, ladder, opened, tell, begun)
    compile_s = time.perf_counter() - build_end - upload_s
    if dump_kernel is not None:
        with atomic_write(dump_kernel) as file:
            file.write(source.encode())
    before = time.perf_counter()
    outcome, replicates = accuracy.sample(tracer, request, partial(tell, "render"), foretell)
    if outcome is None:
        run_rows(tracer, "render", tell)
    pixels = tracer.picture() if outcome is None else outcome.pixels
    end = time.perf_counter()
    stats = RunStats(
        scene=scene.source, width=scene.camera.width, height=scene.camera.height, tree=tree, device=opened.info.name,
        precision=precision, samples=passes(scene, features), seed=scene.seed,
        effects=list(features.effects), without=list(names), objects=_object_stats(prepared), build_s=sum(prepared.tree_s),
        upload_s=upload_s, compile_s=compile_s, render_s=end - before, total_s=end - start,
    )  # fmt: skip
    if tracer.stages is not None:
        stats.decided = tracer.stages.read()
    if outcome is not None:
        accuracy.note(stats, request, outcome)
    if count:
        _count(prepared, buffers, stats, tell, replicates)
        stats.count_s = time.perf_counter() - end
    return Image(pixels, stats, None if outcome is None else outcome.standard_error)


def _features(scene: Scene, without: tuple[str, ...]) -> Features:
    """What the scene calls for but these effects; warns of those that it does not call for."""
    for name in not_called_for(without, Features.of(scene) if without else Features(())):
        warnings.warn(f"the scene does not call for '{name}', which is to be left out; the picture is the same", RuntimeWarning, 3)
    return Features.of(scene, without)


def passes(scene: Scene, features: Features) -> int:
    """How often each pixel is traced: as often as the scene asks for samples, once where nothing is sampled."""
    return scene.samples if any(f.name == "sampling" for f in features.active) else 1


def with_options(scene: Scene, size: tuple[int, int] | None, depth: int | None, samples: int | None, seed: int) -> Scene:
    """The scene with what is given in place of its own, at the size that kernels work with. Raises LimitError, ClrtError."""
    return seen(at_working_size(_with_sampling(_with_size(scene, size, depth), samples, seed)))


def _with_size(scene: Scene, size: tuple[int, int] | None, depth: int | None) -> Scene:
    if size is not None:
        scene = scene.with_size(*size)
    if depth is not None:
        scene = replace(scene, depth=depth)
    if not 0 <= scene.depth <= MAX_DEPTH:
        raise LimitError(f"a depth of {scene.depth} is out of range; it goes from 0 to {MAX_DEPTH}")
    width, height = scene.camera.width, scene.camera.height
    if width < 1 or height < 1 or width * height > MAX_PIXELS:
        raise LimitError(f"a picture of {width} x {height} is out of range; it has 1 to {MAX_PIXELS:,} pixels")
    if not scene.triangle_count and not len(scene.spheres):
        raise ClrtError("the scene has nothing to render; add a triangle or a sphere")
    return scene


def _with_sampling(scene: Scene, samples: int | None, seed: int) -> Scene:
    if samples is None:
        asked = scene.samples_line > 0 or scene.samples > 1
        samples = scene.samples if asked or not any(f.sampled for f in Features.of(scene).active) else DEFAULT_SAMPLES
    if not 1 <= samples <= MOST_SAMPLES:
        raise LimitError(f"{samples} samples are out of range; a pixel has 1 to {MOST_SAMPLES:,}")
    if not 0 <= seed < 1 << 32:
        raise LimitError(f"the seed {seed} is out of range; it goes from 0 to {(1 << 32) - 1}")
    return replace(scene, samples=samples, seed=seed)


def build_trees(scene: Scene, tree: str, tell: Progress, device: Device | None = None, store: Store | None = None) -> Prepared:
    """A kd-tree an object, over coordinates relative to the object's origin; by the device, where one is given and sooner.

    store : where trees of earlier runs are
    """

    def build(meshes: Sequence[F64], origins: F64) -> tuple[list[KdTree], list[float]]:
        from clrt.forest import choose

        return choose.build_trees(meshes, origins, tree, device, partial(tell, "trees"))

    trees, seconds = saved_trees(store, [item.vertices for item in scene.objects], tree_origins(scene), tree, build)
    return Prepared(scene, tuple(trees), tuple(seconds))


def program_shape(
    prepared: Prepared, features: Features, shared_lights: bool, wide: int = program.WIDE_STACK, shared_suns: bool = True
) -> program.Shape:
    """The sizes that the program of these features is compiled for: trees as deep as they may become, so that they need not be there."""
    bounces = any(f.name == "bounce" for f in features.active)
    scene = prepared.scene
    deepest = max([t.depth for t in prepared.trees], default=0)
    if scene.objects:
        deepest = max(deepest, default_max_depth(max(map(len, scene.objects))))
    boxes = depth_limit(len(scene.objects) + placement_count(scene) + len(scene.spheres))
    return program.Shape(
        program.stack_size(deepest), scene.depth if bounces else 0, shared_lights, program.stack_size(boxes), wide=wide,
        groups=program.groups_pay(features, scene.triangle_count), shared_suns=shared_suns,
    )  # fmt: skip


def _as_called(prepared: Prepared, features: Features) -> Prepared:
    """Without the instances and the motion that the features leave out."""
    names = {f.name for f in features.active}
    scene = seen(prepared.scene, "instances" in names, "motion" in names)
    return prepared if scene is prepared.scene else build_trees(scene, "sah", lambda phase, fraction: None)


def fill_buffers(prepared: Prepared, features: Features, precision: Precision, device: Device) -> tuple[Buffers, str, float]:
    """Buffers for these features, the source of their program, and the seconds of packing and upload. Raises LimitError."""
    prepared = _as_called(prepared, features)
    lanes = precision.lanes(device.info.lanes)
    program.check_limits(precision, lanes, program_shape(prepared, features, True), features)
    start = time.perf_counter()
    packed = pack(prepared.scene, prepared.trees, features, precision)
    buffers = Buffers(device, packed, features, precision, program.groups_pay(features, prepared.scene.triangle_count))
    upload_s = time.perf_counter() - start
    shape = program_shape(prepared, features, buffers.shared_lights, buffers.wide_stack, buffers.shared_suns)
    return buffers, program.compose(features, precision, lanes, shape), upload_s


def _begin_program(scene: Scene, features: Features, precision: Precision, device: Device, *, helped: bool = False) -> Compilation:
    """Begins to compile the program that the scene will need, as far as is known before it is packed. Raises LimitError."""
    names = {f.name for f in features.active}
    called = Prepared(seen(scene, "instances" in names, "motion" in names), (), ())
    shared = [shares(called.scene, precision, device) for shares in (shares_lights, shares_suns)]
    lanes, shape = precision.lanes(device.info.lanes), program_shape(called, features, shared[0], shared_suns=shared[1])
    program.check_limits(precision, lanes, shape, features)
    return Compilation(device, program.compose(features, precision, lanes, shape), called.scene.triangle_count, helped=helped)


def open_tracer(
    prepared: Prepared, features: Features, precision: Precision, device: Device, tell: Progress, begun: Compilation | None = None
) -> tuple[Buffers, Tracer, str, float]:
    """Buffers filled and program built; also its source, and the seconds of packing, upload and preparing.

    begun : the program that another thread compiles, taken if it is the one that is needed
    """
    tell("compile", 0.0)
    buffers, source, upload_s = fill_buffers(prepared, features, precision, device)
    built = ahead.build(device, source, begun)
    tracer = Tracer(buffers, built)
    tracer.warm_up()
    tell("compile", 1.0)
    start = time.perf_counter()
    prepare(buffers, built)
    return buffers, tracer, source, upload_s + time.perf_counter() - start


def run_rows(tracer: Tracer, phase: str, tell: Progress) -> None:
    """All samples of all rows, in launches of about _LAUNCH_S each; Python sees signals between them."""
    scene = tracer.buffers.packed.scene
    bounces = any(f.name == "bounce" for f in tracer.buffers.features.active)
    rays_a_pixel = (1 + len(scene.lights_with_position) + len(scene.suns)) * (1 + (2 * scene.depth if bounces else 0))
    high = tracer.row_step
    rows = max(high, _FIRST_LAUNCH // (rays_a_pixel * tracer.width) // high * high)
    sampled = "sampling" in {f.name for f in tracer.buffers.features.active}
    count = passes(scene, tracer.buffers.features)
    for sample in range(count):
        if sampled:
            tracer.begin_samples(sample, sample + 1)
        row = 0
        while row < tracer.height:
            tell(phase, (sample + row / tracer.height) / count)
            end = min(tracer.height, row + rows)
            start = time.perf_counter()
            tracer.run(row, end)
            pace = (time.perf_counter() - start) / (end - row)
            rows = max(high, min(8 * rows, int(_LAUNCH_S / max(pace, 1e-9))) // high * high)
            row = end
    tell(phase, 1.0)


def _object_stats(prepared: Prepared) -> list[ObjectStats]:
    return [
        ObjectStats(
            name=item.name, triangles=len(item), nodes=tree.node_count, leaves=tree.leaf_count,
            references=tree.reference_count, depth=tree.depth, build_s=seconds, built_on=tree.built_on,
        )
        for item, tree, seconds in zip(prepared.scene.objects, prepared.trees, prepared.tree_s, strict=True)
    ]  # fmt: skip


def _count(prepared: Prepared, buffers: Buffers, stats: RunStats, tell: Progress, replicates: Replicates | None) -> None:
    """The same picture again by the counting build, by the same launches if it was made of replicates: rays by kind, tests by object."""
    precision, device = buffers.precision, buffers.device
    lanes = precision.lanes(device.info.lanes)
    shape = program_shape(
        _as_called(prepared, buffers.features), buffers.features, buffers.shared_lights, buffers.wide_stack, buffers.shared_suns
    )
    tracer = Tracer(
        buffers, program.build(device, program.compose(buffers.features, precision, lanes, shape, counting=True)), counting=True
    )
    if replicates is None:
        run_rows(tracer, "count", tell)
    else:
        from clrt.adaptive.replicates import Replicates

        Replicates(tracer, replicates.count).replay(replicates.launches)
    kinds = buffers.features.ray_kinds
    stats.ray_counts = {kind: int(n) for kind, n in zip(kinds, tracer.counts, strict=False)}
    rays = max(1, sum(stats.ray_counts.values()))
    for item, tests in zip(stats.objects, tracer.counts[len(kinds) :], strict=True):
        item.tests_per_ray = int(tests) / rays
