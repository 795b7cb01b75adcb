"""study.json: read, checked, written whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from clrt.errors import ClrtError
from clrt.files import atomic_write
from clrt.study.schema import FORMAT, KEYS, faults

FILE = "study.json"
#: what two runs must share to be one study, by its name in the header
_SAME = ("scene_sha256", "clrt", "size", "quick", "samples", "rung", "seeds", "build_options")
_WORDS = {"scene_sha256": "the scene's text", "clrt": "the version of clrt", "quick": "--quick"}


def empty(header: dict[str, Any]) -> dict[str, Any]:
    """A study of which nothing is measured."""
    return {"format": FORMAT, "header": header, **{key: None for key in KEYS if key not in ("format", "header")}}


def save(study: dict[str, Any], folder: Path) -> Path:
    """Write it to folder/study.json. Raises OSError."""
    path = folder / FILE
    with atomic_write(path) as file:
        file.write((json.dumps(study, indent=1, allow_nan=False) + "\n").encode())
    return path


def read(path: Path) -> dict[str, Any]:
    """The study in a file, or in the study.json of a folder. Raises ClrtError where it is none, OSError."""
    path = path / FILE if path.is_dir() else path
    if not path.exists():
        raise ClrtError(f"{path}: no such file; `clrt study scene.txt -o DIR` writes DIR/{FILE}")
    try:
        study = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ClrtError(f"{path}: no JSON ({error}); give a file that `clrt study` wrote") from None
    found = faults(study)
    if found:
        more = f", and {len(found) - 1} more" if len(found) > 1 else ""
        raise ClrtError(f"{path}: not a study: {found[0]}{more}; give a file that `clrt study` of this version wrote")
    return dict(study)


def resumed(folder: Path, header: dict[str, Any]) -> dict[str, Any]:
    """The study in `folder` to go on with. Raises ClrtError where there is none, or it is of something else than `header` says."""
    path = folder / FILE
    if not path.exists():
        raise ClrtError(f"{path}: there is nothing to resume; leave out --resume")
    study = read(path)
    for key in _SAME:
        was, now = study["header"].get(key), header[key]
        if was != now:
            told = "" if key == "scene_sha256" else f" ({was} there, {now} now)"
            raise ClrtError(f"{path}: {_WORDS.get(key, key)} is another one than in the study to be resumed{told}; "
                            "leave out --resume to begin anew, or give another folder")  # fmt: skip
    for key in ("device", "driver"):
        if study["header"]["opencl"][key] != header["opencl"][key]:
            raise ClrtError(f"{path}: the study to be resumed was measured with another OpenCL {key} ({study['header']['opencl'][key]}); "
                            "leave out --resume to begin anew")  # fmt: skip
    return study
