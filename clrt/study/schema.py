"""The form of study.json, checked: docs/study.md has it in words. A part that is not measured yet is null."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

FORMAT = 1
PARTS = ("verdict", "precision", "samples", "depth", "effects", "trees", "bias", "phases")
KEYS = ("format", "header", *PARTS)

#: part -> what names a row, and the numbers that it has
ROWS: dict[str, tuple[str, tuple[str, ...]]] = {
    "precision": ("rung", ("build", "compile_cold", "compile_warm", "trace", "ratio_to_fast", "rays_per_s", "wrong_primitives",
                           "leaks_per_million", "t_error", "picture_error")),
    "samples": ("samples", ("seconds", "rmse", "relative_mse", "flip", "p99")),
    "depth": ("depth", ("seconds", "error")),
    "effects": ("effect", ("cost", "share_of_time", "changed_pixels", "max_difference", "error")),
    "trees": ("tree", ("build", "nodes", "depth", "tests_per_ray", "trace")),
    "bias": ("samples", ("squared_error", "bias_squared", "variance")),
    "phases": ("phase", ("seconds",)),
}  # fmt: skip
#: numbers of a part beside its rows
LONE: dict[str, tuple[str, ...]] = {"samples": ("slope", "floor")}
_HEADER = ("scene", "scene_sha256", "clrt", "date", "machine", "opencl", "build_options", "contraction", "load_average", "size", "quick",
           "seeds")  # fmt: skip
_MACHINE = ("processor", "cores", "threads", "memory", "system")
_OPENCL = ("platform", "device", "driver", "compiler")


def faults(study: Any) -> list[str]:
    """What is wrong with the JSON of a study, a line each, the place first; nothing where it fits."""
    if not isinstance(study, dict):
        return ["it is no object"]
    if study.get("format") != FORMAT:
        return [f"format is {study.get('format')!r}, and this version of clrt reads {FORMAT}"]
    found = [f"{key} is missing" for key in KEYS if key not in study]
    found += [f"{key} is no key of a study" for key in study if key not in KEYS]
    return found or [*_header_faults(study["header"]), *_verdict_faults(study["verdict"]), *_part_faults(study)]


def _header_faults(header: Any) -> Iterator[str]:
    if not isinstance(header, dict):
        yield "header is no object"
        return
    yield from (f"header.{key} is missing" for key in _HEADER if key not in header)
    for name, wanted in (("machine", _MACHINE), ("opencl", _OPENCL)):
        inner = header.get(name)
        yield from (f"header.{name}.{key} is missing" for key in wanted if not isinstance(inner, dict) or key not in inner)


def _verdict_faults(verdict: Any) -> Iterator[str]:
    if verdict is not None and not (isinstance(verdict, list) and all(isinstance(line, str) for line in verdict)):
        yield "verdict is no list of sentences"


def _part_faults(study: dict[str, Any]) -> Iterator[str]:
    for part in ROWS:
        found = study[part]
        if found is None:
            continue
        if not isinstance(found, dict) or not isinstance(found.get("rows"), list):
            yield f"{part}.rows is no list"
            continue
        if not found["rows"] and not found.get("note"):
            yield f"{part} has neither rows nor a note"
        for name in LONE.get(part, ()):
            yield from _number_faults(found.get(name), f"{part}.{name}", bool(found.get(f"{name}_note") or found.get("note")))
        yield from _rows_faults(part, found)
    bias = study["bias"]
    if isinstance(bias, dict) and not str(bias.get("verdict", "")).startswith(("unbiased", "biased: ")):
        yield "bias.verdict is neither 'unbiased' nor 'biased: ...'"


def _rows_faults(part: str, found: dict[str, Any]) -> Iterator[str]:
    name, numbers = ROWS[part]
    for i, row in enumerate(found["rows"]):
        if not isinstance(row, dict) or name not in row:
            yield f"{part}.rows[{i}] has no {name}"
            continue
        noted = bool(row.get("note") or found.get("note"))
        for key in numbers:
            yield from _number_faults(row.get(key), f"{part}.rows[{i}].{key}", noted)


def _number_faults(value: Any, place: str, noted: bool) -> Iterator[str]:
    """A number is there, or a note says why not."""
    if value is None:
        if not noted:
            yield f"{place} is missing, and no note says why"
        return
    if not isinstance(value, dict):
        yield f"{place} is no measured number"
        return
    low, median, high = (value.get(key) for key in ("low", "median", "high"))
    if not all(isinstance(x, int | float) and math.isfinite(x) for x in (low, median, high)):
        yield f"{place} has no finite median, low and high"
    elif not low <= median <= high:  # type: ignore[operator]
        yield f"{place}: {median} is not between {low} and {high}"
    if not isinstance(value.get("unit"), str) or not isinstance(value.get("runs"), int) or value["runs"] < 1:
        yield f"{place} has no unit or no number of runs"
    elif value["runs"] == 1 and low != high:
        yield f"{place} has an interval from one run"
