"""The report as a file: what stands in it, and what others wrote cannot leave its place."""

from dataclasses import replace
from html.parser import HTMLParser

import pytest

from tests.report.page.sections import HOSTILE, LEVELS, section
from zoobench.errors import UsageError
from zoobench.report.page import html, sections
from zoobench.report.page.html import page
from zoobench.report.page.sections import MOST_ROWS, Section, Still, best_runs, fitted, results_in

VEGA = "window.vegaEmbed = () => {};"


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Section:
    """See `tests.report.page.sections.section`."""
    return section(tmp_path_factory.mktemp("page"))


@pytest.fixture
def text(shown: Section, monkeypatch: pytest.MonkeyPatch) -> str:
    """The page of that section, without Vega, which takes seconds."""
    monkeypatch.setattr(html, "bundle", lambda: VEGA)
    return page([shown], LEVELS, lambda *_: 0.1, "zoobench report", "exports 1234")


class Outline(HTMLParser):
    """The elements and attributes of a page, and its scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep it."""
        self.tags.append((tag, dict(attrs)))


def test_the_page_needs_nothing_else(text: str) -> None:
    """No element loads anything; the library, the style and the data are in the file."""
    for tag, attributes in Outline(text).tags:
        for name in ("src", "href"):
            assert (attributes.get(name) or "#").startswith(("#", "data:")), (tag, attributes)
    assert VEGA in text
    assert "prefers-color-scheme: dark" in text


def test_what_others_wrote_is_text(text: str) -> None:
    """A reason with a script, a picture and an escape sequence is shown and does nothing."""
    outline = Outline(text)
    assert [tag for tag, _ in outline.tags].count("script") == 3
    assert not any(tag == "img" for tag, _ in outline.tags)
    assert HOSTILE not in text
    assert "&lt;/script&gt;&lt;script&gt;alert(1)" in text
    assert "\\x1b[31m" in text
    assert "\x1b" not in text


def test_each_row_has_the_command_that_repeats_it(text: str) -> None:
    """With all methods and seeds of the row; and the page says where its numbers come from."""
    assert text.count("<code>zoobench run --env desert-v1") == 1
    assert "--seeds 0,1" in text
    assert "Example 9000" in text
    assert 'content="exports 1234"' in text


def test_equal_data_give_an_equal_page(text: str, shown: Section) -> None:
    """No moment and no order of a set is in it."""
    assert page([shown], LEVELS, lambda *_: 0.1, "zoobench report", "exports 1234") == text


def test_the_best_robot_of_each_place_is_shown(shown: Section) -> None:
    """The highest score of each environment and task, whatever the method."""
    best = best_runs(shown)
    assert [run.score.value for run in best if run.score] == [10.1, 11.1, 12.1, 13.1]


@pytest.mark.slow
def test_a_film_stands_on_the_screen_and_its_picture_on_paper(shown: Section) -> None:
    """Both are in the page itself; a still without a film is shown on both."""
    stills = [Still("moves", b"picture", b"film"), Still("stands", b"other")]
    tags = Outline(page([replace(shown, stills=stills)], LEVELS, lambda *_: 0.1, "zoobench report")).tags
    (video,) = (given for tag, given in tags if tag == "video")
    assert video["src"] == "data:video/mp4;base64,ZmlsbQ=="
    assert video["poster"] == "data:image/jpeg;base64,cGljdHVyZQ=="
    assert {"loop", "muted", "playsinline"} <= set(video)
    assert "controls" not in video  # they would hide a third of it
    pictures = [given for tag, given in tags if tag == "img"]
    assert [(given["alt"], given.get("class")) for given in pictures] == [("moves", "paper"), ("stands", None)]


@pytest.mark.slow
def test_a_page_holds_so_many_rows_and_says_what_it_leaves_out(shown: Section, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first ones, with the runs of these alone."""
    assert fitted(shown.tables) == (shown.tables, 0)
    tables, left_out = fitted(shown.tables * (MOST_ROWS // 5 + 1))
    assert (sum(len(table.rows) for table in tables), left_out) == (MOST_ROWS, 5)
    monkeypatch.setattr(sections, "MOST_ROWS", 2)
    tables, left_out = fitted(shown.tables * 2)
    assert ([len(table.rows) for table in tables], left_out) == ([2], 8)
    results = results_in(tables, shown.results)
    assert {result.spec.env.name for result in results} == {"clay", "desert"}
    small = replace(shown, tables=tables, results=results, left_out=left_out)
    assert "8 more rows have no room here" in page([small], LEVELS, lambda *_: 0.1, "zoobench report")


def test_without_the_extra_a_word_comes_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """What to install is said before anything is read."""
    monkeypatch.setitem(__import__("sys").modules, "vl_convert", None)
    with pytest.raises(UsageError, match=r"pip install 'zoobench\[report\]'"):
        html.check_tools()
