"""Tables of clrt beside other tracers: rays a second in the view, rays through a lens, rays that go all ways, whole commands, imports."""

from __future__ import annotations

from typing import Any

from clrt.bench.table import Table, interval, left_out
from clrt.bench.versus import EMBREEX, KINDS
from clrt.cli.report import seconds
from clrt.precision import DEFAULT

_KIND_WORDS = {"primary": "primary rays", "shadow": "shadow rays", "both": "both, and shading"}
RAYS_PLOT = "bench-rays"


def versus_table(versus: dict[str, Any]) -> Table:
    """Million rays a second of clrt's default rung and of every peer."""
    names = _peers(versus)
    cells = [
        [f"{row['size']}²", _KIND_WORDS[kind], f"**{row['rates'][f'clrt {DEFAULT}'][kind]:.1f}**",
         *(f"{row['rates'][name][kind]:.1f}" if name in row["rates"] else "-" for name in names)]
        for row in versus["views"] for kind in KINDS
    ]  # fmt: skip
    headings = ["size", f"{versus['scene']}, million a second", f"clrt, {DEFAULT}", *names]
    return Table("Rays a second, beside other tracers", headings, cells, words=2, note=_versus_note(versus), image=RAYS_PLOT)


def over_table(versus: dict[str, Any]) -> Table:
    """How many times as fast as each peer clrt is."""
    names = _peers(versus)
    cells = [
        [f"{row['size']}²", _KIND_WORDS[kind], *(interval(row["ratios"][n][kind]) if n in row["ratios"] else "-" for n in names)]
        for row in versus["views"] for kind in KINDS
    ]  # fmt: skip
    note = "The median of the ratios of each round, and an interval that holds the true one with 95%."
    return Table(f"How many times as fast clrt is, {DEFAULT}", ["size", "over", *names], cells, words=2, note=note)


def _peers(versus: dict[str, Any]) -> list[str]:
    return list(dict.fromkeys(name for row in versus["views"] for name in row["ratios"]))


def _versus_note(versus: dict[str, Any]) -> str:
    last = versus["views"][-1]
    versions = ", ".join(f"{name} {version}" for name, version in versus["peers"]["versions"].items())
    used = ", ".join(f"{name} {value:.2f}" for name, value in cores_by_tracer(last["cores_used"]).items())
    note = (
        f"The bench view: {versus['triangles']:,} triangles, one light; {last['hit_share']:.0%} of the camera's rays hit. By the median "
        f"of rounds in turns. Peers: {versions or 'none'}. Cores in use: {used}."
    )
    if "pixels_that_differ" in last:
        differ = last["pixels_that_differ"]
        note += (
            f" At {last['size']} squared, pixels where only one of clrt and embreex hits anything: {differ['hit']:,}; where only one sees "
            f"the light: {differ['lit']:,}."
        )
    return note + left_out(versus["peers"]["missing"])


def cores_by_tracer(used: dict[str, float]) -> dict[str, float]:
    """The least of what each tracer's contenders got."""
    least: dict[str, float] = {}
    for contender, value in used.items():
        name = contender.partition(",")[0]
        least[name] = min(value, least.get(name, value))
    return least


def rungs_table(versus: dict[str, Any]) -> Table:
    """Million rays a second on each rung."""
    cells = []
    for row in versus["views"]:
        for name, over in row["over_fast"].items():
            rates = row["rates"][f"clrt {name}"]
            cells.append([f"{row['size']}²", name, *(f"{rates[kind]:.1f}" for kind in KINDS), interval(over, 3)])
    headings = ["size", "rung", *(f"{words}, M/s" for words in _KIND_WORDS.values()), "time over fast, 95%"]
    note = "The same view and the same run. The last column compares whole pictures, with shadows and shading."
    return Table("The rungs, in the same view", headings, cells, words=2, note=note)


def general_table(general: dict[str, Any]) -> Table:
    """Rays of neighbouring directions and origins of their own."""
    rows = []
    for name, rate in general["rates"].items():
        rows.append([name, f"{rate:.1f}", interval(general["ratios"][name]) if name in general["ratios"] else "-"])
    note = (
        f"The same view through a lens, {general['size']} squared: {general['rays']:,} rays, of which each begins elsewhere and neighbours "
        "have nearly the same direction. A picture of clrt draws them, traces them in packets for any origin and shades their hits; "
        "drawing points of the lens takes part of its time, so `clrt` is the picture less one of nothing: tracing and shading. "
        "Embree C++ likewise is without the reading of its rays. The others are whole calls over arrays of the same rays; "
        "RayCaster.first_hit takes and gives NumPy arrays. The last column has `clrt` over each of the others."
    )
    return Table("Rays of any origin", ["tracer", "million rays a second", "clrt over it, 95%"], rows, note=note)


def incoherent_table(incoherent: dict[str, Any]) -> Table:
    """Million rays a second against the peer's, of rays that go all ways."""
    rates = incoherent["rates"]
    peer, ratio = rates.get(EMBREEX), incoherent.get("ratio")
    row = [incoherent["scene"], f"{incoherent['triangles']:,}", f"{incoherent['rays']:,}", f"{rates['clrt']:.2f}",
           "-" if peer is None else f"{peer:.2f}", "-" if ratio is None else interval(ratio)]  # fmt: skip
    note = (
        "From points of the scene's largest mesh in a closed room, in all directions, as indirect light sends them; the same arrays for "
        "both, in one call: clrt's RayCaster.first_hit, which gives a record a ray, and embreex's cheapest call, on all cores, "
        "which gives a number."
    )
    if "rays_that_differ" in incoherent:
        note += f" Rays for which they name another triangle: {incoherent['rays_that_differ']:,}."
    headings = ["scene", "triangles", "rays", "clrt, M/s", "embreex, M/s", "ratio, 95%"]
    return Table("Incoherent rays, against embreex", headings, [row], note=note)


def commands_table(commands: dict[str, Any]) -> Table:
    """Whole processes, from files to a PNG."""
    rows = []
    for name, cached in commands["cached"].items():
        first, differ = commands["first"][name], commands["pixels_that_differ"].get(name)
        ratio = commands["ratios"].get(name)
        rows.append([
            name, seconds(first["best"]), seconds(cached["best"]), seconds(cached["median"]), "-" if ratio is None else interval(ratio),
            "-" if differ is None else f"{differ:,}",
        ])  # fmt: skip
    phases = ", ".join(f"{name.removesuffix('_s')} {seconds(value)}" for name, value in commands["phases"].items())
    note = (
        f"From files of {commands['triangles']:,} triangles to a PNG of {commands['size']} squared: processes from start to end, in turns. "
        "First: with an empty home and empty caches, as after the install. clrt reads its scene text; the others have a mesh file (PLY; "
        "POV-Ray its own form) and a script for the same picture, in clrt/bench/scripts. A cached run of clrt tells of itself: "
        f"{phases}. The last column: pixels that differ from clrt's by more than 8 of 255."
    )
    headings = ["command", "first run, best", "cached, best", "median", "over clrt, 95%", "pixels that differ"]
    return Table("From text to picture", headings, rows, note=note + left_out(commands["missing"]))


def imports_table(imports: dict[str, Any]) -> Table:
    rows = [[name, seconds(series["best"]), seconds(series["median"])] for name, series in imports.items()]
    note = "Imports by Python's clock within the process; `clrt --help` and the bare interpreter from start to end."
    return Table("Imports", ["what", "best", "median"], rows, note=note)

