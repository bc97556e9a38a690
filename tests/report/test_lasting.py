"""What solutions do over more frames, and at walls: in tables, pages and exports."""

import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.report.boards import unknown
from tests.report.content import add_done, add_ended, make_spec
from zoobench.db.rows import LASTING, Ending, FinalRow, RunState, StudyRow
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.report.lasting import Lasting
from zoobench.report.leaderboard import Leaderboard, best_of_rows, gather
from zoobench.report.leaderboard_export import from_text, to_text
from zoobench.report.leaderboard_pages import csv_page, markdown_page
from zoobench.report.page.html import page
from zoobench.report.page.sections import section_of
from zoobench.report.run_results import choose_results
from zoobench.report.views import results_overview
from zoobench.spec import RunSelection

SPECS = [make_spec(method=method, seed=seed) for method in ("diffphysics-v2[lr=0.1]", "random-v1") for seed in (0, 1)]
SCORES = (3.0, 2.9, 1.0, 1.1)
LASTS = Lasting(30, 1.5, "", 8.0, 9.0)


def _board(path: Path, known: dict[int, Lasting], gaps: dict[int, float] | None = None) -> Leaderboard:
    """Runs 1 and 2 are the first method's, 3 and 4 the second's; some were lengthened, of some a gap was read."""
    with Store(path) as store:
        for number, (spec, score) in enumerate(zip(SPECS, SCORES, strict=True), start=1):
            gap = [FinalRow("wall_gap", gaps[number], "cells")] if gaps and number in gaps else []
            finals = (FinalRow("score", score, "m/s"), FinalRow("forward_substeps", 1.0), *gap)
            add_ended(store, spec, Ending(RunState.DONE, finals=(*finals, FinalRow("backward_substeps", 0.0))))
        rows = [
            StudyRow("case", "OK", {"run": run, "key": SPECS[run - 1].key(), **lasting.document()})
            for run, lasting in known.items()
        ]
        list(store.save_study(LASTING, rows, provenance={}))
        return gather(store, "mine", "mine", "a test", [(spec, None) for spec in SPECS])


@pytest.mark.parametrize(
    ("lasting", "home", "text"),
    [
        (LASTS, 3.0, "50%"),
        (replace(LASTS, score=-0.3, end="turned away"), 3.0, "-10% turned away"),
        (replace(LASTS, score=None, end="torn in frame 7"), 3.0, "torn in frame 7"),
        (replace(LASTS, score=-0.02), -0.01, "-0.02"),
        (replace(LASTS, score=-0.001), 3.0, "0%"),
    ],
)
def test_a_share_of_the_score_is_kept(lasting: Lasting, home: float, text: str) -> None:
    """Of errors, which are below zero, the score itself is told."""
    assert lasting.text(home) == text


def test_tables_have_a_column_of_what_lasts(tmp_path: Path) -> None:
    """In the page, its HTML and the CSV, of the best solution of each method; the export keeps it."""
    known = {1: LASTS, 2: replace(LASTS, score=0.1), 4: replace(LASTS, score=None, end="torn in frame 7")}
    board = _board(tmp_path / "runs.db", known)
    text = markdown_page(board, unknown)
    assert "| 3x |" in text
    assert "| 50% / torn in frame 7 |" in text
    assert "- lasting: 3x: share of its score that the best solution of each method" in text
    assert markdown_page(from_text(to_text(board), "mine.json"), unknown) == text
    lines = list(csv.DictReader(io.StringIO(csv_page(board, unknown))))
    told = [(line["lasting_frames"], line["lasting_score"], line["lasting_end"]) for line in lines]
    assert told == [("30", "1.5", ""), ("30", "", "torn in frame 7")]
    shown = page([section_of(board, lambda *_: None)], [], lambda *_: None, "zoobench report")
    assert shown.count("50% / torn in frame 7") == 1
    assert ">50%<" in shown


