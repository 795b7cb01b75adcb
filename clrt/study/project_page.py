"""docs/accuracy.md of the studies of several scenes: tables, and conclusions as sentences with figures; from their JSON alone."""

from __future__ import annotations

from typing import Any

from clrt.study.verdict import digit

Result = dict[str, Any]
_RANDOM = -0.5  #: the slope of random sampling


def page(results: list[Result]) -> str:
    """All of it, as Markdown without a title. results : name, words, stands_in, study, known of each scene (see project.measure)."""
    parts = [_where(results), "### What the next digit costs", _digits(results), _digit_table(results), "### What visibility costs",
             _precision_table(results), "### Beside a known answer", *_known(results), "### Scene by scene",
             *(_scene(result) for result in results)]  # fmt: skip
    return "\n\n".join(part for part in parts if part)


def _where(results: list[Result]) -> str:
    head = results[0]["study"]["header"]
    machine, opencl = head["machine"], head["opencl"]
    loads = [load for r in results for load in r["study"]["header"]["load_average"] if load is not None]
    quick = " Quick studies: few runs, small pictures." if head["quick"] else ""
    return (
        f"Measured {head['date'][:10]}, {machine['processor']}, {machine['cores']} cores, {machine['memory']} GiB; {opencl['platform']} "
        f"{opencl['driver']}; clrt {head['clrt']}; load average {min(loads):.1f} to {max(loads):.1f}.{quick} Intervals hold with 95%."
    )


def _table(headings: list[str], rows: list[list[str]], words: int) -> str:
    rule = [":--" if column < words else "--:" for column in range(len(headings))]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (headings, rule, *rows))


def text_of(value: dict[str, Any] | None, factor: float = 1.0, digits: int = 3) -> str:
    """A number with its interval, times `factor`; a dash for none."""
    if value is None:
        return "-"
    median, low, high = (f"{factor * value[key]:.{digits}g}" for key in ("median", "low", "high"))
    return median if value["low"] == value["high"] else f"{median} ({low} to {high})"


def _digits(results: list[Result]) -> str:
    """The conclusion of each scene in a sentence."""
    lines = []
    for result in results:
        samples, name = result["study"]["samples"], f"**{result['name']}** ({result['words']})"
        last, slope = samples["rows"][-1], samples["slope"]
        cost = digit(slope) if slope else None
        if slope is None or cost is None:
            lines.append(f"- {name}: no slope could be measured; {samples.get('slope_note', 'the error does not surely fall')}.")
            continue
        kind = "steeper than" if slope["high"] < _RANDOM else "slower than" if slope["low"] > _RANDOM else "not measurably other than"
        error, time = last["rmse"]["median"], last["seconds"]["median"]
        lines.append(
            f"- {name}: the error falls with the samples to the power {text_of(slope)}, {kind} random sampling. "
            f"The next digit takes {cost[0]:.3g}x the samples ({cost[1]:.3g} to {cost[2]:.3g}): from {error:.2g} in {time:.2g} s to "
            f"{error / 10:.2g} in about {cost[0] * time:.2g} s. The mean is {result['study']['bias']['verdict']}."
        )
    return "\n".join(lines)


def _digit_table(results: list[Result]) -> str:
    rows = []
    for result in results:
        study = result["study"]
        samples, last = study["samples"], study["samples"]["rows"][-1]
        rows.append([
            result["name"], " x ".join(map(str, study["header"]["size"])), f"{last['samples']}", text_of(last["seconds"], 1e3),
            text_of(last["rmse"]), text_of(last["relative_mse"]), text_of(last["flip"]), text_of(samples["slope"]),
            text_of(samples["floor"]), f"{samples['reference']['samples']:,}",
        ])  # fmt: skip
    headings = ["scene", "size", "samples", "ms", "RMSE", "relative MSE", "FLIP", "slope", "reference's error", "its samples"]
    return _table(headings, rows, 1)


def _precision_table(results: list[Result]) -> str:
    rows = []
    for result in results:
        for row in result["study"]["precision"]["rows"]:
            rows.append([
                result["name"], row["rung"], text_of(row["trace"], 1e3), text_of(row["ratio_to_fast"]), text_of(row["compile_cold"]),
                f"{row['wrong_primitives']['median']:.0f} {row['wrong_primitives']['unit']}" if row["wrong_primitives"] else "-",
                text_of(row["leaks_per_million"]), text_of(row["picture_error"], digits=2),
            ])  # fmt: skip
    headings = ["scene", "rung", "trace, ms", "over fast", "compile cold, s", "wrong primitives", "leaks a million", "picture error"]
    return _table(headings, rows, 2)


def _known(results: list[Result]) -> list[str]:
    lines = []
    for result in results:
        known = result["known"]
        if known is not None:
            inside = "inside" if known["low"] <= known["known"] <= known["high"] else "**outside**"
            bounds = f"{known['low']:.6f} to {known['high']:.6f}"
            lines.append(
                f"The reference of **{result['name']}** has a mean of {known['mean']:.6f} ({bounds}); "
                f"the known answer is {known['known']:g}, {inside} this interval."
            )
    return lines


def _scene(result: Result) -> str:
    study = result["study"]
    standing = " A generated scene stands in for the classic report's." if result["stands_in"] else ""
    notes = [study[part]["note"] for part in ("precision", "samples", "depth", "trees") if study[part].get("note")]
    said = "\n".join(f"- {line}" for line in study["verdict"])
    told = "\n\n" + " ".join(f"{note[0].upper()}{note[1:].rstrip('.')}." for note in notes) if notes else ""
    return f"**{result['name']}**: {result['words']}.{standing}\n\n{said}{told}"
