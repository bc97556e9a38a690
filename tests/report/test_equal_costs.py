"""Winners of rows whose methods have not spent the same."""

from functools import partial
from pathlib import Path

import pytest

from tests.report.content import add_curve, add_done, add_ended, claim_new, make_spec
from zoobench.db.rows import Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.report.curve import Curve, read_curves
from zoobench.report.equal_costs import mark_early_winners
from zoobench.report.leaderboard import Leaderboard, gather
from zoobench.report.leaderboard_export import from_text, to_text
from zoobench.report.leaderboard_pages import tables_of
from zoobench.report.run_results import choose_results
from zoobench.report.tables import Table, score_tables
from zoobench.spec import RunSelection, RunSpec

SEEDS = range(3)


def _rival(seed: int, budget: str) -> RunSpec:
    return make_spec(method="random-v1", seed=seed, budget=budget)


def _fill(path: Path, early: float, budget: str = "1000 substeps", costs: tuple[float, float] = (100.0, 80.0)) -> None:
    """Diffphysics, which spends more, with this score after 8 of 10 iterations and 1.0 then; random with 0.5."""
    with Store(path) as store:
        for seed in SEEDS:
            rise = [0.01 * seed] * 7 + [early + 0.001 * seed] * 2 + [1.0 + 0.001 * seed]
            add_curve(store, make_spec(seed=seed, budget=budget), list(rise), cost=costs[0])
            add_curve(store, _rival(seed, budget), [0.5 + 0.001 * seed] * 10, cost=costs[1])


def _winners(tables: list[Table]) -> list[str]:
    (table,) = tables
    pairs = zip(table.entries, table.rows[0].cells, strict=True)
    return [entry.method.name for entry, cell in pairs if cell is not None and cell.is_winner]


def _marked(path: Path) -> list[str]:
    with Store(path, create=False) as store:
        found = score_tables(choose_results(store, RunSelection()))
        assert _winners(found) == [], "what was spent is not alike"
        return _winners(mark_early_winners(found, partial(read_curves, store)))


@pytest.mark.parametrize(("early", "winners"), [(0.9, ["diffphysics"]), (0.503, []), (0.4, [])])
def test_who_led_when_no_more_was_spent_wins(tmp_path: Path, early: float, winners: list[str]) -> None:
    """Beyond the interval of the other's end; within it, or behind then and ahead at its own end, is not enough."""
    _fill(tmp_path / "runs.db", early)
    assert _marked(tmp_path / "runs.db") == winners


def test_a_leader_that_has_spent_less_wins(tmp_path: Path) -> None:
    """Its whole curve counts."""
    _fill(tmp_path / "runs.db", 0.4, costs=(80.0, 100.0))
    assert _marked(tmp_path / "runs.db") == ["diffphysics"]


def test_without_its_curves_a_leader_wins_nothing(tmp_path: Path) -> None:
    """One of the three seeds was stored by an earlier version, which kept none."""
    _fill(tmp_path / "runs.db", 0.9)
    with Store(tmp_path / "runs.db", create=False) as store:
        found = score_tables(choose_results(store, RunSelection()))
        known = read_curves(store, [1, 3, 5], "substeps")
        assert _winners(mark_early_winners(found, lambda runs, kind: known)) == ["diffphysics"]
        del known[3]
        assert _winners(mark_early_winners(found, lambda runs, kind: known)) == []


def test_nobody_wins_against_one_that_does_not_say_what_it_has_spent(tmp_path: Path) -> None:
    """It may have led with less."""
    _fill(tmp_path / "runs.db", 0.9)
    with Store(tmp_path / "runs.db", create=False) as store:
        for seed in SEEDS:
            silent = Ending(RunState.DONE, finals=(FinalRow("score", 0.7 + 0.001 * seed, "m/s"),))
            add_ended(store, make_spec(method="cmaes-v1", seed=seed), silent)
    assert _marked(tmp_path / "runs.db") == []


def test_nobody_wins_before_all_is_done(tmp_path: Path) -> None:
    """A rival's run is still in progress."""
    _fill(tmp_path / "runs.db", 0.9)
    with Store(tmp_path / "runs.db", create=False) as store:
        claim_new(store, make_spec(method="cmaes-v1"))
    assert _marked(tmp_path / "runs.db") == []


def test_a_budget_of_episodes_compares_episodes(tmp_path: Path) -> None:
    """Both have spent 80, whatever these were made of."""
    _fill(tmp_path / "runs.db", 0.4, "100 episodes")
    with Store(tmp_path / "runs.db", create=False) as store:
        assert _winners(score_tables(choose_results(store, RunSelection()))) == ["diffphysics"]


def _board(path: Path) -> Leaderboard:
    asked = [(spec, None) for seed in SEEDS for spec in (make_spec(seed=seed), _rival(seed, "1000 substeps"))]
    with Store(path) as store:
        return gather(store, "mine", "mine.yaml", "a test of winners", asked)


def test_a_leaderboard_says_the_same_from_its_export(tmp_path: Path) -> None:
    """The curves go with it, by the points at which they rise."""
    _fill(tmp_path / "runs.db", 0.9)
    board = _board(tmp_path / "runs.db")
    assert board.rows[0].curve == Curve((100.0, 800.0, 1000.0), (0.0, 0.9, 1.0))
    again = from_text(to_text(board), "mine.json")
    assert [row.curve for row in again.rows] == [row.curve for row in board.rows]
    assert _winners(tables_of(again)) == ["diffphysics"]


def test_curves_of_an_earlier_export_are_kept(tmp_path: Path) -> None:
    """A database that had the runs from elsewhere, without curves, takes none away."""
    _fill(tmp_path / "runs.db", 0.9)
    with Store(tmp_path / "bare.db") as store:
        for seed in SEEDS:
            add_done(store, make_spec(seed=seed), 1.0)
    board = _board(tmp_path / "bare.db").completed(_board(tmp_path / "runs.db"))
    assert [row.curve is None for row in board.rows] == [False] * len(board.rows)


@pytest.mark.parametrize(
    "curve", ['{"scores":[1.0],"spent":[1.0,2.0]}', '{"scores":[1.0,2.0],"spent":[2.0,1.0]}', "[]"]
)
def test_a_curve_that_is_none_is_refused(tmp_path: Path, curve: str) -> None:
    """Amounts without scores, or that fall: a damaged export."""
    _fill(tmp_path / "runs.db", 0.9)
    text = to_text(_board(tmp_path / "runs.db"))
    first = text[text.index('{"scores":') : text.index("}", text.index('{"scores":')) + 1]
    with pytest.raises(UsageError, match="no export of a leaderboard"):
        from_text(text.replace(first, curve, 1), "mine.json")
