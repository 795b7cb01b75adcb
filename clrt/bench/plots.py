"""The plots of docs/performance.md, drawn from the JSON of a run alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from clrt.bench.growth import curve
from clrt.bench.tables_growth import GROWTH_PLOT, WORDS
from clrt.bench.tables_peers import RAYS_PLOT
from clrt.precision import DEFAULT
from clrt.study.report_plots import BLUE, GREEN, GREY, ORANGE, PURPLE, Plot, draw, halo, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = {"triangles": BLUE, "pixels": GREEN, "separate": ORANGE, "instances": PURPLE}
_MARKERS = {"triangles": "o", "pixels": "D", "separate": "s", "instances": "^"}
_BAR = 0.38


def all_plots(results: Mapping[str, Any]) -> list[Plot]:
    """One of rays a second, one of growth."""
    with style():
        rays = draw(RAYS_PLOT, "Rays a second", results["versus"], _draw_rays, (7.4, 1.0 + 2.0 * len(results["versus"]["views"])))
        growth = draw(GROWTH_PLOT, "Growth", results["growth"], _draw_growth, (8.6, 6.4))
    return [plot for plot in (rays, growth) if plot is not None]


def _draw_rays(figure: Figure, versus: Mapping[str, Any]) -> str:
    """A panel a size, a pair of bars a tracer: primary and shadow rays."""
    views = versus["views"]
    for axes, row in zip(np.atleast_1d(figure.subplots(len(views), 1, sharex=True)), views, strict=True):
        own = f"clrt {DEFAULT}"
        names = [own, *sorted(row["ratios"], key=lambda name: -row["rates"][name]["primary"])]
        place = np.arange(len(names))[::-1]
        for kind, shift, colour in (("primary", _BAR / 2, BLUE), ("shadow", -_BAR / 2, ORANGE)):
            values = [row["rates"][name][kind] for name in names]
            axes.barh(place + shift, values, _BAR, color=colour, zorder=2, label=f"{kind} rays" if row is views[0] else None)
            for y, value in zip(place + shift, values, strict=True):
                text = f"{value:.0f}" if value >= 10 else f"{value:.1f}"
                halo(axes.annotate(text, (value, y), (3, 0), textcoords="offset points", va="center", fontsize=8.5, zorder=3))
        axes.set_yticks(place, [name.replace(own, f"clrt, {DEFAULT}") for name in names])
        axes.tick_params(axis="y", length=0)
        axes.set_title(f"{row['size']} x {row['size']}", loc="left", fontsize=10.5)
        axes.grid(axis="x")
    axes.set_xlabel("million rays a second")
    figure.legend(loc="outside upper right", ncols=2)
    return "Rays a second of every tracer in the bench view."


def _draw_growth(figure: Figure, growth: Mapping[str, Any]) -> str:
    """Time a ray against triangles and objects with the fitted curves, against pixels; building; memory."""
    (rays, objects), (building, memory) = figure.subplots(2, 2)
    _curves(rays, growth, ("triangles", "pixels"), "triangles or pixels", "Time a ray by triangles, by pixels")
    _curves(objects, growth, ("separate", "instances"), "objects or instances", "Time a ray by objects, by instances")
    triangles = [row for row in growth["points"] if row["kind"] == "triangles"]
    x = np.array([row["triangles"] for row in triangles])
    _powers(building, x, {"build": (BLUE, "o", [row["build_s"]["best"] for row in triangles]),
                          "upload": (ORANGE, "s", [row["upload_s"] for row in triangles])})  # fmt: skip
    building.set(xlabel="triangles", ylabel="seconds")
    building.set_title("Building and uploading", loc="left")
    _powers(memory, x, {"process, at most": (BLUE, "o", [row["peak_bytes"]["built"] / 2**20 for row in triangles]),
                        "on the device": (ORANGE, "s", [row["device_bytes"] / 2**20 for row in triangles])})  # fmt: skip
    memory.set(xlabel="triangles", ylabel="MiB")
    memory.set_title("Memory", loc="left")
    return "Growth with triangles, pixels and objects."


def _curves(axes: Axes, growth: Mapping[str, Any], kinds: tuple[str, ...], x_name: str, title: str) -> None:
    for kind in kinds:
        numbers, values = curve(growth["points"], kind)
        axes.plot(numbers, values, color=_COLOURS[kind], marker=_MARKERS[kind], markersize=5, linewidth=0.8, label=WORDS[kind])
        fit = growth["fits"].get(kind)
        if fit is not None:
            x = np.geomspace(min(numbers), max(numbers), 64)
            axes.plot(x, fit["a"] + fit["b"] * np.log2(x), "--", color=_COLOURS[kind], linewidth=1.4,
                      label=f"{fit['a']:.1f} {fit['b']:+.2f} log$_2$ n")  # fmt: skip
    axes.set(xscale="log", xlabel=x_name, ylabel="ns a ray")
    axes.set_ylim(0.0, 1.35 * axes.get_ylim()[1])  # room for the legend
    axes.grid()
    axes.legend(fontsize=8)
    axes.set_title(title, loc="left")


def _powers(axes: Axes, x: NDArray[np.int64], lines: Mapping[str, tuple[str, str, list[float]]]) -> None:
    """Curves on logarithmic axes, with a guide of slope 1 through the end of the first."""
    for name, (colour, marker, values) in lines.items():
        axes.plot(x, values, color=colour, marker=marker, markersize=5, label=name)
    last = next(iter(lines.values()))[2][-1]
    axes.plot(x, last * x / x[-1], ":", color=GREY, linewidth=1.4, label="in proportion")
    axes.set(xscale="log", yscale="log")
    axes.grid()
    axes.legend(fontsize=8)

