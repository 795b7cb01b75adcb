"""The parts of a study as tables of text, the same ones on the page and in Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from clrt.study.report_numbers import NONE, SCALED, TIMES, Number

Study = Mapping[str, Any]

_SHARES = ("share_of_time", "changed_pixels")  #: shown as percentages


@dataclass(frozen=True)
class Part:
    """One table of the study: its key in the JSON, its title, what it answers, and its columns in order as key -> heading."""

    key: str
    title: str
    about: str
    columns: Mapping[str, str]


PARTS = (
    Part(
        "precision", "Precision", "What exact visibility costs, and what it removes.",
        {
            "rung": "rung", "trace": "trace", "ratio_to_fast": "ratio to fast", "rays_per_s": "rays a second",
            "wrong_primitives": "wrong primitives", "leaks_per_million": "leaks", "t_error": "largest t error",
            "picture_error": "picture error", "build": "trees", "compile_cold": "compile, cold", "compile_warm": "compile, warm",
        },
    ),
    Part(
        "samples", "Samples", "What the next digit of a sampled picture costs.",
        {"samples": "samples", "seconds": "time", "rmse": "RMSE", "relative_mse": "relative MSE", "flip": "FLIP", "p99": "99th percentile"},
    ),
    Part("depth", "Depth", "What each further bounce costs and changes.", {"depth": "depth", "seconds": "time", "error": "error"}),
    Part(
        "effects", "Effects", "What each effect of this scene costs, and what the picture loses without it.",
        {
            "effect": "effect", "line": "line", "text": "what it says", "cost": "cost", "share_of_time": "share of time",
            "changed_pixels": "changed pixels", "max_difference": "largest difference", "error": "error without it",
        },
    ),
    Part(
        "trees", "Trees", "Median splits against the surface area heuristic.",
        {"tree": "tree", "build": "build", "nodes": "nodes", "depth": "depth", "tests_per_ray": "tests a ray", "trace": "trace"},
    ),
    Part(
        "bias", "Bias", "Whether the error would go away with more samples.",
        {"samples": "samples", "squared_error": "squared error", "bias_squared": "bias squared", "variance": "variance"},
    ),
    Part("phases", "Where the time goes", "One run of the whole command, phase by phase.", {"phase": "phase", "seconds": "time"}),
)  # fmt: skip


@dataclass(frozen=True)
class Cell:
    """`sort` is what the page sorts by: a number, or the text itself; `hint` says how often it was measured."""

    text: str
    sort: float | str = ""
    hint: str = ""

    @property
    def is_number(self) -> bool:
        return isinstance(self.sort, float)


@dataclass(frozen=True)
class Table:
    headings: list[str]
    rows: list[list[Cell]]
    numeric: list[bool]  #: by column
    runs: str = ""  #: in words, how often the numbers were measured
    notes: list[str] = field(default_factory=list)  #: what rows have to say


@dataclass(frozen=True)
class Section:
    """What is shown of a part: a table, or the note that says why there is none; more notes and sentences below."""

    part: Part
    table: Table | None
    notes: list[str] = field(default_factory=list)
    facts: list[str] = field(default_factory=list)


def sections(study: Study) -> list[Section]:
    """All parts in the order of the page."""
    return [section(study, part) for part in PARTS]


def section(study: Study, part: Part) -> Section:
    """One part; where the JSON lacks it, a note says so."""
    content = study.get(part.key)
    if not isinstance(content, Mapping):
        return Section(part, None, ["Not measured."])
    rows = [row for row in content.get("rows") or [] if isinstance(row, Mapping)]
    notes = [_sentence(str(content["note"]))] if content.get("note") else []
    table = _table(part, rows) if rows else None
    if table is None and not notes:
        notes = ["Not measured."]
    return Section(part, table, notes, list(_facts(content)))


def _table(part: Part, rows: list[Mapping[str, Any]]) -> Table:
    """Columns that no row fills are left out; measured ones that `part` does not name follow under their own names."""
    known = [key for key in (*part.columns, *_others(part, rows)) if any(row.get(key) is not None for row in rows)]
    headings = [_heading(part.columns.get(key, key.replace("_", " ")), rows, key) for key in known]
    cells = [[cell(row.get(key), key in _SHARES) for key in known] for row in rows]
    numeric = [any(line[i].is_number for line in cells) for i in range(len(headings))]
    return Table(headings, cells, numeric, _runs(rows), _row_notes(rows, next(iter(part.columns))))


def _heading(name: str, rows: list[Mapping[str, Any]], key: str) -> str:
    """With the unit of the numbers below, where it is one for all of them and says more than the name."""
    units = {number.unit for row in rows if (number := Number.of(row.get(key)))}
    unit = units.pop() if len(units) == 1 else ""
    return name if unit in ("", "1", *SCALED) or unit in name else f"{name}, {unit.replace('^2', '²')}"


def _row_notes(rows: list[Mapping[str, Any]], key: str) -> list[str]:
    """Each note once, after the names of its rows; without them where it is that of all."""
    names: dict[str, list[str]] = {}
    for row in rows:
        if row.get("note"):
            names.setdefault(str(row["note"]), []).append(cell(row.get(key)).text)
    return [text if len(which) == len(rows) else f"{', '.join(which)}: {text}" for text, which in names.items()]


def _others(part: Part, rows: list[Mapping[str, Any]]) -> Iterator[str]:
    seen = {*part.columns, "note"}
    for row in rows:
        for key, value in row.items():
            if key not in seen and (Number.of(value) is not None or isinstance(value, str)):
                seen.add(key)
                yield key


def cell(value: object, share: bool = False) -> Cell:
    """A measured number, one that is a share as a percentage, a plain one, or a text."""
    number = Number.of(value)
    if number is not None:
        hint = f"median of {number.runs} runs" if number.runs > 1 and number.has_interval else ""
        return Cell(str(replace(number, unit="share") if share else number.without_unit()), number.median, hint)
    if value is None or isinstance(value, (Mapping, list, float)):
        return Cell(NONE)
    return Cell(str(value), str(value))


def _runs(rows: list[Mapping[str, Any]]) -> str:
    """How often what has an interval was measured, from the fewest to the most."""
    numbers = [number for row in rows for value in row.values() if (number := Number.of(value)) is not None and number.runs > 1]
    if not numbers:
        return ""
    fewest, most = min(number.runs for number in numbers), max(number.runs for number in numbers)
    return f"Medians of {fewest if fewest == most else f'{fewest} to {most}'} runs, with 95% intervals in parentheses."


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def _facts(content: Mapping[str, Any]) -> Iterator[str]:
    """What stands beside the rows of a part."""
    if (slope := Number.of(content.get("slope"))) is not None:
        yield f"Measured slope of error against {slope_axis(slope)} on logarithmic axes: {slope.without_unit()} (random sampling: -0.5)."
    if isinstance(note := content.get("slope_note"), str):
        yield _sentence(note)
    if (floor := Number.of(content.get("floor"))) is not None:
        yield f"Noise floor, the error of the reference itself: {floor}."
    if isinstance(reference := content.get("reference"), Mapping):
        rung, samples, times = (_text(reference.get(key)) for key in ("rung", "samples", "times_largest"))
        yield f"The reference: {rung}, {samples} samples a pixel, {times} times those of the largest point."
    if isinstance(against := content.get("against"), str):
        yield f"Error: {against}."
    if isinstance(verdict := content.get("verdict"), str):
        yield _sentence(f"verdict: {verdict}")


def slope_axis(slope: Number) -> str:
    """What a slope is measured against, as its unit says."""
    return "samples" if "samples" in slope.unit else "time"


def header_lines(header: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What was measured, on what: name and text."""
    machine, opencl = header.get("machine") or {}, header.get("opencl") or {}
    processor = " · ".join(
        text for text in (
            _text(machine.get("processor")), _counted(machine.get("cores"), "core"), _counted(machine.get("threads"), "thread"),
            _memory(machine.get("memory")),
        ) if text
    )  # fmt: skip
    samples = _counted(header.get("samples"), "sample")
    lines = [
        ("Scene", _joined(header.get("scene"), _size(header.get("size")), samples and f"{samples} a pixel")),
        ("Scene's SHA-256", _text(header.get("scene_sha256"))),
        ("Date", _text(header.get("date"))), ("clrt", _text(header.get("clrt"))), ("Processor", processor),
        ("System", _text(machine.get("system"))),
        ("OpenCL", _joined(*(opencl.get(key) for key in ("platform", "device", "driver")))), ("Compiler", _text(opencl.get("compiler"))),
        ("Build options", _text(header.get("build_options"))), ("Contraction", _text(header.get("contraction"))),
        ("Load, before and after", _load(header.get("load_average"))), ("Seeds", _text(header.get("seeds"))),
    ]  # fmt: skip
    return [(name, text) for name, text in lines if text]


