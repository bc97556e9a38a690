"""The report in headless Chromium, where there is one."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.report.page.sections import LEVELS, section
from zoobench.report.page.html import page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of `tests.report.page.sections.section`."""
    folder = tmp_path_factory.mktemp("report")
    path = folder / "report.html"
    path.write_text(page([section(folder)], LEVELS, lambda *_: 0.1, "zoobench report"), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield started
        started.close()


def open_page(browser: Any, file: Path, **options: Any) -> tuple[Any, list[str]]:
    """The page with its charts drawn, and what it has said on the console."""
    shown = browser.new_context(offline=True, **options).new_page()
    said: list[str] = []
    shown.on("console", lambda message: said.append(message.text))
    shown.on("pageerror", lambda error: said.append(str(error)))
    shown.goto(file.as_uri())
    shown.wait_for_function(
        "document.querySelectorAll('.chart svg').length === document.querySelectorAll('.chart').length"
    )
    return shown, said


def column(shown: Any, number: int) -> list[str]:
    """The texts of a column of the first table, of the rows that are seen."""
    found: list[str] = shown.locator(f".board >> nth=0 >> tbody tr:visible td:nth-child({number})").all_inner_texts()
    return found


def test_tables_sort_and_filter(browser: Any, file: Path) -> None:
    """By numbers and back, with nothing at the end; by words that all must be in a row. The console stays silent."""
    shown, said = open_page(browser, file)
    assert column(shown, 1) == ["clay", "desert", "ground", "ice", "snow"]
    head = shown.locator(".board >> nth=0 >> th button", has_text="diffphysics")
    head.click()
    assert column(shown, 1) == ["desert", "ground", "ice", "snow", "clay"]
    head.click()
    assert column(shown, 1) == ["snow", "ice", "ground", "desert", "clay"]
    shown.locator(".board >> nth=0 >> input").fill("turning ICE")
    assert column(shown, 1) == ["ice"]
    assert shown.locator(".board >> nth=0 >> output").inner_text() == "1 of 5 rows"
    assert said == []


def test_a_chart_shows_the_chosen_cell(browser: Any, file: Path) -> None:
    """Another choice, another picture."""
    shown, said = open_page(browser, file)
    chart = shown.locator(".chart", has=shown.locator("select")).first
    before = chart.locator("svg").inner_html()
    chart.locator("select").select_option(index=2)
    shown.wait_for_timeout(200)
    assert chart.locator("svg").inner_html() != before
    assert said == []


@pytest.mark.parametrize(
    "options",
    [
        {"viewport": {"width": 390, "height": 844}, "is_mobile": True},
        {"viewport": {"width": 1280, "height": 900}, "color_scheme": "dark"},
    ],
)
def test_the_page_fits_phones_and_dark_screens(browser: Any, file: Path, options: dict[str, Any]) -> None:
    """Nothing is wider than the screen, and text stands out from its ground, in charts as well."""
    shown, said = open_page(browser, file, **options)
    assert shown.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    ink, paper = (
        sum(map(int, shown.evaluate(f"getComputedStyle({what}).{name}").removeprefix("rgb(").rstrip(")").split(",")))
        for what, name in (("document.querySelector('.chart svg text')", "fill"), ("document.body", "backgroundColor"))
    )
    assert abs(ink - paper) > 450
    assert (paper < 120) == (options.get("color_scheme") == "dark")
    assert said == []
