"""The checked scene: plain frozen data between the scene text and everything that renders it.

Axes are left-handed: x to the right, y up, +z into the picture. All arrays are float64 in scene units and are
never written to after construction. A `Scene` holds no device data and imports nothing of the renderer.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from clrt.scene.boxes import box_of, boxes_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]


def numbers_in(ids: IntArray) -> list[int]:
    """The numbers that occur in ids (n,), each at least -1, in ascending order. In one go, where np.unique would sort."""
    found: list[int] = (np.flatnonzero(np.bincount(ids + 1)) - 1).tolist()
    return found


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole eye and the rectangle it looks through.

    eye : (3,) float64, scene units
    corners : (4, 3) float64, vectors from the eye to the image corners UL, UR, LL, LR; bilinear in between
    width, height : pixels

    The ray of pixel (column i, row j), row 0 at the top, goes through s = (i + 0.5) / width, t = (j + 0.5) / height:
    direction = (1-s)(1-t) UL + s(1-t) UR + (1-s)t LL + st LR, then normalised.
    """

    eye: FloatArray
    corners: FloatArray
    width: int
    height: int

    @classmethod
    def from_view(
        cls, eye: FloatArray, view: FloatArray, up: FloatArray, fov_deg: float, width: int, height: int
    ) -> Camera:
        """The camera of the lines E, V, F, R: `fov_deg` is the full horizontal field of view.

        Raises ValueError where `view` is zero or parallel to `up`.
        """
        forward = np.asarray(view, np.float64)
        length = np.linalg.norm(forward)
        right = np.cross(np.asarray(up, np.float64), forward)
        right_length = np.linalg.norm(right)
        if not length > 0.0 or not right_length > 1e-12 * length * np.linalg.norm(up):
            raise ValueError("the view direction is zero or parallel to the up vector")
        forward = forward / length
        right = right / right_length
        true_up = np.cross(forward, right)
        half_x = np.tan(np.radians(fov_deg) / 2.0)
        half_y = half_x * height / width
        corners = np.array([forward + sx * half_x * right + sy * half_y * true_up
                            for sy in (1.0, -1.0) for sx in (-1.0, 1.0)])  # fmt: skip
        return cls(np.asarray(eye, np.float64), corners, width, height)

    def with_size(self, width: int, height: int) -> Camera:
        """The same view at another size: the horizontal extent and the pixels' shape stay, the vertical extent follows."""
        scale = (height / width) / (self.height / self.width)
        top, bottom = self.corners[:2], self.corners[2:]
        middle, half = (top + bottom) / 2.0, (top - bottom) / 2.0 * scale
        return replace(self, corners=np.concatenate([middle + half, middle - half]), width=width, height=height)

    def directions(self) -> FloatArray:
        """Unit ray directions, (height, width, 3) float64."""
        s = ((np.arange(self.width) + 0.5) / self.width)[None, :, None]
        t = ((np.arange(self.height) + 0.5) / self.height)[:, None, None]
        ul, ur, ll, lr = self.corners
        d = (1 - s) * (1 - t) * ul + s * (1 - t) * ur + (1 - s) * t * ll + s * t * lr
        return np.asarray(d / np.linalg.norm(d, axis=-1, keepdims=True))


