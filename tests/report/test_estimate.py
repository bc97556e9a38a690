"""Estimates of how long runs take."""

from dataclasses import replace

import pytest

from tests.report.content import make_spec
from zoobench.db.rows import FinalRow, RunRow, RunState
from zoobench.report.estimate import estimate_seconds, total_seconds
from zoobench.report.run_results import RunResult
from zoobench.spec import RunSpec


def past(spec: RunSpec, seconds: float, substeps: float = 1000.0) -> RunResult:
    """A finished run that took so long for so many substeps."""
    row = RunRow(
        id=1,
        key=spec.key(),
        spec=spec,
        state=RunState.DONE,
        attempt=1,
        first_attempt=1,
        seconds=seconds,
    )
    return RunResult(row, {"forward_substeps": FinalRow("forward_substeps", substeps)})


def test_runs_of_the_same_cell_come_first() -> None:
    """The median time of the other seeds, whatever the kind of budget."""
    spec = make_spec(budget="5 iterations")
    others = [past(make_spec(budget="5 iterations", seed=seed), 10.0 * seed) for seed in (1, 2, 9)]
    assert estimate_seconds(spec, others) == 20.0


def test_a_budget_in_substeps_goes_by_the_pace_of_the_same_place() -> None:
    """2000 substeps at 10 ms each, as the same method took them with another budget; other methods do not count."""
    known = [past(make_spec(budget="500 substeps"), 10.0), past(make_spec(method="random-v1"), 1.0)]
    assert estimate_seconds(make_spec(budget="2000 substeps"), known) == pytest.approx(20.0)


def test_another_method_is_better_than_nothing() -> None:
    """Without a run of the same method the others give the pace."""
    assert estimate_seconds(make_spec(), [past(make_spec(method="random-v1"), 3.0)]) == pytest.approx(3.0)


@pytest.mark.parametrize("other", [{"env": "ice-v1"}, {"fidelity": "paper-v1"}, {"design": "fish-v1"}])
def test_another_place_tells_nothing(other: dict[str, str]) -> None:
    """The pace depends on environment, design and fidelity."""
    assert estimate_seconds(make_spec(), [past(make_spec(**other), 3.0)]) is None


def test_failed_runs_are_no_measure() -> None:
    """A run that broke off early would make everything look fast."""
    done = past(make_spec(seed=1), 3.0)
    failed = replace(done, run=replace(done.run, state=RunState.FAILED))
    assert estimate_seconds(make_spec(), [failed]) is None


def test_a_budget_in_seconds_is_its_own_estimate() -> None:
    """Nothing needs to be known."""
    assert estimate_seconds(make_spec(budget="60 seconds"), []) == 60.0


def test_the_total_shares_the_runs_among_the_workers() -> None:
    """Two workers do 4, 3 and 2 seconds of work in 5; one unknown makes the total unknown."""
    assert total_seconds([4.0, 3.0, 2.0], 2) == 5.0
    assert total_seconds([4.0, None], 2) is None
    assert total_seconds([], 2) == 0.0
