"""The figures of a run on screen."""

from __future__ import annotations

import io
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from clrt.cli import streams

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

    from clrt.stats import RunStats

_MAX_OBJECTS = 24  #: rows of the table; the JSON has all
_UNBOUNDED = 10_000  #: columns, where no terminal sets a width


@dataclass(frozen=True)
class Figures:
    """A table before it is set: `words` columns of text, then numbers; `total`: the last row sums up the others."""

    headings: list[str]
    rows: list[list[str]]
    words: int = 0
    total: bool = False


#: name, text, and what is said more faintly after it
Fact = tuple[str, str, str]


def print_report(stats: RunStats, picture: Path, error_map: str = "") -> None:
    """Print tables of objects and times, then lines: coloured and folded on a terminal, plain text elsewhere."""
    tables, facts = [object_figures(stats), time_figures(stats)], fact_lines(stats, picture, error_map)
    cells = [cell for t in tables for row in t.rows for cell in row] + [text for fact in facts for text in fact]
    if not streams.is_terminal(sys.stdout) and all(cell.isascii() and cell.isprintable() for cell in cells):
        # The same text without rich, whose import takes longer than the picture.
        blocks = [*(_plain([t.headings, *t.rows], t.words) for t in tables), _plain([[name, text + more] for name, text, more in facts], 2)]
        streams.write("\n".join(blocks))
        return
    from rich.text import Text

    print_plainly([_set(tables[0]), Text(), _set(tables[1]), Text(), _set_facts(facts)])


def _plain(rows: list[list[str]], words: int) -> str:
    """Columns two blanks apart, text to the left and numbers to the right, without trailing blanks."""
    columns = max(map(len, rows))
    widths = [max(len(row[i]) for row in rows if i < len(row)) for i in range(columns)]
    lines = []
    for row in rows:
        cells = (cell.ljust(width) if i < words else cell.rjust(width) for i, (cell, width) in enumerate(zip(row, widths, strict=False)))
        lines.append("  ".join(cells).rstrip() + "\n")
    return "".join(lines)


def _set(figures: Figures) -> Table:
    from rich.text import Text

    result = table(figures.headings, words=figures.words)
    for number, row in enumerate(figures.rows, 1):
        bold = figures.total and number == len(figures.rows)
        result.add_row(*(Text(cell) for cell in row), style="bold" if bold else None)
    return result


def _set_facts(facts: list[Fact]) -> Table:
    from rich.table import Table
    from rich.text import Text

    lines = Table.grid(padding=(0, 2, 0, 0))
    lines.add_column(style="bold", no_wrap=True)
    lines.add_column(overflow="fold")
    for name, text, more in facts:
        lines.add_row(name, Text(text).append_text(Text(more, style="dim")))
    return lines


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


def object_figures(stats: RunStats) -> Figures:
    """A row an object, the largest first where there are too many to show, and a row for all."""
    counted = stats.tests_per_ray is not None
    rows = []
    shown = stats.objects
    if len(shown) > _MAX_OBJECTS:
        shown = sorted(shown, key=lambda o: -o.triangles)[: _MAX_OBJECTS - 1]
    for o in shown:
        tests = [f"{o.tests_per_ray:.2f}"] if o.tests_per_ray is not None and counted else []
        rows.append([o.name, f"{o.triangles:,}", f"{o.nodes:,}", str(o.depth), seconds(o.build_s), *tests])
    if hidden := len(stats.objects) - len(shown):
        rows.append([f"({hidden} smaller objects)"])
    tests = [f"{stats.tests_per_ray:.2f}"] if stats.tests_per_ray is not None else []
    rows.append(["all", f"{stats.triangles:,}", f"{stats.nodes:,}", str(stats.depth), seconds(stats.build_s), *tests])
    headings = ["object", "triangles", "nodes", "depth", "build", *(["tests/ray"] if counted else [])]
    return Figures(headings, rows, words=1, total=True)


def time_figures(stats: RunStats) -> Figures:
    times = (stats.read_s, stats.build_s, stats.upload_s, stats.compile_s, stats.render_s, stats.write_s, stats.total_s)
    return Figures(["read", "build", "upload", "compile", "render", "write", "total"], [[seconds(t) for t in times]])


def fact_lines(stats: RunStats, picture: Path, error_map: str = "") -> list[Fact]:
    """Rays, their rate, the device, what the scene calls for, its error where that is known, the picture."""
    if stats.ray_counts is None:
        hint = "  (--stats FILE counts all rays, and the tests a ray)"
        lines = [("primary rays", f"{stats.primary_rays:,}{_per_second(stats.primary_rays_per_s)}", hint)]
    else:
        kinds = ", ".join(f"{kind} {n:,}" for kind, n in stats.ray_counts.items() if n)
        lines = [("rays", f"{stats.rays:,}{_per_second(stats.rays_per_s)}  ({kinds})", "")]
    lines.append(("device", stats.device, ""))
    lines.append(("effects", ", ".join(stats.effects) or "none", ""))
    if stats.bias:
        lines.append(("bias", f"{stats.bias}; without the clamp the mean is right", ""))
    lines.append(("precision", f"{stats.precision}, {stats.tree} trees", ""))
    if stats.accuracy is not None:
        from clrt.cli.accuracy import outcome_lines

        lines += [(name, text, "") for name, text in outcome_lines(stats)]
    if error_map:
        lines.append(("error map", error_map, ""))
    lines.append(("picture", f"{_printable(picture)}, {stats.width} x {stats.height}", ""))
    return lines


def seconds(value: float) -> str:
    return f"{value * 1e3:.1f} ms" if value < 1.0 else f"{value:.2f} s"


def _per_second(rate: float | None) -> str:
    return "" if rate is None else f", {rate / 1e6:.2f} million a second"


def _printable(path: Path) -> str:
    return os.fsencode(path).decode("utf-8", "replace")
