"""What `clrt study` shows: numbers as text, tables, plots and the page, made of a study.json alone."""

from __future__ import annotations

import copy
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import study_example

pytest.importorskip("matplotlib")
pytest.importorskip("jinja2")

from matplotlib.figure import Figure
from PIL import Image

from clrt.errors import ClrtError
from clrt.study import report
from clrt.study.report_bars import draw_effects, draw_precision
from clrt.study.report_curves import draw_bias, draw_depth, draw_samples
from clrt.study.report_numbers import Number
from clrt.study.report_plots import draw, style
from clrt.study.report_tables import PARTS, section
from clrt.study.schema import faults

PLOTS = ("precision", "samples", "depth", "effects", "trees", "bias", "phases")
HARD_NAME = '<b>&"x|y*</b>'


class Page(HTMLParser):
    """Elements of a page as (tag, attributes), and its text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.text += data

    def values(self, *names: str) -> Iterator[str]:
        yield from (value or "" for _, attributes in self.elements for name, value in attributes.items() if name in names)


@pytest.fixture(scope="module")
def named() -> list[Path]:
    """What `report.write` said that it wrote, once `written` is there."""
    return []


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory, named: list[Path]) -> Path:
    """The folder of an example whose scene has a hard name, with everything that is made of it."""
    folder = study_example.make(tmp_path_factory.mktemp("study"), study_example.study(HARD_NAME))
    named += report.write(folder)
    return folder


@pytest.fixture(scope="module")
def page(written: Path) -> Page:
    return Page((written / "study.html").read_text(encoding="utf-8"))


def painted(paint: Any, content: dict[str, Any]) -> tuple[Figure, str]:
    figure = Figure()
    with style():
        caption = paint(figure, content)
    return figure, caption


@pytest.mark.parametrize(
    ("median", "low", "high", "unit", "text"),
    [
        (1.16, 1.13, 1.19, "x", "1.16x (1.13 to 1.19)"),
        (0.01234, 0.0121, 0.0126, "s", "12.3 ms (12.1 to 12.6)"),
        (2.5e-7, 2.4e-7, 2.6e-7, "s", "250 ns (240 to 260)"),
        (0.0, 0.0, 0.0, "s", "0 s"),
        (-0.004, -0.012, 0.004, "s", "-4.0 ms (-12.0 to 4.0)"),
        (21.3e6, 20.7e6, 21.9e6, "1/s", "21.3 M/s (20.7 to 21.9)"),
        (0.134, 0.128, 0.141, "share", "13.4% (12.8 to 14.1)"),
        (1234567.0, 1234567.0, 1234567.0, "nodes", "1,234,567 nodes"),
        (3.2e-6, 2.9e-6, 3.5e-6, "", "3.2\N{MULTIPLICATION SIGN}10⁻⁶ (2.9 to 3.5)"),
        (0.0001, 0.0001, 0.0001, "", "1\N{MULTIPLICATION SIGN}10⁻⁴"),
        (-0.66, -0.69, -0.63, "", "-0.66 (-0.69 to -0.63)"),
        (1.16, 1.1599999, 1.1600001, "x", "1.160x (1.160 to 1.160)"),
        (0.0037, 0.0000012, 2.6122, "s", "3.7 ms (0.0012 to 2,600)"),
        (0.00082, -0.01447, 0.01499, "s", "0.82 ms (-14 to 15)"),
        (0.00001, -0.02, 0.02, "", "0.000010 (-0.020 to 0.020)"),
    ],
)
def test_number_as_text(median: float, low: float, high: float, unit: str, text: str) -> None:
    assert str(Number(median, low, high, unit, 7)) == text


@pytest.mark.parametrize("value", [None, "4", True, float("nan"), {"median": None}, {"median": float("inf")}, []])
def test_what_is_no_number_has_none(value: object) -> None:
    assert Number.of(value) is None


def test_example_has_the_form_of_a_study() -> None:
    assert faults(study_example.study()) == []


def test_everything_is_written_and_named(written: Path, named: list[Path]) -> None:
    wanted = {"study.md", "study.html"} | {f"plots/{name}.{ending}" for name in PLOTS for ending in ("svg", "png")}
    assert {str(path.relative_to(written)) for path in named} == wanted
    files = {str(path.relative_to(written)) for path in written.rglob("*") if path.is_file() and path.parent.name != "pictures"}
    assert files == wanted | {"study.json"}


def test_page_asks_nothing_of_a_network(page: Page) -> None:
    links = [*page.values("src", "srcset", "href", "xlink:href", "data", "action")]
    assert links
    assert [link for link in links if not link.startswith(("data:", "#"))] == []
    assert any("default-src 'none'" in value for value in page.values("content"))


def test_page_escapes_what_the_json_says(page: Page) -> None:
    assert HARD_NAME in page.text
    assert "b" not in {tag for tag, _ in page.elements}


def test_page_ids_are_unique_and_references_lead_to_them(page: Page) -> None:
    ids = [*page.values("id")]
    assert len(ids) == len(set(ids))
    wanted = {link[1:] for link in page.values("href", "xlink:href") if link.startswith("#")}
    wanted |= {name for value in page.values("aria-labelledby") for name in value.split()}
    wanted |= {name for value in page.values("clip-path", "style") for name in re.findall(r"url\(#([^)]+)\)", value)}
    assert wanted <= set(ids)


def test_page_pictures_have_words_beside_them(page: Page) -> None:
    pictures = [attributes for tag, attributes in page.elements if tag == "img"]
    assert len(pictures) == 5 + 2 + 5  # reference and rungs, difference maps, crops
    assert all(attributes.get("alt") for attributes in pictures)


def test_markdown_tables_are_whole_and_say_the_numbers(written: Path) -> None:
    text = (written / "study.md").read_text(encoding="utf-8")
    assert "1.16x (1.13 to 1.19)" in text
    assert r"\<b\>\&" in text.partition("\n")[0]
    for block in re.findall(r"(?:^\|.*\n)+", text, re.M):
        lines = block.splitlines()
        assert len({len(line) for line in lines}) == 1
        assert len({line.count(" | ") for line in lines}) == 1
    assert [name for name in PLOTS if f"(plots/{name}.svg)" not in text] == []
    assert "The reference: double, 6400 samples a pixel, 100 times those of the largest point." in text
    assert "Error: root mean square error against depth 8." in text
    assert "- brute: 69,451 triangles: it would take about 40 minutes" in text


def test_part_without_rows_shows_its_note_and_no_table(tmp_path: Path) -> None:
    content = study_example.study()
    content["depth"] = {"rows": [], "note": "nothing in the scene sends rays on"}
    content["trees"] = None
    parts = {part.key: section(content, part) for part in PARTS}
    assert (parts["depth"].table, parts["depth"].notes) == (None, ["Nothing in the scene sends rays on."])
    assert (parts["trees"].table, parts["trees"].notes) == (None, ["Not measured."])


def test_study_of_which_nothing_is_measured_has_a_page(tmp_path: Path) -> None:
    whole = study_example.study()
    folder = study_example.make(tmp_path, {key: whole[key] if key in ("format", "header") else None for key in whole})
    assert {path.name for path in report.write(folder)} == {"study.md", "study.html"}
    assert Page((folder / "study.html").read_text(encoding="utf-8")).text.count("Not measured.") == len(PARTS)


def test_plots_are_whole_pictures(written: Path) -> None:
    for name in PLOTS:
        assert ElementTree.parse(written / "plots" / f"{name}.svg").getroot().tag.endswith("svg")
        with Image.open(written / "plots" / f"{name}.png") as image:
            assert image.convert("L").getextrema() != (255, 255)


def test_same_json_draws_the_same_bytes() -> None:
    content = study_example.study()["samples"]
    with style():
        first, second = (draw("samples", "", content, draw_samples) for _ in range(2))
    assert first is not None
    assert first == second


@pytest.mark.slow
def test_same_json_writes_the_same_bytes_in_another_process(written: Path, tmp_path: Path) -> None:
    folder = study_example.make(tmp_path, study_example.study(HARD_NAME))
    program = "import sys, pathlib; from clrt.study.report import write; write(pathlib.Path(sys.argv[1]))"
    subprocess.run([sys.executable, "-c", program, folder], check=True, env={**os.environ, "PYTHONHASHSEED": "7"})
    for path in written.rglob("*.*"):
        assert (folder / path.relative_to(written)).read_bytes() == path.read_bytes(), path.name


def test_samples_plot_has_guide_slope_floor_and_rings() -> None:
    content = study_example.study()["samples"]
    figure, caption = painted(draw_samples, content)
    axes = figure.axes[0]
    lines = {str(line.get_label()): line.get_xydata() for line in axes.lines}
    counts = np.log([row["samples"] for row in content["rows"]])
    guide, measured = lines["slope -1/2 in samples: random sampling"], lines["slope -0.66 in samples: measured"]
    assert np.polyfit(counts, np.log(np.asarray(guide)[:, 1]), 1)[0] == pytest.approx(-0.5)
    assert np.polyfit(counts, np.log(np.asarray(measured)[:, 1]), 1)[0] == pytest.approx(-0.66)
    rings = np.asarray(lines["no other is better in both"])
    assert rings[:, 0] == pytest.approx([content["rows"][i]["seconds"]["median"] for i in content["pareto"]])
    floor = next(patch for patch in axes.patches if patch.get_label() == "noise floor")
    assert floor.get_extents().transformed(axes.transData.inverted()).y1 == pytest.approx(content["floor"]["high"])
    assert "steeper than the -0.5" in caption


def test_caption_claims_a_slope_only_where_the_interval_parts() -> None:
    content = study_example.study()["samples"]
    content["slope"] |= {"median": -0.55, "low": -0.61, "high": -0.49}
    assert "not to be told from the -0.5" in painted(draw_samples, content)[1]


def test_caption_claims_a_cost_only_where_the_interval_parts() -> None:
    content = study_example.study()["precision"]
    content["rows"][1]["ratio_to_fast"] |= {"median": 1.04, "low": 0.99, "high": 1.09}
    caption = painted(draw_precision, content)[1]
    assert "Dearer than fast: exact, double." in caption
    assert "Not to be told from fast in time: watertight." in caption


def test_effects_are_drawn_dearest_first() -> None:
    figure, caption = painted(draw_effects, study_example.study()["effects"])
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["mirrors", "shadows", "smooth", "triangles"]
    bars: list[Any] = list(figure.axes[0].patches)
    assert [bar.get_width() for bar in bars] == pytest.approx([305, 121, 4])  # milliseconds
    assert "Not to be told from nothing in time: smooth." in caption


def test_points_that_logarithmic_axes_cannot_show_are_named() -> None:
    assert "Without any error, and so not on these axes: 8." in painted(draw_depth, study_example.study()["depth"])[1]
    assert "In 1 of 6 rows the estimated bias is zero or less" in painted(draw_bias, study_example.study()["bias"])[1]


def test_too_few_points_draw_nothing() -> None:
    content = study_example.study()["samples"]
    with style():
        assert draw("samples", "", {**content, "rows": content["rows"][:1]}, draw_samples) is None


def test_crops_are_the_pixels_at_their_place(written: Path, page: Page) -> None:
    import base64

    crop = next(attributes["src"] for tag, attributes in page.elements if attributes.get("alt") == "Crop of exact")
    assert crop is not None
    shown = np.asarray(Image.open(io.BytesIO(base64.b64decode(crop.partition(",")[2]))))
    whole = np.asarray(Image.open(written / "pictures" / "exact.png"))
    factor = shown.shape[0] // 12
    assert np.array_equal(shown[::factor, ::factor], whole[20:32, 16:28])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda s: s["precision"]["pictures"].update(exact="../secret.png"), "'../secret.png'"),
        (lambda s: s["precision"]["pictures"].update(exact="/etc/passwd"), "'/etc/passwd'"),
        (lambda s: s["precision"]["pictures"].update(exact="pictures/none.png"), "pictures/none.png"),
        (lambda s: s.pop("bias"), "bias is missing"),
    ],
    ids=["outside", "absolute", "missing", "key"],
)
def test_faults_are_told_and_nothing_is_written(tmp_path: Path, change: Any, said: str) -> None:
    content = copy.deepcopy(study_example.study())
    change(content)
    folder = study_example.make(tmp_path, content)
    with pytest.raises(ClrtError, match=re.escape(said)):
        report.write(folder)
    assert {path.name for path in folder.iterdir()} == {"study.json", "pictures"}


def test_picture_that_is_none_is_told(tmp_path: Path) -> None:
    folder = study_example.make(tmp_path)
    (folder / "pictures" / "exact.png").write_bytes(b"not a picture")
    with pytest.raises(ClrtError, match="no PNG picture"):
        report.write(folder)


def test_missing_library_is_told_with_what_installs_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ClrtError, match=r"matplotlib and jinja2; .*pip install 'clrt\[study\]'"):
        report.write(tmp_path)
