"""Whether the order of methods stands where their best solutions were evaluated on a finer grid."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.report.boards import unknown
from tests.report.content import add_done, make_spec
from zoobench.db.rows import TRANSFER, StudyRow
from zoobench.db.store import Store
from zoobench.report.leaderboard import BoardRow, FinerScore, Leaderboard, gather
from zoobench.report.leaderboard_export import from_text, to_text
from zoobench.report.leaderboard_pages import markdown_page
from zoobench.spec import Ref

METHODS = ("diffphysics-v2[lr=0.1]", "random-v1")
SPECS = [
    replace(make_spec(method=method, seed=seed), fidelity=Ref.parse("draft-v2[grid_spacing=0.01]"))
    for method in METHODS
    for seed in (0, 1)
]
SCORES = (3.0, 2.9, 1.0, 1.1)
FINE, COARSE = "fine-v2[grid_spacing=0.005]", "smoke-v2[grid_spacing=0.03]"
DENSE = "fine-v2[grid_spacing=0.005,particles_per_cell=27]"


def _row(store: Store, run: int, score: float | None, fidelity: str = FINE, env: str = "desert-v1") -> StudyRow:
    document = {
        "run": run, "env": env, "task": str(SPECS[0].task), "fidelity": fidelity, "frames": SPECS[0].frames,
        "score": score,
    }  # fmt: skip
    return StudyRow("case", "OK", document)


def _board(path: Path, finer: dict[int, float | None], **elsewhere: str) -> Leaderboard:
    """Runs 1 and 2 are the first method's, 3 and 4 the second's; some have scores on a finer grid."""
    with Store(path) as store:
        for spec, score in zip(SPECS, SCORES, strict=True):
            add_done(store, spec, score)
        rows = [_row(store, run, score, **elsewhere) for run, score in finer.items()]
        list(store.save_study(TRANSFER, rows, provenance={}))
        return gather(store, "mine", "mine", "a test", [(spec, None) for spec in SPECS])


@pytest.mark.parametrize(
    ("finer", "line"),
    [
        ({1: 2.7, 4: 0.9}, "| 3 → 2.7 (90%) | 1.1 → 0.9 (82%) | stands |"),
        ({1: 0.5, 2: 5.0, 4: 0.9}, "| 3 → 0.5 (17%) | 1.1 → 0.9 (82%) | another |"),
        ({1: None, 4: 0.9}, "| 3 → diverged | 1.1 → 0.9 (82%) | another |"),
        ({1: -0.001, 4: -0.003}, "| 3 → -0.001 (0%) | 1.1 → -0.003 (0%) | stands |"),
    ],
)
def test_the_page_says_whether_the_order_stands(tmp_path: Path, finer: dict[int, float | None], line: str) -> None:
    """By the best solution of each method, whatever others do; a winner that does not win there is marked."""
    board = _board(tmp_path / "runs.db", finer)
    text = markdown_page(board, unknown)
    assert line in text
    assert "### On a finer grid: fine" in text
    assert (" §** |" in text) == ("- overturned: § wins here" in text) == line.endswith("another |")
    assert f"in {int(line.endswith('stands |'))} of 1 pairs." in text
    assert markdown_page(from_text(to_text(board), "mine.json"), unknown) == text


def test_of_one_method_alone_the_score_is_told(tmp_path: Path) -> None:
    """Without an order, which takes two."""
    text = markdown_page(_board(tmp_path / "runs.db", {1: 2.7}), unknown)
    assert "| 3 → 2.7 (90%) |  |  |" in text
    assert "as it scores here → at fine.\n" in text
    assert "order of the methods" not in text
    assert "§" not in text


def test_nothing_is_said_of_what_was_not_evaluated(tmp_path: Path) -> None:
    """On a coarser grid or in another environment."""
    for number, elsewhere in enumerate([{"fidelity": COARSE}, {"env": "ice-v1"}]):
        text = markdown_page(_board(tmp_path / f"{number}.db", {1: 2.0, 4: 3.0}, **elsewhere), unknown)
        assert "finer grid" not in text
        assert "§" not in text


def test_of_several_grids_the_finest_counts(tmp_path: Path) -> None:
    """Whichever was evaluated last."""
    board = _board(tmp_path / "runs.db", {1: 2.0})
    with Store(tmp_path / "runs.db") as store:
        rows = [_row(store, 1, 7.0, "paper-v2[grid_spacing=0.0075]")]
        list(store.save_study(TRANSFER, rows, provenance={}))
        again = gather(store, "mine", "mine", "a test", [(spec, None) for spec in SPECS])
    assert board.rows[0].finer == again.rows[0].finer == FinerScore(Ref.parse(FINE), 2.0)


def test_of_one_grid_the_score_with_more_particles_counts(tmp_path: Path) -> None:
    """Where a robot tore with fewer; it is marked, and the mark explained."""
    board = _board(tmp_path / "runs.db", {1: None, 4: 0.9})
    assert "°" not in markdown_page(board, unknown)
    with Store(tmp_path / "runs.db") as store:
        list(store.save_study(TRANSFER, [_row(store, 1, 2.7, DENSE), _row(store, 1, None)], provenance={}))
        text = markdown_page(gather(store, "mine", "mine", "a test", [(spec, None) for spec in SPECS]), unknown)
    assert "| 3 → 2.7 (90%) ° | 1.1 → 0.9 (82%) | stands |" in text
    assert "°: the robot tore there" in text
    assert "### On a finer grid: fine\n" in text


def test_every_table_names_its_own_finer_grid(tmp_path: Path) -> None:
    """Where a board has rows of two fidelities, each confirmed on another."""
    board = _board(tmp_path / "runs.db", {1: 2.7, 4: 0.9})
    own, finer = Ref.parse("standard-v2[grid_spacing=0.0075]"), Ref.parse("reference-v2[grid_spacing=0.004]")
    others = [replace(row, spec=replace(row.spec, fidelity=own)) for row in board.rows]
    others = [replace(row, finer=replace(row.finer, fidelity=finer) if row.finer else None) for row in others]
    text = markdown_page(replace(board, rows=(*board.rows, *others)), unknown)
    assert text.count("### On a finer grid: fine\n") == text.count("### On a finer grid: reference\n") == 1


def test_a_finer_score_outlives_its_database(tmp_path: Path) -> None:
    """A publication from a database with the run and without the score keeps that of the earlier export."""
    earlier, later = _board(tmp_path / "one.db", {1: 2.0}), _board(tmp_path / "two.db", {})
    assert later.completed(earlier).rows[0].finer == earlier.rows[0].finer
    assert replace(later, rows=tuple(BoardRow(spec) for spec in SPECS)).completed(earlier).rows[0].finer is not None
