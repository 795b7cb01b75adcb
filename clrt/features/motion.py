"""Effects of time: objects and an eye that move while the shutter is open."""

from __future__ import annotations

from clrt.features.feature import REAL, Feature, Joint
from clrt.scene.model import Scene


def _object_caller(scene: Scene) -> int | None:
    if scene.shutter is None:
        return None
    lines = [o.motion_line for i, o in enumerate(scene.objects) if any(o.motion) and (not o.hidden or _placed(scene, i))]
    return min(lines, default=None)


def _placed(scene: Scene, number: int) -> bool:
    return any(instance.object == number for instance in scene.instances)


def _eye_caller(scene: Scene) -> int | None:
    return scene.shutter.line if scene.shutter is not None and any(scene.shutter.eye_motion) else None


MOTION = Feature("motion", _object_caller, "motion.cl", early=True, sampled=True)
EYE_MOTION = Feature(
    "moving eye",
    _eye_caller,
    "motion_eye.cl",
    frame=(("eye_motion", REAL, (3,), lambda scene: scene.shutter.eye_motion if scene.shutter else (0.0, 0.0, 0.0)),),
    sampled=True,
)
SHUTTER = Feature(
    "shutter",
    Joint((MOTION, EYE_MOTION)),
    "shutter.cl",
    frame=(
        ("shutter_open", REAL, lambda scene: scene.shutter.open if scene.shutter else 0.0),
        ("shutter_span", REAL, lambda scene: scene.shutter.close - scene.shutter.open if scene.shutter else 0.0),
    ),
    helper=True,
)
