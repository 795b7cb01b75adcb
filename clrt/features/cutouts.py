"""Light that passes straight through: opacity, alpha of pictures, their shadows. And what pictures do besides colour: normal maps."""

from __future__ import annotations

import numpy as np

from clrt.features import lamps, placed, sampled, shapes, surfaces, surroundings
from clrt.features.feature import REAL, Caller, Feature, Joint, used_materials
from clrt.scene.model import Material, Scene, numbers_in


def _opacity_line(scene: Scene, material: Material) -> int:
    return material.opacity_line if material.opacity < 1.0 else scene.textures[material.alpha_texture].line


def _opacity_caller(scene: Scene) -> int | None:
    return min((_opacity_line(scene, m) for m in used_materials(scene) if m.translucent), default=None)


def _seen_caller(scene: Scene) -> int | None:
    return min((_opacity_line(scene, m) for m in used_materials(scene) if m.translucent and m.opacity_seen), default=None)


def _map_caller(attribute: str) -> Caller:
    """The first used material with a picture for `attribute`."""

    def called_by(scene: Scene) -> int | None:
        numbers = (getattr(m, attribute) for m in used_materials(scene))
        return min((scene.textures[i].line for i in numbers if i >= 0), default=None)

    return called_by


def _metal_map_caller(scene: Scene) -> int | None:
    numbers = (m.metal_rough_map for m in used_materials(scene) if m.metal_rough)
    return min((scene.textures[i].line for i in numbers if i >= 0), default=None)


def _glow_map_caller(scene: Scene) -> int | None:
    numbers = (m.emission_map for m in used_materials(scene) if max(m.emission) > 0.0)
    return min((scene.textures[i].line for i in numbers if i >= 0), default=None)


def _round_picture_caller(scene: Scene) -> int | None:
    """A picture on a round primitive."""
    used = [scene.materials[i] for i in numbers_in(scene.spheres.material_ids)]
    numbers = {i for m in used for i in (m.texture, m.normal_map, m.metal_rough_map, m.emission_map) if i >= 0}
    return min((scene.textures[i].line for i in numbers), default=None)


def _pane_caller(scene: Scene) -> int | None:
    return min((_opacity_line(scene, m) for m in used_materials(scene) if m.translucent and not m.opacity_seen), default=None)


#: surfaces that let light pass: how much
OPACITY = Feature("opacity", _opacity_caller, "opaque.cl", material=(("opacity", REAL),))
#: what calls for a part below: surfaces that do so for light alone
SHADOW_PANES = Feature("shadow panes", _pane_caller, "opaque.cl")
#: what is seen of them, and behind them
OPACITY_SEEN = Feature(
    "opacity seen", _seen_caller, "opacity.cl", material=(("opacity_seen", np.int32),), rays=("passed",), branches=1, needs=(OPACITY,),
    helper=True,
)  # fmt: skip
OPACITY_SHADOWS = Feature(
    "opacity shadows",
    Joint((OPACITY, Joint((lamps.SHADOWS, lamps.SUN_SHADOWS, sampled.AREA_SHADOWS, surroundings.ENVIRONMENT_SHADOWS))), every=True),
    "opacity_shadow.cl",
    helper=True,
)
OPACITY_PLACED = Feature("placed opacity", Joint((OPACITY_SHADOWS, placed.PLACED), every=True), "opacity_placed.cl", helper=True)
AFTER = Feature("hits in order", Joint((OPACITY_SHADOWS,)), "after.cl", helper=True)
OPACITY_SPHERE = Feature("round opacity", Joint((OPACITY, shapes.SPHERES), every=True), "opaque_sphere.cl", helper=True)
ALPHA = Feature(
    "alpha",
    _map_caller("alpha_texture"),
    "alpha.cl",
    material=(("alpha_texture", np.int32), ("alpha_cutoff", REAL)),
    needs=(OPACITY,),
    helper=True,
)
NORMAL_MAP = Feature(
    "normal map", _map_caller("normal_map"), "normalmap.cl", material=(("normal_map", np.int32), ("normal_strength", REAL))
)
NORMAL_GLOBE = Feature("round normal map", Joint((NORMAL_MAP, shapes.SPHERES), every=True), "normalmap_globe.cl", helper=True)
NORMAL_PLACED = Feature("placed normal map", Joint((NORMAL_MAP, placed.PLACED), every=True), "normalmap_placed.cl", helper=True)
_METAL_MAPS = Feature("metal maps", _metal_map_caller, "texture.cl")  #: what calls for pictures besides effects above
_GLOW_MAPS = Feature("glow maps", _glow_map_caller, "texture.cl", needs=(sampled.AREA_LIGHT,))  #: as well
PICTURES = Feature(
    "pictures",
    Joint((surfaces.TEXTURES, ALPHA, NORMAL_MAP, _METAL_MAPS, _GLOW_MAPS)),
    "texture.cl",
    parameters=(
        ("textures", "global const Texture *textures"),
        ("texels", "global const uchar *texels"),
        ("texel_values", "global const real *texel_values"),
        ("corner_uvs", "global const double *corner_uvs"),
    ),
    helper=True,
)
GLOW_MAP = Feature(
    "area light map", _glow_map_caller, "arealight_map.cl", material=(("emission_map", np.int32),), needs=(sampled.AREA_LIGHT, PICTURES),
    helper=True,
)  # fmt: skip
GLOBE = Feature("globe", _round_picture_caller, "globe.cl", needs=(shapes.SPHERES, PICTURES), helper=True)
