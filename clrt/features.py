"""What a scene calls for: effects, the line that calls each, and what each adds to the program.

An effect is called for by a line of the scene, never by an option. One that is not called for is not in the composed
program: not its kernel file, its arguments, its members of structs, nor its name.

To add one: a `Feature` in FEATURES, a file in kernels/ of its own, a packer in device/pack.py for each kernel argument,
a reference function, a smallest scene and a test. No other effect's file changes (CONTRIBUTING.md has the list).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from clrt.scene.model import Material, Scene

REAL = "real"  #: stands for the rung's number type in `Feature.material` and `Feature.frame`

Caller = Callable[[Scene], "int | None"]


@dataclass(frozen=True)
class Feature:
    """One effect.

    name : as the figures of a run tell it
    called_by : scene -> number of the first line that calls for it (0: no text), None where none does
    kernel : its file in kernels/
    early : its file stands before the scene's traversal, which calls it
    material : members it adds to the Material struct; each is an attribute of `scene.model.Material`
    light : members it adds to the Light struct: name, type, shape if it is no scalar
    frame : members it adds to the Frame struct, with their values
    parameters : kernel arguments it adds: name of the packer in device/pack.py -> C declaration
    rays : kinds of rays it spawns, as the counters name them
    """

    name: str
    called_by: Caller
    kernel: str
    early: bool = False
    material: tuple[tuple[str, Any], ...] = ()
    light: tuple[tuple[Any, ...], ...] = ()
    frame: tuple[tuple[str, Any, Callable[[Scene], Any]], ...] = ()
    parameters: tuple[tuple[str, str], ...] = ()
    rays: tuple[str, ...] = ()


def _used_materials(scene: Scene) -> Iterator[Material]:
    used: set[int] = set(np.unique(scene.spheres.material_ids).tolist())
    for item in scene.objects:
        used |= set(np.unique(item.material_ids).tolist())
    return (scene.materials[i] for i in sorted(used))


def _material_caller(attribute: str) -> Caller:
    """The first used material with a positive `attribute`, where rays may go on at all."""

    def called_by(scene: Scene) -> int | None:
        lines = [m.line for m in _used_materials(scene) if getattr(m, attribute) > 0.0]
        return min(lines) if lines and scene.depth > 0 else None

    return called_by


def _light_caller(scene: Scene) -> int | None:
    return min((light.line for light in scene.lights_with_position), default=None)


def _spot_caller(scene: Scene) -> int | None:
    return min((spot.line for spot in scene.spots), default=None)


def _sun_caller(scene: Scene) -> int | None:
    return min((sun.line for sun in scene.suns), default=None)


def _can_shadow(scene: Scene) -> bool:
    """Something can stand in a light's way: a lone flat triangle cannot shadow itself, a curved one and a sphere can."""
    return scene.triangle_count > 1 or len(scene.spheres) > 0 or _smooth_caller(scene) is not None


def _shadow_caller(scene: Scene) -> int | None:
    return _light_caller(scene) if _can_shadow(scene) else None


def _bounce_caller(scene: Scene) -> int | None:
    lines = [line for attribute in ("reflect", "refract") if (line := _material_caller(attribute)(scene)) is not None]
    return min(lines, default=None)


def _fresnel_caller(scene: Scene) -> int | None:
    lines = [m.fresnel_line for m in _used_materials(scene) if m.fresnel and m.refract > 0.0]
    return min(lines) if lines and scene.depth > 0 else None


def _absorption_caller(scene: Scene) -> int | None:
    lines = [m.absorb_line for m in _used_materials(scene) if m.refract > 0.0 and max(m.absorb) > 0.0]
    return min(lines) if lines and scene.depth > 0 else None


def _smooth_caller(scene: Scene) -> int | None:
    return min((o.line for o in scene.objects if o.vertex_normals is not None), default=None)


def _texture_caller(scene: Scene) -> int | None:
    return min((scene.textures[m.texture].line for m in _used_materials(scene) if m.texture >= 0), default=None)


def _globe_caller(scene: Scene) -> int | None:
    """A picture on a round primitive."""
    used = np.unique(scene.spheres.material_ids).tolist()
    return min((scene.textures[t].line for i in used if (t := scene.materials[i].texture) >= 0), default=None)


def _samples_caller(scene: Scene) -> int | None:
    return scene.samples_line if scene.samples > 1 else None


