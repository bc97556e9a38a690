"""Learning curves and tables at an equal amount spent, from databases whose content is known."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.report.content import add_curve, add_done, add_ended, claim_new, made_once, make_spec
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.report.learning_curves import curves, curves_overview, points_listing, spending_tables
from zoobench.report.listing import cell_text
from zoobench.report.run_results import RunResult, choose_results
from zoobench.report.table_forms import long_listing, table_listing
from zoobench.report.tables import Table, score_tables
from zoobench.spec import BudgetKind, RunSelection


def results_of(path: Path) -> list[RunResult]:
    """All results of a database."""
    with Store(path, create=False) as store:
        return choose_results(store, RunSelection())


def tables_at(path: Path, kind: BudgetKind, amount: float | None = None) -> list[Table]:
    """All tables of a database at an equal amount spent."""
    with Store(path, create=False) as store:
        results = choose_results(store, RunSelection())
        return spending_tables(results, curves(store, results, kind), kind, amount)


def cell_texts(table: Table) -> dict[str, str]:
    """The cells of a table by method."""
    return {
        entry.method.name: cell_text(cell.estimate())
        for row in table.rows
        for entry, cell in zip(table.entries, row.cells, strict=True)
        if cell is not None
    }


@made_once
def _learnt(store: Store) -> None:
    for seed in range(2):
        rise = [None, 0.2 + seed, 0.4 + seed, 0.8 + seed]
        add_curve(store, make_spec(seed=seed), rise, cost=200.0)
        slow = [0.1, 0.1, 0.3, 0.3, 0.3, 0.9]
        add_curve(store, make_spec(method="random-v1", seed=seed, budget="2000 substeps"), slow, cost=300.0)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Diffphysics with a budget of 1000 substeps, of which 4 iterations take 800; random with 300 of 2000 a time."""
    return _learnt(tmp_path / "runs.db")


def test_a_curve_says_what_had_been_found_at_every_amount(path: Path) -> None:
    """It holds from one iteration to the next, has no score before the first, and reaches to the run's own budget."""
    with Store(path) as store:
        results = choose_results(store, RunSelection())
        curve = curves(store, results, "substeps")[1]
        assert [curve.at(amount) for amount in (0, 199, 200, 399, 400, 599, 600, 1e9)] == [
            None, None, None, None, 0.2, 0.2, 0.4, 0.8
        ]  # fmt: skip
        assert curve.spent == (200.0, 400.0, 600.0, 800.0)
        assert curve.reach == 1000.0
        assert curves(store, results, "seconds")[1].reach == 2.0


@pytest.mark.parametrize(("cost", "score"), [(250.25, 0.4), (300.0, 0.3)])
def test_a_run_has_its_final_score_at_its_budget(tmp_path: Path, cost: float, score: float) -> None:
    """Where its last iteration has spent one substep more of 1000, and not where it has spent 200 more."""
    with Store(tmp_path / "runs.db") as store:
        add_curve(store, make_spec(), [0.1, 0.2, 0.3, 0.4], cost=cost)
        (curve,) = curves(store, choose_results(store, RunSelection()), "substeps").values()
    assert curve.at(999.0) == 0.3
    assert curve.at(1000.0) == score
    assert curve.at(2000.0) == 0.4


def test_runs_of_different_budgets_stand_in_one_table_that_says_so(path: Path) -> None:
    """In the ordinary tables they are apart; at 1000 substeps random has made three iterations."""
    assert len(score_tables(results_of(path))) == 2
    (table,) = tables_at(path, "substeps")
    assert table.title == (
        "fidelity draft, best so far at equal substeps, of runs with a budget of 1000 substeps and 2000 substeps, "
        "10 frames, 2 seeds"
    )
    assert table.rows[0].amount == 1000.0
    assert [cell.interval.mean for cell in table.rows[0].cells if cell and cell.interval] == pytest.approx([1.3, 0.3])
    assert table_listing(table).columns == ("env", "task", "design", "at [substeps]", "diffphysics", "random")
    assert table_listing(table).reading()[0][3] == "1000"


