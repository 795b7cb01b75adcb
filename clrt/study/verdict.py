"""What a study says, in sentences with figures; made of the JSON alone. A difference is claimed where intervals part, nowhere else."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

Row = dict[str, Any]
_STEP = 4  #: samples of two points that are compared, one over the other
_FLATTEST = -0.01  #: a slope of error over samples above which the next digit takes more than 10^100 times the samples


def sentences(study: dict[str, Any]) -> list[str]:
    """The verdict; what was not measured is not spoken of."""
    makers = (_precision, _samples, _bias, _depth, _effects, _trees, _phases)
    return [sentence for make in makers for sentence in make(study)]


def ratio(a: Row, b: Row) -> tuple[float, float, float]:
    """a over b: of the medians, and its extremes within both intervals. For positive numbers."""
    return a["median"] / b["median"], a["low"] / b["high"], a["high"] / b["low"]


def digit(slope: Row) -> tuple[float, float, float] | None:
    """How many times the samples a tenth of the error takes, with its bounds; None where it does not surely fall, or out of all reach."""
    if slope["high"] > _FLATTEST:
        return None
    median, low, high = (10.0 ** (-1.0 / slope[key]) for key in ("median", "low", "high"))
    return median, low, high


def _rows(study: dict[str, Any], part: str) -> list[Row]:
    found = study.get(part)
    return list(found["rows"]) if isinstance(found, dict) else []


def short(value: float) -> str:
    """Three digits, without powers of ten where a person would write none."""
    if not 1e3 <= abs(value) < 1e9:
        return f"{value:.3g}"
    return f"{float(f'{value:.3g}'):,.0f}"


def _times(median: float, low: float, high: float) -> str:
    return f"{short(median)}x ({short(low)} to {short(high)})"


def _interval(value: Row) -> str:
    return f"{short(value['median'])} ({short(value['low'])} to {short(value['high'])})"


def _milliseconds(value: Row) -> str:
    return f"{short(1e3 * value['median'])} ms ({short(1e3 * value['low'])} to {short(1e3 * value['high'])})"


def _positive(*values: Row | None) -> bool:
    return all(value is not None and value["low"] > 0.0 for value in values)


def _precision(study: dict[str, Any]) -> Iterator[str]:
    rows = {row["rung"]: row for row in _rows(study, "precision")}
    base = rows.get("fast")
    for name, row in rows.items():
        if base is None or name == "fast":
            continue
        cost = row["ratio_to_fast"]
        told = _times(cost["median"], cost["low"], cost["high"])
        if cost["low"] > 1.0 or cost["high"] < 1.0:
            yield f"The rung {name} takes {told} the time of fast{_gain(row, base)}."
        else:
            yield f"The rung {name} takes no measurably other time than fast, {told}{_gain(row, base)}."


def _gain(row: Row, base: Row) -> str:
    wrong, before = row["wrong_primitives"], base["wrong_primitives"]
    if wrong is None or before is None:
        return ""
    gained = before["median"] - wrong["median"]
    if gained > 0:
        return f", and removes {gained:.0f} wrong primitives {wrong['unit']} ({wrong['median']:.0f} left)"
    return f", and has {wrong['median']:.0f} wrong primitives {wrong['unit']}, fast {before['median']:.0f}"


def _samples(study: dict[str, Any]) -> Iterator[str]:
    rows = _rows(study, "samples")
    if not rows:
        return
    last = rows[-1]
    before = next((row for row in rows if row["samples"] * _STEP == last["samples"]), None)
    if before is not None and _positive(last["seconds"], before["seconds"], before["rmse"], last["rmse"]):
        cost, gain = ratio(last["seconds"], before["seconds"]), ratio(before["rmse"], last["rmse"])
        gained = f"divide the error by {_interval(dict(zip(('median', 'low', 'high'), gain, strict=True)))}"
        if not (gain[1] > 1.0 or gain[2] < 1.0):
            gained = "do not change the error measurably"
        yield f"{_STEP}x the samples, {before['samples']} to {last['samples']}, take {_times(*cost)} the time and {gained}."
    slope = study["samples"].get("slope")
    if slope is not None:
        yield f"The error falls with the samples to the power {_interval(slope)}; random sampling has -0.5."
        tenth = digit(slope)
        if tenth is not None and _positive(last["rmse"], last["seconds"]):
            ends = zip(("median", "low", "high"), tenth, strict=True)
            whole = {end: times * last["seconds"][end] for end, times in ends}
            yield (f"The next digit, a tenth of the error, so takes {_times(*tenth)} the samples: from {last['rmse']['median']:.2g} at "
                   f"{_milliseconds(last['seconds'])} about {_milliseconds(whole)}, if the slope holds.")  # fmt: skip
    floor, made = study["samples"].get("floor"), study["samples"].get("reference")
    if floor is not None and made is not None:
        yield (f"The reference has {made['samples']:,} samples in {made['rung']}, {made['times_largest']}x those of the largest point, "
               f"and an error of its own of {_interval(floor)}.")  # fmt: skip


def _bias(study: dict[str, Any]) -> Iterator[str]:
    found = study.get("bias")
    if isinstance(found, dict) and found["rows"]:
        known = found["verdict"]
        clean = "The mean over seeds is the reference's: no bias shows above its noise."
        yield clean if known == "unbiased" else f"The pictures are {known}."


def _depth(study: dict[str, Any]) -> Iterator[str]:
    rows = _rows(study, "depth")
    if len(rows) < 2:
        return
    last = rows[-1]
    enough = next(row for row in rows if row["error"]["low"] <= last["error"]["high"])
    if enough is last:
        yield f"Every depth up to {last['depth']} still lowers the error, to {_interval(last['error'])}."
        return
    more = ""
    if enough["seconds"]["high"] < last["seconds"]["low"]:
        more = f"; the depth {last['depth']} takes {_times(*ratio(last['seconds'], enough['seconds']))} its time"
    yield f"From a depth of {enough['depth']} on the error does not fall measurably{more}."


def _effects(study: dict[str, Any]) -> Iterator[str]:
    rows = [row for row in _rows(study, "effects") if row.get("cost") and row["cost"]["low"] > 0.0]
    for row in sorted(rows, key=lambda row: -float(row["cost"]["median"]))[:2]:
        part, changed = row["share_of_time"]["median"], row["changed_pixels"]["median"]
        yield (f"The effect {row['effect']} costs {_milliseconds(row['cost'])}, {part:.0%} of the time; without it {changed:.0%} of the "
               f"pixels change, by {row['error']['median']:.3g} in the root mean square.")  # fmt: skip


def _trees(study: dict[str, Any]) -> Iterator[str]:
    rows = {row["tree"]: row for row in _rows(study, "trees") if row.get("trace")}
    if "sah" not in rows:
        return
    own = rows["sah"]
    for name, words in (("median", "the median tree"), ("brute", "brute force")):
        other = rows.get(name)
        if other is None:
            continue
        told = _times(*ratio(other["trace"], own["trace"]))
        if other["trace"]["low"] > own["trace"]["high"] or other["trace"]["high"] < own["trace"]["low"]:
            yield f"Tracing with {words} takes {told} the time of the SAH tree."
        else:
            yield f"Tracing with {words} and with the SAH tree takes no measurably different time, {told}."


def _phases(study: dict[str, Any]) -> Iterator[str]:
    rows = [row for row in _rows(study, "phases") if row.get("seconds") and row["phase"] != "compile cold"]
    if rows:
        longest = max(rows, key=lambda row: float(row["seconds"]["median"]))
        others = [row["seconds"]["high"] for row in rows if row is not longest]
        sure = "" if all(longest["seconds"]["low"] > high for high in others) else " by its median, but not surely,"
        yield (f"Of a run with compiled programs at hand the longest phase is{sure} {longest['phase']}: "
               f"{_milliseconds(longest['seconds'])}.")  # fmt: skip
