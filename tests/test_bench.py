"""The harness of `make bench`: turns, verdicts, tables and files from fixed numbers; one quick run."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bench_results
import numpy as np
import pytest

from clrt.bench import __main__ as command_line
from clrt.bench import export, report, scenes, tables_growth, tables_peers, tables_trees
from clrt.bench.incoherent import closed_room, scattered_rays
from clrt.bench.marks import marks_of
from clrt.bench.measure import whole_from_sample
from clrt.bench.programs import absent_bytes
from clrt.bench.versus import DARK, LIT, SHADOWED, compared, compared_general, times_of
from clrt.device.program import Shape, compose
from clrt.errors import ClrtError
from clrt.features import Features
from clrt.precision import DEFAULT, RUNGS, rung
from clrt.rays import RayCaster
from clrt.timing import Ratio, Series, Told, interleave, paired

NEEDS_MATPLOTLIB = pytest.mark.skipif(importlib.util.find_spec("matplotlib") is None, reason="matplotlib is not installed")


def test_contenders_take_turns_and_the_warm_up_is_not_kept() -> None:
    now, order = [0.0], []

    def contender(name: str, seconds: list[float]) -> Callable[[], None]:
        def run() -> None:
            order.append(name)
            now[0] += seconds.pop(0)

        return run

    taken = interleave({"A": contender("A", [9.0, 3.0, 1.0, 2.0]), "B": contender("B", [8.0, 5.0, 7.0, 6.0])}, 3, clock=lambda: now[0])
    assert order == ["A", "B"] * 4
    assert taken["A"].seconds == (3.0, 1.0, 2.0)
    assert taken["B"].seconds == (5.0, 7.0, 6.0)
    assert (taken["A"].best, taken["A"].median) == (1.0, 2.0)
    assert taken["B"].to_json() == {"best": 5.0, "median": 6.0, "all": [5.0, 7.0, 6.0]}


def test_no_rounds_are_refused() -> None:
    with pytest.raises(ValueError, match="0 rounds"):
        interleave({"A": lambda: None}, 0)


def test_runs_before_a_turn_are_not_timed() -> None:
    now = [0.0]
    ran: list[str] = []

    def run(name: str, cold: float, warm: float) -> None:
        now[0] += warm if ran and ran[-1] == name else cold
        ran.append(name)

    turns = {"A": lambda: run("A", 9.0, 2.0), "B": lambda: run("B", 8.0, 3.0)}
    taken = interleave(turns, 2, before=1, clock=lambda: now[0])
    assert ran == ["A", "A", "B", "B"] * 3
    assert (taken["A"].seconds, taken["B"].seconds) == ((2.0, 2.0), (3.0, 3.0))


def test_time_of_a_whole_picture_from_a_sample_leaves_the_launch_out() -> None:
    # 100 rays in 3 s of which 1 s is the launch: 0.02 s a ray
    assert whole_from_sample(3.0, 1.0, 100, 1000) == pytest.approx(1.0 + 1000 * 0.02)


def test_a_contender_that_tells_its_seconds_is_believed() -> None:
    now = [0.0]

    def run() -> Told:
        now[0] += 7.0
        return Told(0.25)

    assert interleave({"A": run}, 2, clock=lambda: now[0])["A"].seconds == (0.25, 0.25)


def test_ratios_are_those_of_the_rounds() -> None:
    found = paired([2.0, 8.0, 3.0], [1.0, 2.0, 3.0])
    assert found == Ratio(2.0, 1.0, 4.0, False), "three rounds give the range"
    assert found.inverse == Ratio(0.5, 0.25, 1.0, False)
    assert found.times(10.0).high == 40.0
    # Of seven values, the interval from the least to the greatest holds the median with 1 - 2 / 2^7 = 98%; the next ones with 87% alone.
    seven = paired([1.0, 5.0, 3.0, 2.0, 7.0, 6.0, 4.0], [1.0] * 7)
    assert (seven.median, seven.low, seven.high, seven.sure) == (4.0, 1.0, 7.0, True)
    with pytest.raises(ValueError, match="no rounds"):
        paired([], [])


def view_series() -> dict[str, Series]:
    """Three rounds of a view, the second and third of them on a machine half as fast and a third as fast."""
    seconds = {f"clrt {name}, {what}": s for name in RUNGS for what, s in ((DARK, 0.01), (LIT, 0.012), (SHADOWED, 0.02))}
    seconds |= {f"Embree C++, {kind}": s for kind, s in (("primary", 0.02), ("shadow", 0.03), ("light", 0.016), ("picture", 0.03))}
    seconds |= {"embreex, primary": 0.05, "embreex, shadow": 0.03}
    return {name: Series((s, 2 * s, 3 * s)) for name, s in seconds.items()}


def test_rates_and_ratios_follow_from_the_times_of_each_round() -> None:
    series = view_series()
    rays = {name: {"primary": 1_000_000, "shadow": 600_000} for name in (*(f"clrt {rung}" for rung in RUNGS), "embreex")}
    rays["Embree C++"] = {"primary": 1_000_000, "shadow": 300_000}
    found = compared(series, rays)
    assert times_of("clrt exact", "shadow", series) == pytest.approx((0.008, 0.016, 0.024))
    assert found["rates"]["clrt watertight"] == pytest.approx({"primary": 50.0, "shadow": 0.6 / 0.016, "both": 1.6 / 0.04})
    assert found["rates"]["embreex"] == pytest.approx({"primary": 10.0, "shadow": 10.0, "both": 10.0})
    assert found["rates"]["Embree C++"] == pytest.approx({"primary": 25.0, "shadow": 0.3 / 0.032, "both": 1.3 / 0.06}), "the faster way"
    medians = {kind: r["median"] for kind, r in found["ratios"]["Embree C++"].items()}
    assert medians == pytest.approx({"primary": 2.0, "shadow": 2.0 * (600 / 300), "both": 1.5 * (1600 / 1300)})
    assert found["ratios"]["embreex"]["both"]["low"] == pytest.approx(4.0), "what slows a round falls on both"
    assert found["over_fast"]["exact"]["median"] == 1.0


def test_a_difference_of_times_below_zero_is_no_negative_rate() -> None:
    series = view_series()
    series[f"clrt fast, {SHADOWED}"] = Series((0.01, 0.02, 0.03))
    assert min(times_of("clrt fast", "shadow", series)) > 0.0


def test_rays_of_any_origin_are_compared_without_what_makes_them() -> None:
    names = {"clrt, picture": 0.05, "clrt, picture of nothing": 0.03, "Embree C++": 0.03, "Embree C++, reading": 0.005, "Mitsuba": 0.04}
    found = compared_general({name: Series((s, 2 * s)) for name, s in names.items()}, 1_000_000)
    assert found["rates"] == pytest.approx({"clrt": 1 / 0.03, "clrt, picture": 1 / 0.075, "Embree C++": 1 / 0.0375, "Mitsuba": 1 / 0.06})
    assert {name: ratio["low"] for name, ratio in found["ratios"].items()} == pytest.approx({"Embree C++": 1.25, "Mitsuba": 2.0})


def verdicts(results: dict[str, Any]) -> dict[str, bool | None]:
    return {mark.what: mark.passed for mark in marks_of(results)}


def test_marks_that_are_kept_pass() -> None:
    found = marks_of(bench_results.results())
    assert len(found) == 12 + 1 + 1 + 3 + 4 + 2 + 2 + 3 + 4 + 1
    assert {mark.passed for mark in found} == {True}


@pytest.mark.parametrize(
    ("change", "mark"),
    [
        (lambda r: r["versus"]["views"][1]["ratios"]["Embree C++"]["shadow"].update(median=1.49),
         "shadow rays, watertight, rabbit, 1024 squared, over Embree C++"),
        (lambda r: r["versus"]["views"][0]["ratios"]["Embree C++"]["primary"].update(median=1.19),
         "primary rays, watertight, rabbit, 512 squared, over Embree C++"),
        (lambda r: r["versus"]["views"][1]["ratios"]["embreex"]["both"].update(median=4.4),
         "primary and shadow rays, watertight, rabbit, 1024 squared, over embreex"),
        (lambda r: r["versus"]["general"]["ratios"]["Embree C++"].update(median=0.99), "rays of any origin, 1024 squared, over Embree C++"),
        (lambda r: r["incoherent"]["ratio"].update(median=1.1), "incoherent rays, 1,000,000 in one call, over embreex"),
        (lambda r: r["ladder"][2]["ratio"].update(median=1.07), "exact over fast, rabbit, 1024 squared, shadows alone"),
        (lambda r: r["commands"]["first"].update(clrt=bench_results.series(1.3), trimesh=bench_results.series(2.0)),
         "rabbit 512 squared, from text to PNG, first run ever"),
        (lambda r: r["commands"]["cached"].update(trimesh=bench_results.series(0.2)), "rabbit 512 squared, from text to PNG, cached"),
        (lambda r: r["imports"].update({"import clrt": bench_results.series(0.2)}), "import clrt"),
        (lambda r: r["trees"][1].update(build_s=bench_results.series(0.12)), "sah tree of rabbit"),
        (lambda r: r["growth"]["points"][2].update(build_s=bench_results.series(2.5)), "sah tree of 1 million triangles"),
        (lambda r: r["growth"]["points"][3]["peak_bytes"].update(built=13 * 10**9), "sah tree of 10 million triangles"),
        (lambda r: r["growth"]["fits"]["beyond"]["points"][0].update(measured=30.0),
         "time a ray at 1,000,000 triangles, over the logarithm fitted up to 100,000"),
        (lambda r: r["tests"][0].update(tests_per_ray=40.0), "ray-triangle tests a ray, sah, rabbit, 1024 squared"),
        (lambda r: r["tests"][2].update(tests_per_ray=30.0), "ray-triangle tests a ray, sah, monkey, 1024 squared"),
        (lambda r: r["tests"][1].update(depth=21), "median tree, rabbit"),
        (lambda r: r["tests"][3].update(nodes=400), "median tree, monkey"),
        (lambda r: r["programs"][0].update(absent_bytes=1), "source of absent effects in a scene's program"),
    ],
)
def test_a_mark_that_is_not_kept_is_a_miss(change: Callable[[dict[str, Any]], None], mark: str) -> None:
    results = bench_results.results()
    change(results)
    assert [(found.what, found.passed) for found in marks_of(results) if found.passed is not True] == [(mark, False)]


def test_marks_have_no_verdict_where_other_scenes_or_no_peer_were_measured() -> None:
    results = bench_results.results()
    results["scenes"][1] |= {"name": "rabbit-like (generated)", "generated": True}
    found = verdicts(results)
    assert {passed for what, passed in found.items() if "rabbit" in what} == {None}
    assert [passed for what, passed in found.items() if "monkey" in what] == [True] * 2
    results = bench_results.results() | {"quick": True}
    assert sorted(map(str, set(verdicts(results).values()))) == ["None", "True"]
    results = bench_results.results()
    results["versus"]["views"].pop()
    del results["versus"]["views"][0]["ratios"]["Embree C++"], results["versus"]["general"]["ratios"]["Embree C++"]
    del results["incoherent"]["ratio"], results["growth"]["points"][3]
    notes = [mark.note for mark in marks_of(results) if mark.passed is None]
    assert notes[:9] == ["no verdict: 1024 squared was not measured"] * 9
    assert notes[9:13] == ["no verdict: Embree C++ is not there"] * 4
    assert notes[13:] == ["no verdict: embreex is not there", "no verdict: not measured, --largest 10000000 does"]


def test_a_part_of_a_run_has_its_marks_and_tables_alone(tmp_path: Path) -> None:
    results = {key: value for key, value in bench_results.results().items() if key not in export.PARTS}
    results["imports"] = bench_results.results()["imports"]
    assert [mark.what for mark in marks_of(results)] == ["import clrt", "clrt --help"]
    assert [table.title for table in report.tables(results)] == ["Marks", "Imports"]
    assert not list(report.warnings(results))
    checkout(tmp_path)
    with pytest.raises(ClrtError, match="no versus; leave out --only"):
        export.write_docs(results, tmp_path)


def test_tables_tell_the_numbers_and_what_was_compared() -> None:
    table = tables_trees.trees_table(bench_results.results()["trees"])
    whole, sampled = table.rows
    same = ["rabbit", "sah", "256²", "69,453", "23,476", "20", "100.0 ms", "20.9", "14.9 ms"]
    assert whole == [*same, "6.00 s", "402.7", "9.88"]
    assert sampled == [*same[:2], "512²", *same[3:], "about 6.00 s", "about 402.7", "9.88"]
    assert "at 256 squared" in table.note
    assert "at 256 squared" not in tables_trees.trees_table(bench_results.results()["trees"][:1]).note


def test_markdown_has_every_row_once() -> None:
    results = bench_results.results()
    text = report.markdown(results, [tables_trees.marks_table(results["marks"])], level=3)
    assert text == (
        "Measured 2031-02-03, Some CPU (TM), 2 cores, 8 GiB; PoCL 3.0, packets of 16; Python 3.11.0, NumPy 2.0.0; clrt 0.1.0, commit "
        "abc1234.\n\n### Marks\n\n| mark | target | measured | verdict |\n| :-- | :-- | :-- | :-- |\n| a mark | under 2 | 1 | met |"
    )
    everything = report.markdown(results, report.tables(results), level=3)
    rows = [line for line in everything.splitlines() if line.startswith("| ")]
    shown = report.tables(results)
    assert len(shown) == 1 + 4 + 7 + 4
    assert len(rows) == 2 * len(shown) + sum(len(table.rows) for table in shown)
    assert "images/" not in everything
    assert "![Growth with triangles](images/bench-growth.svg)" in report.markdown(results, shown, level=3, images="images")


def test_peers_have_rates_and_ratios_with_their_intervals() -> None:
    shown, over = (make(bench_results.results()["versus"]) for make in (tables_peers.versus_table, tables_peers.over_table))
    assert shown.headings == ["size", "rabbit, million a second", "clrt, watertight", "Embree C++", "Mitsuba", "embreex"]
    assert shown.rows[0] == ["512²", "primary rays", "**80.0**", "50.0", "61.5", "16.0"]
    assert over.rows[0] == ["512²", "primary rays", "1.60 (1.44 to 1.76)", "1.30 (1.17 to 1.43)", "5.00 (4.50 to 5.50)"]
    assert "Not measured: Open3D; open3d is not installed." in shown.note
    assert "embreex 1.90" in shown.note
    commands = tables_peers.commands_table(bench_results.results()["commands"])
    assert commands.rows == [["clrt", "1.00 s", "250.0 ms", "375.0 ms", "-", "-"],
                             ["trimesh", "1.25 s", "500.0 ms", "750.0 ms", "2.00 (1.80 to 2.20)", "12"]]  # fmt: skip


def test_growth_is_told_a_ray_and_a_triangle() -> None:
    triangles, _, objects, fits = tables_growth.growth_tables(bench_results.results()["growth"])
    assert triangles.rows[1] == ["100,000", "200.0 ms", "100.0 ms", "2", "2.00", "19.1 ns", "3.0 MiB", "1.00 GiB"]
    assert [row[0] for row in objects.rows] == ["10 objects of 20 triangles", "10 instances of 20 triangles"]
    assert fits.rows == [["triangles", "2.00 ns", "+1.500 ns", "1.2%"]]
    assert "20.0 ns for 1,000,000 (22.0 ns measured, 1.10 times as much), 25.0 ns for 10,000,000" in fits.note


def test_a_busy_machine_is_told() -> None:
    results = bench_results.results()
    assert not list(report.warnings(results))
    results["versus"]["views"][1]["cores_used"]["embreex, primary"] = 1.2
    assert ["less than nine tenths of the cores" in text for text in report.warnings(results)] == [True]


def test_ranges_are_not_called_intervals() -> None:
    results = bench_results.results()
    results["plan"]["ladder_rounds"] = 5
    assert ["Of 5 rounds no interval" in text for text in report.warnings(results)] == [True]
    without = [mark.note for mark in marks_of(results) if mark.passed is None]
    assert without == ["no verdict: of 5 rounds no interval can be had"] * (12 + 1 + 1 + 3 + 4)


def checkout(root: Path) -> tuple[Path, Path]:
    page, readme = root / "docs" / "performance.md", root / "README.md"
    page.parent.mkdir()
    for path in (page, readme, _numerics(root)):
        path.write_text(f"before\n\n{export.BEGIN}\nwhat was here\n{export.END}\n\nafter\n")
    return page, readme


def _numerics(root: Path) -> Path:
    return root / "docs" / "numerics.md"


@NEEDS_MATPLOTLIB
def test_documents_are_filled_between_their_marks_alone(tmp_path: Path) -> None:
    page, readme = checkout(tmp_path)
    export.write_docs(bench_results.results(), tmp_path)
    once = page.read_text(), readme.read_text()
    plots = [tmp_path / "docs" / "images" / f"bench-{name}.svg" for name in ("rays", "growth")]
    drawn = [plot.read_bytes() for plot in plots]
    assert export.write_docs(bench_results.results(), tmp_path) == [page, readme, _numerics(tmp_path), *plots]
    assert (page.read_text(), readme.read_text()) == once
    assert [plot.read_bytes() for plot in plots] == drawn, "the same JSON gives the same bytes"
    assert all(drawing.startswith(b"<?xml") for drawing in drawn)
    assert "(images/bench-rays.svg)" in once[0]
    assert "bench-rays" not in once[1]
    for text in once:
        assert text.startswith(f"before\n\n{export.BEGIN}\nMeasured 2031-02-03")
        assert text.endswith(f"{export.END}\n\nafter\n")
        assert "what was here" not in text
    assert "| a mark |" in once[0]
    assert "| a mark |" not in once[1]
    assert "| 256² |" in once[0]
    assert "| 256² |" in once[1]
    assert "about 402.7" in once[1]
    assert "| watertight | 1024² |" in _numerics(tmp_path).read_text()


@NEEDS_MATPLOTLIB
def test_documents_without_marks_or_for_a_quick_run_are_left_alone(tmp_path: Path) -> None:
    page, readme = checkout(tmp_path)
    before = page.read_text()
    with pytest.raises(ClrtError, match="quick"):
        export.write_docs(bench_results.results() | {"quick": True}, tmp_path)
    readme.write_text("no marks\n")
    with pytest.raises(ClrtError, match=r"README\.md: the tables go between"):
        export.write_docs(bench_results.results(), tmp_path)
    readme.unlink()
    with pytest.raises(ClrtError, match="works in a checkout"):
        export.check_docs(tmp_path)
    assert page.read_text() == before


def test_results_are_kept_by_date_and_processor_and_read_again(tmp_path: Path) -> None:
    path = export.save(bench_results.results(), tmp_path / "kept")
    assert path.name == "20310203T040506-some-cpu-tm-2-cores.json"
    assert export.read(path) == bench_results.results()
    path.write_text("{}")
    with pytest.raises(ClrtError, match="started is missing"):
        export.read(path)
    path.write_text(json.dumps(bench_results.results() | {"format": 1}))
    with pytest.raises(ClrtError, match="another version of the benchmarks"):
        export.read(path)
    path.write_text("no json")
    with pytest.raises(ClrtError, match="give a file that"):
        export.read(path)


def test_scenes_that_are_not_there_are_generated_and_named_so(tmp_path: Path) -> None:
    with pytest.raises(ClrtError, match="leave --scenes out"):
        scenes.load(tmp_path, tmp_path)
    loaded = scenes.load(None, tmp_path, quick=True)
    assert [(s.role, s.name, s.generated) for s in loaded] == [
        ("monkey", "sphere (generated)", True), ("rabbit", "rabbit-like (generated)", True)
    ]  # fmt: skip
    for scene in loaded:
        (tmp_path / f"{scene.role}.txt").write_bytes(scene.path.read_bytes())
    assert [(s.name, s.generated) for s in scenes.load(tmp_path, tmp_path)] == [("monkey", False), ("rabbit", False)]


def test_lines_of_an_absent_effect_are_found_where_they_are(tmp_path: Path) -> None:
    scene = scenes.load(None, tmp_path, quick=True)[1].scene
    features = Features.of(scene)
    source = compose(features, rung(DEFAULT), 4, Shape(16, 5))
    assert {"mirror", "shadows"} <= set(features.effects)
    for name in features.effects:
        effect = next(f for f in features.active if f.name == name)
        others = tuple(f for f in features.active if f is not effect)
        assert absent_bytes(source, [effect], others) > 200, name
    without = Features.of(scenes.straight(scene))
    lost = [f for f in features.active if f not in without.active]
    assert {"mirror", "spheres"} <= {f.name for f in lost}
    assert absent_bytes(compose(without, rung(DEFAULT), 4, Shape(16, 5)), lost, without.active) == 0


def test_incoherent_rays_are_told_beside_embreex() -> None:
    results = bench_results.results()
    shown = tables_peers.incoherent_table(results["incoherent"])
    assert shown.rows == [["rabbit", "69,463", "1,000,000", "6.00", "4.00", "1.50 (1.35 to 1.65)"]]
    assert "another triangle: 3" in shown.note
    for key in ("ratio", "rays_that_differ"):
        del results["incoherent"][key]
    del results["incoherent"]["rates"]["embreex"]
    assert tables_peers.incoherent_table(results["incoherent"]).rows[0][-2:] == ["-", "-"]


def test_scattered_rays_leave_a_mesh_in_a_closed_room() -> None:
    mesh = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 3, 0], [0, 0, 4]]])
    origins, directions = scattered_rays(mesh, 20_000, 5)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-12)
    on_large = np.abs(origins[:, 0]) < 1e-3
    assert abs(on_large.mean() - 6.0 / 6.5) < 0.01, "points are even over the area"
    cosine = np.abs(directions[on_large][:, 0])
    assert abs(cosine.mean() - 2.0 / 3.0) < 0.01, "the mean of the cosine, drawn in proportion to it"
    room = closed_room(mesh)
    assert RayCaster(np.concatenate([mesh, room]), "watertight").any_hit(origins[:2000], directions[:2000]).all()


@pytest.mark.slow
def test_quick_run_measures_everything(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "clrt.bench", "--quick", "-o", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (path,) = tmp_path.iterdir()
    results = json.loads(path.read_text())
    general = {"format", "started", "finished", "quick", "machine", "load_before", "load_after", "plan", "scenes", "marks"}
    assert set(results) == general | set(export.PARTS)
    assert {"cpu", "cores", "memory_gib", "os", "python", "opencl_platform", "opencl_driver", "packages"} <= set(results["machine"])
    sphere, rabbit = ("sphere (generated)", False), ("rabbit-like (generated)", True)
    assert [(row["scene"], bool(row["sample"]), row["tree"]) for row in results["trees"]] == [
        (*sphere, "sah"), (*sphere, "median"), (*rabbit, "sah"), (*rabbit, "median")
    ]  # fmt: skip
    assert all(len(row["render_s"]["all"]) == 2 and row["brute_tests_per_ray"] > row["tests_per_ray"] for row in results["trees"])
    assert [row["tree"] for row in results["tests"]] == ["sah", "median"] * 2
    assert [row["absent_bytes"] for row in results["programs"]] == [0, 0, 0]
    (view,) = results["versus"]["views"]
    assert view["rays"]["clrt watertight"]["primary"] == 64 * 64
    assert {name: rays["shadow"] for name, rays in view["rays"].items()} == dict.fromkeys(view["rays"], view["rays"]["clrt fast"]["shadow"])
    assert all(len(times["all"]) == 2 for times in view["seconds"].values())
    phases = results["commands"]["phases"]
    assert 0 < phases["read_s"] < phases["total_s"]
    assert set(results["growth"]["fits"]) == {"triangles", "instances"}
    assert {mark["passed"] for mark in results["marks"]} == {None, True}
    assert "kd-trees against brute force" in done.stdout


def test_faults_of_the_command_line_are_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    wrong = (["--from", str(tmp_path / "none.json")], ["--quick", "--write-docs"], ["--scenes", str(tmp_path)], ["--size", "100"],
             ["--only", "imports", "--write-docs"])  # fmt: skip
    for arguments in wrong:
        monkeypatch.setattr(sys, "argv", ["clrt.bench", *arguments])
        with pytest.raises(SystemExit) as left:
            command_line.main()
        assert left.value.code == 2
        told = capfd.readouterr().err
        assert told.startswith("clrt: error:")
        assert len(told.splitlines()) == 1
