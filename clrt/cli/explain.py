"""`clrt explain`: which effects a scene calls for, what each adds, and, when asked, what it costs and changes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from clrt.cli import arguments as kinds
from clrt.cli import failure, paths
from clrt.cli.progress import PhaseProgress

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult
    from rich.table import Table

    from clrt.explain import Explained, Explanation

_NARROW = 72  #: columns; with fewer, a block of lines an effect takes the place of tables


@click.command("explain")
@click.argument("scene", type=kinds.file)
@click.option("--measure", "measured", is_flag=True, help="Time the scene with and without each effect, and compare the pictures.")
@click.option("--rounds", type=kinds.whole(6), default=15, show_default=True, metavar="N", help="Of timing, fewer where they are long.")
@click.option("--json", "json_path", type=kinds.file_or_stdout, metavar="FILE", help="Write it as JSON; - for standard output, no tables.")
@click.option("--size", type=kinds.size, metavar="WxH", help="Width and height in pixels, instead of the scene's.")
@click.option("--tree", type=click.Choice(["sah", "median"]), default="sah", show_default=True, help="How the kd-trees are split.")
@click.option("--device", metavar="NAME", help="Part of the name of an OpenCL device; `clrt devices` lists them.")
@click.option("--depth", type=kinds.whole(0), metavar="N", help="Reflections and refractions in a row, instead of the scene's.")
@click.option("--samples", type=kinds.whole(1, 1 << 16), metavar="N", help="Rays through each pixel, instead of the scene's.")
@click.option("--seed", type=kinds.whole(0, (1 << 32) - 1), metavar="S", default=0, show_default=True, help="Of all random numbers.")
@click.option("--precision", metavar="NAME", default="watertight", show_default=True, help="fast, watertight, exact or double.")
@click.option("--right-handed", is_flag=True, help="Mirror x: for scenes made in right-handed axes.")
@click.option("--split-objects", is_flag=True, help="Make each connected component an object, where the scene marks none.")
@click.option("--allow-path", type=kinds.file, multiple=True, metavar="DIR", help="Permit the scene to name files in DIR, too.")
@click.option("-q", "--quiet", is_flag=True, help="Print no tables and no progress.")
def explain(scene: Path, json_path: Path | None, quiet: bool, **options: Any) -> None:
    """List the effects of SCENE, and the line that calls for each.

    `clrt SCENE --without EFFECT` renders without one. What an effect adds and costs is that of leaving it out, with what needs it.
    """
    paths.check_scene(scene)
    paths.check_outputs({"scene": scene}, {"file of effects": None if json_path is kinds.STDOUT else json_path})
    with PhaseProgress(quiet=quiet) as progress:
        found = _explain(scene, progress, **options)
    if json_path is not None:
        paths.write_text(json.dumps(found.to_json(), indent=2, allow_nan=False) + "\n", json_path)
    if not quiet and json_path is not kinds.STDOUT:
        from clrt.cli.report import print_plainly

        print_plainly([_Page(found)])


def _explain(
    path: Path, progress: PhaseProgress, *, measured: bool, rounds: int, size: tuple[int, int] | None, tree: str, device: str | None,
    depth: int | None, samples: int | None, seed: int, precision: str, right_handed: bool, split_objects: bool,
    allow_path: tuple[Path, ...],
) -> Explanation:  # fmt: skip
    from clrt.device.context import open_device
    from clrt.explain import explain, measure
    from clrt.precision import rung
    from clrt.renderer import build_trees, with_options
    from clrt.scene.build import load_scene

    ladder = rung(precision)
    progress("read", 0.0)
    scene = load_scene(path, right_handed=right_handed, split_objects=split_objects, allow_paths=allow_path)
    for warning in scene.warnings:
        failure.warn(f"{scene.source}: {warning}")
    opened = open_device(device)
    prepared = build_trees(with_options(scene, size, depth, samples, seed), tree, progress, opened)
    found = explain(prepared, ladder, opened, progress)
    return measure(found, prepared, ladder, opened, rounds, progress) if measured else found


class _Page:
    """All of an explanation, as tables or, where there is no room for these, as lines."""

    def __init__(self, found: Explanation) -> None:
        self.found = found

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich.text import Text

        found, measured = self.found, any(effect.cost is not None for effect in self.found.effects)
        if options.max_width < _NARROW:
            yield from (Text(line) for effect in found.effects for line in _block(effect))
        elif found.effects:
            yield effects_table(found)
            if measured:
                yield from (Text(), cost_table(found), Text(), difference_table(found))
            yield Text()
        yield Text.assemble(("all of it ", "bold"), f"{found.source_bytes:,} bytes of program, {found.buffer_bytes:,} bytes of buffers")
        yield Text.assemble(("off       ", "bold"), ", ".join(found.off) or "nothing")
        if measured:
            rounds = min(len(effect.cost.with_s) for effect in found.effects if effect.cost is not None)
            camera = found.scene.camera
            yield Text(
                f"Medians of {rounds} rounds or more, {camera.width} x {camera.height}, each picture in turns with and without the effect; "
                "the interval holds the median cost with 95%.",
                style="dim",
            )


def effects_table(found: Explanation) -> Table:
    """The effects that are on: the line that calls for each, what it adds."""
    from rich.text import Text

    from clrt.cli.report import table

    result = table(["effect", "with it go", "line", "that calls for it", "program", "buffers"], words=0)
    for column in (0, 1, 3):
        result.columns[column].justify, result.columns[column].no_wrap, result.columns[column].overflow = "left", False, "fold"
    for effect in found.effects:
        line = str(effect.line) if effect.line else "-"
        added = map(_bytes, (effect.source_bytes, effect.buffer_bytes))
        result.add_row(Text(effect.name), Text(", ".join(effect.brings)), line, Text(_short(effect.text)), *added)
    return result


def cost_table(found: Explanation) -> Table:
    """Times with and without each effect."""
    from rich.text import Text

    from clrt.cli.report import table

    result = table(["effect", "with", "without", "costs", "", "95% interval"], words=1)
    for effect in found.effects:
        if effect.cost is not None:
            result.add_row(Text(effect.name), *_times(effect))
    return result


def difference_table(found: Explanation) -> Table:
    """How the picture differs without each effect."""
    from rich.text import Text

    from clrt.cli.report import table

    result = table(["without", "pixels that differ", "at most by", "on average by"], words=1)
    for effect in found.effects:
        if effect.cost is not None:
            d = effect.cost.difference
            result.add_row(Text(effect.name), f"{d.pixels:.2%}", f"{d.greatest:.4g}", f"{d.mean:.4g}")
    return result


def _times(effect: Explained) -> tuple[str, str, str, str, str]:
    """Medians with and without, the cost, its part of the whole, its interval."""
    import statistics

    assert effect.cost is not None
    whole, low_high = statistics.median(effect.cost.with_s), effect.cost.interval_s
    low, high = (_signed(value) for value in low_high)
    return (
        _milliseconds(whole), _milliseconds(statistics.median(effect.cost.without_s)), _signed(effect.cost.cost_s),
        f"{effect.cost.cost_s / whole:+.0%}", f"{low} to {high}",
    )  # fmt: skip


def _block(effect: Explained) -> list[str]:
    """What the tables say of one effect, in lines."""
    lines = [f"{effect.name}: line {effect.line}" if effect.line else effect.name]
    if effect.text:
        lines.append(f"  {_short(effect.text)}")
    lines.append(f"  program {_bytes(effect.source_bytes)}, buffers {_bytes(effect.buffer_bytes)}")
    if effect.brings:
        lines.append(f"  with it go {', '.join(effect.brings)}")
    if effect.cost is not None:
        _, _, cost, part, interval = _times(effect)
        d = effect.cost.difference
        lines += [f"  costs {cost} ({part})", f"  95%: {interval}", f"  changes {d.pixels:.2%} of pixels"]
        lines.append(f"  by {d.greatest:.4g} at most")
    return [*lines, ""]


_LONGEST = 48  #: characters of a line of the scene that are shown


def _short(text: str) -> str:
    plain = " ".join(text.split())
    return plain if len(plain) <= _LONGEST else plain[: _LONGEST - 3] + "..."


def _bytes(count: int) -> str:
    return f"{count:+,}"


def _milliseconds(seconds: float) -> str:
    return f"{seconds * 1e3:.2f} ms" if seconds < 1.0 else f"{seconds:.3f} s"


def _signed(seconds: float) -> str:
    return f"{seconds * 1e3:+.2f} ms"
