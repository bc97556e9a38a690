"""`zoobench report`: from a database, from leaderboards, and what it refuses."""

import shutil
from pathlib import Path

import pytest

from tests.cli.conftest import ROOT, Command
from zoobench.report.page import html


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without Vega, which takes seconds."""
    monkeypatch.setattr(html, "_vega", lambda: "")


def test_a_database_becomes_a_page(zoobench: Command, database: Path, tmp_path: Path) -> None:
    """With scores, reasons and the command that makes it again; without smoke runs."""
    reply = zoobench("report", "--env", "desert,ice", "-o", "out/results.html")
    assert reply.code == 0
    assert "Written: out/results.html" in reply.err
    text = (tmp_path / "out" / "results.html").read_text(encoding="utf-8")
    assert "1.001 ± 0.0025 m/s (n=3)" in text
    assert "ValueError: boom" in text
    assert "zoobench report --env desert,ice --output results.html" in text
    assert "77" not in text.partition('id="charts"')[0].partition("<main>")[2].partition("Origin")[0]


def test_leaderboards_become_a_page_that_is_known_to_be_theirs(zoobench: Command, tmp_path: Path) -> None:
    """`leaderboard check` finds it made from other exports once one of them changes."""
    shutil.copytree(ROOT / "leaderboards", tmp_path / "boards")
    assert zoobench("report", "--from", "boards", "-o", "boards/index.html").code == 0
    assert 'href="#section-3">laptop<' in (tmp_path / "boards" / "index.html").read_text(encoding="utf-8")
    assert zoobench("leaderboard", "check", "boards").code == 0
    for ending in (".json", ".csv", ".md"):
        (tmp_path / "boards" / f"design{ending}").unlink()
    reply = zoobench("leaderboard", "check", "boards")
    assert reply.code == 1
    assert "zoobench report --from boards --output boards/index.html" in reply.err


def test_the_committed_page_is_that_of_the_committed_exports() -> None:
    """And small enough for a repository."""
    from zoobench.report.leaderboard_files import INDEX, is_behind

    assert (ROOT / "leaderboards" / INDEX).stat().st_size < 1_500_000
    assert not is_behind(ROOT / "leaderboards")


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--from", "boards", "--stills", "2"), "hold no robots"),
        (("--from", "boards", "--env", "ice"), "whole leaderboards"),
        (("--from", "nowhere"), "no export"),
        (("--env", "mars"), "mars"),
        (("-o", "zoobench.db/page.html"), "Give another -o"),
    ],
)
def test_what_cannot_be_is_said(zoobench: Command, database: Path, words: tuple[str, ...], why: str) -> None:
    """Exit code 2, and what to do."""
    reply = zoobench("report", *words)
    assert reply.code == 2
    assert why in reply.err
