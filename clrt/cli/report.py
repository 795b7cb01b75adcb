"""The figures of a run on screen."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from clrt.cli import streams

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

    from clrt.stats import RunStats

_MAX_OBJECTS = 24  #: rows of the table; the JSON has all
_UNBOUNDED = 10_000  #: columns, where no terminal sets a width


def print_report(stats: RunStats, picture: Path, error_map: str = "") -> None:
    """Print tables of objects and times, then lines: coloured and folded on a terminal, plain text elsewhere."""
    from rich.text import Text

    print_plainly([object_table(stats), Text(), time_table(stats), Text(), fact_lines(stats, picture, error_map)])


def print_plainly(renderables: list[RenderableType]) -> None:
    """Print to standard output without trailing blanks; characters that its encoding lacks become question marks."""
    from rich.console import Console

    terminal = streams.is_terminal(sys.stdout)
    buffer = io.StringIO()
    console = Console(file=buffer, force_terminal=terminal, width=None if terminal else _UNBOUNDED, highlight=False)
    for renderable in renderables:
        console.print(renderable)
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    text = "".join(line.rstrip() + "\n" for line in buffer.getvalue().splitlines())
    streams.write(text.encode(encoding, "replace").decode(encoding))


def table(headings: list[str], *, words: int = 0) -> Table:
    """A table without frames; the first `words` columns are left-aligned text that folds, the others numbers."""
    from rich.table import Table

    result = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for column, heading in enumerate(headings):
        if column < words:
            result.add_column(heading, overflow="fold")
        else:
            result.add_column(heading, justify="right", no_wrap=True)
    return result


def object_table(stats: RunStats) -> Table:
    """A row an object, the largest first where there are too many to show, and a row for all."""
    from rich.text import Text

    counted = stats.tests_per_ray is not None
    result = table(["object", "triangles", "nodes", "depth", "build", *(["tests/ray"] if counted else [])], words=1)
    shown = stats.objects
    if len(shown) > _MAX_OBJECTS:
        shown = sorted(shown, key=lambda o: -o.triangles)[: _MAX_OBJECTS - 1]
    for o in shown:
        tests = [f"{o.tests_per_ray:.2f}"] if o.tests_per_ray is not None and counted else []
        result.add_row(Text(o.name), f"{o.triangles:,}", f"{o.nodes:,}", str(o.depth), seconds(o.build_s), *tests)
    if hidden := len(stats.objects) - len(shown):
        result.add_row(f"({hidden} smaller objects)")
    tests = [f"{stats.tests_per_ray:.2f}"] if stats.tests_per_ray is not None else []
    result.add_row("all", f"{stats.triangles:,}", f"{stats.nodes:,}", str(stats.depth), seconds(stats.build_s), *tests, style="bold")
    return result


def time_table(stats: RunStats) -> Table:
    result = table(["read", "build", "upload", "compile", "render", "write", "total"])
    times = (stats.read_s, stats.build_s, stats.upload_s, stats.compile_s, stats.render_s, stats.write_s, stats.total_s)
    result.add_row(*(seconds(t) for t in times))
    return result


def fact_lines(stats: RunStats, picture: Path, error_map: str = "") -> Table:
    """Rays, their rate, the device, what the scene calls for, its error where that is known, the picture."""
    from rich.table import Table
    from rich.text import Text

    lines = Table.grid(padding=(0, 2, 0, 0))
    lines.add_column(style="bold", no_wrap=True)
    lines.add_column(overflow="fold")
    if stats.ray_counts is None:
        hint = Text("  (--stats FILE counts all rays, and the tests a ray)", style="dim")
        lines.add_row("primary rays", Text(f"{stats.primary_rays:,}{_per_second(stats.primary_rays_per_s)}").append_text(hint))
    else:
        kinds = ", ".join(f"{kind} {n:,}" for kind, n in stats.ray_counts.items() if n)
        lines.add_row("rays", Text(f"{stats.rays:,}{_per_second(stats.rays_per_s)}  ({kinds})"))
    lines.add_row("device", Text(stats.device))
    lines.add_row("effects", Text(", ".join(stats.effects) or "none"))
    if stats.bias:
        lines.add_row("bias", Text(f"{stats.bias}; without the clamp the mean is right"))
    lines.add_row("precision", Text(f"{stats.precision}, {stats.tree} trees"))
    if stats.accuracy is not None:
        from clrt.cli.accuracy import outcome_lines

        for name, text in outcome_lines(stats):
            lines.add_row(name, Text(text))
    if error_map:
        lines.add_row("error map", Text(error_map))
    lines.add_row("picture", Text(f"{_printable(picture)}, {stats.width} x {stats.height}"))
    return lines


def seconds(value: float) -> str:
    return f"{value * 1e3:.1f} ms" if value < 1.0 else f"{value:.2f} s"


def _per_second(rate: float | None) -> str:
    return "" if rate is None else f", {rate / 1e6:.2f} million a second"


def _printable(path: Path) -> str:
    return os.fsencode(path).decode("utf-8", "replace")
