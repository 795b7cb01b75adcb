"""The results of a run as tables: text made of numbers here, on screen and as Markdown below."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from clrt.cli.report import print_plainly, seconds, table

if TYPE_CHECKING:
    from rich.console import RenderableType

_BUSY = 0.9  #: share of the cores that a tracer gets on a machine that does nothing else
_VERDICTS = {True: "pass", False: "**miss**", None: "-"}


@dataclass(frozen=True)
class Table:
    """A table of text; the first `words` columns are words, the others numbers. `note` says what was compared with what."""

    title: str
    headings: list[str]
    rows: list[list[str]]
    words: int = 1
    note: str = ""


def tables(results: dict[str, Any]) -> list[Table]:
    """All tables of a run, the marks first."""
    return [
        marks_table(results["marks"]), trees_table(results["trees"]), versus_table(results["versus"], results["machine"]["cores"]),
        incoherent_table(results["incoherent"]),
        ladder_table(results["ladder"]), tests_table(results["tests"]), command_table(results["command"]),
        programs_table(results["programs"]),
    ]  # fmt: skip


def marks_table(marks: list[dict[str, Any]]) -> Table:
    rows = [[m["what"], m["target"], m["measured"], _VERDICTS[m["passed"]] + (f" ({m['note']})" if m["note"] else "")] for m in marks]
    return Table("Marks", ["mark", "target", "measured", "verdict"], rows, words=4)


def trees_table(rows: list[dict[str, Any]]) -> Table:
    """The report's table: trees, and render times with and without them."""
    headings = [
        "scene", "tree", "size", "triangles", "nodes", "depth", "build", "tests/ray", "render", "brute force", "speed-up", "same rays"
    ]  # fmt: skip
    cells = []
    for row in rows:
        about = "about " if row["sample"] else ""
        cells.append([
            row["scene"], row["tree"], f"{row['size']}²", f"{row['triangles']:,}", f"{row['nodes']:,}", str(row["depth"]),
            seconds(row["build_s"]["best"]), f"{row['tests_per_ray']:.1f}", seconds(row["render_s"]["best"]),
            about + seconds(row["brute_picture_s"]), f"{about}{row['speed_up']:.1f}", _times(row["speed_up_same_rays"]),
        ])  # fmt: skip
    return Table("kd-trees against brute force", headings, cells, words=2, note=_trees_note(rows))


def _trees_note(rows: list[dict[str, Any]]) -> str:
    note = (
        "Best times, in turns. Brute force is the same kernels over a tree of one leaf an object: a ray that meets the object's box "
        "is tested against all of its triangles. Tests a ray are over rays of all kinds."
    )
    if tests := {row["scene"]: row["brute_tests_per_ray"] for row in rows}:
        note += " Brute force's: " + ", ".join(f"{count:,.0f} in {scene}" for scene, count in tests.items()) + "."
    if sizes := sorted({row["sample"]["size"] for row in rows if row["sample"]}):
        note += (
            f" Where it says about, brute force was not run over the whole picture: its time a ray was measured on a picture of the same "
            f"view at {sizes[0]} squared, less an empty launch. The last column has the trees timed on the very same rays."
        )
    return note


def versus_table(versus: dict[str, Any], cores: int) -> Table:
    """Million rays a second against the peer's."""
    rates, rows = versus["rates"], []
    for kind, words in (("primary", "primary rays"), ("shadow", "shadow rays"), ("both", "both, and shading")):
        own, peer, ratio = (rates[who][kind] if who in rates else None for who in ("clrt", "embreex", "ratio"))
        count = {who: _rays(rays, kind) for who, rays in versus["rays"].items()}
        rows.append([words, count["clrt"], count.get("embreex", "-"), f"{own:.1f}", "-" if peer is None else f"{peer:.1f}", _times(ratio)])
    headings = [f"{versus['scene']}, {versus['size']}²", "rays, clrt", "rays, embreex", "clrt, M/s", "embreex, M/s", "ratio"]
    return Table("Rays a second, against embreex", headings, rows, note=_versus_note(versus, cores))


def _rays(rays: dict[str, int], kind: str) -> str:
    return f"{rays['primary'] + rays['shadow'] if kind == 'both' else rays[kind]:,}"


def _versus_note(versus: dict[str, Any], cores: int) -> str:
    if "ratio" not in versus["rates"]:
        return "embreex is not installed, so there is nothing to compare with; `pip install 'clrt[bench]'` brings it."
    differ, used = versus["pixels_that_differ"], versus["cores_used"]
    ours, theirs = (min(value for name, value in used.items() if name.startswith(who)) for who in ("clrt", "embreex"))
    return (
        "The scene without mirrors, glass and highlights, so that both trace the same rays. embreex: single rays, ready in arrays, on as "
        "many threads as there are cores; one number is written for each. clrt: launches that make the rays, trace them and shade what "
        "they hit; primary is a picture without lights, shadow what shadows add to a lit one, both the lit picture whole. "
        f"Cores in use, of {cores}: clrt {ours:.2f}, embreex {theirs:.2f}. "
        f"Pixels where only one hits anything: {differ['hit']:,}; where only one sees the light: {differ['lit']:,}."
    )


