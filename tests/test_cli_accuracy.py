"""`--error`, `--within` and `--stderr` on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from clrt.cli import arguments
from clrt.cli.main import cli

SCENE = "E 0 0 -1\nV 0 0 1\nF 45\nR 64 48\nL 5 5 -5\nM 1 0.5 0.5 1 0 0 1 0\nT -0.4 -1 2  0.2 -1.1 2  0.1 0.3 2\nlens 0.1 1.5\n"


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.txt").write_text(SCENE)
    return tmp_path


@pytest.mark.parametrize(("text", "seconds"), [("5", 5.0), ("5s", 5.0), ("300ms", 0.3), ("2min", 120.0), ("1.5 h", 5400.0), (".5s", 0.5)])
def test_durations(text: str, seconds: float) -> None:
    assert arguments.duration(text) == pytest.approx(seconds)


@pytest.mark.parametrize("text", ["", "s", "5 m", "5sec", "nan", "inf", "1,5"])
def test_what_is_no_duration_is_refused(text: str) -> None:
    with pytest.raises(click.BadParameter, match="this is a time"):
        arguments.duration(text)


def test_error_may_be_given_in_per_cent() -> None:
    assert arguments.fraction("1%") == arguments.fraction("0.01") == 0.01
    with pytest.raises(click.BadParameter, match="relative error"):
        arguments.fraction("1 %")


def test_forecast_comes_first_and_the_outcome_last(scene: Path) -> None:
    result = CliRunner().invoke(cli, ["scene.txt", "--error", "0.02", "--stderr", "error.png"], catch_exceptions=False)
    assert result.exit_code == 0
    assert "asked: 2%" in result.stdout
    assert "error.png, white is" in result.stdout
    assert (scene / "error.png").exists()


def test_figures_hold_the_accuracy(scene: Path) -> None:
    CliRunner().invoke(cli, ["scene.txt", "--error", "0.02", "--stats", "figures.json", "-q"], catch_exceptions=False)
    accuracy = json.loads((scene / "figures.json").read_text())["accuracy"]
    assert accuracy["met"]
    assert accuracy["error"]["low"] <= accuracy["error"]["value"] <= 0.02


@pytest.mark.parametrize(
    "options", [["--error", "-1"], ["--error", "0"], ["--within", "-2s"], ["--within", "0"], ["--error", "0.1", "--samples", "4"],
                ["--within", "1s", "--samples", "4"], ["--stderr", "error.txt"], ["--stderr", "scene.txt"]],
)  # fmt: skip
def test_bad_options_write_nothing(scene: Path, options: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        cli.main(["scene.txt", *options], prog_name="clrt")
    assert end.value.code == 2
    assert capsys.readouterr().err.startswith("clrt: error: ")
    assert [path.name for path in scene.iterdir()] == ["scene.txt"]
