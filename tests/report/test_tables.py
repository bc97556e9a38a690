"""Tables of scores, from databases whose content is known."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest

from tests.report.content import add_done, add_ended, fill, make_spec
from zoobench.db.owner import Owner
from zoobench.db.query import Reader
from zoobench.db.rows import Batch, Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.report.cells import read_cells
from zoobench.report.footer import footer
from zoobench.report.listing import cell_text
from zoobench.report.run_results import choose_results, origins
from zoobench.report.table_forms import long_listing, pivot_listing, table_listing
from zoobench.report.tables import Table, score_tables, tables_of_cells
from zoobench.spec import Ref, RunSelection


def tables_of(path: Path) -> list[Table]:
    """All tables of a database."""
    with Store(path, create=False) as store:
        return score_tables(choose_results(store, RunSelection()))


def cell_texts(table: Table) -> dict[tuple[str, str], str]:
    """The cells of a table by environment and method."""
    return {
        (row.env.name, entry.method.name): cell_text(cell.estimate())
        for row in table.rows
        for entry, cell in zip(table.entries, row.cells, strict=True)
        if cell is not None
    }


@pytest.fixture
def filled(tmp_path: Path) -> Path:
    """The database of `tests.report.content.fill`."""
    return fill(tmp_path / "runs.db")


def test_a_cell_is_mean_interval_unit_and_count(filled: Path) -> None:
    """Three seeds at 1.000, 1.001, 1.002: mean 1.001, half width 4.303 * 0.001 / sqrt(3)."""
    (table,) = tables_of(filled)
    assert cell_texts(table)["desert", "diffphysics"] == "1.0010 ± 0.0025 (n=3)"


def test_missing_seeds_and_unsuccessful_runs_are_shown_as_shares(filled: Path) -> None:
    """A cell with fewer seeds than asked for says so, and what became of the others."""
    cells = cell_texts(tables_of(filled)[0])
    assert cells["ice", "diffphysics"] == "0.5 (n=2 of 3, all equal, diverged 1/3)"
    assert cells["ice", "random"] == "no score (n=0 of 3, failed 1/3, queued 1/3, running 1/3)"


def test_a_method_with_fewer_seeds_than_its_rival_is_marked(tmp_path: Path) -> None:
    """The seeds asked for are counted over the row, so a shorter column cannot hide."""
    with Store(tmp_path / "runs.db") as store:
        for seed in range(3):
            add_done(store, make_spec(seed=seed), 1.0)
        add_done(store, make_spec(method="random-v1"), 0.5)
    (table,) = tables_of(tmp_path / "runs.db")
    assert cell_texts(table)["desert", "random"] == "0.5 (n=1 of 3)"


def test_smoke_runs_are_never_shown(filled: Path) -> None:
    """The smoke run's score of 77 is in no table."""
    tables = tables_of(filled)
    assert [table.fidelity.name for table in tables] == ["draft"]
    assert 77.0 not in {record["mean"] for record in long_listing(tables).records()}


@pytest.mark.parametrize("other", [{"fidelity": "paper-v1"}, {"budget": "2000 substeps"}])
def test_fidelities_and_budgets_are_never_mixed(tmp_path: Path, other: dict[str, str]) -> None:
    """The same cell at another fidelity or budget goes into a table of its own."""
    with Store(tmp_path / "runs.db") as store:
        add_done(store, make_spec(), 1.0)
        add_done(store, make_spec(**other), 3.0)
    tables = tables_of(tmp_path / "runs.db")
    means = {cell.interval.mean for table in tables for cell in table.rows[0].cells if cell and cell.interval}
    assert len(tables) == 2
    assert means == {1.0, 3.0}


def test_versions_of_a_component_are_never_mixed(tmp_path: Path) -> None:
    """A new version of the environment is another row, with the version in its name."""
    with Store(tmp_path / "runs.db") as store:
        add_done(store, make_spec(), 1.0)
        add_done(store, make_spec(env="desert-v2"), 3.0)
    (table,) = tables_of(tmp_path / "runs.db")
    assert [row[0] for row in table_listing(table).rows] == ["desert-v1", "desert-v2"]


def test_the_winner_is_bold_only_where_the_interval_supports_it(filled: Path) -> None:
    """Diffphysics wins on the desert; on ice it has no rival with a score and a diverged seed."""
    (table,) = tables_of(filled)
    assert [[cell.is_winner for cell in row.cells if cell] for row in table.rows] == [[True, False], [False, False]]
    assert table_listing(table).bold == frozenset({(0, 3)})