def test_a_run_that_its_method_ended_reaches_no_further_than_it_went(tmp_path: Path) -> None:
    """Two iterations were all that was asked for: of what more would have found, nothing is known."""
    path = tmp_path / "runs.db"
    with Store(path) as store:
        for name, is_spent in (("random-v1", 1.0), ("diffphysics-v2[iterations=2]", 0.0)):
            claim = claim_new(store, make_spec(method=name))
            points = {("substeps", step): 300.0 * step for step in (1, 2)}
            finals = (FinalRow("score", 0.5, "m/s"), FinalRow("budget_spent", is_spent))
            scored = Batch(metrics=points | {("score", step): 0.5 for step in (1, 2)})
            store.finish(claim, Ending(RunState.DONE, finals=finals), scored)
        found = curves(store, choose_results(store, RunSelection()), "substeps")
        reached = {curve.result.spec.method.name: curve.reach for curve in found.values()}
    assert reached == {"random": 1000.0, "diffphysics": 600.0}
    (table,) = tables_at(path, "substeps")
    assert table.rows[0].amount == 600.0


def test_at_their_own_budget_a_table_is_the_ordinary_one(path: Path) -> None:
    """What could not be spent, since it held no further iteration, is no reason to drop a run."""
    with Store(path) as store:
        results = choose_results(store, RunSelection(method="diffphysics"))
        (table,) = spending_tables(results, curves(store, results, "substeps"), "substeps", 1000.0)
    (ordinary,) = score_tables(results)
    (cell,), (own,) = table.rows[0].cells, ordinary.rows[0].cells
    assert own is not None
    assert cell == replace(own, spent=None), "the row says what was spent"


@pytest.mark.parametrize(("kind", "amount"), [("episodes", 32.0), ("seconds", 2.0)])
def test_the_largest_amount_that_all_have_reached_is_the_default(path: Path, kind: BudgetKind, amount: float) -> None:
    """Four iterations of either, whatever an iteration of each costs in substeps."""
    (table,) = tables_at(path, kind)
    assert table.rows[0].amount == amount
    assert cell_texts(table)["random"] == "0.3 (n=2, all equal)"


def test_a_run_that_never_reached_the_amount_is_missing_and_said_to_be(path: Path) -> None:
    """At 1500 substeps only random is there, and nobody wins against nobody."""
    (table,) = tables_at(path, "substeps", 1500.0)
    assert cell_texts(table) == {
        "diffphysics": "no score (n=0 of 2, spent less 2/2)",
        "random": "0.3 (n=2, all equal)",
    }
    assert "at 1500 substeps" in table.title
    assert "at [substeps]" not in table_listing(table).columns
    assert not any(cell.is_winner for cell in table.rows[0].cells if cell)


def test_before_its_first_score_a_run_has_none(path: Path) -> None:
    """At 350 substeps diffphysics has made an iteration and met nothing that did not diverge."""
    assert cell_texts(tables_at(path, "substeps", 350.0)[0]) == {
        "diffphysics": "no score (n=0 of 2, no score yet 2/2)",
        "random": "0.1 (n=2, all equal)",
    }


def test_unfinished_runs_and_those_without_curves_are_told_apart(tmp_path: Path) -> None:
    """A run in progress has no result; one by an earlier zoobench has a result and no curve."""
    with Store(tmp_path / "runs.db") as store:
        add_curve(store, make_spec(seed=0), [0.5])
        add_ended(store, make_spec(seed=1), Ending(RunState.DIVERGED, "det F is -1."))
        add_done(store, make_spec(seed=2), 9.0)
    (table,) = tables_at(tmp_path / "runs.db", "episodes")
    assert cell_texts(table)["diffphysics"] == "0.5 (n=1 of 3, diverged 1/3, kept no curve 1/3)"