def test_an_export_of_before_goes_on_being_read(tmp_path: Path) -> None:
    """Its pages have no such column, and say that walls are not known."""
    text = to_text(_board(tmp_path / "runs.db", {}))
    assert "lasting" not in text
    board = from_text(text, "mine.json")
    assert board.rows[0].lasting is None
    assert "3x" not in markdown_page(board, unknown)
    assert "- walls: whether it met one is not known of 4 of 4 runs" in markdown_page(board, unknown)


def test_what_lasts_outlives_its_database(tmp_path: Path) -> None:
    """A publication from a database without it keeps that of the earlier export."""
    earlier, later = _board(tmp_path / "one.db", {1: LASTS}), _board(tmp_path / "two.db", {})
    assert later.completed(earlier).rows[0].lasting == LASTS


def test_another_run_of_that_number_is_not_taken_for_it(tmp_path: Path) -> None:
    """A study that was merged from elsewhere names a run by its key, too."""
    with Store(tmp_path / "runs.db") as store:
        add_done(store, SPECS[0], 3.0)
        row = StudyRow("case", "OK", {"run": 1, "key": SPECS[1].key(), **LASTS.document()})
        list(store.save_study(LASTING, [row], provenance={}))
        assert gather(store, "mine", "mine", "a test", [(SPECS[0], None)]).rows[0].lasting is None


def test_a_number_that_is_none_is_refused(tmp_path: Path) -> None:
    """An export with a word in place of a score is no export."""
    text = to_text(_board(tmp_path / "runs.db", {1: LASTS})).replace('"score":1.5', '"score":"x"')
    with pytest.raises(UsageError, match=r"mine\.json is no export"):
        from_text(text, "mine.json")


@pytest.mark.parametrize("is_old", [False, True])
def test_nobody_wins_at_a_wall(tmp_path: Path, is_old: bool) -> None:
    """The cell has a mark that is explained; of an old run the longer episode may tell."""
    far = dict.fromkeys(range(1, 5), 9.0)
    assert "**3 ± " not in markdown_page(_board(tmp_path / "far.db", {}), unknown)
    winner = "**2.95 ± 0.64**"
    assert winner in markdown_page(_board(tmp_path / "near.db", {}, far), unknown)
    near = replace(LASTS, home_gap=2.9)
    board = _board(tmp_path / "runs.db", {1: near} if is_old else {}, {} if is_old else {**far, 1: 2.9})
    text = markdown_page(board, unknown)
    assert winner not in text
    assert "| 2.95 ± 0.64 ‖ |" in text
    assert "- walls: ‖ a robot came within 3 cells of a side of its arena" in text
    assert text.count("not known of 3 of 4 runs") == int(is_old)
    assert next(csv.DictReader(io.StringIO(csv_page(board, unknown))))["wall_gap"] == "2.9"


def test_the_best_of_a_row_keeps_away_from_walls(tmp_path: Path) -> None:
    """Its solution is published, whatever scores more at a wall; where all are at one the best of those."""
    some = _board(tmp_path / "some.db", {}, {1: 1.0, 2: 9.0, 3: 9.0, 4: 9.0})
    every = _board(tmp_path / "every.db", {}, {1: 1.0, 2: 1.0, 3: 1.0, 4: 1.0})
    assert [[row.score for row in best_of_rows(board.rows)] for board in (some, every)] == [[2.9], [3.0]]


def test_results_say_that_a_run_met_a_wall(tmp_path: Path) -> None:
    """Beside its score, where another would have a reason."""
    _board(tmp_path / "runs.db", {}, {1: 1.25, 2: 9.0})
    with Store(tmp_path / "runs.db", create=False) as store:
        rows = results_overview(choose_results(store, RunSelection())).rows
    assert [row[-1] for row in rows] == ["at a wall: within 1.2 cells of it", None, None, None]


def test_the_export_holds_plain_data(tmp_path: Path) -> None:
    """A line of JSON with frames, score, word and gaps."""
    document = json.loads(to_text(_board(tmp_path / "runs.db", {1: LASTS})))
    assert document["runs"][0]["lasting"] == {
        "frames": 30, "score": 1.5, "end": "", "wall_gap": 8.0, "home_gap": 9.0
    }  # fmt: skip
