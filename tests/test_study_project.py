"""The project's own study: its scenes, and the page of made-up studies."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
import study_example

from clrt.errors import ClrtError
from clrt.scene.build import load_scene
from clrt.study import project, store
from clrt.study.project_page import page
from clrt.study.verdict import digit


def result(name: str, **changes: Any) -> dict[str, Any]:
    study = copy.deepcopy(study_example.study())
    study["samples"]["slope"] = {"median": -0.5, "low": -0.55, "high": -0.45, "unit": "1", "runs": 12}
    study["samples"].setdefault("reference", {"rung": "double", "samples": 800, "batches": 16, "times_largest": 100})
    return {"name": name, "words": "an example", "stands_in": False, "study": study, "known": None, **changes}


def test_a_tenth_of_the_error_takes_a_hundred_times_the_random_samples() -> None:
    assert digit({"median": -0.5, "low": -1.0, "high": -0.25}) == pytest.approx((100.0, 10.0, 10_000.0))
    assert digit({"median": -0.1, "low": -0.3, "high": 0.1}) is None
    assert digit({"median": -0.1, "low": -0.3, "high": -0.001}) is None  # 10^1000 times


def test_page_has_each_scene_its_cost_and_its_verdict() -> None:
    text = page([result("one"), result("two", stands_in=True)])
    assert text.count("The next digit takes 100x the samples") == 2
    assert "random sampling" in text
    assert text.count("A generated scene stands in") == 1
    for line in study_example.study()["verdict"]:
        assert text.count(line) == 2
    assert text.count("| one | fast |") == text.count("| two | double |") == 1


@pytest.mark.parametrize(("low", "word"), [(0.9999, "inside"), (1.0001, "**outside**")])
def test_page_says_whether_the_known_answer_lies_within(low: float, word: str) -> None:
    text = page([result("furnace", known={"known": 1.0, "mean": 1.0002, "low": low, "high": 1.0003})])
    assert f"the known answer is 1, {word} this interval" in text


def test_six_scenes_of_the_project_can_be_read(tmp_path: Path) -> None:
    assert [scene.name for scene in project.SCENES] == ["monkey", "rabbit", "glass", "soft shadows", "indirect light", "furnace"]
    for scene in project.SCENES:
        if scene.stand_in is None:
            assert load_scene(project.text_of(scene, tmp_path)[0]).warnings == ()


def test_scene_of_the_report_that_is_missing_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(project, "_REPORTS", tmp_path)
    path, stands_in = project.text_of(project.SCENES[0], tmp_path)
    assert stands_in
    assert load_scene(path).triangle_count == pytest.approx(968, rel=0.05)


def test_page_goes_into_its_place_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(project, "PAGE", tmp_path / "accuracy.md")
    with pytest.raises(ClrtError, match="no such file"):
        project.write_page("new", False, tmp_path)
    (tmp_path / "accuracy.md").write_text(f"before\n{project.BEGIN}\nold\n{project.END}\nafter\n")
    project.write_page("new", False, tmp_path)
    assert (tmp_path / "accuracy.md").read_text() == f"before\n{project.BEGIN}\nnew\n{project.END}\nafter\n"
    (tmp_path / "accuracy.md").write_text("no place")
    with pytest.raises(ClrtError, match="must have once"):
        project.write_page("new", False, tmp_path)
    assert project.write_page("new", True, tmp_path).read_text() == "new\n"


def test_whole_study_is_kept_and_not_measured_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "glass").mkdir()
    store.save(study_example.study(), tmp_path / "glass")
    monkeypatch.setattr(project.subprocess, "run", lambda *a, **k: pytest.fail("measured again"))
    found = project.measure(project.SCENES[2], tmp_path, quick=True, anew=False)
    assert found["study"] == study_example.study()


def test_accuracy_page_has_the_place_of_the_tables() -> None:
    text = project.PAGE.read_text(encoding="utf-8")
    assert text.count(project.BEGIN) == text.count(project.END) == 1
