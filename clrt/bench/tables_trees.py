"""Tables of clrt by itself: the marks, trees against brute force, tests a ray, the precision ladder, specialised programs."""

from __future__ import annotations

from typing import Any

from clrt.bench.table import Table, interval, times
from clrt.cli.report import seconds

_VERDICTS = {True: "met", False: "**missed**", None: "-"}


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
            about + seconds(row["brute_picture_s"]), f"{about}{row['speed_up']:.1f}", times(row["speed_up_same_rays"]),
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


def ladder_table(rows: list[dict[str, Any]]) -> Table:
    """What each rung costs over `fast`."""
    cells = []
    for row in rows:
        decided = row["decided"] or {}
        cells.append([
            row["scene"], row["effects"], row["rung"], f"{row['size']}²", seconds(row["render_s"]["best"]), interval(row["ratio"], 3),
            *(f"{decided[s]:,}" if decided else "-" for s in ("float64", "exact")),
        ])  # fmt: skip
    headings = ["scene", "with", "rung", "size", "best", "over fast, 95%", "lanes to float64", "to expansions"]
    note = (
        "Launches in turns. A round's ratio is its time over that of `fast` in the same round; here their median, and an interval that "
        "holds the true one with 95%."
    )
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


def programs_table(rows: list[dict[str, Any]]) -> Table:
    headings = ["program of", "effects", "bytes", "of absent effects", "with all effects"]
    cells = [
        [row["scene"], ", ".join(row["effects"]) or "none", *(f"{row[key]:,}" for key in ("bytes", "absent_bytes", "bytes_of_all_effects"))]
        for row in rows
    ]
    return Table("Specialised programs", headings, cells, words=2)
