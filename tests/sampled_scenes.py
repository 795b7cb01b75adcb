"""Small scenes of sampled effects, alone and together, built without the scene reader."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from reference_scenes import box, glass, globe, matte, mesh, mirror, plane_y, quad, scene, spheres

from clrt.scene.model import Environment, Fog, Indirect, Lens, Material, MeshObject, PointLight, Scene, Shutter

SIZE = (12, 12)
FLOOR = Material((0.9, 0.6, 0.3), 0.1, 0.6, 0.4, 8.0)
RED, GREEN = replace(matte(diffuse=0.7), color=(1.0, 0.3, 0.2)), replace(matte(diffuse=0.7), color=(0.3, 1.0, 0.2))


def lamp(r: float, g: float, b: float, of: Material | None = None) -> Material:
    return replace(of or Material((1.0, 1.0, 1.0), 0.0, 0.0, 0.0, 1.0), emission=(r, g, b), emission_line=1)


def rough(material: Material, gloss: float) -> Material:
    return replace(material, gloss=gloss, gloss_line=1)


def metal_rough(color: tuple[float, float, float], metallic: float, roughness: float) -> Material:
    return Material(color, 0.0, 0.0, 0.0, 1.0, metal_rough=True, metallic=metallic, roughness=roughness, metal_rough_line=1)


def objects(*parts: tuple[np.ndarray, int]) -> list[MeshObject]:
    """One object a part: triangles and their material."""
    first, made = 0, []
    for vertices, material in parts:
        made.append(mesh(vertices, first, material))
        first += len(vertices)
    return made


def ceiling(y: float = 2.0, half: float = 1.0) -> np.ndarray:
    return quad((-half, y, -half), (half, y, -half), (half, y, half), (-half, y, half))


def still_life(
    materials: list[Material], thing: int = 0, ball: int = 2, lights: list | None = None, height: float = -0.5, **keys: object
) -> Scene:
    """A floor (material 0), a square above it (material 1), a box (material `thing`) and a ball (material `ball`)."""
    parts = objects((plane_y(-1.0), 0), (ceiling(), 1), (box((-0.9, -0.9, -0.4), (-0.1, 0.1, 0.4)), thing))
    s = scene(parts, materials, lights, spheres((0.7, height, 0.0, 0.5, ball)), eye=(0.2, 0.4, -4), view=(0, -0.12, 1), fov=45.0,
              size=SIZE)  # fmt: skip
    return replace(s, samples_line=1, **keys)  # type: ignore[arg-type]


def room(materials: list[Material], **keys: object) -> Scene:
    """An open room: floor, back wall and ceiling (material 0), left and right walls (1, 2), a lamp (3) and a ball (4)."""
    walls = [quad((-2, -1, -2), (2, -1, -2), (2, -1, 2), (-2, -1, 2)), quad((-2, -1, 2), (2, -1, 2), (2, 2, 2), (-2, 2, 2)),
             quad((-2, 2, -2), (2, 2, -2), (2, 2, 2), (-2, 2, 2))]  # fmt: skip
    sides = [quad((x, -1, -2), (x, -1, 2), (x, 2, 2), (x, 2, -2)) for x in (-2.0, 2.0)]
    parts = objects((np.concatenate(walls), 0), (sides[0], 1), (sides[1], 2), (ceiling(1.6, 0.6), 3))
    s = scene(parts, materials, None, spheres((0.5, -0.4, 0.5, 0.6, 4)), eye=(0, 0.4, -5), view=(0, 0, 1), fov=40.0, size=SIZE, depth=4)
    return replace(s, samples_line=1, indirect=Indirect(line=1), **keys)  # type: ignore[arg-type]


def sky() -> Environment:
    """Grey and blue, with a bright patch above to the left."""
    radiance = np.full((6, 12, 3), 0.4) * np.linspace(1.5, 0.3, 6)[:, None, None]
    radiance[:3, :, 2] *= 1.5
    radiance[:3, 2:5] = (3.0, 2.5, 2.0)
    return Environment(radiance, rotation=0.4, line=1)


def many() -> dict[str, Scene]:
    """Name -> scene; the names are those of the effects."""
    light = lamp(4.0, 3.0, 2.0)
    ball_lamp = lamp(5.0, 6.0, 7.0, matte(diffuse=0.3))
    shine = rough(replace(mirror(0.6), ambient=0.05), 0.6)
    clear = replace(glass(1.5, 0.9), gloss_line=1, gloss=0.5)
    return {
        "area": still_life([FLOOR, light, matte(diffuse=0.8)]),
        "area of a ball": still_life([FLOOR, matte(diffuse=0.5), ball_lamp], height=0.3),
        "area, mirror, glass, point": still_life([replace(FLOOR, reflect=0.3), light, glass(1.4, 0.8, 0.1)], lights=[(3, 4, -3)]),
        "indirect": room([matte(diffuse=0.75), RED, GREEN, light, FLOOR]),
        "indirect, mirror": room([matte(diffuse=0.75), RED, GREEN, light, mirror(0.8)], background=(0.2, 0.3, 0.5)),
        "environment": still_life([FLOOR, matte(diffuse=0.5), matte(diffuse=0.8)], environment=sky()),
        "environment, indirect": still_life([FLOOR, matte(diffuse=0.7), mirror(0.8)], environment=sky(), indirect=Indirect(line=1)),
        "environment, area": still_life([FLOOR, light, matte(diffuse=0.8)], environment=sky(), background=(9.0, 9.0, 9.0)),
        "gloss": still_life([FLOOR, matte(diffuse=0.7), shine], thing=2, lights=[(3, 4, -3)], background=(0.3, 0.4, 0.6)),
        "gloss, area": still_life([shine, light, matte(diffuse=0.8)]),
        "gloss, environment, indirect": still_life([shine, matte(diffuse=0.7), FLOOR], environment=sky(), indirect=Indirect(line=1)),
        "gloss, area, last depth": still_life([shine, light, matte(diffuse=0.8)], thing=2, depth=1),
        "gloss of glass": still_life([FLOOR, light, clear], lights=[(3, 4, -3)], background=(0.3, 0.4, 0.6)),
        "gloss of glass, fresnel": still_life([FLOOR, light, replace(clear, fresnel=True, fresnel_line=1)], background=(0.3, 0.4, 0.6)),
        "metal-rough": still_life([metal_rough((0.8, 0.6, 0.3), 0.0, 0.6), light, metal_rough((1.0, 0.8, 0.4), 1.0, 0.5)],
                                  lights=[(3, 4, -3)], environment=sky()),
        "metal-rough, indirect": still_life([metal_rough((0.8, 0.6, 0.3), 0.3, 0.7), light, metal_rough((1.0, 0.8, 0.4), 0.0, 0.4)],
                                            environment=sky(), indirect=Indirect(line=1)),
        "opacity, area": still_life([FLOOR, light, replace(matte(diffuse=0.8), opacity=0.4, opacity_line=1)], thing=2,
                                    indirect=Indirect(line=1)),
        "smooth, area": smooth_ball(),
        "fog, area, point": still_life([FLOOR, light, mirror(0.7)], lights=[(3, 4, -3)], fog=Fog(0.15, (0.9, 0.8, 0.7), 0.4, line=1)),
        "fog, area of a ball, indirect": still_life([FLOOR, matte(), ball_lamp], height=0.3, fog=Fog(0.1, line=1),
                                                    indirect=Indirect(line=1)),
        "fog, gloss, opacity, falloff": still_life(
            [shine, matte(), replace(matte(diffuse=0.8), opacity=0.4, opacity_line=1)], thing=2,
            lights=[PointLight((0.5, 1.2, -1.0), (3.0, 3.0, 3.0), falloff=True, line=1)], fog=Fog(0.2, (0.9, 0.9, 0.9), -0.3, line=1)),
        "lens": still_life([FLOOR, light, mirror(0.7)], lights=[(3, 4, -3)], lens=Lens(0.15, 3.0, line=1)),
        "motion": moving([FLOOR, light, matte(diffuse=0.8)], Shutter(0.0, 1.0, line=1), lights=[(3, 4, -3)]),
        "motion of the eye, mirror, environment": moving([FLOOR, replace(light, emission=(0.0, 0.0, 0.0)), mirror(0.7)],
                                                         Shutter(0.2, 0.9, (0.3, 0.1, 0.0), line=1), environment=sky()),
    }  # fmt: skip


def moving(materials: list[Material], shutter: Shutter, **keys: object) -> Scene:
    """The still life with its box on its way."""
    s = still_life(materials, shutter=shutter, **keys)  # type: ignore[arg-type]
    box_moves = replace(s.objects[2], motion=(0.5, 0.6, -0.4), motion_line=1)
    return replace(s, objects=(*s.objects[:2], box_moves))


def smooth_ball() -> Scene:
    """A coarse ball with smooth normals under a lamp."""
    ball = globe(9, 0.8, (0.0, -0.1, 0.0))
    parts = objects((plane_y(-1.0), 0), (ceiling(), 1), (ball, 2))
    parts[2] = replace(parts[2], vertex_normals=(ball - [0.0, -0.1, 0.0]) / 0.8, line=1)
    s = scene(parts, [FLOOR, lamp(4.0, 3.0, 2.0), matte(diffuse=0.8)], eye=(0.2, 0.4, -4), view=(0, -0.1, 1), fov=40.0, size=SIZE)
    return replace(s, samples_line=1)
