"""A model file as a whole scene: its own cameras and lights, or a view and a sky for one that has none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from clrt.errors import SceneError
from clrt.scene.model import Camera, FloatArray, Instance, Material, MeshObject, Scene
from clrt.scene.models.gltf import read_gltf
from clrt.scene.models.gltf_materials import default_material
from clrt.scene.models.model_file import Model, ModelError, View
from clrt.scene.models.place import SCENE_FROM_FILE, Placing, flat_warnings, placed
from clrt.scene.picture import Folders
from clrt.scene.sky import default_sky
from clrt.scene.triangles import unit

LONGER_SIDE = 1024  #: pixels of a picture whose file says no size
_SAMPLES = 64  #: rays through a pixel: metal-rough surfaces, emission and the sky are sampled
_ASPECT = 4.0 / 3.0  #: of a picture whose file says none
_FOV = 45.0  #: degrees from left to right, where there is no camera
_FILL = 0.85  #: of the picture that the model then spans
_MOST_POINTS = 1 << 22  #: of instances, that the view is fitted to one by one
_VIEW = (-0.45, -0.35, 1.0)  #: from the front, the right and a little above


def load_model_scene(path: Path, *, camera: int | None = None, allow_paths: Sequence[Path] = ()) -> Scene:
    """The scene of a glTF or GLB file. camera : which of its cameras, from 1; the first without it.

    Raises SceneError with one `file: error: ...` line, with line and column where the file's text is broken.
    """
    try:
        data = path.read_bytes()
    except OSError as problem:
        raise SceneError(f"{path}: error: cannot be read: {problem.strerror or problem}") from None
    try:
        return scene_of(read_gltf(data, Folders(path.parent, allow_paths)), str(path), camera)
    except ModelError as problem:
        place_in_file = "".join(f":{number}" for number in (problem.line, problem.column) if number)
        raise SceneError(f"{path}{place_in_file}: error: {problem}") from None


def scene_of(model: Model, source: str, camera: int | None = None) -> Scene:
    """The model in front of a camera. Raises ModelError."""
    warnings = list(model.warnings)
    objects, instances = placed(model, Placing(SCENE_FROM_FILE, material=len(model.materials)))
    warnings += flat_warnings(objects)
    materials: tuple[Material, ...] = (*model.materials, default_material())
    view = _chosen(model, camera, warnings)
    seen = framed(objects, instances) if view is None else camera_of(view)
    scene = Scene(
        seen, tuple(replace(light, position=_flip(light.position)) for light in model.lights), materials, objects, instances=instances,
        source=source, textures=model.textures, samples=_SAMPLES,
        spots=tuple(replace(s, position=_flip(s.position), direction=_flip(s.direction)) for s in model.spots),
        suns=tuple(replace(s, direction=_flip(s.direction)) for s in model.suns),
    )  # fmt: skip
    if not (model.lights or model.spots or model.suns):
        warnings.append("there is no light in the file; an overcast sky lights it")
        scene = replace(scene, environment=default_sky())
    return replace(scene, warnings=tuple(warnings))


def _flip(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    return vector[0], vector[1], 0.0 - vector[2]


def _chosen(model: Model, camera: int | None, warnings: list[str]) -> View | None:
    """The camera to look through; None for a view that frames the model."""
    views = model.views
    if camera is None:
        usable = [view for view in views if view is not None]
        if not usable:
            warnings.append(f"there is no {'perspective ' if views else ''}camera in the file; the view frames the model")
        return usable[0] if usable else None
    if not 1 <= camera <= len(views):
        there = f"they are {', '.join(_listed(model))}" if views else "it has none; leave out --camera, and the view frames the model"
        raise ModelError(f"there is no camera {camera} in the file; {there}")
    chosen = views[camera - 1]
    if chosen is None:
        raise ModelError(f"camera {camera} is orthographic, which is not supported; leave out --camera, or choose another")
    return chosen


def _listed(model: Model) -> list[str]:
    return [f'{i} "{view.name}"' if view else f"{i} (orthographic)" for i, view in enumerate(model.views, 1)]


def camera_of(view: View) -> Camera:
    """The scene's camera: the file's vertical angle, at 1024 pixels along the longer side."""
    world = SCENE_FROM_FILE @ view.world_from_camera
    aspect = view.aspect or _ASPECT
    width, height = _size(aspect)
    # From the pixels, not from the aspect, which they only come near to: the vertical angle stays exact.
    fov = 2.0 * math.degrees(math.atan(math.tan(view.yfov / 2.0) * width / height))
    try:
        return Camera.from_view(world[:3, 3], 0.0 - world[:3, 2], world[:3, 1], fov, width, height)
    except ValueError:
        raise ModelError(f'the camera "{view.name}" stands in a node without directions: its scale is zero') from None


def _size(aspect: float) -> tuple[int, int]:
    if aspect >= 1.0:
        return LONGER_SIDE, max(1, round(LONGER_SIDE / aspect))
    return max(1, round(LONGER_SIDE * aspect)), LONGER_SIDE


def framed(objects: Sequence[MeshObject], instances: Sequence[Instance] = ()) -> Camera:
    """A view from the front, the right and a little above that holds all vertices, 85% of it wide or high.

    With the eye at distance D from the middle of the box, along the view, a vertex that lies (x, y, z) from there as the eye sees it is
    within the picture if |x| <= k (D + z): so D is the greatest |x| / k - z, for x and y alike.
    """
    points = _seen_points(objects, instances)
    lo, hi = points.min(axis=0), points.max(axis=0)
    middle = lo / 2.0 + hi / 2.0
    forward = unit(np.array(_VIEW))
    right = unit(np.cross([0.0, 1.0, 0.0], forward))
    axes: FloatArray = np.stack([right, np.cross(forward, right), forward])
    seen = (points - middle) @ axes.T
    width, height = _size(_ASPECT)
    half = _FILL * math.tan(math.radians(_FOV) / 2.0)
    halves = np.array([half, half * height / width])
    distance = float((np.abs(seen[:, :2]) / halves - seen[:, 2:]).max()) or 1.0
    return Camera.from_view(middle - distance * forward, forward, np.array([0.0, 1.0, 0.0]), _FOV, width, height)


def _seen_points(objects: Sequence[MeshObject], instances: Sequence[Instance]) -> FloatArray:
    """(n, 3): all vertices; of instances with very many in all, the corners of their objects' boxes."""
    total = sum(3 * len(objects[i.object]) for i in instances)
    of_object = {i.object: objects[i.object].vertices.reshape(-1, 3) for i in instances}
    if total > _MOST_POINTS:
        of_object = {number: _box_corners(points) for number, points in of_object.items()}
    copies = [of_object[i.object] @ i.world_from_object[:, :3].T + i.world_from_object[:, 3] for i in instances]
    return np.concatenate([*(item.vertices.reshape(-1, 3) for item in objects if not item.hidden), *copies])


def _box_corners(points: FloatArray) -> FloatArray:
    """(8, 3) of the box around points (n, 3)."""
    ends = np.stack([points.min(axis=0), points.max(axis=0)])
    return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
