"""clrt: a ray tracer in Python and OpenCL for machines without a GPU.

    import clrt
    image = clrt.render("scene.txt")
    image.save("scene.png")

Importing it costs nothing: NumPy, PyOpenCL and Pillow are imported by the first call that needs them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from clrt.errors import ClrtError, DeviceError, LimitError, MeshError, RayError, SceneError

if TYPE_CHECKING:
    from clrt.device.context import DeviceInfo
    from clrt.image.image import Image
    from clrt.rays import RayCaster
    from clrt.scene.model import Scene
    from clrt.stats import ObjectStats, RunStats

__version__ = "0.1.0"

__all__ = [
    "ClrtError", "DeviceError", "Image", "LimitError", "MeshError", "ObjectStats", "RayCaster", "RayError",
    "RunStats", "Scene", "SceneError",
    "devices", "load", "render",
]  # fmt: skip

_LAZY = {
    "Image": "clrt.image.image",
    "RayCaster": "clrt.rays",
    "Scene": "clrt.scene.model",
    "RunStats": "clrt.stats",
    "ObjectStats": "clrt.stats",
}


def load(
    path: str | PathLike[str], *, right_handed: bool = False, split_objects: bool = False,
    allow_paths: Sequence[str | PathLike[str]] = (), camera: int | None = None,
) -> Scene:  # fmt: skip
    """Read and check a scene text, or a glTF or GLB file.

    right_handed : mirror x, for files made in right-handed axes
    split_objects : make each connected component of triangles an object, where the text marks none
    allow_paths : folders, besides the scene's own, that the files it names may be in
    camera : which of the cameras of a glTF file, from 1; the first without it

    Raises SceneError with one line a fault, OSError where the file cannot be read.
    """
    from clrt.scene.build import load_scene

    return load_scene(path, right_handed=right_handed, split_objects=split_objects, allow_paths=allow_paths, camera=camera)


def render(
    scene: Scene | str | PathLike[str],
    *,
    size: tuple[int, int] | None = None,
    tree: str = "sah",
    device: str | None = None,
    precision: str = "watertight",
    depth: int | None = None,
    samples: int | None = None,
    seed: int = 0,
    count: bool = False,
    without: Iterable[str] = (),
    progress: Callable[[str, float], None] | None = None,
    error: float | None = None,
    within: float | None = None,
    standard_error: bool = False,
    cache: bool = False,
) -> Image:
    """The picture of a scene, or of a scene text; its `stats` are the figures of the run.

    size : (width, height) in pixels instead of the scene's own
    tree : "sah", or "median" for the splitter of the classic report
    device : part of a name that `devices()` lists
    depth : reflections and refractions in a row, instead of the scene's own
    samples : rays through each pixel, instead of the scene's own; 1: one, through its centre
    seed : of all random numbers, 0 to 2^32 - 1; the same seed gives the same picture
    count : count rays and tests in a second pass
    without : names of effects to leave out, as `clrt explain` lists them, with what needs them
    progress : called with a phase and how much of it is done, 0 to 1
    error : sample where it brings most until the picture's relative error is below this, with 95% (docs/error.md); not with `samples`
    within : the best picture in this many seconds, from the call on; with `error`, too: until the first of both is reached
    cache : keep trees for later runs in the user's cache folder, and take those that are there, as the command does (docs/caching.md)
    standard_error : the picture has a `standard_error` with plain `samples`, too, which are split over 8 independent sequences for it

    Raises SceneError, DeviceError, LimitError; OSError where a file cannot be read.
    """
    import time

    from clrt.renderer import render as render_scene
    from clrt.scene.model import Scene

    start = time.perf_counter()
    loaded = scene if isinstance(scene, Scene) else load(scene)
    read_s = time.perf_counter() - start
    image = render_scene(
        loaded, size=size, tree=tree, device=device, precision=precision, depth=depth, samples=samples, seed=seed,
        count=count, without=without, progress=progress, error=error, within=within, standard_error=standard_error,
        deadline=None if within is None else start + within, cache=cache,
    )
    if image.stats is not None and loaded is not scene:
        image.stats.read_s = read_s
        image.stats.total_s += read_s
    return image


def devices() -> list[DeviceInfo]:
    """The OpenCL devices of this machine, the one that is used by default marked so. Raises DeviceError where there is no OpenCL."""
    from clrt.device.context import list_devices

    return list_devices()


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module 'clrt' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_LAZY[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