def test_of_runs_that_differ_by_the_budget_the_longest_counts(tmp_path: Path) -> None:
    """Its curve goes through the end of the shorter one, so that counting both would count one seed twice."""
    with Store(tmp_path / "runs.db") as store:
        add_curve(store, make_spec(budget="2 iterations"), [0.1, 0.2])
        add_curve(store, make_spec(budget="5 iterations"), [0.1, 0.2, 0.3, 0.4, 0.5])
        add_curve(store, make_spec(budget="3 iterations"), [0.1, 0.2, 0.3])
    (table,) = tables_at(tmp_path / "runs.db", "substeps")
    assert cell_texts(table)["diffphysics"] == "0.5 (n=1)"
    assert table.rows[0].amount == 500.0
    assert cell_texts(tables_at(tmp_path / "runs.db", "substeps", 250.0)[0])["diffphysics"] == "0.2 (n=1)"


def test_fidelities_are_never_mixed_and_smoke_is_never_shown(tmp_path: Path) -> None:
    """A table for each fidelity but smoke."""
    with Store(tmp_path / "runs.db") as store:
        for fidelity in ("draft-v1", "paper-v1", "smoke-v1"):
            add_curve(store, make_spec(fidelity=fidelity), [0.5])
    assert [table.fidelity.name for table in tables_at(tmp_path / "runs.db", "episodes")] == ["draft", "paper"]


def test_the_long_form_says_what_was_spent_and_not_the_budgets(path: Path) -> None:
    """So that its rows are not taken for those of an ordinary table."""
    records = long_listing(tables_at(path, "substeps")).records()
    assert {(record["spent_kind"], record["spent_amount"]) for record in records} == {("substeps", 1000.0)}
    assert "budget_amount" not in records[0]


def test_every_point_is_listed_for_programs(path: Path) -> None:
    """A row per iteration with all currencies; nothing where there was no score yet."""
    with Store(path) as store:
        records = points_listing(store, choose_results(store, RunSelection())).records()
    assert len(records) == 2 * (4 + 6)
    assert [record["score"] for record in records if record["run"] == 1] == [None, 0.2, 0.4, 0.8]
    last = records[3]
    assert (last["iteration"], last["substeps"], last["episodes"], last["seconds"]) == (4, 800.0, 32.0, 2.0)
    assert last["forward_substeps"] == pytest.approx(800 / 3)
    assert last["method"] == "diffphysics-v2[lr=0.1]"


def test_the_overview_gives_means_at_shares_of_what_all_have_spent(path: Path) -> None:
    """An eighth of 1000 substeps is before anybody's first score; a half is diffphysics' second iteration."""
    with Store(path) as store:
        results = choose_results(store, RunSelection())
        overview = curves_overview(results, curves(store, results, "substeps"), "substeps").records()
    assert [record["method"] for record in overview] == ["diffphysics", "random"]
    assert [record["at 0.125"] for record in overview] == [None, None]
    assert [record["at 0.5"] for record in overview] == pytest.approx([0.7, 0.1])
    assert [record["at all of it"] for record in overview] == pytest.approx([1.3, 0.3])
    assert {record["spent [substeps]"] for record in overview} == {"1000"}


def test_a_run_that_is_done_again_has_its_new_curve_alone(tmp_path: Path) -> None:
    """Points of the former one that were not replaced are no part of it."""
    with Store(tmp_path / "runs.db") as store:
        run = add_curve(store, make_spec(), [0.1, 0.2, 0.9])
        store.retry([run], states=[RunState.DONE])
        claim = store.claim(Owner.current(), provenance={}, ids=[run])
        assert claim is not None
        batch = Batch(metrics={("substeps", 1): 100.0, ("score", 1): 0.1})
        store.finish(claim, Ending(RunState.DONE), batch)
        curve = curves(store, choose_results(store, RunSelection()), "substeps")[run]
    assert (curve.spent, curve.scores) == ((100.0,), (0.1,))
