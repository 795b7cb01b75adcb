"""What a scene calls for: effects, the line that calls each, and what each adds to the program.

An effect is called for by a line of the scene, never by an option. One that is not called for is not in the composed
program: not its kernel file, its arguments, its members of structs, nor its name.

To add one: a `Feature` in a module here and its place in FEATURES, a file in kernels/ of its own, a packer for each kernel argument,
a reference function, a smallest scene and a test. No other effect's file changes (CONTRIBUTING.md has the list).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from clrt.features import camera, cutouts, helpers, lamps, motion, placed, rough, sampled, shapes, single, surfaces, surroundings, volume
from clrt.features.feature import REAL, Calls, Feature
from clrt.scene.model import Scene

__all__ = ["FEATURES", "HELPERS", "REAL", "Feature", "Features"]

#: in the order of the program: code at the same place runs in this order
FEATURES: tuple[Feature, ...] = (
    helpers.SAMPLER,
    camera.LENS,
    motion.SHUTTER,
    motion.EYE_MOTION,
    helpers.SAMPLING,
    camera.SAMPLES,
    helpers.WIDE_EYE,
    helpers.PATH,
    single.BLOCKS,
    single.SINGLE,
    placed.INSTANCES,
    motion.MOTION,
    placed.PLACED,
    placed.OBJECT_TREE,
    shapes.SPHERES,
    shapes.SMOOTH,
    placed.PLACED_SMOOTH,
    placed.PLACED_BACK,
    cutouts.GLOBE,
    cutouts.PICTURES,
    cutouts.NORMAL_GLOBE,
    cutouts.NORMAL_PLACED,
    cutouts.NORMAL_MAP,
    cutouts.ALPHA,
    cutouts.OPACITY,
    cutouts.OPACITY_SPHERE,
    cutouts.AFTER,
    cutouts.OPACITY_PLACED,
    cutouts.OPACITY_SHADOWS,
    helpers.FACETS,
    rough.METAL_OPACITY,
    rough.METAL_ROUGH,
    rough.METAL_MAP,
    lamps.SHADOWS,
    lamps.DIRECT_LIGHT,
    lamps.SPOT,
    lamps.FALLOFF,
    helpers.REACH,
    lamps.SUN_SHADOWS,
    lamps.SUN,
    volume.FOG,
    helpers.FOG_TINT,
    helpers.FOG_ABSORPTION,
    volume.FOG_OPACITY,
    volume.FOG_POINT,
    rough.GLOSS,
    surfaces.FRESNEL,
    surfaces.REFRACTION,
    surfaces.ABSORPTION,
    surfaces.MIRROR,
    rough.GLOSS_MIRROR,
    rough.GLOSS_FRESNEL,
    rough.GLOSS_GLASS,
    cutouts.OPACITY_SEEN,
    helpers.BOUNCE,
    helpers.PATH_BOUNCE,
    helpers.ADDED,
    surroundings.ENVIRONMENT,
    helpers.THROUGHPUT,
    helpers.MIS,
    helpers.LIGHTS_ALONE,
    helpers.PANES,
    sampled.INDIRECT,
    sampled.CLAMP,
    rough.METAL_RAY,
    helpers.METAL_INDIRECT,
    helpers.SCATTER,
    helpers.GLOSS_LIGHT,
    helpers.METAL_LIGHT,
    helpers.METAL_MIS,
    surroundings.ENVIRONMENT_LIGHT,
    surroundings.ENVIRONMENT_SHADOWS,
    helpers.ENVIRONMENT_MIS,
    sampled.AREA_LIGHT,
    cutouts.GLOW_MAP,
    sampled.AREA_SHADOWS,
    volume.FOG_AREA,
    helpers.AREA_MIS,
    helpers.AREA_SPHERE,
    surfaces.TEXTURES,
)
HELPERS = frozenset(f.name for f in FEATURES if f.helper)  #: parts that effects share; not effects of their own


@dataclass(frozen=True)
class Features:
    """The effects of one scene: `lines` maps each called-for feature to the line that calls for it (0: no text).

    every : the program is to hold all features there are; those without a line are not to act. For comparisons alone.
    """

    lines: tuple[tuple[str, int], ...]
    every: bool = False

    @classmethod
    def of(cls, scene: Scene, without: Iterable[str] = ()) -> Features:
        """What `scene` calls for; left out are the effects called `without`, what needs them, and helpers that nothing needs any more."""
        dropped = frozenset(without)
        return cls._where(lambda feature: None if feature.name in dropped else feature.called_by(scene))

    @classmethod
    def named(cls, names: Iterable[str]) -> Features:
        """Just the effects of these names, with the helpers that they need, as if line 0 of some scene called for them."""
        wanted = frozenset(names)
        return cls._where(lambda feature: 0 if feature.name in wanted else None)

    def with_every(self) -> Features:
        """The same effects in a program that holds the code of all."""
        return replace(self, every=True)

    @classmethod
    def _where(cls, calls: Calls) -> Features:
        return cls(tuple((f.name, line) for f in FEATURES if (line := f.line(calls)) is not None))

    @property
    def active(self) -> tuple[Feature, ...]:
        """The features in the program, helpers included, in its order: those that are called for, or every one."""
        if self.every:
            return FEATURES
        names = {name for name, _ in self.lines}
        return tuple(f for f in FEATURES if f.name in names)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects in the program, helpers left out."""
        return tuple(f.name for f in self.active if f.name not in HELPERS)

    @property
    def switches(self) -> tuple[Feature, ...]:
        """The features that are switched on and off while the program runs."""
        return tuple(f for f in FEATURES if f.switch) if self.every else ()

    def idle(self, feature: Feature) -> bool:
        """The feature is in the program and switched off, so that what it is given is never looked at."""
        return feature in self.switches and feature.name not in dict(self.lines)

    @property
    def ray_kinds(self) -> tuple[str, ...]:
        """The kinds of rays that exist at all; the eye's first."""
        return tuple(dict.fromkeys(("primary", *(kind for f in self.active for kind in f.rays))))
