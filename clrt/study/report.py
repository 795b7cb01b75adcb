"""study.json shown: study.md, study.html and the plots, made of the JSON and the pictures beside it, and of nothing else."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from clrt.errors import ClrtError
from clrt.files import atomic_write
from clrt.study.report_markdown import markdown
from clrt.study.report_page import page
from clrt.study.report_pictures import read_pictures
from clrt.study.report_plots import all_plots
from clrt.study.report_tables import PARTS, sections

JSON_NAME = "study.json"


def write(folder: Path) -> list[Path]:
    """Write study.md, study.html and plots/*.svg and *.png into `folder`, from its study.json and pictures; the files written.

    The same JSON and pictures give the same bytes. Raises ClrtError where the JSON or a picture is missing or cannot be read, or
    matplotlib or Jinja2 is not installed, before anything is written; OSError where writing fails.
    """
    study = read_study(folder / JSON_NAME)
    pictures = read_pictures(folder, study.get("precision"))
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


def read_study(path: Path) -> Mapping[str, Any]:
    """The JSON of a study, as far as it was measured. Raises ClrtError where there is none."""
    try:
        study = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ClrtError(f"{path} cannot be read: {error.strerror}; `clrt study SCENE -o {path.parent}` measures it") from error
    except ValueError as error:
        raise ClrtError(f"{path} is no JSON: {error}; `clrt study SCENE -o {path.parent}` measures it anew") from error
    if not isinstance(study, dict) or not isinstance(study.get("header"), dict):
        raise ClrtError(f"{path} is no study: a JSON object with the keys header, verdict, {', '.join(p.key for p in PARTS)} is expected")
    return study
