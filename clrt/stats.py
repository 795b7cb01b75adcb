"""Counters and timings of one run, and their JSON form (`clrt scene.txt --stats FILE`).

The keys of the JSON are part of the program's interface: they are added to, never renamed. docs: README, section "Figures of a run".
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

from clrt import __version__
from clrt.files import atomic_write

RAY_KINDS = ("primary", "shadow", "mirror", "refracted")


@dataclass
class ObjectStats:
    """One object and its kd-tree.

    name : as in the scene, such as "object 2"
    nodes, leaves : of its tree, nodes in all (inner nodes and leaves)
    references : triangle entries over all leaves; more than `triangles` where planes cut triangles
    depth : edges from the root to the deepest leaf
    build_s : seconds of this tree alone
    tests_per_ray : ray-triangle tests against this object, over all rays of the scene; None unless counted
    built_on : what built the tree: "numpy", or "device" for its kernels
    """

    name: str
    triangles: int
    nodes: int
    leaves: int
    references: int
    depth: int
    build_s: float
    tests_per_ray: float | None = None
    built_on: str = "numpy"


@dataclass
class RunStats:
    """One run from scene text to picture. Times are seconds of wall time.

    read_s, build_s, upload_s, compile_s, render_s, write_s : reading the scene, all trees, filling buffers, composing and building
        the kernels, tracing and shading with the transfer of the picture, writing the picture
    count_s : the second pass that counts, which no other time contains
    total_s : from the start of the command to the written picture, without `count_s`; from Python, from `render` to the picture
    ray_counts : rays traced by kind (see RAY_KINDS), None unless counted
    decided : lanes that the rung "exact" decided in float64 and in exact arithmetic; None for other rungs
    samples, seed : rays through each pixel, the most where they are not the same everywhere; the seed of all random numbers
    samples_per_pixel : their mean, None where they are the same everywhere
    accuracy : what was asked of the picture's error, foretold and reached (README, "Figures of a run"); None where no error is known
    effects : names of what the scene calls for, in the order of their kernels, but for what was left out
    without : names of effects that were to be left out
    """

    scene: str = ""
    width: int = 0
    height: int = 0
    tree: str = ""
    device: str = ""
    precision: str = ""
    samples: int = 1
    seed: int = 0
    samples_per_pixel: float | None = None
    accuracy: dict[str, Any] | None = None
    effects: list[str] = field(default_factory=list)
    without: list[str] = field(default_factory=list)
    objects: list[ObjectStats] = field(default_factory=list)
    ray_counts: dict[str, int] | None = None
    decided: dict[str, int] | None = None
    read_s: float = 0.0
    build_s: float = 0.0
    upload_s: float = 0.0
    compile_s: float = 0.0
    render_s: float = 0.0
    count_s: float = 0.0
    write_s: float = 0.0
    total_s: float = 0.0

    @property
    def bias(self) -> str:
        """What makes the picture another one than the scene's in the mean, for its label; empty where nothing does."""
        return "biased: indirect clamp" if "clamp" in self.effects else ""

    @property
    def triangles(self) -> int:
        return sum(o.triangles for o in self.objects)

    @property
    def nodes(self) -> int:
        """Nodes of all trees."""
        return sum(o.nodes for o in self.objects)

    @property
    def depth(self) -> int:
        """Depth of the deepest tree."""
        return max((o.depth for o in self.objects), default=0)

    @property
    def tests_per_ray(self) -> float | None:
        """Ray-triangle tests over rays of all kinds, or None unless counted."""
        per_object = [o.tests_per_ray for o in self.objects if o.tests_per_ray is not None]
        counted = self.ray_counts is not None and len(per_object) == len(self.objects)
        return sum(per_object) if counted else None

    @property
    def primary_rays(self) -> int:
        """Rays from the eye: `samples` a pixel, known without counting."""
        if self.ray_counts is not None:
            return self.ray_counts.get("primary", 0)
        return round(self.width * self.height * (self.samples if self.samples_per_pixel is None else self.samples_per_pixel))

    @property
    def rays(self) -> int | None:
        """Rays of all kinds, or None unless counted."""
        return None if self.ray_counts is None else sum(self.ray_counts.values())

    @property
    def rays_per_s(self) -> float | None:
        """Rays of all kinds over `render_s`, or None unless counted."""
        return None if self.rays is None else _rate(self.rays, self.render_s)

    @property
    def primary_rays_per_s(self) -> float | None:
        return _rate(self.primary_rays, self.render_s)

    def to_json(self) -> dict[str, Any]:
        """A dict of JSON types, with the keys and the order that the README lists."""
        return {
            "clrt": __version__,
            "scene": self.scene,
            "width": self.width,
            "height": self.height,
            "tree": self.tree,
            "device": self.device,
            "precision": self.precision,
            "samples": self.samples,
            "seed": self.seed,
            "effects": list(self.effects),
            "without": list(self.without),
            "bias": self.bias,
            "accuracy": self.accuracy,
            **{name: round(getattr(self, name), 6) for name in _TIMES},
            "triangles": self.triangles,
            "nodes": self.nodes,
            "depth": self.depth,
            "tests_per_ray": self.tests_per_ray,
            "primary_rays": self.primary_rays,
            "primary_rays_per_s": self.primary_rays_per_s,
            "rays": self.rays,
            "rays_per_s": self.rays_per_s,
            "ray_counts": None if self.ray_counts is None else {k: self.ray_counts.get(k, 0) for k in _kinds(self.ray_counts)},
            "decided": self.decided,
            "objects": [_object_json(o) for o in self.objects],
        }

    def json_text(self) -> str:
        """`to_json` as text."""
        return json.dumps(self.to_json(), indent=2, allow_nan=False) + "\n"

    def write_json(self, path: str | PathLike[str]) -> None:
        """Write `json_text` to `path`, whole or not at all. Raises OSError with the path in it."""
        with atomic_write(path) as file:
            file.write(self.json_text().encode())


_TIMES = ("read_s", "build_s", "upload_s", "compile_s", "render_s", "write_s", "total_s", "count_s")


def _rate(count: int, seconds: float) -> float | None:
    return count / seconds if seconds > 0.0 else None


def _kinds(counts: dict[str, int]) -> list[str]:
    """The known kinds, which are always listed, then whatever else was counted."""
    return [*RAY_KINDS, *(k for k in counts if k not in RAY_KINDS)]


def _object_json(o: ObjectStats) -> dict[str, Any]:
    return {
        "name": o.name,
        "triangles": o.triangles,
        "nodes": o.nodes,
        "leaves": o.leaves,
        "references": o.references,
        "depth": o.depth,
        "build_s": round(o.build_s, 6),
        "tests_per_ray": o.tests_per_ray,
        "built_on": o.built_on,
    }