def test_a_method_that_diverges_on_some_seeds_does_not_win(tmp_path: Path) -> None:
    """Dropping the seeds that failed would flatter the survivors."""
    with Store(tmp_path / "runs.db") as store:
        for seed in range(3):
            add_done(store, make_spec(seed=seed), 10.0 + 0.01 * seed)
            add_done(store, make_spec(method="random-v1", seed=seed), 0.1)
        add_ended(store, make_spec(seed=3), Ending(RunState.DIVERGED, "blew up"))
    (table,) = tables_of(tmp_path / "runs.db")
    assert not any(cell.is_winner for cell in table.rows[0].cells if cell)


def test_a_done_run_without_a_finite_score_is_not_averaged(tmp_path: Path) -> None:
    """It is counted apart, and the mean is that of the others."""
    with Store(tmp_path / "runs.db") as store:
        add_done(store, make_spec(), 2.0)
        finals = (FinalRow("score", float("nan"), "m/s"),)
        add_ended(store, make_spec(seed=1), Ending(RunState.DONE, finals=finals))
    (table,) = tables_of(tmp_path / "runs.db")
    text = cell_texts(table)["desert", "diffphysics"]
    assert text == "2 (n=1 of 2, done without a finite score 1/2)"


def test_controllers_stand_side_by_side(tmp_path: Path) -> None:
    """A method has a column for each controller, which the heading names where there are several; one of them wins."""
    with Store(tmp_path / "runs.db") as store:
        for seed in range(3):
            add_done(store, make_spec(seed=seed), 1.0 + 0.001 * seed)
        (table,) = score_tables(choose_results(store, RunSelection()))
        assert table_listing(table.parts()[0]).columns[3:] == ("diffphysics [m/s]",)
        for seed in range(3):
            add_done(store, make_spec(controller="trajectory-v1", seed=seed), 2.0 + 0.001 * seed)
        (table,) = score_tables(choose_results(store, RunSelection()))
    listing = table_listing(table.parts()[0])
    assert listing.columns[3:] == ("diffphysics (sine-basis) [m/s]", "diffphysics (trajectory) [m/s]")
    assert listing.bold == {(0, 4)}


def test_errors_are_positive_and_stand_apart(tmp_path: Path) -> None:
    """Of a path less is better, which the title says, and the winner is the least; programs get the score."""
    task = Ref("waypoint-following", 1)
    with Store(tmp_path / "runs.db") as store:
        for seed in range(3):
            add_done(store, replace(make_spec(seed=seed), task=task), -0.01 - 1e-4 * seed, unit="m")
            add_done(store, replace(make_spec(method="random-v1", seed=seed), task=task), -0.05, unit="m")
        add_done(store, make_spec(), 1.0)
        (table,) = score_tables(choose_results(store, RunSelection()))
    speed, error = (table_listing(part) for part in table.parts())
    assert speed.title.startswith("Score [m/s]: ")
    assert error.title.startswith("Error [m], less is better: ")
    assert error.columns[3:] == ("diffphysics [m]", "random [m]")
    assert error.reading()[0][3:] == ["0.01010 ± 0.00025", "0.05 (all equal)"]
    assert long_listing([table]).records()[1]["mean"] == pytest.approx(-0.0101)


def test_an_agent_from_outside_stands_beside_the_methods(tmp_path: Path) -> None:
    """In the rows of its cell, whatever their budget, marked as of unknown cost; it wins nothing and takes nothing."""
    (tmp_path / "agent.py").write_text("")
    outside = f"external[policy={tmp_path / 'agent.py'},agent=mine]"
    agent = make_spec(method=outside, controller="trajectory-v1[frames=10]", budget="2 episodes")
    with Store(tmp_path / "runs.db") as store:
        for budget, seed in product(("1000 substeps", "2000 substeps"), range(3)):
            add_done(store, make_spec(seed=seed, budget=budget), 1.0 + 0.001 * seed)
            add_done(store, make_spec(method="random-v1", seed=seed, budget=budget), 0.1 + 0.001 * seed)
        add_done(store, agent, 5.0)
        add_done(store, replace(agent, env=Ref("ice", 1)), 4.0)
        tables = score_tables(choose_results(store, RunSelection()))
    first, second, alone = (table_listing(table.parts()[0]) for table in tables)
    assert first.columns[3:] == second.columns[3:] == ("diffphysics [m/s]", "random [m/s]", "mine ¶ [m/s]")
    assert first.reading()[0][3:] == ["1.0010 ± 0.0025", "0.1010 ± 0.0025", "5 (n=1)"]
    assert first.bold == {(0, 3)}
    assert "trained elsewhere" in alone.title
    assert [row[0] for row in alone.rows] == ["ice"]
    records = [record for record in long_listing(tables).records() if record["method"].startswith("external")]
    assert [(record["env"], record["budget_amount"], record["used"]) for record in records] == [
        ("desert-v1", 2.0, None), ("ice-v1", 2.0, None)
    ]  # fmt: skip


