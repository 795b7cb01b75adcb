"""Bars of a study: rungs, effects, trees, phases. Each returns the caption that says what is seen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from clrt.study.report_plots import BLUE, GREEN, GREY, INK, ORANGE, NothingToDraw
from clrt.study.report_series import Rows, Series, rows_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LONGEST_NAME = 28  #: characters of a name beside a bar
_ROOM = 1.45  #: length of the axis over that of the longest bar: room for the numbers at their ends
_ROOM_BEGINS = 0.82  #: part of the axis beyond which a number beside a whisker would run out of the plot
_CUT = 2.5  #: times the longest bar, at which whiskers are cut


def draw_precision(figure: Figure, content: Mapping[str, Any]) -> str:
    """Left the time over that of `fast`, right what is still wrong."""
    rows = rows_of(content)
    ratio = Series.of(rows, "ratio_to_fast")
    wrong_key = next((key for key in ("wrong_primitives", "picture_error") if Series.of(rows, key).known.any()), None)
    if not ratio.known.any():
        raise NothingToDraw
    panels = figure.subplots(1, 2 if wrong_key else 1, squeeze=False, sharey=True)[0]
    names = _names(rows, "rung")
    _bars(panels[0], names, ratio, BLUE, "time over fast")
    panels[0].axvline(1.0, color=INK, linewidth=0.8, linestyle=":")
    if wrong_key:
        _bars(panels[1], names, Series.of(rows, wrong_key), ORANGE, wrong_key.replace("_", " "))
    return _precision_caption(names, ratio)


def _precision_caption(names: list[str], ratio: Series) -> str:
    """A rung is said to differ from fast only where its interval leaves 1 out."""
    known = {name: number for name, number in zip(names, ratio.numbers, strict=True) if number and number.has_interval}
    if not known:
        return "Trace time over that of fast."
    dearer = [name for name, number in known.items() if number.low > 1.0]
    cheaper = [name for name, number in known.items() if number.high < 1.0]
    words = [f"Trace time over that of fast, with 95% intervals: {', '.join(f'{name} {number}' for name, number in known.items())}."]
    words += [f"Dearer than fast: {', '.join(dearer)}."] if dearer else []
    words += [f"Cheaper than fast: {', '.join(cheaper)}."] if cheaper else []
    if same := [name for name in known if name not in (*dearer, *cheaper)]:
        words.append(f"Not to be told from fast in time: {', '.join(same)}.")
    return " ".join(words)


def draw_effects(figure: Figure, content: Mapping[str, Any]) -> str:
    """Left the time that each effect takes, right the error of the picture without it; the dearest on top."""
    rows = rows_of(content)
    cost = Series.of(rows, "cost")
    error_key = next((key for key in ("error", "max_difference") if Series.of(rows, key).known.any()), None)
    if not cost.known.any():
        raise NothingToDraw
    order = np.argsort(-np.where(cost.known, cost.medians, -np.inf), kind="stable")
    rows = [rows[i] for i in order]
    names = _names(rows, "effect")
    panels = figure.subplots(1, 2 if error_key else 1, squeeze=False, sharey=True)[0]
    cost = Series.of(rows, "cost")
    _bars(panels[0], names, cost, BLUE, "time it takes")
    if error_key:
        what = "error" if error_key == "error" else "difference"
        _bars(panels[1], names, Series.of(rows, error_key), ORANGE, f"{what} without it")
    dearest, *others = [n for n in cost.numbers if n]
    apart = all(dearest.low > other.high for other in others)
    words = [f"The dearest effect{'' if apart else ' by its median'} is {names[0]}, {dearest}."]
    if free := [name for name, n in zip(names, cost.numbers, strict=True) if n and n.has_interval and n.low <= 0.0 <= n.high]:
        words.append(f"Not to be told from nothing in time: {', '.join(free)}.")
    return " ".join(words)


def draw_trees(figure: Figure, content: Mapping[str, Any]) -> str:
    """One panel a quantity, one bar a tree; a panel where they lie far apart is a logarithmic one with points."""
    rows = rows_of(content)
    wanted = {"build": "build", "tests_per_ray": "tests a ray", "trace": "trace", "nodes": "nodes"}
    series = {key: Series.of(rows, key) for key in wanted}
    series = {key: value for key, value in series.items() if value.known.any()}
    if len(rows) < 2 or not series:
        raise NothingToDraw
    names = _names(rows, "tree")
    panels = figure.subplots(2, 2, squeeze=False, sharey=True).ravel()
    for axes, (key, values) in zip(panels, series.items(), strict=False):
        _bars(axes, names, values, GREEN if key == "nodes" else BLUE, wanted[key])
    for axes in panels[len(series):]:
        axes.remove()
    words = [_compare(names, series[key], what) for key, what in (("tests_per_ray", "tests a ray"), ("trace", "trace")) if key in series]
    return " ".join(word for word in words if word)


def _compare(names: list[str], values: Series, what: str) -> str:
    """All of them, and which is the least where its interval lies below all others."""
    known = [(name, n.without_unit()) for n, name in zip(values.numbers, names, strict=True) if n]
    if len(known) < 2:
        return ""
    listed = f"{what[:1].upper()}{what[1:]}: {', '.join(f'{name} {number}' for name, number in known)}"
    (least, best), *others = sorted(known, key=lambda pair: pair[1].median)
    apart = all(best.high < number.low for _, number in others)
    return f"{listed}; {least} has the least." if apart else f"{listed}; the least is not to be told."


def draw_phases(figure: Figure, content: Mapping[str, Any]) -> str:
    """One bar a phase in the order in which they happen."""
    rows = rows_of(content)
    seconds = Series.of(rows, "seconds")
    total = float(np.nansum(seconds.medians))
    if not seconds.known.any() or total <= 0.0:
        raise NothingToDraw
    names = _names(rows, "phase")
    _bars(figure.subplots(), names, seconds, BLUE, "time")
    largest = int(np.nanargmax(seconds.medians))
    longest, *others = sorted((n for n in seconds.numbers if n), key=lambda n: -n.median)
    claim = "The longest is" if all(longest.low > other.high for other in others) else "The longest by its median is"
    return f"Phases from first to last. {claim} {names[largest]}: {longest}."


def _names(rows: Rows, key: str) -> list[str]:
    texts = [str(row.get(key, "?")) for row in rows]
    return [text if len(text) <= _LONGEST_NAME else text[: _LONGEST_NAME - 1] + "…" for text in texts]


def _bars(axes: Axes, names: list[str], values: Series, colour: str, title: str) -> None:
    """Lying bars, the first on top, with whiskers for intervals and the median written at the end of each."""
    shown, places = values.known, np.arange(len(names))
    factor, unit = values.axis
    medians, spread = values.medians / factor, shown & (values.highs > values.lows)
    axes.barh(places[shown], medians[shown], height=0.62, color=colour)
    axes.errorbar(medians[spread], places[spread], xerr=values.whiskers(spread, 1.0 / factor), fmt="none", ecolor=INK, elinewidth=1.2)
    axes.set_yticks(places, [_safe(name) for name in names])
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_title(title, loc="left")
    axes.set_xlabel("" if unit in title.split() else unit)
    axes.tick_params(axis="y", length=0)
    axes.grid(True, axis="x")
    _length(axes, values, factor)
    _numbers(axes, values, factor)


def _length(axes: Axes, values: Series, factor: float) -> None:
    """From nothing to the longest bar; a whisker that is much longer than all bars is cut, and the numbers beside the bars get room."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator

    shown = values.known
    longest = float(np.abs(values.medians[shown]).max())
    reach = _CUT * longest if longest > 0.0 else np.inf
    top = min(max(float(values.highs[shown].max()), 0.0), reach) / factor
    bottom = max(min(float(values.lows[shown].min()), 0.0), -reach) / factor
    whole = (top - bottom) or 1.0
    axes.set_xlim(bottom - 0.04 * whole if bottom < 0.0 else 0.0, bottom + _ROOM * whole)
    counts = bool((values.medians[shown] == np.round(values.medians[shown])).all()) and factor == 1.0
    axes.xaxis.set_major_locator(MaxNLocator(4, integer=counts) if top > bottom else FixedLocator([0.0]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,.6g}"))
    if bottom < 0.0:
        axes.axvline(0.0, color=INK, linewidth=0.8)


def _numbers(axes: Axes, values: Series, factor: float) -> None:
    """Right of bar and whisker; where the whisker is cut, above it."""
    low, high = axes.get_xlim()
    limit = low + _ROOM_BEGINS * (high - low)
    for place, number in enumerate(values.numbers):
        text = "not measured" if number is None else number.without_unit().short()
        end = 0.0 if number is None else max(number.median, number.high, 0.0) / factor
        cut = end > limit
        start = 0.0 if number is None else max(number.median, 0.0) / factor
        look: dict[str, Any] = {"fontsize": 9, "color": GREY if number is None else INK, "va": "bottom" if cut else "center"}
        axes.annotate(text, (start if cut else end, place), xytext=(5, 1 if cut else 0), textcoords="offset points", **look)


def _safe(text: str) -> str:
    """Dollar signs would start a formula."""
    return text.replace("$", r"\$")