@dataclass(frozen=True)
class Material:
    """The homework's material. `line` is where the scene text defines it (0: not from a text).

    fresnel : Fresnel's equations split `refract` between the reflected and the refracted ray; `reflect` is 0 then
    absorb : how much of red, green, blue the medium behind the surface swallows a scene unit: exp(-absorb * length) is left
    fresnel_line, absorb_line : the lines that say so (0: none)
    texture : index into Scene.textures of the picture that multiplies the colour, -1 for none
    emission : the radiance that the surface sends out by itself, on both sides; `emission_line` (arealight) asks for it
    gloss : roughness of mirror and glass, 0 (polished) to 1; `gloss_line` asks for it
    opacity : the part of light that the surface keeps from passing straight through; `opacity_line` asks for it
    opacity_of : what it holds for, "all", or "shadow" alone: light from the lights
    normal_map : index into Scene.textures of the picture that tilts the normals, -1 for none; `normal_strength` scales the tilt
    metal_rough : the material is a metal-rough one as in glTF 2.0, of base colour `color`; `metallic` and `roughness` from 0 to 1;
        `metal_rough_line` asks for it
    metal_rough_map, emission_map : indices into Scene.textures, -1 for none: roughness in green and metallic in blue; colour of emission
    alpha : the alpha of the picture `texture` multiplies the opacity
    alpha_cutoff : a picture's alpha below this is a hole, at or above it is none; 0: alpha is the surface's own opacity
    """

    color: tuple[float, float, float]
    ambient: float
    diffuse: float
    specular: float
    exponent: float
    reflect: float = 0.0
    refract: float = 0.0
    ior: float = 1.0
    line: int = 0
    fresnel: bool = False
    fresnel_line: int = 0
    absorb: tuple[float, float, float] = (0.0, 0.0, 0.0)
    absorb_line: int = 0
    texture: int = -1
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emission_line: int = 0
    gloss: float = 0.0
    gloss_line: int = 0
    opacity: float = 1.0
    opacity_line: int = 0
    opacity_of: str = "all"
    normal_map: int = -1
    normal_strength: float = 1.0
    metal_rough: bool = False
    metallic: float = 0.0
    roughness: float = 0.0
    metal_rough_line: int = 0
    metal_rough_map: int = -1
    emission_map: int = -1
    alpha_cutoff: float = 0.0
    alpha: bool = False

    @property
    def alpha_texture(self) -> int:
        """Index into Scene.textures of the picture whose alpha counts, -1 for none."""
        return self.texture if self.alpha else -1

    @property
    def emission_drawn(self) -> bool:
        """Whether light samples know of its light: not where a picture shapes it, whose rays alone find it."""
        return max(self.emission) > 0.0 and self.emission_map < 0 and self.alpha_texture < 0

    @property
    def translucent(self) -> bool:
        """Whether some of the light may pass straight through."""
        return self.opacity < 1.0 or self.alpha_texture >= 0

    @property
    def opacity_seen(self) -> bool:
        """Whether its opacity holds for what is seen, not for shadows alone."""
        return self.opacity_of == "all"

    def without_phong(self) -> Material:
        """The material without the parts that a metal-rough one does not have: Ka, Kd, Ks, Reflect, Refract and what belongs to them."""
        return replace(self, ambient=0.0, diffuse=0.0, specular=0.0, reflect=0.0, refract=0.0, gloss=0.0, fresnel=False)


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture as its file has it: texels (h, w, 4) uint8 or uint16, red, green, blue, alpha; row 0 at the top."""

    texels: NDArray[np.uint8] | NDArray[np.uint16]
    name: str = "picture"


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture and how it is looked up: u to the right, v up, 0 to 1 across the picture.

    wrap : beyond that, "repeat", "clamp" (the edge goes on) or "mirror" (every second copy is turned round)
    linear : bilinear between the middles of texels, else the texel that holds the point
    srgb : the colours are sRGB-encoded, else linear
    line : where the scene text calls for it (0: not from a text)
    """

    picture: Picture
    wrap: str = "repeat"
    linear: bool = True
    srgb: bool = True
    line: int = 0


@dataclass(frozen=True)
class PointLight:
    """A point that shines in all directions. `color` defaults to white. falloff : it is divided by the square of the distance."""

    position: tuple[float, float, float]
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    line: int = 0
    falloff: bool = False


@dataclass(frozen=True)
class SpotLight:
    """A point light with a cone, as of a lamp: full inside, less towards the edge, nothing outside.

    direction : unit, from the light into the cone, along its axis
    outer, inner : half-angles of the cone and of its bright part, radians, 0 <= inner <= outer; equal: a hard edge
    falloff : `color` is divided by the square of the distance
    """

    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    outer: float
    inner: float
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    line: int = 0
    falloff: bool = False


@dataclass(frozen=True)
class SunLight:
    """A light infinitely far away. direction : unit, towards the light."""

    direction: tuple[float, float, float]
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    line: int = 0


@dataclass(frozen=True, eq=False)
class Environment:
    """Light from infinitely far away, from all directions, as a picture by longitude and latitude; in place of the background.

    radiance : (h, w, 3) float64 linear, >= 0, row 0 at the top (+y); constant within a texel
    rotation : radians about the y axis; at 0 the middle column lies towards +z, columns run to the right of one who looks there
    """

    radiance: FloatArray
    rotation: float = 0.0
    name: str = "environment"
    line: int = 0


@dataclass(frozen=True)
class Lens:
    """A thin lens in place of the pinhole. radius : of its disc, scene units; focus : distance of the sharp plane, along the view."""

    radius: float
    focus: float
    line: int = 0


@dataclass(frozen=True)
class Shutter:
    """When the picture is taken: times open <= close; what moves does so by its motion a unit of time. `eye_motion` : the eye's."""

    open: float
    close: float
    eye_motion: tuple[float, float, float] = (0.0, 0.0, 0.0)
    line: int = 0


@dataclass(frozen=True)
class Fog:
    """A medium that fills all space. density : what it takes from a ray, per scene unit; albedo : the part of that which it scatters;
    asymmetry : -1 (back) to 1 (forward), of Henyey and Greenstein's phase function."""

    density: float
    albedo: tuple[float, float, float] = (1.0, 1.0, 1.0)
    asymmetry: float = 0.0
    line: int = 0