def incoherent_table(incoherent: dict[str, Any]) -> Table:
    """Million rays a second against the peer's, of rays that go all ways."""
    rates = incoherent["rates"]
    own, peer = rates["clrt"], rates.get("embreex")
    row = [incoherent["scene"], f"{incoherent['triangles']:,}", f"{incoherent['rays']:,}", f"{own:.2f}",
           "-" if peer is None else f"{peer:.2f}", _times(None if peer is None else own / peer)]  # fmt: skip
    note = (
        "From points of the scene's largest mesh in a closed room, in all directions, as indirect light sends them; the same arrays for "
        "both, in one call: clrt's RayCaster.first_hit, which gives a record a ray, and embreex's cheapest call, on all cores, "
        "which gives a number."
    )
    if "rays_that_differ" in incoherent:
        note += f" Rays for which they name another triangle: {incoherent['rays_that_differ']:,}."
    return Table("Incoherent rays, against embreex", ["scene", "triangles", "rays", "clrt, M/s", "embreex, M/s", "ratio"], [row], note=note)


def ladder_table(rows: list[dict[str, Any]]) -> Table:
    """What each rung costs over `fast`."""
    cells = []
    for row in rows:
        low, high = row["ratio_range"]
        decided = row["decided"] or {}
        cells.append([
            row["scene"], row["effects"], row["rung"], f"{row['size']}²", seconds(row["render_s"]["best"]), f"{row['ratio']:.3f}",
            f"{row['ratio_median']:.3f} ({low:.2f} to {high:.2f})", *(f"{decided[s]:,}" if decided else "-" for s in ("float64", "exact")),
        ])  # fmt: skip
    headings = ["scene", "with", "rung", "size", "best", "ratio of bests", "ratio by rounds, median", "lanes to float64", "to expansions"]
    note = "Launches in turns; a round's ratio is its time over that of `fast` in the same round."
    return Table("The precision ladder", headings, cells, words=3, note=note)


def tests_table(rows: list[dict[str, Any]]) -> Table:
    headings = ["scene", "tree", "size", "nodes", "depth", "rays", "tests/ray"]
    cells = [
        [
            row["scene"], row["tree"], f"{row['size']}²", f"{row['nodes']:,}", str(row["depth"]), f"{row['rays']:,}",
            f"{row['tests_per_ray']:.1f}",
        ]
        for row in rows
    ]  # fmt: skip
    return Table("Ray-triangle tests", headings, cells, words=2, note="Over primary, shadow and mirror rays, by the program that counts.")


def command_table(command: dict[str, Any]) -> Table:
    phases = {name.removesuffix("_s"): value for name, value in command["phases"].items()}
    times = command["seconds"]
    rows = [[command["scene"], f"{command['size']}²", seconds(times["best"]), seconds(times["median"]), *map(seconds, phases.values())]]
    note = (
        "Wall time of the process, best and median, after one run that fills the kernel cache; then the phases that one more run tells "
        "of itself."
    )
    return Table("The whole command", ["clrt scene.txt -o picture.png", "size", "best", "median", *phases], rows, note=note)


def programs_table(rows: list[dict[str, Any]]) -> Table:
    headings = ["program of", "effects", "bytes", "of absent effects", "with all effects"]
    cells = [
        [row["scene"], ", ".join(row["effects"]) or "none", *(f"{row[key]:,}" for key in ("bytes", "absent_bytes", "bytes_of_all_effects"))]
        for row in rows
    ]
    return Table("Specialised programs", headings, cells, words=2)


def _times(ratio: float | None) -> str:
    return "-" if ratio is None else f"{ratio:.1f}" if ratio >= 10.0 else f"{ratio:.2f}"


def heading(results: dict[str, Any]) -> str:
    """One line: when, and on what."""
    m = results["machine"]
    return (
        f"{results['started'][:10]}, {m['cpu']}, {m['cores']} cores, {m['memory_gib']:.0f} GiB; {m['opencl_platform']} "
        f"{m['opencl_driver']}, packets of {m['lanes']}; Python {m['python']}, NumPy {m['packages']['numpy']}; clrt {m['clrt']}"
        + (f", commit {m['commit']}" if m["commit"] else "")
    )


def warnings(results: dict[str, Any]) -> Iterator[str]:
    """What casts doubt on the figures, and what to do about it."""
    cores = results["machine"]["cores"]
    if results["quick"]:
        yield "This was a quick run over small pictures: it shows that the harness works, not how fast clrt is."
    if min(results["versus"]["cores_used"].values()) < _BUSY * cores and not results["quick"]:
        load = results["load_before"][0]
        yield f"Something else used the cores meanwhile (load {load} before): ratios hold better than times; run again when it is idle."
    if made := [scene["name"] for scene in results["scenes"] if scene["generated"]]:
        yield f"Measured on {' and '.join(made)}; --scenes FOLDER says where the report's rabbit.txt and monkey.txt are."


def print_results(results: dict[str, Any]) -> None:
    """All tables on screen."""
    from rich.text import Text

    shown: list[RenderableType] = [Text(heading(results))]
    for each in tables(results):
        grid = table(each.headings, words=each.words)
        for row in each.rows:
            grid.add_row(*(cell.replace("**", "") for cell in row))
        shown += [Text(), Text(each.title, style="bold underline"), grid, *([Text(each.note, style="dim")] if each.note else [])]
    print_plainly([*shown, Text(), *(Text(warning, style="yellow") for warning in warnings(results))])


def markdown(results: dict[str, Any], chosen: list[Table], level: int) -> str:
    """Tables as Markdown, under headings of this level, after a line that says when and on what."""
    parts = [f"Measured {heading(results)}.", *warnings(results)]
    for each in chosen:
        rule = [":--" if column < each.words else "--:" for column in range(len(each.headings))]
        lines = "\n".join(f"| {' | '.join(line)} |" for line in (each.headings, rule, *each.rows))
        parts += [f"{'#' * level} {each.title}", lines, *([each.note] if each.note else [])]
    return "\n\n".join(parts)