def test_the_footer_names_everything_that_the_numbers_depend_on(filled: Path) -> None:
    """Commit with its dirty mark, components with parameters, machine, packages, date and command."""
    with Store(filled, create=False) as store:
        results = [result for result in choose_results(store, RunSelection()) if not result.is_smoke]
        text = "\n".join(footer(score_tables(results), origins(store, results), ["zoobench", "table"]).lines())
    for fact in (
        "0123456789ab with uncommitted changes",
        "diffphysics-v2[lr=0.1]",
        "Example 9000 (4 cores, 8 threads), 8 GiB",
        "Python 3.11.7, zoobench 0.1.0, taichi 1.7.4",
        "runs from: 20",
        "made by: zoobench table",
    ):
        assert fact in text


def test_the_same_database_gives_the_same_text(filled: Path) -> None:
    """A table can be rebuilt byte for byte."""
    assert long_listing(tables_of(filled)) == long_listing(tables_of(filled))


def test_what_is_wanted_and_does_not_exist_is_shown_as_missing(tmp_path: Path) -> None:
    """A cell without any run says so, one with some counts the rest, and a row without any is known to be empty."""
    with Store(tmp_path / "runs.db") as store:
        for seed in range(3):
            add_done(store, make_spec(seed=seed), 1.0 + 0.001 * seed)
        add_done(store, make_spec(method="cmaes-v1", seed=0), 0.5)
        found = choose_results(store, RunSelection())
    missing = [make_spec(method="cmaes-v1", seed=seed) for seed in (1, 2)]
    missing += [make_spec(method="random-v1", seed=seed) for seed in range(3)]
    missing += [make_spec(env="ice-v1")]
    (table,) = score_tables(found, missing)
    cells = cell_texts(table)
    assert cells["desert", "cmaes"] == "0.5 (n=1 of 3, missing 2/3)"
    assert cells["desert", "random"] == cells["ice", "diffphysics"] == "missing"
    assert [row.is_empty for row in table.rows] == [False, True]
    counts = {(row["env"], row["method"]): row["missing"] for row in long_listing([table]).records()}
    assert counts["desert-v1", "diffphysics-v2[lr=0.1]"] == 0
    assert counts["desert-v1", "cmaes-v1"] == 2
    assert counts["desert-v1", "random-v1"] == 3


def test_nobody_wins_a_row_while_a_run_is_to_come(tmp_path: Path) -> None:
    """A rival that is queued or in progress might be better; once it has ended there is a winner."""
    with Store(tmp_path / "runs.db") as store:
        for seed in range(2):
            add_done(store, make_spec(seed=seed), 10.0 + 0.01 * seed)
            add_done(store, make_spec(method="random-v1", seed=seed), 0.1 + 0.001 * seed)
        store.enqueue([make_spec(method="cmaes-v1", seed=0)])
        (queued,) = tables_of(tmp_path / "runs.db")
        claim = store.claim(Owner.current(), provenance={})
        assert claim is not None
        (running,) = tables_of(tmp_path / "runs.db")
        store.finish(claim, Ending(RunState.FAILED, "boom"), Batch())
    (ended,) = tables_of(tmp_path / "runs.db")
    winners = [[cell.is_winner for cell in table.rows[0].cells if cell] for table in (queued, running, ended)]
    assert [any(row) for row in winners] == [False, False, True]


def test_nobody_wins_a_row_that_lacks_a_run(filled: Path) -> None:
    """What is missing might be better; without it the same row has a winner."""
    with Store(filled, create=False) as store:
        found = choose_results(store, RunSelection(env="desert"))
    assert any(cell.is_winner for row in score_tables(found)[0].rows for cell in row.cells if cell)
    (table,) = score_tables(found, [make_spec(method="cmaes-v1")])
    assert not any(cell.is_winner for row in table.rows for cell in row.cells if cell)


def _finals(score: float, forward: float, episodes: float = 8.0) -> Ending:
    """The ending of a run with this score after so much was spent."""
    values = {"forward_substeps": forward, "backward_substeps": 0.0, "episodes": episodes}
    others = (FinalRow(name, value) for name, value in values.items())
    return Ending(RunState.DONE, finals=(FinalRow("score", score, "m/s"), *others))


