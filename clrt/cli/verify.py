"""`clrt verify`: the catalogue of hard cases on the user's device."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from clrt.cli import arguments as kinds
from clrt.cli import paths, streams
from clrt.cli.failure import FAULT
from clrt.cli.progress import PhaseProgress
from clrt.files import check_writable

if TYPE_CHECKING:
    from rich.table import Table

    from clrt.verify.case import Context, Result


_BEGIN, _END = "<!-- verify:begin -->", "<!-- verify:end -->"


@click.command("verify")
@click.option("--full", is_flag=True, help="1,000,000 rays a case instead of 100,000: many minutes.")
@click.option("--case", "numbers", type=kinds.whole(1), multiple=True, metavar="N", help="Run this case alone; may be repeated.")
@click.option(
    "--json",
    "json_path",
    type=kinds.file_or_stdout,
    metavar="FILE",
    help="Write all results as JSON too; - for standard output, instead of the table.",
)
@click.option(
    "--markdown",
    "page",
    type=kinds.file,
    metavar="FILE",
    help="Write the table as Markdown too; into the place that <!-- verify:begin --> marks, if any.",
)
@click.option("--device", metavar="NAME", help="Part of the name of a device that `clrt devices` lists.")
@click.option("--quiet", is_flag=True, help="No table and no progress: broken promises and the exit code only.")
def verify(full: bool, numbers: tuple[int, ...], json_path: Path | None, page: Path | None, device: str | None, quiet: bool) -> int:
    """Run the hard cases of docs/numerics.md on this machine.

    Counts disagreements with the oracle for each precision, and for a naive variant, which must fail. Exit codes: 0 all promises
    hold, 1 one is broken, 2 something to mend.
    """
    from clrt.verify.run import chosen, context_for, failures, to_json
    from clrt.verify.two import run_in_two

    cases = chosen(numbers)
    for path in (json_path, page):
        if path is not None and path is not kinds.STDOUT:
            check_writable(path)
    context = context_for(device, full=full)
    with PhaseProgress(quiet=quiet) as progress:
        start = time.perf_counter()
        results = run_in_two(cases, context, lambda _, done: progress("running the hard cases", done))
        taken = time.perf_counter() - start
    if json_path is not None:
        paths.write_text(json.dumps(to_json(results, context), indent=2, ensure_ascii=False) + "\n", json_path)
    if page is not None:
        _write_page(markdown_table(results, context), page)
    if not quiet and json_path is not kinds.STDOUT:
        _print(results, context, taken)
    broken = failures(results, context)
    for line in broken:
        streams.complain(f"clrt: broken promise: {line}\n")
    return FAULT if broken else 0


def _write_page(text: str, page: Path) -> None:
    """The table into the marked place of a page that has one, or as the whole of the file."""
    found = page.read_text(encoding="utf-8") if page.exists() else ""
    if _BEGIN in found and _END in found:
        before, after = found.partition(_BEGIN)[0], found.partition(_END)[2]
        text = f"{before}{_BEGIN}\n{text}\n{_END}{after}"
    paths.write_text(text, page)


def markdown_table(results: list[Result], context: Context) -> str:
    """The table of results as Markdown, under a line that says when and on what it was made."""
    import datetime

    from clrt.device.context import open_device

    info = open_device(context.device).info
    lines = [
        f"{datetime.date.today().isoformat()}, {info.name}, {info.platform} {info.driver}, packets of {info.lanes}. Disagreements with the "
        "oracle; in brackets where the rung makes no promise.\n",
        f"| case | | rays | {' | '.join(context.rungs)} | naive | verdict |",
        f"| --: | :-- | --: | {' | '.join('--:' for _ in context.rungs)} | --: | :-- |",
    ]
    for result in results:
        outcome = result.outcome
        cells = [str(result.case.number), result.case.title, f"{outcome.rays:,}" if outcome else "-"]
        cells += [_count(result, rung) for rung in context.rungs]
        cells += [f"{outcome.naive:,}" if outcome else "-", "**FAIL**" if result.failures(context.rungs) else "pass"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _print(results: list[Result], context: Context, taken: float) -> None:
    from rich.text import Text

    from clrt.cli.report import print_plainly, seconds

    passed = sum(not r.failures(context.rungs) for r in results)
    total = f"{passed} of {len(results)} cases pass, {seconds(taken)}"
    print_plainly([result_table(results, context), Text(), Text(total, style="bold")])


def result_table(results: list[Result], context: Context) -> Table:
    """A row a case. Counts in brackets: the rung makes no promise there. A dash: the case does not apply to it."""
    from rich.text import Text

    from clrt.cli.report import seconds, table

    shown = table(["case", "", "rays", *context.rungs, "naive", "time", ""], words=2)
    for result in results:
        case, outcome = result.case, result.outcome
        passed = not result.failures(context.rungs)
        counts = [_count(result, rung) for rung in context.rungs]
        rays, naive = (f"{outcome.rays:,}", f"{outcome.naive:,}") if outcome else ("-", "-")
        word = Text("pass" if passed else "FAIL", style="" if passed else "bold red")
        shown.add_row(str(case.number), Text(case.title), rays, *counts, naive, seconds(result.seconds), word)
    return shown


def _count(result: Result, rung: str) -> str:
    wrong = result.outcome.wrong.get(rung) if result.outcome else None
    if wrong is None:
        return "-"
    return f"{wrong:,}" if rung in result.case.promised else f"({wrong:,})"
