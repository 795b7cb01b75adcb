"""What is measured: the report's two scenes where they are at hand, generated ones of about their size elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from clrt.errors import ClrtError
from clrt.generate import make
from clrt.scene.build import load_scene
from clrt.scene.model import Scene, Spheres

#: where the report's scenes are looked for: beside the checkout
DEFAULT_FOLDER = Path(__file__).resolve().parents[3] / "shared" / "scenes"

#: the report's scene -> what is made in its place (kind), with about as many triangles
_STAND_INS = {"monkey": ("sphere", 968), "rabbit": ("rabbit-like", 69_451)}
_QUICK_TRIANGLES = {"monkey": 200, "rabbit": 1000}


@dataclass(frozen=True, eq=False)
class BenchScene:
    """A scene to measure. `role`: "monkey" or "rabbit", whose place it takes; `name`: what it is; `path`: its text."""

    role: str
    name: str
    path: Path
    generated: bool
    scene: Scene


def load(folder: Path | None, scratch: Path, *, quick: bool = False) -> tuple[BenchScene, ...]:
    """The scenes `monkey` and `rabbit` of `folder` (None: beside the checkout); what is not there is made in `scratch`.

    quick : make small ones in any case. Raises ClrtError where a given folder lacks them.
    """
    if folder is not None and not any((folder / f"{role}.txt").is_file() for role in _STAND_INS):
        names = " or ".join(f"{role}.txt" for role in _STAND_INS)
        raise ClrtError(f"{folder}: no {names} in this folder; leave --scenes out to measure generated scenes")
    return tuple(_one(role, folder or DEFAULT_FOLDER, scratch, quick) for role in _STAND_INS)


def _one(role: str, folder: Path, scratch: Path, quick: bool) -> BenchScene:
    path = folder / f"{role}.txt"
    if path.is_file() and not quick:
        return BenchScene(role, role, path, False, load_scene(path))
    kind, triangles = _STAND_INS[role]
    path = scratch / f"{kind}.txt"
    make(kind, path, _QUICK_TRIANGLES[role] if quick else triangles, seed=1)
    return BenchScene(role, f"{kind} (generated)", path, True, load_scene(path))


def straight(scene: Scene) -> Scene:
    """`scene` with primary and shadow rays alone: matt triangles, one light, a black background.

    Mirrors, glass and spheres go, so that a tracer of triangles from outside can be given the very same rays; highlights, whose
    powers are no part of tracing, go too.
    """
    materials = tuple(replace(m, specular=0.0, reflect=0.0, refract=0.0) for m in scene.materials)
    return replace(scene, materials=materials, lights=scene.lights[:1], spheres=Spheres(), background=(0.0, 0.0, 0.0))
