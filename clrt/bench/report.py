"""The results of a run as text: tables on screen and as Markdown. The modules tables_* make them of numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from clrt.bench.marks import fewest_rounds
from clrt.bench.table import Table
from clrt.bench.tables_growth import growth_tables
from clrt.bench.tables_peers import (
    commands_table,
    cores_by_tracer,
    general_table,
    imports_table,
    incoherent_table,
    over_table,
    rungs_table,
    versus_table,
)
from clrt.bench.tables_trees import ladder_table, marks_table, programs_table, tests_table, trees_table
from clrt.cli.report import print_plainly, table
from clrt.timing import FEWEST

if TYPE_CHECKING:
    from rich.console import RenderableType

_BUSY = 0.9  #: share of the cores that a tracer gets on a machine that does nothing else


def tables(results: dict[str, Any]) -> list[Table]:
    """All tables of what a run has measured, the marks first."""
    found: list[Table] = []
    if results["marks"]:
        found.append(marks_table(results["marks"]))
    if "versus" in results:
        found += [make(results["versus"]) for make in (versus_table, over_table, rungs_table)]
        found.append(general_table(results["versus"]["general"]))
    makers: dict[str, Callable[[Any], Table]] = {
        "incoherent": incoherent_table, "commands": commands_table, "imports": imports_table, "trees": trees_table, "ladder": ladder_table,
        "tests": tests_table, "programs": programs_table,
    }  # fmt: skip
    found += [make(results[part]) for part, make in makers.items() if part in results]
    return found + (growth_tables(results["growth"]) if "growth" in results else [])


def heading(results: dict[str, Any]) -> str:
    """One line: when, and on what."""
    m = results["machine"]
    return (
        f"{results['started'][:10]}, {m['cpu']}, {m['cores']} cores, {m['memory_gib']:.0f} GiB; {m['opencl_platform']} "
        f"{m['opencl_driver']}, packets of {m['lanes']}; Python {m['python']}, NumPy {m['packages']['numpy']}; clrt {m['clrt']}"
        + (f", commit {m['commit']}" if m["commit"] else "")
    )


def warnings(results: dict[str, Any]) -> Iterator[str]:
    """What casts doubt on the figures, and what to do about it."""
    cores = results["machine"]["cores"]
    if results["quick"]:
        yield "This was a quick run over small pictures: it shows that the harness works, not how fast clrt is."
    elif "versus" in results:
        used = cores_by_tracer(results["versus"]["views"][-1]["cores_used"])
        # trimesh works on one core, whatever there is.
        if min((value for name, value in used.items() if name != "trimesh"), default=cores) < _BUSY * cores:
            load = results["load_before"][0]
            yield (
                f"Some tracers got less than nine tenths of the cores (load {load} before): ratios hold better than times; "
                "run again when idle."
            )
    if (rounds := fewest_rounds(results)) < FEWEST:
        yield f"Of {rounds} rounds no interval can be had: brackets hold the range of the ratios. Give --rounds {FEWEST} or more."
    if made := [scene["name"] for scene in results["scenes"] if scene["generated"]]:
        yield f"Measured on {' and '.join(made)}; --scenes FOLDER says where the report's rabbit.txt and monkey.txt are."


def print_results(results: dict[str, Any]) -> None:
    """All tables on screen."""
    from rich.text import Text

    shown: list[RenderableType] = [Text(heading(results))]
    for each in tables(results):
        grid = table(each.headings, words=each.words)
        for row in each.rows:
            grid.add_row(*(cell.replace("**", "") for cell in row))
        shown += [Text(), Text(each.title, style="bold underline"), grid, *([Text(each.note, style="dim")] if each.note else [])]
    print_plainly([*shown, Text(), *(Text(warning, style="yellow") for warning in warnings(results))])


def markdown(results: dict[str, Any], chosen: list[Table], level: int, images: str | None = None) -> str:
    """Tables as Markdown, under headings of this level, after a line that says when and on what; `images`: the folder of their plots."""
    parts = [f"Measured {heading(results)}.", *warnings(results)]
    for each in chosen:
        rule = [":--" if column < each.words else "--:" for column in range(len(each.headings))]
        lines = "\n".join(f"| {' | '.join(line)} |" for line in (each.headings, rule, *each.rows))
        plot = [f"![{each.title}]({images}/{each.image}.svg)"] if each.image and images is not None else []
        parts += [f"{'#' * level} {each.title}", *plot, lines, *([each.note] if each.note else [])]
    return "\n\n".join(parts)
