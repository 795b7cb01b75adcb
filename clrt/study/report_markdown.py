"""A study as Markdown that also reads well in a terminal: columns are padded to one width."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from clrt.study.report_plots import Plot
from clrt.study.report_tables import Section, Table, header_lines, summary

_SPECIAL = re.compile(r"([\\*\[\]<>|&]|(?<!\w)_|_(?!\w))")  # not the backquote: notes have `words` of the program in them


def markdown(study: Mapping[str, Any], parts: Sequence[Section], plots: Sequence[Plot]) -> str:
    """The whole file: verdict, header, then a table a part with its plot."""
    header = study.get("header") or {}
    drawn = {plot.key: plot for plot in plots}
    blocks = [f"# Accuracy against time: {escape(str(header.get('scene', 'a scene')))}"]
    blocks += [escape(summary(header)), *_quick(header), "## Verdict", _verdict(study)]
    blocks += ["## Measured on", "\n".join(f"- {name}: {escape(text)}" for name, text in header_lines(header))]
    for part in parts:
        blocks += _blocks(part, drawn.get(part.part.key))
    return "\n\n".join(block for block in blocks if block) + "\n"


def _quick(header: Mapping[str, Any]) -> list[str]:
    return ["Measured with `--quick`: small pictures and few runs."] if header.get("quick") else []


def _verdict(study: Mapping[str, Any]) -> str:
    sentences = study.get("verdict") or []
    return "\n".join(f"- {escape(str(sentence))}" for sentence in sentences) or "No verdict: too little was measured."


def _blocks(section: Section, plot: Plot | None) -> list[str]:
    blocks = [f"## {section.part.title}", section.part.about]
    if section.table:
        blocks += [table(section.table), section.table.runs]
        blocks += ["\n".join(f"- {escape(text)}" for text in section.table.notes)]
    blocks += [escape(text) for text in (*section.facts, *section.notes)]
    return [*blocks, f"![{plot.title}](plots/{plot.key}.svg)", escape(plot.caption)] if plot else blocks


def table(content: Table) -> str:
    """Numbers to the right, words to the left, both padded."""
    lines = [[escape(text) for text in content.headings], *([escape(cell.text) for cell in row] for row in content.rows)]
    widths = [max(3, *(len(line[i]) for line in lines)) for i in range(len(content.headings))]
    rule = ["-" * (width - 1) + ":" if number else ":" + "-" * (width - 1) for width, number in zip(widths, content.numeric, strict=True)]
    padded = [
        [text.rjust(width) if number else text.ljust(width) for text, width, number in zip(line, widths, content.numeric, strict=True)]
        for line in lines
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in (padded[0], rule, *padded[1:]))


def escape(text: str) -> str:
    """A text of the JSON on one line, none of its characters markup."""
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))
