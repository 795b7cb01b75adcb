"""`clrt explain`, `--without`: what belongs to an effect, what it adds, costs and changes; names that people give."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import clrt
from clrt.cli.main import cli
from clrt.errors import ClrtError
from clrt.explain import Difference
from clrt.features import FEATURES, HELPERS, Features
from clrt.features.choice import EFFECTS, effect_names
from clrt.scene.build import load_scene
from clrt.timing import median_interval

SCENES = Path(__file__).parents[1] / "scenes"


def active(name: str, *without: str) -> set[str]:
    return {f.name for f in Features.of(load_scene(SCENES / f"{name}.txt"), without).active}


@pytest.mark.parametrize(
    ("scene", "without", "gone"),
    [
        ("spot", "direct light", {"direct light", "shadows", "spot"}),
        ("spot", "shadows", {"shadows"}),
        ("sun", "sun", {"sun", "sun shadows", "reach"}),
        ("fresnel", "refraction", {"refraction", "fresnel", "bounce"}),
        ("absorb", "absorption", {"absorption", "throughput"}),
        ("mirror", "mirror", {"mirror", "bounce"}),
        ("first", "mirror", {"mirror"}),
        ("samples", "samples", {"samples", "sampling", "sampler"}),
    ],
)
def test_an_effect_takes_along_what_needs_it_and_what_nothing_needs_any_more(scene: str, without: str, gone: set[str]) -> None:
    assert active(scene) - active(scene, without) == gone
    assert active(scene, without) < active(scene)


@pytest.mark.parametrize("path", sorted(SCENES.glob("*.txt")), ids=lambda path: path.stem)
def test_without_all_effects_nothing_is_left(path: Path) -> None:
    assert Features.of(load_scene(path), EFFECTS).active == ()


def test_helpers_are_no_effects_and_every_effect_has_a_name_of_its_own() -> None:
    assert set(EFFECTS) == {f.name for f in FEATURES} - HELPERS
    assert len(EFFECTS) == len(set(EFFECTS))


def test_names_are_taken_as_people_write_them() -> None:
    assert effect_names(["Sun_Shadows", "sun-shadows", " mirror "]) == ("sun shadows", "mirror")
    with pytest.raises(ClrtError, match="'shadow'; did you mean 'shadows'"):
        effect_names(["shadow"])
    with pytest.raises(ClrtError, match=r"there are .*mirror"):
        effect_names(["zzzz"])


def test_picture_without_lights_and_mirrors_is_ambient_light_alone(tmp_path: Path) -> None:
    """A card of colour (0.5, 1, 0.25) with ambient 0.5, lit and mirroring: without both effects C Ka is left."""
    text = "E 0 0 0\nV 0 0 1\nF 20\nR 4 4\nL 0 0 0\nM 0.5 1 0.25  0.5 0.5 0 1  0.5\nT -9 -9 2  -9 9 2  9 9 2\nT -9 -9 2  9 9 2  9 -9 2\nO\n"
    (tmp_path / "scene.txt").write_text(text)
    lit = clrt.render(tmp_path / "scene.txt")
    dark = clrt.render(tmp_path / "scene.txt", without=("direct light", "mirror"))
    np.testing.assert_array_equal(dark.pixels, np.broadcast_to(np.float32([0.25, 0.5, 0.125]), (4, 4, 3)))
    assert (lit.pixels > dark.pixels).all()
    assert dark.stats is not None
    assert (dark.stats.effects, dark.stats.without) == ([], ["direct light", "mirror"])


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(cli, [str(a) for a in arguments])


def test_an_effect_that_is_not_called_for_is_told_and_changes_nothing() -> None:
    with pytest.warns(RuntimeWarning, match="does not call for 'mirror'"):
        without = clrt.render(SCENES / "shadow.txt", without=["mirror"])
    np.testing.assert_array_equal(without.pixels, clrt.render(SCENES / "shadow.txt").pixels)


def test_unknown_effect_is_said_before_anything_is_rendered(tmp_path: Path) -> None:
    picture = tmp_path / "o.png"
    command = [str(SCENES / "shadow.txt"), "-o", str(picture), "--without", "shadow"]
    with pytest.raises(ClrtError, match="did you mean 'shadows'"):
        CliRunner().invoke(cli, command, catch_exceptions=False, standalone_mode=False)
    assert not picture.exists()


def test_explain_names_the_line_of_each_effect_and_what_is_off() -> None:
    result = run("explain", SCENES / "mirror.txt", "--json", "-")
    found = json.loads(result.output)
    lines = (SCENES / "mirror.txt").read_text().splitlines()
    on = {e["name"]: e for e in found["effects"] if e["on"]}
    assert set(on) == {"direct light", "shadows", "mirror"}
    assert {e["name"] for e in found["effects"]} == set(EFFECTS)
    for effect in on.values():
        assert effect["text"] == lines[effect["line"] - 1].strip()
        assert effect["source_bytes"] > 0
    assert lines[on["direct light"]["line"] - 1].startswith("L ")
    assert lines[on["mirror"]["line"] - 1].startswith("M ")
    assert on["mirror"]["brings"] == ["bounce"]
    assert on["direct light"]["buffer_bytes"] > on["shadows"]["buffer_bytes"] > 0
    assert on["mirror"]["measured"] is None


def test_measured_effects_have_intervals_and_differences() -> None:
    result = run("explain", SCENES / "mirror.txt", "--measure", "--rounds", "6", "--size", "32x32", "--json", "-")
    by_name = {e["name"]: e["measured"] for e in json.loads(result.output)["effects"] if e["on"]}
    for measured in by_name.values():
        low, high = measured["cost_interval_s"]
        assert measured["rounds"] == len(measured["with_s"]) == len(measured["without_s"]) == 6
        assert low <= measured["cost_s"] <= high
    assert by_name["mirror"]["difference"]["pixels"] > 0.0
    full, less = (clrt.render(SCENES / "mirror.txt", size=(32, 32), without=names).pixels.astype(float) for names in ((), ("mirror",)))
    assert by_name["mirror"]["difference"]["greatest"] == np.abs(full - less).max()
    assert by_name["mirror"]["difference"]["pixels"] == np.any(full != less, axis=-1).mean()


@pytest.mark.parametrize("width", [30, 60, 100])
def test_tables_fit_the_terminal(width: int) -> None:
    import io

    from rich.console import Console

    from clrt.cli.explain import _Page
    from clrt.device.context import open_device
    from clrt.explain import explain
    from clrt.precision import rung
    from clrt.renderer import build_trees

    scene = load_scene(SCENES / "mirror.txt")
    found = explain(build_trees(scene, "sah", lambda *_: None), rung("watertight"), open_device(), lambda *_: None)
    out = io.StringIO()
    Console(file=out, width=width, force_terminal=False).print(_Page(found))
    shown = out.getvalue()
    assert max(map(len, shown.splitlines())) <= width
    assert "mirror" in shown
    assert "…" not in shown


def test_difference_of_pictures_counts_numbers_and_no_numbers() -> None:
    a = np.zeros((2, 2, 3), np.float32)
    b = a.copy()
    b[0, 0] = (0.5, 0.0, -1.0)
    assert Difference.of(a, b) == Difference(1.0, 1.5 / 12.0, 0.25, np.sqrt(1.25 / 12.0))
    a[1, 1, 0] = b[1, 1, 0] = np.nan
    assert Difference.of(a, b).pixels == 0.25
    b[1, 1, 0] = 0.0
    assert (Difference.of(a, b).greatest, Difference.of(a, b).pixels) == (np.inf, 0.5)


@pytest.mark.parametrize(("count", "outside"), [(6, 0), (9, 1), (15, 3), (21, 5)])
def test_interval_of_a_median_is_that_of_the_sign_test(count: int, outside: int) -> None:
    """Places in published tables of the sign test at 95% (Dixon and Mood 1946)."""
    assert median_interval(list(range(count))[::-1]) == (outside, count - 1 - outside)
    with pytest.raises(ValueError, match="take 6"):
        median_interval([1.0] * 5)


def test_interval_of_a_median_holds_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(4)
    held = [low <= np.log(2.0) <= high for low, high in (median_interval(rng.exponential(size=11).tolist()) for _ in range(4000))]
    assert 0.95 <= np.mean(held) <= 1.0
