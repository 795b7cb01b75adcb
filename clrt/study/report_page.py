"""A study as one page of HTML that needs no network: pictures, plots, style and script are in it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clrt.study.report_pictures import Pictures
from clrt.study.report_plots import GREY, GROUND, INK, LINES, Plot
from clrt.study.report_tables import Section, header_lines, summary

if TYPE_CHECKING:
    from markupsafe import Markup

_TEMPLATES = Path(__file__).parent / "page"


def page(study: Mapping[str, Any], parts: Sequence[Section], plots: Sequence[Plot], pictures: Pictures) -> str:
    """The text of study.html."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    # Everything from the JSON is escaped; only the plots, drawn here, are put in as they are.
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["words"] = _words
    header = study.get("header") or {}
    return environment.get_template("study.html").render(
        scene=str(header.get("scene", "a scene")), quick=bool(header.get("quick")), header=header_lines(header), summary=summary(header),
        verdict=[str(sentence) for sentence in study.get("verdict") or []], parts=parts, pictures=pictures,
        plots={plot.key: (plot, inline_svg(plot)) for plot in plots},
    )  # fmt: skip


def _words(text: str) -> Markup:
    """A sentence, escaped, with what stands between backquotes as code."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(text))))


def inline_svg(plot: Plot) -> str:
    """The drawing as an element of the page: ids of its own, named for who cannot see it, colours that follow the page's."""
    text = plot.svg.decode("utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.S)
    text = re.sub(r'\bid="', f'id="{plot.key}-', text)
    text = re.sub(r'(xlink:href="#|url\(#)', rf"\1{plot.key}-", text)
    for colour, name in ((INK, "ink"), (LINES, "lines"), (GREY, "grey"), (GROUND, "ground")):
        text = text.replace(colour, f"var(--{name})")
    text = text.replace("fill: #ffffff", "fill: none")  # the ground is the page's
    return text.replace("<svg", f'<svg role="img" aria-labelledby="plot-{plot.key}-title"', 1)
