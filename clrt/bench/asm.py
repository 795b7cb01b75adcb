"""The instructions of the loops that rays spend their time in: `make asm`, or `python -m clrt.bench.asm [SCENE]`.

The scene is rendered once, small, by a process whose PoCL compiles into a fresh folder, with line numbers; what it leaves there is
disassembled. Line numbers change no instruction.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import click

from clrt.bench import disassembly
from clrt.bench.disassembly import Instruction, Loop
from clrt.cli import failure
from clrt.errors import ClrtError
from clrt.generate import make
from clrt.precision import DEFAULT, RUNGS

#: what a rung's test of a triangle calls, for the few lanes that float32 cannot decide, and how their rays get there
RARE = {"triangle_grazing", "triangle_unsure", "group_decide", "memcpy"}
_TRAVERSAL = ("triangle.cl", "kdtree.cl")  #: files, the one that says most of a loop first
_SIDE = 32


def leave_kernel(scene: Path, precision: str, folder: Path) -> Path:
    """Renders `scene` with PoCL's cache in `folder`; the library of its kernel `render`. Raises ClrtError where there is none."""
    cache = folder / "pocl"
    picture = str(folder / "picture.png")
    command = [sys.executable, "-m", "clrt", str(scene), "--size", f"{_SIDE}x{_SIDE}", "--precision", precision, "-o", picture]
    environment = {**os.environ, "POCL_CACHE_DIR": str(cache), "PYOPENCL_BUILD_OPTIONS": "-g"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ClrtError(done.stderr.strip().removeprefix("clrt: ").removeprefix("error: "))
    found = sorted(cache.rglob("render.so"))
    if not found:
        raise ClrtError("the device left no compiled kernel; only PoCL does: install it with  pip install 'pyopencl[pocl]'")
    return found[0]


def traversal_loops(functions: dict[str, list[Instruction]]) -> list[Loop]:
    """The innermost loops of the traversal, all copies of it: down the tree, over a leaf's triangles, back up."""
    tracing = {name: body for name, body in functions.items() if any(i.file == "kdtree.cl" for i in body)}
    loops = [loop for name, body in tracing.items() for loop in disassembly.inner_loops(name, body, RARE)]
    return [loop for loop in loops if loop.files & set(_TRAVERSAL)]


def traversal_calls(functions: dict[str, list[Instruction]]) -> set[str]:
    """All that is called from the lines of the traversal and of triangle tests, but for what rare functions call themselves."""
    inside = [i for name, body in functions.items() if name not in RARE for i in body]
    return {i.called for i in inside if i.called and (i.file in _TRAVERSAL or i.file.startswith("triangle_"))}


def _title(loop: Loop) -> str:
    file = next(file for file in _TRAVERSAL if file in loop.files)
    lines = sorted(i.line for i in loop.body if i.file == file)
    vectors, across = sum(i.vector for i in loop.body), sum(i.reduces for i in loop.body)
    return (
        f"{loop.function}, {file}:{lines[0]}-{lines[-1]}: {len(loop.body)} instructions, {vectors} of vectors; "
        f"calls {len(loop.calls)}; vectors from the stack {loop.spills('load')}, to it {loop.spills('store')}; across lanes {across}"
    )


def report(loops: Sequence[Loop], *, full: bool) -> str:
    """A line a loop; with `full` its instructions, too."""
    lines = []
    for loop in loops:
        lines.append(_title(loop))
        if full:
            lines += [f"  {i.address:8x}  {f'{i.file}:{i.line}' if i.file else '':24} {i.mnemonic:14} {i.operands}" for i in loop.body]
            lines.append("")
    return "\n".join(lines)


@click.command("asm", context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("scene", required=False, type=click.Path(path_type=Path))
@click.option("--precision", type=click.Choice(list(RUNGS)), default=DEFAULT, show_default=True, help="The rung.")
@click.option("--brief", is_flag=True, help="Counts alone, without the instructions.")
def asm(scene: Path | None, precision: str, brief: bool) -> None:
    """Show the instructions of the innermost loops of the traversal, as PoCL compiled it for SCENE (a generated one without it)."""
    with tempfile.TemporaryDirectory(prefix="clrt-asm-") as scratch:
        folder = Path(scratch)
        if scene is None:
            scene = folder / "scene.txt"
            make("rabbit-like", scene, 1000, seed=1)
        functions = disassembly.functions(disassembly.disassemble(leave_kernel(scene.resolve(), precision, folder)))
    loops = traversal_loops(functions)
    if not loops:
        raise ClrtError("no loop of the traversal was recognised; the compiler left no line numbers, or this is no x86-64 processor")
    click.echo(report(loops, full=not brief))
    click.echo(f"called from the traversal: {', '.join(sorted(traversal_calls(functions))) or 'nothing'}")


def main() -> None:
    """As the command line of clrt: every failure is one line and an exit code."""
    try:
        asm.main(prog_name="python -m clrt.bench.asm", standalone_mode=False)
    except (Exception, KeyboardInterrupt) as error:
        sys.exit(failure.report(error))


if __name__ == "__main__":
    main()
