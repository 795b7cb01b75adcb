"""The harness of `make bench`: turns, verdicts, tables and files from fixed numbers; brute force against the trees; one quick run."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bench_results
import numpy as np
import pytest

from clrt.bench import export, report, scenes
from clrt.bench.incoherent import closed_room, scattered_rays
from clrt.bench.marks import marks_of
from clrt.bench.measure import whole_from_sample
from clrt.bench.programs import absent_bytes
from clrt.bench.versus import DARK, LIT, SHADOWED, rates_of
from clrt.device.program import Shape, compose
from clrt.errors import ClrtError
from clrt.features import Features
from clrt.precision import DEFAULT, rung
from clrt.rays import RayCaster
from clrt.timing import Series, interleave


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


def test_time_of_a_whole_picture_from_a_sample_leaves_the_launch_out() -> None:
    # 100 rays in 3 s of which 1 s is the launch: 0.02 s a ray
    assert whole_from_sample(3.0, 1.0, 100, 1000) == pytest.approx(1.0 + 1000 * 0.02)


def test_rates_follow_from_the_best_times() -> None:
    seconds = {DARK: 0.01, LIT: 0.012, SHADOWED: 0.02, "embreex primary": 0.05, "embreex shadow": 0.03}
    series = {name: Series((best * 2, best)) for name, best in seconds.items()}
    rays = {"clrt": {"primary": 1_000_000, "shadow": 600_000}, "embreex": {"primary": 1_000_000, "shadow": 600_000}}
    rates = rates_of(series, rays)
    assert rates["clrt"] == pytest.approx({"primary": 100.0, "shadow": 0.6 / 0.008, "both": 1.6 / 0.02})
    assert rates["embreex"] == pytest.approx({"primary": 20.0, "shadow": 20.0, "both": 20.0})
    assert rates["ratio"] == pytest.approx({"primary": 5.0, "shadow": 3.75, "both": 4.0})
    assert set(rates_of(series, {"clrt": rays["clrt"]})) == {"clrt"}


def verdicts(results: dict[str, Any]) -> dict[str, bool | None]:
    return {mark.what: mark.passed for mark in marks_of(results)}


def test_marks_that_are_kept_pass() -> None:
    assert len(verdicts(bench_results.results())) == 13
    assert set(verdicts(bench_results.results()).values()) == {True}


@pytest.mark.parametrize(
    ("change", "mark"),
    [
        (lambda r: r["versus"]["rates"]["ratio"].update(shadow=1.99), "shadow rays, rabbit, 1024 squared"),
        (lambda r: r["versus"]["rates"]["ratio"].update(both=1.0), "primary and shadow rays, rabbit, 1024 squared"),
        (lambda r: r["tests"][0].update(tests_per_ray=40.0), "ray-triangle tests a ray, sah, rabbit, 1024 squared"),
        (lambda r: r["tests"][2].update(tests_per_ray=30.0), "ray-triangle tests a ray, sah, monkey, 1024 squared"),
        (lambda r: r["tests"][1].update(depth=21), "median tree, rabbit"),
        (lambda r: r["tests"][3].update(nodes=400), "median tree, monkey"),
        (lambda r: r["command"].update(seconds=bench_results.series(2.0)), "whole command, rabbit, 512 squared, after a first run"),
        (lambda r: r["programs"][0].update(absent_bytes=1), "source of absent effects in a scene's program"),
    ],
)
def test_a_mark_that_is_not_kept_is_a_miss(change: Callable[[dict[str, Any]], None], mark: str) -> None:
    results = bench_results.results()
    change(results)
    assert [what for what, passed in verdicts(results).items() if passed is not True] == [mark]
    assert verdicts(results)[mark] is False


def test_marks_have_no_verdict_where_other_scenes_or_no_peer_were_measured() -> None:
    results = bench_results.results()
    results["scenes"][1] |= {"name": "rabbit-like (generated)", "generated": True}
    found = verdicts(results)
    assert [passed for what, passed in found.items() if "rabbit" in what] == [None] * 9
    assert [passed for what, passed in found.items() if "monkey" in what] == [True] * 2
    results = bench_results.results() | {"quick": True}
    assert sorted(map(str, set(verdicts(results).values()))) == ["None", "True"]
    results = bench_results.results()
    del results["versus"]["rates"]["ratio"], results["versus"]["rates"]["embreex"], results["versus"]["rays"]["embreex"]
    assert [mark.note for mark in marks_of(results)][:3] == ["no verdict: embreex is not installed"] * 3
    assert "embreex is not installed" in report.versus_table(results["versus"], 2).note


def test_tables_tell_the_numbers_and_what_was_compared() -> None:
    table = report.trees_table(bench_results.results()["trees"])
    whole, sampled = table.rows
    same = ["rabbit", "sah", "256²", "69,453", "23,476", "20", "250.0 ms", "20.9", "14.9 ms"]
    assert whole == [*same, "6.00 s", "402.7", "9.88"]
    assert sampled == [*same[:2], "512²", *same[3:], "about 6.00 s", "about 402.7", "9.88"]
    assert "at 256 squared" in table.note
    assert "at 256 squared" not in report.trees_table(bench_results.results()["trees"][:1]).note


def test_markdown_has_every_row_once() -> None:
    results = bench_results.results()
    text = report.markdown(results, [report.marks_table(results["marks"])], level=3)
    assert text == (
        "Measured 2031-02-03, Some CPU (TM), 2 cores, 8 GiB; PoCL 3.0, packets of 16; Python 3.11.0, NumPy 2.0.0; clrt 0.1.0, commit "
        "abc1234.\n\n### Marks\n\n| mark | target | measured | verdict |\n| :-- | :-- | :-- | :-- |\n| a mark | under 2 | 1 | pass |"
    )
    everything = report.markdown(results, report.tables(results), level=3)
    rows = [line for line in everything.splitlines() if line.startswith("| ")]
    assert len(rows) == 2 * 8 + sum(len(table.rows) for table in report.tables(results)) == 16 + 1 + 2 + 3 + 1 + 4 + 4 + 1 + 1
    assert "| both, and shading | 1,500 | 1,501 | 50.0 | 22.0 | 2.27 |" in rows


def test_a_busy_machine_is_told() -> None:
    results = bench_results.results()
    assert not list(report.warnings(results))
    results["versus"]["cores_used"]["embreex primary"] = 1.2
    assert ["Something else used the cores" in text for text in report.warnings(results)] == [True]


def checkout(root: Path) -> tuple[Path, Path]:
    page, readme = root / "docs" / "performance.md", root / "README.md"
    page.parent.mkdir()
    for path in (page, readme, _numerics(root)):
        path.write_text(f"before\n\n{export.BEGIN}\nold\n{export.END}\n\nafter\n")
    return page, readme


def _numerics(root: Path) -> Path:
    return root / "docs" / "numerics.md"


def test_documents_are_filled_between_their_marks_alone(tmp_path: Path) -> None:
    page, readme = checkout(tmp_path)
    export.write_docs(bench_results.results(), tmp_path)
    once = page.read_text(), readme.read_text()
    assert export.write_docs(bench_results.results(), tmp_path) == [page, readme, _numerics(tmp_path)]
    assert (page.read_text(), readme.read_text()) == once
    for text in once:
        assert text.startswith(f"before\n\n{export.BEGIN}\nMeasured 2031-02-03")
        assert text.endswith(f"{export.END}\n\nafter\n")
        assert "old" not in text
    assert "| a mark |" in once[0]
    assert "| a mark |" not in once[1]
    assert "| 256² |" in once[0]
    assert "| 256² |" in once[1]
    assert "about 402.7" in once[1]
    assert "| watertight | 1024² |" in _numerics(tmp_path).read_text()


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
    shown = report.incoherent_table(results["incoherent"])
    assert shown.rows == [["rabbit", "69,463", "1,000,000", "4.00", "8.00", "0.50"]]
    assert "another triangle: 3" in shown.note
    del results["incoherent"]["rates"]["embreex"], results["incoherent"]["rays_that_differ"]
    assert report.incoherent_table(results["incoherent"]).rows[0][-2:] == ["-", "-"]


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
    command = [sys.executable, "-m", "clrt.bench", "--quick", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (path,) = tmp_path.iterdir()
    results = json.loads(path.read_text())
    assert set(results) == {
        "started", "finished", "quick", "machine", "load_before", "load_after", "plan", "scenes", "trees", "versus", "incoherent", "ladder",
        "tests",         "command", "programs", "marks",
    }  # fmt: skip
    assert {"cpu", "cores", "memory_gib", "os", "python", "opencl_platform", "opencl_driver", "packages"} <= set(results["machine"])
    sphere, rabbit = ("sphere (generated)", False), ("rabbit-like (generated)", True)
    assert [(row["scene"], bool(row["sample"]), row["tree"]) for row in results["trees"]] == [
        (*sphere, "sah"), (*sphere, "median"), (*rabbit, "sah"), (*rabbit, "median")
    ]  # fmt: skip
    assert all(len(row["render_s"]["all"]) == 2 and row["brute_tests_per_ray"] > row["tests_per_ray"] for row in results["trees"])
    assert [row["tree"] for row in results["tests"]] == ["sah", "median"] * 2
    assert [row["absent_bytes"] for row in results["programs"]] == [0, 0, 0]
    phases = results["command"]["phases"]
    assert 0 < sum(seconds for phase, seconds in phases.items() if phase != "total_s") <= phases["total_s"]
    assert {mark["passed"] for mark in results["marks"]} == {None, True}
    assert "kd-trees against brute force" in done.stdout


def test_faults_of_the_command_line_are_one_line(tmp_path: Path) -> None:
    for arguments in (["--from", str(tmp_path / "none.json")], ["--quick", "--write-docs"], ["--scenes", str(tmp_path)]):
        done = subprocess.run([sys.executable, "-m", "clrt.bench", *arguments], capture_output=True, text=True, check=False)
        assert done.returncode == 2
        assert done.stderr.startswith("clrt: error:")
        assert len(done.stderr.splitlines()) == 1
