"""Curves of a study on logarithmic axes: samples, depth, bias. Each returns the caption that says what is seen."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from clrt.study.report_numbers import Number
from clrt.study.report_plots import BLUE, GREEN, GREY, INK, ORANGE, NothingToDraw, halo
from clrt.study.report_series import Rows, Series, rows_of
from clrt.study.report_tables import slope_axis

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_RANDOM = -0.5  #: slope of the error of random sampling against time
_FEW_DECADES = 2.6  #: below which 2 and 5 between powers of ten have ticks, too
_SMALLEST = 1e-3  #: tick that is written without a power of ten


def draw_samples(figure: Figure, content: Mapping[str, Any]) -> str:
    """RMSE against seconds: median, band, guide of slope -1/2, measured slope, noise floor, ringed Pareto points."""
    rows = rows_of(content)
    seconds, error = Series.of(rows, "seconds"), Series.of(rows, "rmse")
    shown = seconds.positive & error.positive
    if shown.sum() < 2:
        raise NothingToDraw
    axes = figure.subplots()
    x, y = seconds.medians[shown], error.medians[shown]
    slope, floor = Number.of(content.get("slope")), Number.of(content.get("floor"))
    # Time has a part that does not grow with samples: a slope over samples is drawn over the times that these samples take.
    by_samples = slope is None or slope_axis(slope) == "samples"
    effort = Series.of(rows, "samples").medians[shown] if by_samples else x
    what = " in samples" if by_samples else ""
    _curve(axes, seconds, error, shown, BLUE, "RMSE, median and 95% band")
    _guide(axes, x, y[0] * (effort / effort[0]) ** _RANDOM, f"slope -1/2{what}: random sampling", ":", GREY)
    if slope is not None:
        middle = np.exp(np.log(effort).mean()), np.exp(np.log(y).mean())
        _guide(axes, x, middle[1] * (effort / middle[0]) ** slope.median, f"slope {_plain_slope(slope)}{what}: measured", "--", ORANGE)
    ringed = _ring(axes, seconds, error, content.get("pareto"), shown)
    _log_axes(axes, "time, s", f"RMSE, {error.unit}" if error.unit not in ("", "1") else "RMSE")
    if floor is not None and floor.high > 0.0:
        _shade(axes, floor)
    _label(axes, x, y, [str(_plain(row, "samples")) for row, seen in zip(rows, shown, strict=True) if seen])
    figure.legend(loc="outside upper left", ncols=2)  # never over the curves
    return _samples_caption(rows, shown, error, slope, floor, ringed)


def _samples_caption(
    rows: Rows, shown: NDArray[np.bool_], error: Series, slope: Number | None, floor: Number | None, ringed: int
) -> str:
    first, last = (int(i) for i in np.flatnonzero(shown)[[0, -1]])
    words = [
        f"From {_plain(rows[first], 'samples')} to {_plain(rows[last], 'samples')} samples, written beside the points, "
        f"the RMSE goes from {_in_words(error, first)} to {_in_words(error, last)}."
    ]
    if slope is not None:
        words.append(f"The slope against {slope_axis(slope)} is {slope.without_unit()}, {_against_random(slope)}.")
    if ringed:
        words.append("Ringed: points that no other one beats in both time and error.")
    if floor is not None:
        words.append(f"Shaded: the noise floor, the error of the reference itself, {floor.without_unit()}: below it nothing is known.")
    return " ".join(words)


def _plain_slope(slope: Number) -> str:
    return slope.without_unit().short()


def _in_words(series: Series, row: int) -> str:
    number = series.numbers[row]
    return str(number.without_unit()) if number else "?"


def _against_random(slope: Number) -> str:
    """A difference is claimed only where the interval leaves -1/2 out."""
    if slope.high < _RANDOM:
        return "steeper than the -0.5 of random sampling (dotted)"
    word = "flatter than" if slope.low > _RANDOM else "not to be told from"
    return f"{word} the -0.5 of random sampling (dotted)"


def draw_depth(figure: Figure, content: Mapping[str, Any]) -> str:
    """Error against seconds, each point a depth; a point without error has no place on a logarithmic axis and is named instead."""
    rows = rows_of(content)
    seconds, error = Series.of(rows, "seconds"), Series.of(rows, "error")
    shown = seconds.positive & error.positive
    if shown.sum() < 2:
        raise NothingToDraw
    axes = figure.subplots()
    _curve(axes, seconds, error, shown, BLUE, "median")
    _log_axes(axes, "time, s", "error" + (f", {error.unit}" if error.unit not in ("", "1") else ""))
    names = [_plain(row, "depth") for row, seen in zip(rows, shown, strict=True) if seen]
    _label(axes, seconds.medians[shown], error.medians[shown], names)
    first, last = (int(i) for i in np.flatnonzero(shown)[[0, -1]])
    words = [
        f"Each point is a largest number of bounces, written beside it, with its 95% interval. From {_plain(rows[first], 'depth')} to "
        f"{_plain(rows[last], 'depth')} the error goes from {_in_words(error, first)} to {_in_words(error, last)} and the time from "
        f"{_in_words(seconds, first)} to {_in_words(seconds, last)}."
    ]
    if same := [_plain(row, "depth") for row, known, zero in zip(rows, error.known, error.medians == 0.0, strict=True) if known and zero]:
        words.append(f"Without any error, and so not on these axes: {', '.join(same)}.")
    return " ".join(words)


def draw_bias(figure: Figure, content: Mapping[str, Any]) -> str:
    """Squared error, its bias and its variance against samples."""
    rows = rows_of(content)
    samples = Series.of(rows, "samples")
    columns = {
        "squared_error": ("squared error: both together", BLUE, "o"), "variance": ("variance", GREEN, "s"),
        "bias_squared": ("bias squared", ORANGE, "^"),
    }  # fmt: skip
    series = {key: Series.of(rows, key) for key in columns}
    if (samples.positive & series["squared_error"].positive).sum() < 2:
        raise NothingToDraw
    axes = figure.subplots()
    for key, (name, colour, marker) in columns.items():
        shown = samples.positive & series[key].positive
        if shown.any():
            look = {"markersize": 10, "fillstyle": "none", "linewidth": 4.0, "alpha": 0.6} if key == "squared_error" else {}
            _curve(axes, samples, series[key], shown, colour, name, marker, **look)
    first = series["squared_error"].medians[0]
    x = samples.medians[samples.positive]
    if np.isfinite(first) and first > 0.0:
        _guide(axes, x, first * x[0] / x, "slope -1, random sampling", ":", GREY)
    unit = series["squared_error"].unit.replace("^2", "²")
    _log_axes(axes, "samples a pixel", f"squared error, {unit}" if unit not in ("", "1") else "squared error")
    axes.set_xticks(x, [_plain(row, "samples") for row, ok in zip(rows, samples.positive, strict=True) if ok])
    axes.minorticks_off()
    _y_ticks(axes)
    figure.legend(loc="outside upper left", ncols=2)
    return _bias_caption(content, samples, series["bias_squared"])


def _bias_caption(content: Mapping[str, Any], samples: Series, bias: Series) -> str:
    words = ["Squared error over seeds is bias squared plus variance: variance falls with more samples, bias stays."]
    if hidden := int((samples.known & bias.known & ~bias.positive).sum()):
        words.append(f"In {hidden} of {int(bias.known.sum())} rows the estimated bias is zero or less, which these axes cannot show.")
    if isinstance(verdict := content.get("verdict"), str):
        words.append(f"Found: {verdict.rstrip('.')}.")
    return " ".join(words)


def _curve(axes: Axes, x: Series, y: Series, shown: NDArray[np.bool_], colour: str, name: str, marker: str = "o", **look: Any) -> None:
    """A line through medians with the intervals of y as a band and as whiskers, those of x as whiskers."""
    middle = y.medians[shown]
    low = np.where(y.lows[shown] > 0.0, y.lows[shown], middle)  # a band that reaches zero has no lower end on a logarithmic axis
    axes.fill_between(x.medians[shown], low, y.highs[shown], color=colour, alpha=0.18, linewidth=0)
    axes.plot(x.medians[shown], middle, color=colour, marker=marker, label=name, **{"markersize": 5, **look})
    below = np.stack([middle - low, y.whiskers(shown)[1]])
    bars: dict[str, Any] = {"fmt": "none", "ecolor": colour, "elinewidth": 1.0}
    at = (y.highs > y.lows)[shown]
    axes.errorbar(x.medians[shown][at], middle[at], yerr=below[:, at], **bars)
    at = (x.highs > x.lows)[shown]
    axes.errorbar(x.medians[shown][at], middle[at], xerr=x.whiskers(shown)[:, at], **bars)


def _guide(axes: Axes, x: NDArray[np.float64], y: NDArray[np.float64], name: str, dashes: str, colour: str) -> None:
    axes.plot(x, y, dashes, color=colour, linewidth=1.4, label=name, zorder=1.5)


def _ring(axes: Axes, x: Series, y: Series, indices: object, shown: NDArray[np.bool_]) -> int:
    """Rings round the points of these indices; how many there are."""
    chosen = [i for i in indices if isinstance(i, int) and 0 <= i < len(shown) and shown[i]] if isinstance(indices, list) else []
    if chosen:
        look: dict[str, Any] = {"markersize": 11, "fillstyle": "none", "color": INK, "markeredgewidth": 1.2}
        axes.plot(x.medians[chosen], y.medians[chosen], "o", label="no other is better in both", **look)
    return len(chosen)


def _shade(axes: Axes, floor: Number) -> None:
    """From the bottom of the axes, which goes below the floor, up to its upper end."""
    bottom, top = axes.get_ylim()
    bottom = min(bottom, floor.median / 1.6)
    axes.set_ylim(bottom, top)
    axes.axhspan(bottom, floor.high, color=GREY, alpha=0.25, linewidth=0, label="noise floor")
    axes.axhline(floor.median, color=GREY, linewidth=1.0)


def _label(axes: Axes, x: NDArray[np.float64], y: NDArray[np.float64], texts: list[str]) -> None:
    """Beside each point, below and to the left of a falling curve, where the line does not run."""
    for a, b, text in zip(x, y, texts, strict=True):
        halo(axes.annotate(text, (a, b), xytext=(-7, -7), textcoords="offset points", ha="right", va="top", fontsize=9, color=INK))


def _log_axes(axes: Axes, x_name: str, y_name: str) -> None:
    axes.set(xscale="log", yscale="log", xlabel=x_name, ylabel=y_name)
    axes.margins(x=0.1, y=0.12)
    axes.grid(True)
    _ticks(axes, "x")
    _y_ticks(axes)


def _y_ticks(axes: Axes) -> None:
    _ticks(axes, "y")


def _ticks(axes: Axes, which: str) -> None:
    """Powers of ten; where there are few of them, 2 and 5 between them, too. Numbers as people write them."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis, limits = (axes.xaxis, axes.get_xlim()) if which == "x" else (axes.yaxis, axes.get_ylim())
    decades = abs(np.log10(limits[1] / limits[0]))
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < _FEW_DECADES else (1.0,), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _tick(value)))
    axis.set_minor_formatter(NullFormatter())


def _tick(value: float) -> str:
    """Without zeros at the end, and beyond four of them in front as a power of ten."""
    if value <= 0.0 or _SMALLEST <= value < 1.0 / _SMALLEST:
        return f"{value:,.6g}"
    power = math.floor(math.log10(value) + 1e-9)
    mantissa = value / 10.0**power
    return (f"{mantissa:.3g}·" if abs(mantissa - 1.0) > 1e-6 else "") + f"$10^{{{power}}}$"


def _plain(row: Mapping[str, Any], key: str) -> str:
    number = Number.of(row.get(key))
    return number.short() if number else str(row.get(key, "?"))
