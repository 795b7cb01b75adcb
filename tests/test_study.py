"""`clrt study`: a whole study of a tiny scene, going on after an interrupt, comparing, and what is refused."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import study_example
from click.testing import CliRunner, Result

from clrt.cli.main import cli
from clrt.errors import ClrtError
from clrt.scene.build import load_scene
from clrt.scene.model import Indirect, Scene
from clrt.study import measure_samples, reference, run, store, verdict
from clrt.study.compare import compare
from clrt.study.plan import QUICK, Plan
from clrt.study.schema import KEYS, ROWS, faults
from clrt.study.subject import FIRST_SEED, REFERENCE_SEED, open_subject

SCENES = Path(__file__).parents[1] / "scenes"
TINY = replace(
    QUICK, seeds=10, batches=4, rounds=6, part_s=0.5, oracle_rays=60, leak_rays=900, compile_rounds=2, brute_pairs=10**7, depths=2,
    most_samples=8, reference_s=1.0,
)  # fmt: skip
#: a closed cube before a mirror, lit by a point
CUBE = """E 0.3 1.2 -5
V 0 -0.3 1
F 40
R 24 16
L 3 4 -5
M 0.5 0.5 1 0.1 0.9 0.3 20 0
{cube}O
M 0.9 0.9 0.9 0.1 0.5 0 1 0.4
T -3 -0.75 -3  -3 -0.75 4  3 -0.75 -3
O
"""


def cube_text() -> str:
    from clrt.verify.rays import cube

    return CUBE.format(cube="".join("T " + " ".join(f"{x:g}" for x in triangle.ravel()) + "\n" for triangle in cube(0.7)))


def clrt(*arguments: str | Path) -> Result:
    return CliRunner().invoke(cli, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The folder of a whole study, and its JSON as read from there."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "cube.txt").write_text(cube_text())
    run.run_study(folder / "cube.txt", partial(load_scene, folder / "cube.txt"), folder / "out", TINY)
    return folder / "out", json.loads((folder / "out" / "study.json").read_text())


def test_study_has_every_part_in_its_form(measured: tuple[Path, dict[str, Any]]) -> None:
    _, study = measured
    assert faults(study) == []
    assert tuple(study) == KEYS
    assert all(study[part]["rows"] for part in ROWS)
    assert [row["rung"] for row in study["precision"]["rows"]] == ["fast", "watertight", "exact", "double"]
    assert [row["samples"] for row in study["samples"]["rows"]] == [2, 4, 8]
    assert [row["tree"] for row in study["trees"]["rows"]] == ["sah", "median", "brute"]
    assert [row["depth"] for row in study["depth"]["rows"]] == [0, 5]
    assert {row["effect"] for row in study["effects"]["rows"]} == {"shadows", "direct light", "mirror"}
    assert study["header"]["size"] == [24, 16]
    assert len(study["header"]["scene_sha256"]) == 64


def test_study_says_what_is_so(measured: tuple[Path, dict[str, Any]]) -> None:
    """Facts that do not hang on the machine: exact is right, a closed mesh keeps its rays, more samples err less, depth 5 is the whole."""
    _, study = measured
    rungs = {row["rung"]: row for row in study["precision"]["rows"]}
    assert rungs["exact"]["wrong_primitives"]["median"] == 0
    assert rungs["double"]["picture_error"]["median"] == 0.0
    assert all(rungs[name]["leaks_per_million"]["median"] == 0.0 for name in ("watertight", "exact", "double"))
    assert max(row["t_error"]["median"] for row in rungs.values()) < 1e-6
    assert rungs["exact"]["t_error"]["median"] < 2.0**-31
    errors = [row["rmse"]["median"] for row in study["samples"]["rows"]]
    assert errors[0] > errors[1] > errors[2] > study["samples"]["floor"]["median"]
    assert study["samples"]["slope"]["high"] < -0.3
    assert study["samples"]["reference"]["samples"] >= TINY.reference_factor * study["samples"]["rows"][-1]["samples"]
    assert study["bias"]["verdict"] == "unbiased"
    assert study["depth"]["rows"][-1]["error"]["median"] == 0.0 < study["depth"]["rows"][0]["error"]["median"]
    trees = {row["tree"]: row for row in study["trees"]["rows"]}
    assert trees["brute"]["depth"]["median"] == 0 < trees["sah"]["nodes"]["median"]


def test_no_seed_judges_itself(measured: tuple[Path, dict[str, Any]]) -> None:
    _, study = measured
    used = study["header"]["seeds"]["points"] * measure_samples.SEEDS_APART
    assert len(study["samples"]["rows"]) < measure_samples.SEEDS_APART
    assert FIRST_SEED + used < REFERENCE_SEED == study["header"]["seeds"]["reference_first"]


def test_pictures_are_where_the_study_says(measured: tuple[Path, dict[str, Any]]) -> None:
    from PIL import Image as PillowImage

    folder, study = measured
    part = study["precision"]
    files = [*part["pictures"].values(), *(d["file"] for d in part["differences"].values()), *part["crop"]["files"].values()]
    for file in files:
        with PillowImage.open(folder / file) as picture:
            assert picture.width > 0
    with PillowImage.open(folder / part["pictures"]["double"]) as picture:
        assert picture.size == (24, 16)
    assert part["differences"]["fast"]["scale"] >= part["rows"][0]["picture_error"]["median"]


def test_verdict_has_the_figures_of_the_json(measured: tuple[Path, dict[str, Any]]) -> None:
    _, study = measured
    assert study["verdict"] == verdict.sentences({**study, "verdict": None})
    assert any("4x the samples, 2 to 8" in line for line in study["verdict"])
    assert all(line.endswith(".") for line in study["verdict"])


def test_verdict_claims_no_difference_where_intervals_meet() -> None:
    study = study_example.study()
    cost = study["precision"]["rows"][1]["ratio_to_fast"]
    cost.update(low=0.97, high=1.08)
    assert "no measurably other time" in verdict.sentences(study)[0]
    cost.update(low=1.02)
    assert "takes 1.04x (1.02 to 1.08) the time of fast" in verdict.sentences(study)[0]


def test_verdict_names_a_longest_phase_only_where_intervals_part() -> None:
    study = study_example.study()
    assert "the longest phase is trees: " in verdict.sentences(study)[-1]
    study["phases"]["rows"][5]["seconds"].update(high=1.95)
    assert "the longest phase is by its median, but not surely, trees: " in verdict.sentences(study)[-1]


def test_next_digit_has_its_interval() -> None:
    study = study_example.study()
    last = study["samples"]["rows"][-1]
    last["seconds"].update(median=0.2, low=0.1, high=0.3)
    study["samples"]["slope"] = {"median": -0.5, "low": -1.0, "high": -0.25, "unit": "log error / log samples", "runs": 10}
    (told,) = (line for line in verdict.sentences(study) if line.startswith("The next digit"))
    assert "takes 100x (10 to 10,000) the samples" in told
    assert "about 20,000 ms (1,000 to 3,000,000)" in told
    study["samples"]["slope"].update(high=-0.001)  # 10 to the 1000th
    assert not any(line.startswith("The next digit") for line in verdict.sentences(study))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 and no more of it", b"no archive"])
def test_damaged_reference_is_rendered_again(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / reference.FILE
    path.write_bytes(content)
    assert reference._kept(path, "key") is None


def _fake(part: str, log: list[str]) -> Callable[..., dict[str, Any]]:
    def measure(subject: Any, study: dict[str, Any]) -> dict[str, Any]:
        log.append(part)
        found = study_example.study()
        return {key: found[key] for key in (("samples", "bias") if part == "samples" else (part,))}

    return measure


@pytest.fixture
def faked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> tuple[Path, list[str]]:
    """A scene, and the parts that were measured, by steps that give made-up numbers at once."""
    log: list[str] = []
    steps = [replace(step, measure=_fake(step.parts[0], log)) for step in run.STEPS]
    monkeypatch.setattr(run, "STEPS", tuple(steps))
    monkeypatch.setattr(run, "write_report", lambda folder: [])
    (tmp_path / "cube.txt").write_text(cube_text())
    return tmp_path / "cube.txt", log


def _interrupt_at(monkeypatch: pytest.MonkeyPatch, part: str) -> None:
    def interrupted(subject: Any, study: dict[str, Any]) -> dict[str, Any]:
        raise KeyboardInterrupt

    steps = tuple(replace(step, measure=interrupted) if step.parts[0] == part else step for step in run.STEPS)
    monkeypatch.setattr(run, "STEPS", steps)


def test_interrupted_study_keeps_its_parts_and_goes_on(faked: tuple[Path, list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    path, log = faked
    out, whole = path.parent / "out", run.STEPS
    _interrupt_at(monkeypatch, "effects")
    result = clrt("study", path, "-o", out, "--quick", "--quiet")
    assert result.exit_code == 130
    assert result.stderr.strip() == f"clrt: interrupted; what is measured is kept in {out}, and --resume goes on with it"
    kept = store.read(out)
    assert {part for part in ROWS if kept[part] is not None} == {"samples", "bias", "precision", "depth"}
    assert kept["verdict"] is None
    log.clear()
    monkeypatch.setattr(run, "STEPS", whole)
    assert clrt("study", path, "-o", out, "--quick", "--resume", "--quiet").exit_code == 0
    assert log == ["effects", "trees", "phases"]
    assert faults(json.loads((out / "study.json").read_text())) == []


def test_interrupted_study_that_kept_nothing_cannot_be_resumed(faked: tuple[Path, list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    path, _ = faked
    _interrupt_at(monkeypatch, "samples")
    result = clrt("study", path, "-o", path.parent / "out", "--quick", "--quiet")
    assert (result.exit_code, result.stderr.strip()) == (130, "clrt: interrupted")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("scene_sha256", "0" * 64), "the scene's text"),
        (("clrt", "0.0.1"), "version of clrt"),
        (("size", [7, 7]), r"size .*\[7, 7\] there"),
        (("quick", False), "--quick"),
    ],
)
def test_study_of_something_else_is_not_resumed(faked: tuple[Path, list[str]], change: tuple[str, Any], words: str) -> None:
    path, log = faked
    out = path.parent / "out"
    assert clrt("study", path, "-o", out, "--quick", "--quiet").exit_code == 0
    study = store.read(out)
    study["header"][change[0]] = change[1]
    store.save(study, out)
    before = (out / "study.json").read_bytes()
    log.clear()
    result = clrt("study", path, "-o", out, "--quick", "--resume", "--quiet")
    assert (result.exit_code, log) == (2, [])
    assert (out / "study.json").read_bytes() == before
    with pytest.raises(ClrtError, match=words):
        run.run_study(path, partial(load_scene, path), out, QUICK, resume=True)


def test_progress_grows_from_part_to_part(faked: tuple[Path, list[str]]) -> None:
    path, _ = faked
    steps = tuple(replace(step, measure=_telling(step.measure)) for step in run.STEPS)
    told: list[float] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "STEPS", steps)
        run.run_study(path, partial(load_scene, path), path.parent / "out", QUICK, tell=lambda _, fraction: told.append(fraction))
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)


def _telling(measure: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    def told(subject: Any, study: dict[str, Any]) -> dict[str, Any]:
        subject.tell("this part", 0.5)
        subject.tell("this part", 1.0)
        return measure(subject, study)

    return told


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("missing.txt", "-o", "out"), "no such file"),
        (("cube.txt", "-o", "file"), "this is a file; a study is kept in a folder"),
        (("cube.txt", "-o", "no/out"), "there is no folder"),
        (("cube.txt",), "give a scene, and a folder"),
        (("cube.txt", "-o", "out", "--resume"), "nothing to resume"),
        (("cube.txt", "-o", "out", "--size", "0x3"), "width and height"),
        (("cube.txt", "-o", "out", "--device", "no such thing"), "no OpenCL device"),
        (("bad.txt", "-o", "out"), "bad.txt:1"),
        (("cube.txt", "-o", "out", "--json", "x"), "--json goes with --compare"),
        (("--compare", "file", "good.json"), "no JSON"),
        (("--compare", "missing.json", "good.json"), "no such file"),
        (("--compare", "good.json", "later.json"), "format is 99"),
        (("--compare", "good.json", "spoilt.json"), "samples.rows"),
        (("cube.txt", "--compare", "good.json", "good.json"), "--compare takes two studies"),
    ],
)
def test_wrong_input_is_one_line_and_writes_nothing(
    arguments: tuple[str, ...], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cube.txt").write_text(cube_text())
    (tmp_path / "bad.txt").write_text("nonsense\n")
    (tmp_path / "file").write_text("text")
    good = study_example.study()
    spoilt = copy.deepcopy(good)
    spoilt["samples"]["rows"][0]["rmse"] = 0.1
    for name, study in (("good", good), ("later", {**good, "format": 99}), ("spoilt", spoilt)):
        (tmp_path / f"{name}.json").write_text(json.dumps(study))
    before = sorted(tmp_path.rglob("*"))
    result = clrt("study", *arguments)
    assert result.exit_code == 2
    assert words in result.output + "".join(capfd.readouterr())
    assert sorted(tmp_path.rglob("*")) == before


def test_example_of_the_page_is_in_the_form() -> None:
    assert faults(study_example.study()) == []


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda s: s.pop("bias"), "bias is missing"),
        (lambda s: s.update(extra=1), "extra is no key"),
        (lambda s: s["header"].pop("clrt"), "header.clrt is missing"),
        (lambda s: s["samples"]["floor"].update(low=1e9), "samples.floor: .* is not between"),
        (lambda s: s["depth"]["rows"][0]["seconds"].update(runs=1), "an interval from one run"),
        (lambda s: s["depth"]["rows"][0].update(error=None), "missing, and no note says why"),
        (lambda s: s["depth"].update(rows=[]), "neither rows nor a note"),
        (lambda s: s["bias"].update(verdict="perhaps"), "neither 'unbiased' nor"),
    ],
)
def test_what_does_not_fit_the_form_is_said(spoil: Callable[[dict[str, Any]], Any], words: str) -> None:
    study = study_example.study()
    study["depth"].pop("note", None)
    for row in study["depth"]["rows"]:
        row.pop("note", None)
    spoil(study)
    assert len(faults(study)) == 1
    assert re.search(words, faults(study)[0])


def _pair(a: tuple[float, float, float], b: tuple[float, float, float]) -> Any:
    studies = [study_example.study(), study_example.study()]
    for study, (low, median, high) in zip(studies, (a, b), strict=True):
        study["depth"]["rows"][0]["seconds"].update(low=low, median=median, high=high)
    found = compare(*studies)
    place = ("depth", str(studies[0]["depth"]["rows"][0]["depth"]), "seconds")
    return found, next(pair for pair in found.pairs if (pair.part, pair.row, pair.quantity) == place)


@pytest.mark.parametrize(
    ("b", "expected"),
    [
        ((1.0, 1.5, 2.5), "no difference"),
        ((1.2, 2.5, 3.0), "no difference"),
        ((1.21, 1.5, 2.5), "a is less"),
        ((0.5, 0.6, 0.79), "b is less"),
    ],
)
def test_difference_is_claimed_where_intervals_part(b: tuple[float, float, float], expected: str) -> None:
    found, pair = _pair((0.8, 1.0, 1.2), b)
    assert pair.verdict == expected
    assert pair.ratio == pytest.approx((b[1] / 1.0, b[0] / 1.2, b[2] / 0.8))
    assert found.shared - found.agreeing == (expected != "no difference")


def test_comparison_on_screen_and_as_json(tmp_path: Path) -> None:
    a, b = study_example.study(), study_example.study("other.txt")
    b["phases"]["rows"] = b["phases"]["rows"][:-1]
    for name, study in (("a", a), ("b", b)):
        (tmp_path / f"{name}.json").write_text(json.dumps(study))
    shown = clrt("study", "--compare", tmp_path / "a.json", tmp_path / "b.json")
    assert shown.exit_code == 0
    assert "other.txt" in shown.output
    assert "not in b" in shown.output
    found = json.loads(clrt("study", "--compare", tmp_path / "a.json", tmp_path / "b.json", "--json", "-").output)
    assert list(found["differing"]) == ["scene"]
    assert found["shared"] == found["agreeing"] > 20
    assert {row["verdict"] for row in found["rows"]} == {"no difference", "not in b"}


@pytest.mark.slow
@pytest.mark.parametrize(("clamp", "start"), [(0.1, "biased: indirect clamp"), (0.5, "unbiased")])
def test_clamped_light_is_named_biased_where_it_is_cut(clamp: float, start: str, tmp_path: Path, device: Any) -> None:
    """scenes/clamp.txt: each further hit brings 0.3, so that a bound of 0.5 cuts nothing, and one of 0.1 does."""
    path = SCENES / "clamp.txt"

    def read() -> Scene:
        return replace(load_scene(path), indirect=Indirect(clamp, 1))

    plan: Plan = replace(TINY, most_samples=32, reference_factor=32, reference_s=60.0, batches=16)
    subject = open_subject(path, read, device, plan, tmp_path, (16, 12), lambda phase, fraction: None)
    assert measure_samples.measure(subject, {})["bias"]["verdict"].startswith(start)


@pytest.mark.slow
def test_reference_of_a_furnace_is_its_known_answer(tmp_path: Path, device: Any) -> None:
    """scenes/indirect.txt: every pixel is 1. The reference says so within its own error, on every picture's mean."""
    path = SCENES / "indirect.txt"
    subject = open_subject(path, partial(load_scene, path), device, TINY, tmp_path, (16, 12), lambda phase, fraction: None)
    measure_samples.measure(subject, {})
    with np.load(tmp_path / "reference.npz") as file:
        batches = file["batches"].mean(axis=(1, 2))
    error = batches.std(axis=0, ddof=1) / np.sqrt(len(batches))
    assert (np.abs(batches.mean(axis=0) - 1.0) < 6.0 * error + 1e-6).all()
