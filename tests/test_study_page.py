"""The page of a study in a real browser: headless Chromium of the system, driven by Selenium; skipped where there is none."""

from __future__ import annotations

import io
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import study_example
from numpy.typing import NDArray
from PIL import Image

if TYPE_CHECKING:
    from selenium.webdriver.chrome.webdriver import WebDriver
    from selenium.webdriver.remote.webelement import WebElement

CHROMIUM = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
DRIVER = shutil.which("chromedriver")
RED = [255, 40, 40]  #: what study_example paints into the rungs and not into the reference
_FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --disable-dev-shm-usage --disable-background-networking --disable-component-update "
    "--disable-sync --no-first-run --hide-scrollbars --force-device-scale-factor=1 --window-size=1100,1000"
)  # fmt: skip


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WebDriver]:
    """Chromium, which logs what the page says and asks for."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed: pip install selenium")
    if CHROMIUM is None or DRIVER is None:
        pytest.skip("no browser: neither chromium nor chromedriver is installed; on Debian: apt install chromium chromium-driver")
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    options = Options()
    options.binary_location = CHROMIUM
    for flag in [*_FLAGS.split(), f"--user-data-dir={tmp_path_factory.mktemp('chromium')}"]:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("matplotlib")
    pytest.importorskip("jinja2")
    from clrt.study.report import write

    folder = study_example.make(tmp_path_factory.mktemp("study"))
    write(folder)
    return folder / "study.html"


@pytest.fixture
def page(browser: WebDriver, file: Path) -> WebDriver:
    """The page, just opened; what was logged before is forgotten."""
    browser.get("about:blank")
    for log in ("browser", "performance"):
        browser.get_log(log)  # type: ignore[no-untyped-call]
    browser.get(file.as_uri())
    return browser


def find(page: WebDriver, selector: str) -> WebElement:
    return page.find_element("css selector", selector)


def picture(element: WebElement) -> NDArray[np.uint8]:
    """(h, w, 3): the element as it is on the screen."""
    return np.asarray(Image.open(io.BytesIO(element.screenshot_as_png)).convert("RGB"))


def red(page: WebDriver) -> int:
    """Pixels of the comparison that show what the reference has not."""
    shown = picture(find(page, ".frame")).astype(np.int16)
    return int((np.abs(shown - RED).max(axis=-1) < 12).sum())


def column(page: WebDriver, table: str, index: int) -> list[str]:
    return [cell.text for cell in page.find_elements("css selector", f"#{table} tbody td:nth-child({index})")]


def heading(page: WebDriver, table: str, index: int) -> WebElement:
    return find(page, f"#{table} th:nth-child({index})")


def press(element: WebElement, *keys: str) -> None:
    element.send_keys(*keys)


def set_slider(page: WebDriver, key: str) -> None:
    """To an end, by the keyboard, as a person without a mouse would."""
    press(find(page, "input[type=range]"), key)


def test_page_opens_without_errors_and_without_a_network(page: WebDriver) -> None:
    assert page.get_log("browser") == []  # type: ignore[no-untyped-call]
    messages = [json.loads(entry["message"])["message"] for entry in page.get_log("performance")]  # type: ignore[no-untyped-call]
    asked = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    assert asked
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


def test_slider_moves_and_changes_what_is_seen(page: WebDriver) -> None:
    from selenium.webdriver.common.keys import Keys

    set_slider(page, Keys.END)
    assert find(page, "output").text == "100%"
    assert red(page) == 0
    set_slider(page, Keys.HOME)
    assert find(page, "output").text == "0%"
    whole = red(page)
    assert whole > 1000
    for _ in range(45):  # to the middle of the red, which is from 16/48 to 28/48 of the width
        press(find(page, "input[type=range]"), Keys.ARROW_RIGHT)
    assert find(page, "output").text == "45%"
    assert red(page) == pytest.approx(whole * (28 / 48 - 0.45) / (12 / 48), rel=0.08)


def test_slider_follows_the_pointer_on_the_picture(page: WebDriver) -> None:
    from selenium.webdriver.common.action_chains import ActionChains

    frame = find(page, ".frame")
    page.execute_script("arguments[0].scrollIntoView()", frame)
    ActionChains(page).move_to_element(frame).click_and_hold().move_by_offset(frame.size["width"] // 4, 0).release().perform()
    assert int(find(page, "input[type=range]").get_attribute("value") or 0) == pytest.approx(75, abs=1)


def test_choice_of_a_rung_changes_what_is_seen(page: WebDriver) -> None:
    from selenium.webdriver.common.keys import Keys

    set_slider(page, Keys.HOME)
    fast = red(page)
    press(find(page, "input[name=rung]"), Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)  # to exact, which has three times the red rows of fast
    assert find(page, ".tag.right").text == "exact"
    assert red(page) == pytest.approx(3 * fast, rel=0.05)


def test_table_sorts_numbers_as_numbers_both_ways(page: WebDriver) -> None:
    from selenium.webdriver.common.keys import Keys

    seconds = heading(page, "phases", 2)  # units from ms to s: no order of texts is right
    assert seconds.get_attribute("aria-sort") == "none"
    seconds.find_element("tag name", "button").click()
    assert seconds.get_attribute("aria-sort") == "ascending"
    wanted = ["read back", "upload", "write", "compile warm", "read", "trace", "trees", "compile cold"]
    assert column(page, "phases", 1) == [*wanted, "shade"]
    press(seconds.find_element("tag name", "button"), Keys.ENTER)
    assert seconds.get_attribute("aria-sort") == "descending"
    assert column(page, "phases", 1) == [*wanted[::-1], "shade"]  # not measured: last either way


def test_table_sorts_words_and_one_column_at_a_time(page: WebDriver) -> None:
    heading(page, "effects", 4).find_element("tag name", "button").click()
    heading(page, "effects", 1).find_element("tag name", "button").click()
    assert column(page, "effects", 1) == ["mirrors", "shadows", "smooth", "triangles"]
    sorts = [cell.get_attribute("aria-sort") for cell in page.find_elements("css selector", "#effects th")]
    assert sorts == ["ascending", *["none"] * (len(sorts) - 1)]


def test_all_pictures_and_plots_are_seen(page: WebDriver) -> None:
    sizes: list[Any] = page.execute_script(
        "return [...document.images].map((image) => image.complete && image.naturalWidth > 0)"
    )
    assert len(sizes) == 12
    assert all(sizes)
    plots = page.find_elements("css selector", ".plot svg")
    assert len(plots) == 7
    for plot in plots:
        page.execute_script("arguments[0].scrollIntoView()", plot)
        assert len(np.unique(picture(plot).reshape(-1, 3), axis=0)) > 20


@pytest.mark.parametrize("width", [360, 1100])
def test_page_fits_its_window_and_a_screenshot_is_made(page: WebDriver, tmp_path: Path, width: int) -> None:
    page.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride", {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
    )
    try:
        page.refresh()
        wide: int = page.execute_script("return document.documentElement.scrollWidth")
        shot = Path(os.environ.get("CLRT_SCREENSHOTS", tmp_path)) / f"study-{width}.png"
        assert page.save_screenshot(str(shot))
    finally:
        page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    assert wide == width
    with Image.open(shot) as image:
        assert image.width == width
        assert len(np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0)) > 100
