"""`clrt scene.txt`: read, render, write, print the figures."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from clrt.cli import arguments as kinds
from clrt.cli import clock, failure, paths, streams
from clrt.cli.progress import PhaseProgress
from clrt.errors import ClrtError
from clrt.tasks import Task

if TYPE_CHECKING:
    from clrt.device.context import Device
    from clrt.image.image import Image
    from clrt.scene.model import Scene


@dataclass(frozen=True)
class Options:
    """The command line of a render; `scene` is None where it was not given."""

    scene: Path | None
    out: Path | None
    size: tuple[int, int] | None
    tree: str
    device: str | None
    depth: int | None
    samples: int | None
    seed: int
    precision: str
    stats: Path | None
    dump_kernel: Path | None
    quiet: bool
    srgb: bool
    right_handed: bool
    split_objects: bool
    allow_path: tuple[Path, ...]
    camera: int | None
    without: tuple[str, ...]
    error: float | None
    within: float | None
    stderr: Path | None
    cache: bool


#: the device, until the process ends: freeing it would take apart, piece by piece, all that a compiler has in memory
_open: list[Task[Device]] = []
#: what follows a render: seconds to print figures and to end, and seconds a pixel to write a picture, and as many for a second one
_AFTER_S, _AFTER_PIXEL_S = 0.2, 6e-8


@click.command("render", short_help="Render a scene; the word is never needed.")
@click.argument("scene", type=kinds.file, required=False)
@click.option("-o", "--out", type=kinds.file, metavar="FILE", help="Picture: .png, .ppm, .exr.  [default: SCENE.png in the current folder]")
@click.option("--size", type=kinds.size, metavar="WxH", help="Width and height in pixels, instead of the scene's.")
@click.option("--tree", type=click.Choice(["sah", "median"]), default="sah", show_default=True, help="How the kd-trees are split.")
@click.option("--device", metavar="NAME", help="Part of the name of an OpenCL device; `clrt devices` lists them.")
@click.option("--depth", type=kinds.whole(0), metavar="N", help="Reflections and refractions in a row, instead of the scene's.")
@click.option("--samples", type=kinds.whole(1, 1 << 16), metavar="N", help="Rays through each pixel, instead of the scene's.")
@click.option("--seed", type=kinds.whole(0, (1 << 32) - 1), metavar="S", default=0, show_default=True, help="Of all random numbers.")
@click.option(
    "--precision", metavar="NAME", default="watertight", show_default=True, help="How rays meet triangles: fast, watertight, exact, double."
)
@click.option(
    "--stats",
    type=kinds.file_or_stdout,
    metavar="FILE",
    help="Write the figures as JSON, - for standard output; counts rays and tests in a second pass.",
)
@click.option("--dump-kernel", type=kinds.file, metavar="FILE", help="Write the OpenCL program that is compiled for this scene.")
@click.option("--srgb", is_flag=True, help="Encode the picture as sRGB; without it the linear values are written.")
@click.option("--right-handed", is_flag=True, help="Mirror x: for scenes made in right-handed axes.")
@click.option("--split-objects", is_flag=True, help="Make each connected component an object, where the scene marks none.")
@click.option("--camera", type=kinds.whole(1), metavar="N", help="Which camera of a glTF file to look through.  [default: 1]")
@click.option("--allow-path", type=kinds.file, multiple=True, metavar="DIR", help="Permit the scene to name files in DIR, too.")
@click.option("--without", multiple=True, metavar="EFFECT", help="Leave out an effect of `clrt explain`; may be repeated.")
@click.option(
    "--error",
    type=kinds.fraction,
    metavar="E",
    help="Sample until the relative error (root mean square over pixels, over the picture's mean) is below E, such as 0.01, with 95%.",
)
@click.option("--within", type=kinds.duration, metavar="T", help="The best picture in this time, such as 5s or 2min, compiling included.")
@click.option("--stderr", type=kinds.file, metavar="FILE", help="Write a map of each pixel's standard error, too: .png or .exr.")
@click.option("--no-cache", "cache", flag_value=False, default=True, help="Neither keep trees and compiled kernels nor take kept ones.")
@click.option("-q", "--quiet", is_flag=True, help="Print no figures and no progress.")
def render(**arguments: Any) -> None:
    """Render SCENE to a picture. The same as `clrt SCENE`."""
    start = clock.begun()
    options = Options(**arguments)
    scene_path = _scene_path(options)
    picture = options.out or Path(scene_path.stem + ".png")
    _check(options, scene_path, picture)
    opening = _open_device(options)
    with PhaseProgress(quiet=options.quiet) as progress:
        scene, read_s = _read(options, scene_path, progress)
        image = _render(options, scene, progress, start, opening)
        write_s = _write(options, image, picture, progress)
    stats = image.stats
    if stats is None:
        return
    white = _write_error_map(options, image)
    stats.read_s, stats.write_s = read_s, write_s
    stats.total_s = time.perf_counter() - start - stats.count_s
    if options.stats is kinds.STDOUT:
        streams.write(stats.json_text())
    elif options.stats is not None:
        stats.write_json(options.stats)
    if not options.quiet and options.stats is not kinds.STDOUT:
        from clrt.cli.report import print_report

        print_report(stats, picture, "" if white is None else f"{options.stderr}, white is {white:g}")


def _scene_path(options: Options) -> Path:
    if options.scene is not None:
        return options.scene
    if Path(paths.DEFAULT_SCENE).exists():
        return Path(paths.DEFAULT_SCENE)
    raise ClrtError(f"no scene is given, and there is no {paths.DEFAULT_SCENE} in the current folder")


def _check(options: Options, scene_path: Path, picture: Path) -> None:
    """Raise now what would else be said after the work."""
    paths.check_scene(scene_path)
    figures = None if options.stats is kinds.STDOUT else options.stats
    outputs = {"picture": picture, "file of figures": figures, "kernel": options.dump_kernel, "map of errors": options.stderr}
    paths.check_outputs({"scene": scene_path}, outputs)
    from clrt.features.choice import effect_names
    from clrt.image.image import check_format
    from clrt.precision import rung

    check_format(picture, options.srgb)
    if options.stderr is not None:
        check_format(options.stderr)
    if options.error is not None or options.within is not None or options.stderr is not None:
        from clrt.adaptive.request import Request

        Request.of(options.error, options.within, options.samples, options.stderr is not None, None)
    rung(options.precision)
    effect_names(options.without)


def _open_device(options: Options) -> Task[Device]:
    """The device, which another thread opens while the scene is read."""
    from clrt.device import early, kernel_cache

    if not options.cache:
        kernel_cache.use_temporary_folder()
    kernel_cache.choose_folder()
    opening = Task(partial(early.open_device, options.device))
    _open.append(opening)
    return opening


def _read(options: Options, path: Path, progress: PhaseProgress) -> tuple[Scene, float]:
    """The scene and the seconds it took; its warnings are printed."""
    from clrt.device.kernel_cache import own_folder
    from clrt.scene import saved
    from clrt.scene.build import load_scene
    from clrt.store import Store

    progress("read", 0.0)
    start = time.perf_counter()
    texts = saved.SavedTexts(Store(own_folder("texts"), saved.LIMIT)) if options.cache else None
    scene = load_scene(
        path, right_handed=options.right_handed, split_objects=options.split_objects, allow_paths=options.allow_path,
        camera=options.camera, saved=texts,
    )  # fmt: skip
    if texts is not None:
        Task(texts.keep)
    for warning in scene.warnings:
        failure.warn(f"{scene.source}: {warning}")
    return scene, time.perf_counter() - start


def _render(options: Options, scene: Scene, progress: PhaseProgress, start: float, opening: Task[Device]) -> Image:
    from clrt.cli.accuracy import foretold
    from clrt.renderer import render as render_scene

    deadline = None
    if options.within is not None:
        width, height = options.size or (scene.camera.width, scene.camera.height)
        pictures = 1 + (options.stderr is not None)
        deadline = start + options.within - _AFTER_S - _AFTER_PIXEL_S * width * height * pictures

    with failure.warnings_told():
        return render_scene(
            scene,
            size=options.size,
            tree=options.tree,
            device=options.device,
            precision=options.precision,
            depth=options.depth,
            samples=options.samples,
            seed=options.seed,
            count=options.stats is not None,
            without=options.without,
            progress=progress,
            dump_kernel=options.dump_kernel,
            error=options.error,
            within=options.within,
            standard_error=options.stderr is not None,
            deadline=deadline,
            foretell=lambda told: progress.say(foretold(told, options.error)),
            cache=options.cache,
            opening=opening,
        )


def _write(options: Options, image: Image, picture: Path, progress: PhaseProgress) -> float:
    """Write the picture; the seconds it took. Warnings about its pixels are printed."""
    progress("write", 0.0)
    start = time.perf_counter()
    with failure.warnings_told():
        image.save(picture, srgb=options.srgb)
    return time.perf_counter() - start


def _write_error_map(options: Options, image: Image) -> float | None:
    """Write the map that was asked for; what its white stands for."""
    if options.stderr is None or image.standard_error is None:
        return None
    from clrt.image.error_map import save_error_map

    return save_error_map(options.stderr, image.standard_error)
