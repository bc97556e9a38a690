"""`zoobench report`: from a database, from leaderboards, and what it refuses."""

import re
import shutil
from base64 import b64decode
from dataclasses import replace
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from tests.cli.conftest import ROOT, Command
from tests.conformance.cells import cell
from tests.render.filmed import needs_drawing
from tests.report.boards import unknown
from tests.report.content import add_ended
from zoobench.cell.problem import Problem
from zoobench.db.rows import Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.report.leaderboard import Attempt, BoardRow, Leaderboard
from zoobench.report.leaderboard_files import publish
from zoobench.report.page import html


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without Vega, which takes seconds."""
    monkeypatch.setattr(html, "bundle", lambda: "")


def test_a_database_becomes_a_page(zoobench: Command, database: Path, tmp_path: Path) -> None:
    """With scores, reasons and the command that makes it again; without smoke runs."""
    reply = zoobench("report", "--env", "desert,ice", "-o", "out/results.html")
    assert reply.code == 0
    assert "Written: out/results.html" in reply.err
    text = (tmp_path / "out" / "results.html").read_text(encoding="utf-8")
    assert "1.0010 ± 0.0025" in text
    assert "ValueError: boom" in text
    assert "zoobench report --env desert,ice --output results.html" in text
    assert "77" not in text.partition('id="charts"')[0].partition("<main>")[2].partition("Origin")[0]


@pytest.mark.slow
def test_the_best_robots_are_shown(zoobench: Command, tmp_path: Path) -> None:
    """A film of the first and a still of the second; a robot that cannot be simulated again is left out."""
    needs_drawing()
    with Store(tmp_path / "zoobench.db") as store:
        for env in ("ground", "ice", "desert"):
            problem = Problem(cell(environment=env, fidelity="draft", frames=4))
            parameters = problem.initial(np.random.default_rng(0))
            finals = (FinalRow("score", problem.evaluate(parameters).score, "m/s"),)
            kept = tuple(parameters.tolist())[: -1 if env == "ground" else None]
            add_ended(store, problem.spec, Ending(RunState.DONE, finals=finals, params=kept))
    reply = zoobench("report", "--films", "1", "--stills", "3", "-o", "shown.html")
    assert reply.code == 0, reply.err
    assert re.search(r"film of [1-9][0-9]* kB", reply.err)
    assert "left out: The stored solution has" in reply.err
    text = (tmp_path / "shown.html").read_text(encoding="utf-8")
    assert re.search(r"<figcaption>run 3[^<]*, slowed 2.5 times</figcaption>", text)
    (moving,) = re.findall(r'src="data:video/mp4;base64,([^"]*)"', text)
    assert b64decode(moving)[4:8] == b"ftyp"
    stills = re.findall(r'<img (?:class="paper" )?src="data:image/jpeg;base64,([^"]*)" alt="run (\d)', text)
    assert [int(run) for _, run in stills] == [3, 2]
    assert all(iio.imread(b64decode(image)).std() > 5 for image, _ in stills)


def test_the_best_robots_of_leaderboards_are_shown(zoobench: Command, tmp_path: Path) -> None:
    """Of rows whose solution is published, by the settings, as they have no numbers of runs; an environment once."""
    needs_drawing()
    problem = Problem(cell(fidelity="draft", frames=4))
    params = problem.initial(np.random.default_rng(0))
    finals = {"score": FinalRow("score", problem.evaluate(params).score, "m/s")}
    attempts = (Attempt(0.0, 1.0, False, {}),)
    solved = BoardRow(problem.spec, RunState.DONE, finals=finals, attempts=attempts, solution=tuple(params.tolist()))
    unsolved = replace(solved, spec=cell(environment="ice", fidelity="draft", frames=4), solution=None)
    publish(Leaderboard("mine", "mine", "a test", (unsolved, solved)), tmp_path / "boards", unknown)
    publish(Leaderboard("yours", "yours", "another test", (solved,)), tmp_path / "boards", unknown)
    reply = zoobench("report", "--from", "boards", "--stills", "3", "-o", "shown.html")
    assert reply.code == 0, reply.err
    text = (tmp_path / "shown.html").read_text(encoding="utf-8")
    ((image, title),) = re.findall(r'<img (?:class="paper" )?src="data:image/jpeg;base64,([^"]*)" alt="([^"]*)', text)
    assert title.startswith("ground x movement-speed")
    assert iio.imread(b64decode(image)).std() > 5
    assert "zoobench report --from boards --stills 3 --output boards/shown.html" in text


def test_leaderboards_become_a_page_that_is_known_to_be_theirs(zoobench: Command, tmp_path: Path) -> None:
    """`leaderboard check` finds it made from other exports once one of them changes."""
    (tmp_path / "boards").mkdir()
    for name in ("codesign", "control", "design"):  # the others are large
        for ending in ("json", "csv", "md"):
            shutil.copy(ROOT / "leaderboards" / f"{name}.{ending}", tmp_path / "boards")
    assert zoobench("report", "--from", "boards", "-o", "boards/index.html").code == 0
    text = (tmp_path / "boards" / "index.html").read_text(encoding="utf-8")
    assert re.findall(r'href="#section-\d">(\w+)<', text)[0] == "codesign", "the fullest is not the first"
    assert zoobench("leaderboard", "check", "boards").code == 0
    for ending in (".json", ".csv", ".md"):
        (tmp_path / "boards" / f"design{ending}").unlink()
    reply = zoobench("leaderboard", "check", "boards")
    assert reply.code == 1
    assert "zoobench report --from boards --output boards/index.html" in reply.err


def test_the_committed_page_is_that_of_the_committed_exports() -> None:
    """And small enough for a repository."""
    from zoobench.report.leaderboard_files import INDEX, is_behind

    assert (ROOT / "leaderboards" / INDEX).stat().st_size < 2_500_000
    assert not is_behind(ROOT / "leaderboards")


@pytest.mark.parametrize(
    ("words", "why"),
    [
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
    assert "Errno" not in reply.err
    assert ".part" not in reply.err