def summary(header: Mapping[str, Any]) -> str:
    """When, on what, in one line."""
    lines = dict(header_lines(header))
    version = lines.get("clrt")
    return " · ".join(text for text in (lines.get("Date"), lines.get("Processor"), version and f"clrt {version}") if text)


def _joined(*values: object) -> str:
    return " · ".join(text for text in map(_text, values) if text)


def _counted(count: object, what: str) -> str:
    return "" if count is None else f"{count} {what}{'' if count == 1 else 's'}"


def _memory(value: object) -> str:
    return f"{value:g} GiB" if isinstance(value, (int, float)) else _text(value)


def _size(value: object) -> str:
    return f"{value[0]} {TIMES} {value[1]} pixels" if isinstance(value, list) and len(value) == 2 else _text(value)


def _load(value: object) -> str:
    """Of before and after each the mean over one minute."""
    if not isinstance(value, list):
        return _text(value)
    return " and ".join(_text(each[0] if isinstance(each, list) and each else each) or "not known" for each in value)


def _text(value: object) -> str:
    if value is None or value == "" or value == []:
        return ""
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list):
        return (" " if all(isinstance(each, str) for each in value) else ", ").join(_text(each) for each in value)
    if isinstance(value, Mapping):
        return ", ".join(f"{str(name).replace('_', ' ')} {_text(each)}" for name, each in value.items())
    return str(value)
