"""Scenes and meshes of any size from formulae: the same seed gives the same file."""

from __future__ import annotations

import os
from collections.abc import Callable

from clrt.errors import SceneError
from clrt.generate import scenes
from clrt.generate.rabbit import rabbit_like
from clrt.generate.shapes import grid_mesh, needle_fan, soup, uv_sphere
from clrt.scene.write import write_text

__all__ = ["KINDS", "grid_mesh", "make", "needle_fan", "rabbit_like", "soup", "uv_sphere"]

#: what `make` makes, and what it is
KINDS: dict[str, str] = {
    "rabbit-like": "a closed, bumpy animal on a mirror floor, in two objects; 1,000 to 4,000,000 triangles, within 2%",
    "rabbit-smooth": "the same with a normal at each corner",
    "sphere": "a closed sphere of triangles on a mirror floor",
    "grid": "hills, as a height field",
    "soup": "random triangles that share nothing, over a mirror floor",
    "spheres": "a field of true spheres of six materials on a mirror floor; --triangles is the number of spheres",
}

_MAKERS: dict[str, Callable[[int, int], str]] = {
    "rabbit-like": scenes.rabbit_scene,
    "rabbit-smooth": scenes.smooth_rabbit_scene,
    "sphere": scenes.sphere_scene,
    "grid": scenes.grid_scene,
    "soup": scenes.soup_scene,
    "spheres": scenes.spheres_scene,
}


def make(kind: str, path: str | os.PathLike[str], triangles: int = 10_000, seed: int = 0) -> str:
    """Write a scene of about `triangles` triangles and return a one-line summary.

    Raises SceneError for an unknown kind or a path that cannot be written, LimitError for a number it cannot do.
    """
    if kind not in _MAKERS:
        raise SceneError(f"no kind of scene is called {kind!r}; there are {', '.join(KINDS)}")
    text = _MAKERS[kind](triangles, seed)
    write_text(path, f"# {kind}, {triangles} asked for, seed {seed}\n" + text)
    return f"{path}: {kind}, {_counted(text, 'T', 'triangle')}, {_counted(text, 'S', 'sphere')}"


def _counted(text: str, letter: str, name: str) -> str:
    count = text.count(f"\n{letter} ")
    return f"{count:,} {name}{'' if count == 1 else 's'}"
