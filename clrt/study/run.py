"""A whole study: part after part, each kept as soon as it is measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from clrt.device.context import open_device
from clrt.errors import ClrtError
from clrt.scene.model import Scene
from clrt.study import (
    measure_depth,
    measure_effects,
    measure_phases,
    measure_precision,
    measure_samples,
    measure_trees,
    store,
    verdict,
)
from clrt.study.header import finish, header
from clrt.study.plan import Plan
from clrt.study.reference import Reference, reference_of
from clrt.study.report import check_libraries
from clrt.study.report import write as write_report
from clrt.study.subject import Subject, Tell, open_subject


@dataclass(frozen=True)
class Step:
    """What is measured in one go. parts : keys of the JSON; weight : about its share of the time."""

    parts: tuple[str, ...]
    weight: float
    measure: Callable[[Subject, dict[str, Any]], dict[str, Any]]


def _samples(subject: Subject, study: dict[str, Any]) -> dict[str, Any]:
    return measure_samples.measure(subject, _key(study))


def _precision(subject: Subject, study: dict[str, Any]) -> dict[str, Any]:
    return {"precision": measure_precision.measure(subject, _reference(subject, study))}


def _depth(subject: Subject, study: dict[str, Any]) -> dict[str, Any]:
    return {"depth": measure_depth.measure(subject, _reference(subject, study))}


def _effects(subject: Subject, study: dict[str, Any]) -> dict[str, Any]:
    return {"effects": measure_effects.measure(subject)}


def _trees(subject: Subject, study: dict[str, Any]) -> dict[str, Any]:
    return {"trees": measure_trees.measure(subject)}


def _phases(subject: Subject, study: dict[str, Any]) -> dict[str, Any]:
    return {"phases": measure_phases.measure(subject, study["precision"])}


STEPS = (
    Step(("samples", "bias"), 30.0, _samples), Step(("precision",), 30.0, _precision), Step(("depth",), 10.0, _depth),
    Step(("effects",), 10.0, _effects), Step(("trees",), 12.0, _trees), Step(("phases",), 8.0, _phases),
)  # fmt: skip


def _key(study: dict[str, Any]) -> dict[str, Any]:
    """What tells a reference of this study from that of another one."""
    head = study["header"]
    return {key: head[key] for key in ("scene_sha256", "clrt", "size", "seeds")} | {"device": head["opencl"]["device"]}


def _reference(subject: Subject, study: dict[str, Any]) -> Reference:
    """The reference that the part `samples` rendered."""
    return reference_of(subject, study["samples"]["reference"]["samples"], _key(study))


def check_folder(folder: Path) -> None:
    """Raises ClrtError where a study cannot be kept there; makes nothing."""
    if folder.exists() and not folder.is_dir():
        raise ClrtError(f"{folder}: this is a file; a study is kept in a folder")
    if not folder.parent.is_dir():
        raise ClrtError(f"{folder}: there is no folder {folder.parent}")


def run_study(
    path: Path, read: Callable[[], Scene], folder: Path, plan: Plan, *, size: tuple[int, int] | None = None, device: str | None = None,
    resume: bool = False, tell: Tell = lambda phase, fraction: None,
) -> dict[str, Any]:  # fmt: skip
    """Measures everything of the scene into folder/study.json, and lets the report be written; returns what the JSON holds.

    read : gives the scene of `path`; size : (width, height) instead of the plan's; resume : go on with what `folder` holds
    tell : told what is under way and the part of the whole that is done

    Raises SceneError, ClrtError, DeviceError, LimitError, OSError; before anything is written where the arguments are at fault.
    """
    check_folder(folder)
    check_libraries()
    subject = open_subject(path, read, open_device(device), plan, folder, size, tell)
    head = header(subject)
    study = store.resumed(folder, head) if resume else store.empty(head)
    folder.mkdir(exist_ok=True)
    total, done = sum(step.weight for step in STEPS), 0.0
    for step in STEPS:
        if any(study[part] is None for part in step.parts):
            within = replace(subject, tell=_share(tell, done / total, step.weight / total))
            study = {**study, **step.measure(within, study)}
            store.save(study, folder)
        done += step.weight
    study = {**study, "header": finish(study["header"]), "verdict": verdict.sentences(study)}
    store.save(study, folder)
    write_report(folder)
    return study


def _share(tell: Tell, done: float, share: float) -> Tell:
    return lambda phase, fraction: tell(phase, done + share * fraction)
