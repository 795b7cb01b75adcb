"""Results as files: JSON with every time, and the tables in the marked places of the documentation."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path
from typing import Any

from clrt.bench.plots import all_plots
from clrt.bench.report import markdown, tables
from clrt.bench.tables_peers import commands_table, over_table, versus_table
from clrt.bench.tables_trees import ladder_table, trees_table
from clrt.errors import ClrtError
from clrt.files import atomic_write, check_writable

BEGIN, END = "<!-- bench:begin -->", "<!-- bench:end -->"
_PLACE = re.compile(rf"{re.escape(BEGIN)}\n.*?{re.escape(END)}", re.S)
#: what may be measured, in this order
PARTS = ("versus", "incoherent", "ladder", "trees", "tests", "commands", "imports", "programs", "growth")
FORMAT = 2  #: of the JSON; one more where a key gets another meaning
_KEYS = ("started", "quick", "machine", "scenes", "marks")


def save(results: dict[str, Any], folder: Path) -> Path:
    """Write the results to a new file in `folder`, called by date and processor; returns its path. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    processor = re.sub(r"[^a-z0-9]+", "-", f"{results['machine']['cpu']} {results['machine']['cores']} cores".lower()).strip("-")
    date = re.sub(r"[^0-9T]", "", results["started"].partition("+")[0])
    path = folder / f"{date}-{processor}{'-quick' if results['quick'] else ''}.json"
    with atomic_write(path) as file:
        file.write((json.dumps(results, indent=1, allow_nan=False) + "\n").encode())
    return path


def read(path: Path) -> dict[str, Any]:
    """The results in a file that `save` wrote. Raises ClrtError where it is none, OSError."""
    try:
        results = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ClrtError(f"{path}: no JSON ({error}); give a file that `python -m clrt.bench` wrote") from None
    missing = [key for key in _KEYS if not isinstance(results, dict) or key not in results]
    if missing:
        raise ClrtError(f"{path}: no results of the benchmarks, {missing[0]} is missing; give a file that `python -m clrt.bench` wrote")
    if results.get("format") != FORMAT:
        raise ClrtError(f"{path}: results of another version of the benchmarks; measure again, or read them with that version")
    return dict(results)


def check_docs(root: Path) -> None:
    """Raise ClrtError where the checkout at `root` has no marked places, OSError where they cannot be written: before the work."""
    if importlib.util.find_spec("matplotlib") is None:
        raise ClrtError("the plots of the documentation need matplotlib; `pip install 'clrt[bench]'` brings it")
    for path in _documents(root):
        if not path.is_file():
            raise ClrtError(f"{path}: no such file; --write-docs works in a checkout")
        check_writable(path)
        if len(_PLACE.findall(path.read_text(encoding="utf-8"))) != 1:
            raise ClrtError(f"{path}: the tables go between the lines {BEGIN} and {END}, which this file must have once")


def write_docs(results: dict[str, Any], root: Path) -> list[Path]:
    """Put all tables and plots into docs/performance.md, the main tables into README.md, the ladder into docs/numerics.md; returns what
    was written.

    Raises as `check_docs`.
    """
    if results["quick"]:
        raise ClrtError("a quick run is not for the documentation; leave out --quick")
    if missing := [part for part in PARTS if part not in results]:
        raise ClrtError(f"the documentation has a place for every part, and the run has no {missing[0]}; leave out --only")
    check_docs(root)
    page, readme, numerics = _documents(root)
    written = [page, readme, numerics]
    for plot in all_plots(results):
        written.append(root / "docs" / "images" / f"{plot.key}.svg")
        written[-1].parent.mkdir(exist_ok=True)
        with atomic_write(written[-1]) as file:
            file.write(plot.svg)
    main = [
        versus_table(results["versus"]), over_table(results["versus"]), commands_table(results["commands"]), trees_table(results["trees"])
    ]  # fmt: skip
    chosen = ((page, tables(results)), (readme, main), (numerics, [ladder_table(results["ladder"])]))
    for path, shown in chosen:
        text = markdown(results, shown, 3, "images" if path is page else None)
        before, _, after = path.read_text(encoding="utf-8").partition(BEGIN)
        with atomic_write(path) as file:
            file.write(f"{before}{BEGIN}\n{text}\n{END}{after.partition(END)[2]}".encode())
    return written


def _documents(root: Path) -> tuple[Path, Path, Path]:
    return root / "docs" / "performance.md", root / "README.md", root / "docs" / "numerics.md"
