"""Are the files of a command line there, and can they be written? Asked before the work, not after it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from clrt.cli import streams
from clrt.cli.arguments import STDOUT
from clrt.errors import ClrtError
from clrt.files import atomic_write, check_writable

DEFAULT_SCENE = "input.txt"  #: rendered where no scene is given

_COMMANDS = ("devices", "explain", "study", "convert", "make", "render")
_MESHES = {".obj", ".ply", ".stl", ".off"}  #: not scenes by themselves, as .gltf and .glb are


def check_scene(path: Path) -> None:
    """Raise ClrtError where `path` is no scene text: a command misspelt, no file, a mesh."""
    if not path.exists() and path.parent == Path() and not path.suffix:
        import difflib  # for faults alone

        near = difflib.get_close_matches(str(path), _COMMANDS, 1, 0.7)
        if near:
            raise ClrtError(f"no command and no file is called {path}; did you mean `clrt {near[0]}`?")
    check_input(path)
    if path.suffix.lower() in _MESHES:
        raise ClrtError(
            f"{path}: this is a mesh; `clrt convert {path} scene.txt` makes a scene of it, the line \"mesh {path.name}\" puts it into one"
        )


def check_input(path: Path) -> None:
    """Raise ClrtError, with the nearest name there is, where `path` is no file."""
    if path.is_dir():
        raise ClrtError(f"{path}: this is a folder, not a file")
    if path.exists():
        return
    if not path.parent.is_dir():
        raise ClrtError(f"{path}: no such file; there is no folder {path.parent}")
    files = [entry.name for entry in path.parent.iterdir() if entry.is_file()]
    import difflib  # for faults alone

    near = difflib.get_close_matches(path.name, files, 1, 0.5)
    raise ClrtError(f"{path}: no such file" + (f"; did you mean {path.parent / near[0]}?" if near else ""))


def check_outputs(inputs: Mapping[str, Path], outputs: Mapping[str, Path | None]) -> None:
    """Raise where an output cannot be written (OSError), or is an input or another output (ClrtError). Keys say what a path is."""
    taken = {os.path.realpath(path): what for what, path in inputs.items()}
    for what, path in outputs.items():
        if path is None:
            continue
        check_writable(path)
        real = os.path.realpath(path)
        if real in taken and (path.is_file() or not path.exists()):
            raise ClrtError(f"{path}: this is the {taken[real]}, too; give the {what} another name")
        taken[real] = what


def write_text(text: str, path: Path) -> None:
    """To standard output where `path` is STDOUT, else the whole file. Raises OSError."""
    if path is STDOUT:
        streams.write(text)
        return
    with atomic_write(path) as file:
        file.write(text.encode())
