"""`clrt convert` and `clrt make`: scene texts from meshes and from formulae."""

from __future__ import annotations

import difflib
from pathlib import Path

import click

from clrt.cli import arguments as kinds
from clrt.cli import paths, streams
from clrt.cli.progress import PhaseProgress
from clrt.errors import ClrtError


@click.command("convert")
@click.argument("mesh", type=kinds.file)
@click.argument("scene", type=kinds.file)
@click.option("--smooth", is_flag=True, help="Give each corner a normal, the mean of the faces around it.")
def convert(mesh: Path, scene: Path, smooth: bool) -> None:
    """Make a scene of a mesh (.obj, .ply, .stl, ...).

    The mesh is scaled to fit the view and gets a material and a light.
    """
    paths.check_input(mesh)
    paths.check_outputs({"mesh": mesh}, {"scene": scene})
    from clrt.convert import convert as convert_mesh

    with PhaseProgress() as progress:
        progress("convert", 0.0)
        summary = convert_mesh(mesh, scene, smooth)
    streams.write(f"{summary}\n")


class _Make(click.Command):
    """Lists the kinds at the end of its help, read only when the help is asked for."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        from clrt.generate import KINDS

        with formatter.section("Kinds"):
            formatter.write_dl(list(KINDS.items()))


@click.command("make", cls=_Make)
@click.argument("kind")
@click.option("-o", "--out", type=kinds.file, required=True, metavar="FILE", help="Scene text to write.")
@click.option("--triangles", type=kinds.whole(1), default=10_000, show_default=True, metavar="N", help="About how many.")
@click.option("--seed", type=kinds.whole(0), default=0, show_default=True, metavar="N", help="Of the random numbers.")
def make(kind: str, out: Path, triangles: int, seed: int) -> None:
    """Make a scene of any size, for trials and measurements."""
    from clrt.generate import KINDS
    from clrt.generate import make as make_scene

    if kind not in KINDS:
        near = difflib.get_close_matches(kind, list(KINDS), 1)
        hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(KINDS)}"
        raise ClrtError(f"no kind of scene is called {kind}; {hint}")
    paths.check_outputs({}, {"scene": out})
    with PhaseProgress() as progress:
        progress("make", 0.0)
        summary = make_scene(kind, out, triangles, seed)
    streams.write(f"{summary}\n")