def _sampled_caller(scene: Scene) -> int | None:
    """What is seen is the mean of samples: anything that draws random numbers calls for it."""
    lines = [line for caller in (_samples_caller,) if (line := caller(scene)) is not None]
    return min(lines, default=None)


FEATURES: tuple[Feature, ...] = (
    Feature("sampler", _sampled_caller, "sampler.cl"),
    Feature(
        "sampling",
        _sampled_caller,
        "sampling.cl",
        frame=(("seed", np.int32, lambda scene: np.uint32(scene.seed).astype(np.int32)),),
        parameters=(("sample_range", "global const int *sample_range"), ("sample_sums", "global double *sample_sums")),
    ),
    Feature(
        "samples",
        _samples_caller,
        "antialias.cl",
        frame=(("pixel_spread", REAL, lambda scene: float(scene.samples > 1)),),
    ),
    Feature(
        "spheres",
        lambda scene: scene.spheres.line if len(scene.spheres) else None,
        "sphere.cl",
        early=True,
        frame=(("sphere_count", np.int32, lambda scene: len(scene.spheres)),),
        parameters=(("spheres", "global const Sphere *spheres"),),
    ),
    Feature("smooth", _smooth_caller, "smooth.cl", early=True, parameters=(("corner_normals", "global const real *corner_normals"),)),
    Feature(
        "shadows", _shadow_caller, "shadow.cl", parameters=(("light_planes", "global const EdgePlanes *light_planes"),), rays=("shadow",)
    ),
    Feature(
        "direct light",
        _light_caller,
        "light_point.cl",
        frame=(("light_count", np.int32, lambda scene: len(scene.lights_with_position)),),
        parameters=(("lights", "global const Light *lights"),),
    ),
    Feature("spot", _spot_caller, "spot.cl", early=True, light=(("axis", REAL, (3,)), ("edge", REAL), ("slope", REAL))),
    Feature(
        "sun shadows", lambda scene: _sun_caller(scene) if _can_shadow(scene) else None, "sun_visible.cl", rays=("shadow",)
    ),
    Feature(
        "sun",
        _sun_caller,
        "sun.cl",
        frame=(("sun_count", np.int32, lambda scene: len(scene.suns)),),
        parameters=(("suns", "global const Sun *suns"),),
    ),
    Feature("fresnel", _fresnel_caller, "fresnel.cl", material=(("fresnel", np.int32),), rays=("fresnel",)),
    Feature(
        "refraction",
        _material_caller("refract"),
        "refraction.cl",
        material=(("refract", REAL), ("ior", REAL)),
        parameters=(("media", "global const int *media"),),
        rays=("refracted", "internal"),
    ),
    Feature("absorption", _absorption_caller, "absorb.cl", parameters=(("absorption", "global const real *absorption"),)),
    Feature("mirror", _material_caller("reflect"), "mirror.cl", material=(("reflect", REAL),), rays=("mirror",)),
    Feature("globe", _globe_caller, "globe.cl"),
    Feature(
        "textures",
        _texture_caller,
        "texture.cl",
        material=(("texture", np.int32),),
        parameters=(
            ("textures", "global const Texture *textures"),
            ("texels", "global const uchar *texels"),
            ("texel_values", "global const real *texel_values"),
            ("corner_uvs", "global const double *corner_uvs"),
        ),
    ),
    Feature("bounce", _bounce_caller, "bounce.cl", frame=(("depth", np.int32, lambda scene: scene.depth),)),
)
HELPERS = frozenset({"globe", "bounce", "sampler", "sampling"})  #: parts that effects share; not effects of their own


@dataclass(frozen=True)
class Features:
    """The effects of one scene: `lines` maps each called-for feature to the line that calls for it (0: no text)."""

    lines: tuple[tuple[str, int], ...]

    @classmethod
    def of(cls, scene: Scene) -> Features:
        """What `scene` calls for."""
        return cls(tuple((f.name, line) for f in FEATURES if (line := f.called_by(scene)) is not None))

    @property
    def active(self) -> tuple[Feature, ...]:
        """The called-for features and their helpers, in the order of the program."""
        names = {name for name, _ in self.lines}
        return tuple(f for f in FEATURES if f.name in names)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects, helpers left out."""
        return tuple(f.name for f in self.active if f.name not in HELPERS)

    @property
    def ray_kinds(self) -> tuple[str, ...]:
        """The kinds of rays that exist at all; the eye's first."""
        return tuple(dict.fromkeys(("primary", *(kind for f in self.active for kind in f.rays))))
