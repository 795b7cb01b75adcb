"""Tables of growth: triangles, pixels, objects; and the logarithms fitted to them."""

from __future__ import annotations

from typing import Any

from clrt.bench.growth import AXES
from clrt.bench.table import Table, size
from clrt.cli.report import seconds

WORDS = {"triangles": "triangles", "pixels": "pixels", "separate": "objects of 20 triangles", "instances": "instances of 20 triangles"}
GROWTH_PLOT = "bench-growth"


def growth_tables(growth: dict[str, Any]) -> list[Table]:
    return [_triangles(growth), _pixels(growth), _objects(growth), _fits(growth)]


def _of(growth: dict[str, Any], *kinds: str) -> list[dict[str, Any]]:
    return [row for row in growth["points"] if row["kind"] in kinds]


def a_ray(row: dict[str, Any]) -> str:
    return f"{row['trace_s']['best'] / row['rays'] * 1e9:.1f} ns"


def _triangles(growth: dict[str, Any]) -> Table:
    rows = [
        [
            f"{row['triangles']:,}", seconds(row["build_s"]["best"]), seconds(row["upload_s"]), str(row["depth"]),
            f"{row['references'] / row['triangles']:.2f}", a_ray(row), size(row["device_bytes"]), size(row["peak_bytes"]["built"]),
        ]
        for row in _of(growth, "triangles")
    ]  # fmt: skip
    note = (
        "Hills, the same surface ever finer, on a ground; the time of a primary ray in a picture of "
        f"{growth['reach']['size']} squared, the best of {growth['reach']['rounds']} launches. Memory: what lies on the device; what the "
        "process had at most until the tree was built, interpreter, libraries and triangles included. Each row is a process of its own."
    )
    headings = ["triangles", "build", "upload", "depth", "references a triangle", "a ray", "on the device", "process, at most"]
    return Table("Growth with triangles", headings, rows, note=note, image=GROWTH_PLOT)


def _pixels(growth: dict[str, Any]) -> Table:
    rows = [[f"{row['size']}²", seconds(row["trace_s"]["best"]), a_ray(row)] for row in _of(growth, "pixels")]
    note = "The same hills of 100,000 triangles. A launch and the wait for it cost about a millisecond, whatever the size."
    return Table("Growth with pixels", ["size", "picture", "a ray"], rows, note=note)


def _objects(growth: dict[str, Any]) -> Table:
    rows = [
        [
            f"{row['count']:,} {WORDS[row['kind']]}", seconds(row["build_s"]["best"]), seconds(row["upload_s"]), a_ray(row),
            size(row["device_bytes"]),
        ]
        for row in _of(growth, "separate", "instances")
    ]  # fmt: skip
    note = (
        "Small spheres of triangles in rows and columns that cover the same part of a square, however many. As objects each has triangles "
        "and a tree of its own; as instances all share one."
    )
    return Table("Growth with objects", ["scene", "build", "upload", "a ray", "on the device"], rows, note=note)


def _fits(growth: dict[str, Any]) -> Table:
    fits, rows = growth["fits"], []
    for kind in AXES:
        if kind in fits:
            fit = fits[kind]
            rows.append([WORDS[kind], f"{fit['a']:.2f} ns", f"{fit['b']:+.3f} ns", f"{fit['residual']:.1%}"])
    note = "Time a ray as a + b log2(n), by least squares. Residual: root of the mean squared distance from the curve, over the mean time."
    if "beyond" in fits:
        told = ", ".join(
            f"{point['foretold']:.1f} ns for {point['triangles']:,} ({point['measured']:.1f} ns measured, "
            f"{point['measured'] / point['foretold']:.2f} times as much)"
            for point in fits["beyond"]["points"]
        )  # fmt: skip
        note += f" The curve of up to {fits['beyond']['fitted_up_to']:,} triangles foretells {told}."
    return Table("Fitted curves", ["n", "a", "b, a doubling", "residual"], rows, note=note)
