"""What is in a scene's program of the effects that it does not call for: counted in the composed text."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from clrt.bench.scenes import BenchScene, straight
from clrt.device.context import Device
from clrt.device.program import Shape, compose
from clrt.features import FEATURES, Feature, Features
from clrt.precision import DEFAULT, rung
from clrt.scene.model import Scene

_SHAPE = Shape(stack=32, depth=5)
_LINE = re.compile(r'#line \d+ "(.+)"$')
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)


def measure_programs(bench: BenchScene, device: Device) -> list[dict[str, Any]]:
    """A row a variant of the scene: effects, bytes of its program, bytes in it of absent effects, bytes with every effect there is."""
    plain = straight(bench.scene)
    variants = {bench.name: bench.scene, f"{bench.name}, no mirror": plain, f"{bench.name}, no light": replace(plain, lights=())}
    return [_row(name, scene, device) for name, scene in variants.items()]


def _row(name: str, scene: Scene, device: Device) -> dict[str, Any]:
    features = Features.of(scene)
    source, everything = (_source(f, device) for f in (features, features.with_every()))
    absent = [f for f in FEATURES if f not in features.active]
    return {
        "scene": name, "effects": list(features.effects), "bytes": len(source.encode()), "absent": [f.name for f in absent],
        "absent_bytes": absent_bytes(source, absent, features.active), "bytes_of_all_effects": len(everything.encode()),
    }  # fmt: skip


def _source(features: Features, device: Device) -> str:
    precision = rung(DEFAULT)
    return compose(features, precision, precision.lanes(device.info.lanes), _SHAPE)


def absent_bytes(source: str, absent: list[Feature], active: tuple[Feature, ...]) -> int:
    """Bytes of the lines of a composed program that belong to absent effects.

    A line belongs to an effect where it comes from the effect's file, by the line directives; or where, comments aside, it names a kernel
    argument or a member of a struct that the effect alone would add.
    """
    files = {f.kernel for f in absent}
    names = {name for f in absent for name in _names(f)} - {name for f in active for name in _names(f)}
    word = re.compile(rf"\b({'|'.join(sorted(names))})\b") if names else None
    return sum(len(line.encode()) + 1 for file, line in _lines_by_file(source) if file in files or (word is not None and word.search(line)))


def _names(feature: Feature) -> list[str]:
    """The names that a feature adds to structs and kernel arguments."""
    return [n for n, *_ in (*feature.material, *feature.frame, *feature.parameters)]


def _lines_by_file(source: str) -> Iterator[tuple[str, str]]:
    """(file, line) of a composed text without its comments, line directives left out."""
    file = ""
    for line in _COMMENT.sub("", source).splitlines():
        directive = _LINE.match(line)
        if directive:
            file = directive[1]
        else:
            yield file, line