@pytest.mark.parametrize(
    ("budget", "spent", "is_fair"),
    [
        ("5 iterations", (1000.0, 960.0), True),
        ("5 iterations", (1000.0, 900.0), False),
        ("5 iterations", (900.0, 1000.0), False),
        ("1000 substeps", (1000.0, 900.0), False),
        ("7 episodes", (1000.0, 100.0), True),
        ("7 seconds", (1000.0, 100.0), True),
    ],
)
def test_nobody_wins_where_one_has_spent_more(
    tmp_path: Path, budget: str, spent: tuple[float, float], is_fair: bool
) -> None:
    """By 5 % or more, in what the budget counts, or in substeps where it counts iterations; a column says what."""
    with Store(tmp_path / "runs.db") as store:
        for seed in range(3):
            add_ended(store, make_spec(seed=seed, budget=budget), _finals(1.0 + 0.001 * seed, spent[0]))
            rival = make_spec(method="random-v1", seed=seed, budget=budget)
            add_ended(store, rival, _finals(0.1 + 0.001 * seed, spent[1]))
    (table,) = tables_of(tmp_path / "runs.db")
    assert any(cell.is_winner for cell in table.rows[0].cells if cell) is is_fair
    listing = table_listing(table)
    assert ("spent [substeps]" in listing.columns) is not is_fair
    pivot = pivot_listing(table)
    assert ("spent [substeps]" in pivot.columns) is not is_fair
    if not is_fair:
        assert listing.rows[0][-1] == f"{spent[0]:,.0f} / {spent[1]:,.0f}"
        assert [row[-1] for row in pivot.rows] == [f"{amount:,.0f}" for amount in spent]
    used = 8.0 if "episodes" in budget else spent[0]
    assert long_listing([table]).records()[0]["used"] == used


def test_a_pivot_tells_what_was_spent_where_methods_differ_in_it(tmp_path: Path) -> None:
    """In the order of the environments; in one where they do not, nothing."""
    with Store(tmp_path / "runs.db") as store:
        for env, rival in (("desert", 900.0), ("ground", 1000.0)):
            for method, amount in (("cmaes-v1", 1000.0), ("random-v1", rival)):
                add_ended(store, make_spec(env=env, method=method), _finals(1.0, amount))
    (table,) = tables_of(tmp_path / "runs.db")
    listing = pivot_listing(table)
    assert listing.columns[-3:] == ("desert", "ground", "spent [substeps]")
    assert [row[-1] for row in listing.rows] == ["1,000 / -", "900 / -"]


def test_a_method_that_does_not_depend_on_the_seed_neither_wins_nor_loses(tmp_path: Path) -> None:
    """Three equal runs say nothing about the spread: there is no interval, on either side of a comparison."""
    for name, (best, other) in {"a.db": (0.0, 0.001), "b.db": (0.001, 0.0)}.items():
        with Store(tmp_path / name) as store:
            for seed in range(3):
                add_done(store, make_spec(seed=seed), 1.0 + best * seed)
                add_done(store, make_spec(method="random-v1", seed=seed), 0.1 + other * seed)
        (table,) = tables_of(tmp_path / name)
        assert not any(cell.is_winner for cell in table.rows[0].cells if cell)
    assert cell_texts(table)["desert", "random"] == "0.1 (n=3, all equal)"
    assert long_listing([table]).records()[1]["low"] is None


def test_the_footer_names_the_runs_above_it_alone(tmp_path: Path) -> None:
    """A run that failed, one without a score and a smoke run made no number of the table."""
    with Store(tmp_path / "runs.db") as store:
        done = add_done(store, make_spec(), 1.0)
        add_ended(store, make_spec(seed=1), Ending(RunState.FAILED, "boom"))
        add_ended(store, make_spec(seed=2), Ending(RunState.DONE))
        add_done(store, make_spec(fidelity="smoke-v1"), 77.0)
    (table,) = tables_of(tmp_path / "runs.db")
    assert table.runs == [done]


@pytest.mark.parametrize(("lost", "note"), [((4.0, 0.0), "n=2, 25% of gradients not finite"), ((0.0, 0.0), "n=2")])
def test_gradients_that_were_not_finite_stand_at_the_score(
    tmp_path: Path, lost: tuple[float, float], note: str
) -> None:
    """What a method found without half of its gradients says little of it."""
    with Store(tmp_path / "runs.db") as store:
        for seed, number in enumerate(lost):
            ending = _finals(1.0 + seed, 100.0)
            counts = (*ending.finals, FinalRow("nonfinite_gradients", number))
            add_ended(store, make_spec(seed=seed), replace(ending, finals=counts))
    (table,) = tables_of(tmp_path / "runs.db")
    (text,) = cell_texts(table).values()
    assert text.endswith(f"({note})")
    assert long_listing([table]).records()[0]["nonfinite"] == lost[0] / 16
    with Reader(tmp_path / "runs.db") as reader:
        (cell,) = tables_of_cells(read_cells(reader, RunSelection()))[0].rows[0].cells
    assert cell is not None
    assert cell_text(cell.estimate()) == text
