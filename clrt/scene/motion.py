"""The words `move` and `shutter` together: what moves while the picture is taken, and what cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clrt.scene.faults import Faults
from clrt.scene.instances import object_at
from clrt.scene.model import FloatArray, MeshObject, Scene
from clrt.scene.placed import placed_boxes, placements
from clrt.scene.text import Declarations
from clrt.scene.words import WordCall
from clrt.scene.words.eye import MOTION

Vector = tuple[float, float, float]


def _motion(call: WordCall) -> Vector:
    x, y, z = (call.number(f"{axis} of {MOTION}") for axis in "xyz")
    return x, y, z


def with_motion(scene: Scene, found: Declarations, faults: Faults) -> Scene:
    """The scene with what its `move` lines say; faults are noted.

    found : the lines of a text that was not split, or of one without O lines, all of whose triangles move together then
    """
    calls = [c for c in found.words if c.name == "move"]
    if not calls:
        return _warned(scene, "the shutter has no effect, since nothing moves; add a move line") if scene.shutter else scene
    if scene.shutter is None:
        faults.add(calls[0].line, calls[0].column, 'move needs a time for the picture; add a line such as "shutter 0 1"')
        return scene
    scene = _with_moving_objects(scene, [c for c in calls if c.text("of") == "object"], found, faults)
    eye = [c for c in calls if c.text("of") == "eye"]
    for call in eye[1:]:
        faults.add(call.line, call.column, f"a second move of the eye; the first is line {eye[0].line}, remove one of the two")
    if eye and scene.shutter is not None:
        scene = replace(scene, shutter=replace(scene.shutter, eye_motion=_motion(eye[0])))
    _check_glass(scene, eye, found, faults)
    return scene


def _with_moving_objects(scene: Scene, calls: list[WordCall], found: Declarations, faults: Faults) -> Scene:
    objects, lines = list(scene.objects), dict[int, int]()
    whole = not len(found.get("O", 0).lines)
    for call in calls:
        at = object_at(found, call.line)
        if at is None:
            what = "move moves triangles, and there are none (spheres do not move); put it among the T lines that the next O closes"
            faults.add(call.line, call.column, what)
        elif at in lines:
            faults.add(call.line, call.column, f"a second move of one object; the first is line {lines[at]}, or is an O missing between?")
        else:
            lines[at] = call.line
            for i in range(len(objects)) if whole else (at,):
                objects[i] = replace(objects[i], motion=_motion(call), motion_line=call.line)
                _check_shining(scene, objects[i], call, faults)
    scene = replace(scene, objects=tuple(objects))
    left = _spheres_among(found, calls)
    many = f"{len(left)} spheres do not" if len(left) > 1 else "a sphere does not"
    return _warned(scene, f"line {left[0]}: {many} move with the triangles of the object") if left else scene


def _check_shining(scene: Scene, item: MeshObject, call: WordCall, faults: Faults) -> None:
    if any(max(scene.materials[i].emission) > 0.0 for i in item.used_materials):
        faults.add(call.line, call.column, f"{item.name} sends out light (arealight), and lights do not move; close its parts with O lines")


def _spheres_among(found: Declarations, calls: list[WordCall]) -> list[int]:
    """Lines of the spheres that stand between the O lines around a `move`."""
    closing, spheres = found.get("O", 0).lines, found.get("S", 4).lines
    moving = np.searchsorted(closing, [c.line for c in calls])
    return [int(line) for line in spheres[np.isin(np.searchsorted(closing, spheres), moving)]]


def _warned(scene: Scene, warning: str) -> Scene:
    return replace(scene, warnings=(*scene.warnings, warning))


def _check_glass(scene: Scene, eye: list[WordCall], found: Declarations, faults: Faults) -> None:
    """What the eye is inside of is asked once a picture: it must stay outside of all glass that passes it."""
    line = next((line for line in _passing(scene) if line >= 0), None)
    if line is None:
        return
    call = next((c for c in found.words if c.name == "move" and c.line == line), eye[0] if eye else None)
    if call is not None:
        what = "the eye and something that light passes through may meet while the shutter is open; keep them apart, or let neither move"
        faults.add(call.line, call.column, what)


def _passing(scene: Scene) -> list[int]:
    """Lines of the motions (0: the eye's) by which the eye gets into the box of something that light passes through."""
    shutter, glass = scene.shutter, [_is_glass(scene, item) for item in scene.objects]
    balls = np.array([m.refract > 0.0 for m in scene.materials], np.bool_)[scene.spheres.material_ids]
    if shutter is None or scene.depth == 0 or not (any(glass) or balls.any()):
        return []
    start, glides = np.asarray(scene.camera.eye), np.asarray(shutter.eye_motion)
    passing = []
    for item, clear in zip(scene.objects, glass, strict=True):
        way = glides - np.asarray(item.motion)
        if clear and not item.hidden and way.any() and _enters(shutter.open, shutter.close, start, way, *item.box):
            passing.append(item.motion_line)
    placed = placements(replace(scene, objects=tuple(replace(o, hidden=True) for o in scene.objects)))
    boxes = zip(placed.object.tolist(), *placed_boxes(scene, placed), strict=True)
    for number, lo, hi in boxes:
        item = scene.objects[number]
        if glass[number] and (glides.any() or any(item.motion)) and _enters(shutter.open, shutter.close, start, glides, lo, hi):
            passing.append(item.motion_line)
    spheres = scene.spheres
    for center, radius in zip(spheres.centers[balls], spheres.radii[balls], strict=True):
        if glides.any() and _enters(shutter.open, shutter.close, start, glides, center - radius, center + radius):
            passing.append(0)
    return passing


def _is_glass(scene: Scene, item: MeshObject) -> bool:
    return any(scene.materials[i].refract > 0.0 for i in item.used_materials)


def _enters(first: float, last: float, start: FloatArray, way: FloatArray, lo: FloatArray, hi: FloatArray) -> bool:
    """Whether start + time way is in the box at a time from first to last."""
    for axis in range(3):
        if way[axis] == 0.0:
            if not lo[axis] <= start[axis] <= hi[axis]:
                return False
            continue
        ends = sorted(((lo[axis] - start[axis]) / way[axis], (hi[axis] - start[axis]) / way[axis]))
        first, last = max(first, ends[0]), min(last, ends[1])
    return bool(first <= last)