@dataclass(frozen=True)
class Indirect:
    """Light from surface to surface. clamp : greatest radiance that one path may bring after its first hit, inf: none is cut (unbiased)."""

    clamp: float = float("inf")
    line: int = 0


@dataclass(frozen=True, eq=False)
class MeshObject:
    """Triangles that share one kd-tree.

    vertices : (n, 3, 3) float64, scene units; triangle, corner, axis. The numbers as given, never rounded.
    normals : (n, 3) float64, unit shading normal of each face (two-sided: the side is chosen at the hit);
        zero for a triangle of exactly zero area, which is never hit
    vertex_normals : (n, 3, 3) float64 unit normals a corner, or None where no triangle of the object is smooth
    material_ids : (n,) int32 into Scene.materials
    first_prim : primitive id of the object's triangle 0; ids run through the scene in the order of its text
    name : for people, such as "object 2"
    line : the line that calls for smooth normals (0: none)
    uvs : (n, 3, 2) float64 texture coordinates a corner, or None where no triangle of the scene has any
    motion : scene units that the object moves a unit of time; `motion_line` asks for it
    hidden : the object itself is not there, only its instances are
    """

    vertices: FloatArray
    normals: FloatArray
    material_ids: IntArray
    first_prim: int
    vertex_normals: FloatArray | None = None
    name: str = "object"
    line: int = 0
    uvs: FloatArray | None = None
    motion: tuple[float, float, float] = (0.0, 0.0, 0.0)
    motion_line: int = 0
    hidden: bool = False

    def __len__(self) -> int:
        return len(self.vertices)

    @cached_property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """The least and the greatest coordinates (3,) of its own triangles; zeros where there are none."""
        return box_of(self.vertices)

    @cached_property
    def used_materials(self) -> list[int]:
        """The materials of its triangles, in ascending order."""
        return numbers_in(self.material_ids)


@dataclass(frozen=True, eq=False)
class Spheres:
    """All spheres of a scene: centers (k, 3) float64, radii (k,) float64 > 0, material_ids (k,) int32.

    Sphere k has the primitive id (number of triangles of the scene) + k. `line`: the first S line (0: none).
    """

    centers: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    radii: FloatArray = field(default_factory=lambda: np.zeros(0))
    material_ids: IntArray = field(default_factory=lambda: np.zeros(0, np.int32))
    line: int = 0

    def __len__(self) -> int:
        return len(self.radii)


@dataclass(frozen=True, eq=False)
class Instance:
    """An object once more, elsewhere.

    object : index into Scene.objects
    world_from_object : (3, 4) float64, the point p of the object lies at world_from_object[:, :3] @ p + world_from_object[:, 3];
        of positive determinant; where the object has normals at corners, turns, shifts and one scale for all axes alone
    line : where the scene text asks for it (0: not from a text)
    """

    object: int
    world_from_object: FloatArray
    line: int = 0
    name: str = "instance"


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything a picture depends on. Built by `clrt.scene.build` from a text, or by hand.

    `depth` is the greatest number of reflections and refractions in a row (0: none are followed).
    `samples` is how many rays go through each pixel from the eye, 1: one, through its centre; `samples_line` asks for them (0: no text).
    `seed` is that of the random numbers, 0 to 2^32 - 1.
    `warnings` are counted facts worth telling, one line each, such as degenerate triangles.
    """

    camera: Camera
    lights: tuple[PointLight, ...]
    materials: tuple[Material, ...]
    objects: tuple[MeshObject, ...]
    spheres: Spheres = field(default_factory=Spheres)
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    depth: int = 5
    source: str = "<scene>"
    warnings: tuple[str, ...] = ()
    textures: tuple[Texture, ...] = ()
    samples: int = 1
    samples_line: int = 0
    seed: int = 0
    spots: tuple[SpotLight, ...] = ()
    suns: tuple[SunLight, ...] = ()
    environment: Environment | None = None
    lens: Lens | None = None
    shutter: Shutter | None = None
    fog: Fog | None = None
    indirect: Indirect | None = None
    instances: tuple[Instance, ...] = ()

    @cached_property
    def boxes(self) -> tuple[FloatArray, FloatArray]:
        """(objects, 3): the least and the greatest coordinates of each object's own triangles; zeros where there are none."""
        return boxes_of(self.objects)

    @cached_property
    def triangle_count(self) -> int:
        return sum(len(o) for o in self.objects)

    @property
    def lights_with_position(self) -> tuple[PointLight | SpotLight, ...]:
        """The lights whose rays share a point: point lights, then spots."""
        return (*self.lights, *self.spots)

    def with_size(self, width: int, height: int) -> Scene:
        """The same scene seen at another resolution (see Camera.with_size)."""
        return replace(self, camera=self.camera.with_size(width, height))
