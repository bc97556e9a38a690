"""Normalised scores, from figures that are known."""

from pathlib import Path

import pytest

from tests.report.content import add_done, make_spec
from zoobench.db.store import Store
from zoobench.report.cells import cells_of
from zoobench.report.normalise import floor_of, shares
from zoobench.report.run_results import choose_results
from zoobench.report.table_forms import long_listing, table_listing
from zoobench.report.tables import score_tables
from zoobench.spec import RunSelection

REFERENCES = {"idle_score": -0.1, "random_score": 0.2}


def test_a_share_lies_between_floor_and_best() -> None:
    """The best is 1, halfway is a half, and nothing falls below 0; negative scores are no exception."""
    assert shares([1.2, 0.7, 0.1, None], 0.2) == [1.0, pytest.approx(0.5), 0.0, None]
    assert shares([-0.01, -0.03], -0.04) == [1.0, pytest.approx(1 / 3)]


def test_where_no_method_exceeds_the_floor_all_are_zero() -> None:
    """Being best among the useless is worth nothing."""
    assert shares([0.1, 0.2], 0.2) == [0.0, 0.0]


def test_without_references_or_scores_there_is_no_share() -> None:
    """Nothing is made up."""
    assert shares([1.0, 2.0], None) == [None, None]
    assert shares([None], 0.2) == [None]


def test_the_floor_is_the_better_reference(tmp_path: Path) -> None:
    """Over the runs that have both; one reference alone is not enough."""
    with Store(tmp_path / "runs.db") as store:
        add_done(store, make_spec(seed=0), 1.2, references=REFERENCES)
        add_done(store, make_spec(seed=1), 1.2, references={"idle_score": 5.0})
        found = choose_results(store, RunSelection())
    both, one = (outcome.floor for cell in cells_of(found) for outcome in cell.outcomes)
    assert floor_of([both, one]) == both == 0.2
    assert floor_of([one]) is None


def test_a_table_shows_them_beside_the_scores(tmp_path: Path) -> None:
    """Only where asked for in the table for reading, always in the long form."""
    with Store(tmp_path / "runs.db") as store:
        add_done(store, make_spec(), 1.2, references=REFERENCES)
        add_done(store, make_spec(method="random-v1"), 0.7, references=REFERENCES)
        tables = score_tables(choose_results(store, RunSelection()))
    assert table_listing(tables[0]).reading()[0][-2:] == ["1.2", "0.7"]
    assert table_listing(tables[0], normalised=True).reading()[0][-2:] == [
        "1.2 (normalised 1.00)", "0.7 (normalised 0.50)"
    ]  # fmt: skip
    assert [record["normalised"] for record in long_listing(tables).records()] == [1.0, pytest.approx(0.5)]
