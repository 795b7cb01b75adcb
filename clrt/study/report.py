"""study.json shown: study.md, study.html and the plots, made of the JSON and the pictures beside it, and of nothing else."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from clrt.errors import ClrtError
from clrt.files import atomic_write
from clrt.study import store
from clrt.study.report_markdown import markdown
from clrt.study.report_page import page
from clrt.study.report_pictures import read_pictures
from clrt.study.report_plots import all_plots
from clrt.study.report_tables import sections


def check_libraries() -> None:
    """Raises ClrtError where what `write` needs is not installed: to be said before a study is measured, not after it."""
    if missing := [name for name in ("matplotlib", "jinja2") if importlib.util.find_spec(name) is None]:
        raise ClrtError(f"the page of a study needs {' and '.join(missing)}; install what is missing: pip install 'clrt[study]'")


def write(folder: Path) -> list[Path]:
    """Write study.md, study.html and plots/*.svg and *.png into `folder`, from its study.json and pictures; the files written.

    The same JSON and pictures give the same bytes. Raises ClrtError where the JSON or a picture is missing or cannot be read, or a
    library is not installed, before anything is written; OSError where writing fails.
    """
    check_libraries()
    study = store.read(folder / store.FILE)
    pictures = read_pictures(folder, study["precision"])
    parts, plots = sections(study), all_plots(study)
    files = {
        "study.md": markdown(study, parts, plots).encode("utf-8"), "study.html": page(study, parts, plots, pictures).encode("utf-8"),
        **{f"plots/{plot.key}.svg": plot.svg for plot in plots}, **{f"plots/{plot.key}.png": plot.png for plot in plots},
    }  # fmt: skip
    (folder / "plots").mkdir(exist_ok=True)
    for name, content in files.items():
        with atomic_write(folder / name) as file:
            file.write(content)
    return [folder / name for name in files]
