"""The plots of a study, drawn with matplotlib from its JSON alone; the same JSON gives the same bytes."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.text import Text

#: Colours that people with any kind of colour vision tell apart (Okabe and Ito, 2008), on light and on dark ground.
BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072b2", "#d55e00", "#009e73", "#aa5c93", "#888888"
INK, LINES, GROUND = "#1f2328", "#d0d7de", "#fefefe"  #: text and axes; grid; what is behind them. The page has its own in the dark
INCHES = (6.2, 4.0)
_DPI = 150
_STYLE: dict[str, Any] = {
    "svg.hashsalt": "clrt", "svg.fonttype": "path", "font.family": "DejaVu Sans", "font.size": 10.5, "axes.titlesize": 11,
    "axes.titleweight": "bold", "axes.spines.top": False, "axes.spines.right": False, "text.color": INK, "axes.labelcolor": INK,
    "axes.edgecolor": INK, "xtick.color": INK, "ytick.color": INK, "grid.color": LINES, "grid.linewidth": 0.7, "axes.axisbelow": True,
    "axes.grid": False, "legend.frameon": False, "legend.fontsize": 9, "figure.facecolor": "white", "axes.facecolor": "none",
    "errorbar.capsize": 3.5, "lines.linewidth": 1.8,
}  # fmt: skip


@dataclass(frozen=True)
class Plot:
    """A drawn plot under the key of its part; `caption` says what is seen in it."""

    key: str
    title: str
    caption: str
    svg: bytes
    png: bytes


Draw = Callable[["Figure", Mapping[str, Any]], str]  #: draws a part of the JSON, returns the caption


class NothingToDraw(Exception):
    """Too few numbers for a plot: the table alone says it."""


@contextmanager
def style() -> Iterator[None]:
    """Settings of all plots, whatever matplotlibrc the user has."""
    from matplotlib import rc_context, rcParamsDefault

    defaults: Any = rcParamsDefault
    settings = {name: value for name, value in defaults.items() if not name.startswith(("backend", "interactive", "toolbar"))}
    with rc_context(settings | _STYLE):
        yield


def draw(key: str, title: str, content: object, paint: Draw, inches: tuple[float, float] = INCHES) -> Plot | None:
    """One plot, or None where the part has too little to draw."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if not isinstance(content, Mapping):
        return None
    figure = Figure(figsize=inches, layout="constrained")
    FigureCanvasAgg(figure)
    try:
        caption = paint(figure, content)
    except NothingToDraw:
        return None
    return Plot(key, title, caption, _svg(figure), _png(figure))


def _svg(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI, metadata={"Software": None})
    return buffer.getvalue()


def halo(axes_text: Text) -> None:
    """Keeps a text readable where lines run behind it."""
    from matplotlib.patheffects import withStroke

    axes_text.set_path_effects([withStroke(linewidth=3, foreground=GROUND)])


def all_plots(study: Mapping[str, Any]) -> list[Plot]:
    """Every plot that the study has numbers for, in the order of the page."""
    from clrt.study.report_bars import draw_effects, draw_phases, draw_precision, draw_trees
    from clrt.study.report_curves import draw_bias, draw_depth, draw_samples

    def bars(key: str) -> tuple[float, float]:
        content = study.get(key)
        count = len(content.get("rows") or []) if isinstance(content, Mapping) else 0
        return INCHES[0], 1.3 + 0.38 * max(count, 2)

    wanted: Sequence[tuple[str, str, Draw, tuple[float, float]]] = (
        ("precision", "What each rung costs, and what it leaves wrong", draw_precision, bars("precision")),
        ("samples", "Error against time", draw_samples, INCHES),
        ("depth", "Error against time, by depth", draw_depth, INCHES),
        ("effects", "What each effect costs, and what the picture loses without it", draw_effects, bars("effects")),
        ("trees", "One tree against the other", draw_trees, (INCHES[0], 3.4)),
        ("bias", "Bias and variance", draw_bias, INCHES),
        ("phases", "Where the time goes", draw_phases, bars("phases")),
    )
    with style():
        plots = [draw(key, title, study.get(key), paint, inches) for key, title, paint, inches in wanted]
    return [plot for plot in plots if plot is not None]
