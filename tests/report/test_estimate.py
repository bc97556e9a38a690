"""Estimates of how long runs take."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.report.content import add_done, add_ended, make_spec
from zoobench.db.many_rows import PastRun, PastTotal
from zoobench.db.rows import Ending, RunState
from zoobench.db.store import Store
from zoobench.report.estimate import Basis, Estimator, basis_text, total_seconds
from zoobench.spec import RunSpec


@dataclass(frozen=True)
class Measured:
    """A simulated second takes 1000 substeps and 2 s, with its gradient 8 s."""

    substeps: float | None = 1000.0
    seconds: float | None = 2.0
    gradient_seconds: float | None = 8.0


def seconds_of(spec: RunSpec, known: list[PastRun]) -> float | None:
    """The estimate from finished runs alone."""
    found = Estimator(known)(spec)
    return found and found.seconds


def past(spec: RunSpec, seconds: float, substeps: float = 1000.0) -> PastRun:
    """A finished run that took so long for so many substeps."""
    return PastRun(spec, seconds, substeps, 0.0)


def test_runs_of_the_same_cell_come_first() -> None:
    """The median time of the other seeds, whatever the kind of budget."""
    spec = make_spec(budget="5 iterations")
    others = [past(make_spec(budget="5 iterations", seed=seed), 10.0 * seed) for seed in (1, 2, 9)]
    assert seconds_of(spec, others) == 20.0


def test_a_budget_in_substeps_goes_by_the_pace_of_the_same_place() -> None:
    """2000 substeps at 10 ms each, as the same method took them with another budget; other methods do not count."""
    known = [past(make_spec(budget="500 substeps"), 10.0), past(make_spec(method="random-v1"), 1.0)]
    assert seconds_of(make_spec(budget="2000 substeps"), known) == pytest.approx(20.0)


def test_another_method_is_better_than_nothing() -> None:
    """Without a run of the same method the others give the pace."""
    assert seconds_of(make_spec(), [past(make_spec(method="random-v1"), 3.0)]) == pytest.approx(3.0)


@pytest.mark.parametrize("other", [{"env": "ice-v1"}, {"fidelity": "paper-v1"}, {"design": "fish-v1"}])
def test_another_place_tells_nothing(other: dict[str, str]) -> None:
    """The pace depends on environment, design and fidelity."""
    assert seconds_of(make_spec(), [past(make_spec(**other), 3.0)]) is None


def test_runs_that_failed_or_lie_elsewhere_are_no_measure(tmp_path: Path) -> None:
    """A run that broke off early would make everything look fast; of those that are done, the places asked for."""
    with Store(tmp_path / "runs.db") as store:
        add_done(store, make_spec(seed=1), 1.0)
        add_ended(store, make_spec(seed=2), Ending(RunState.FAILED, "boom"))
        add_done(store, make_spec(env="ice-v1"), 1.0)
        (found,) = store.past([make_spec()])
        totals = {total.env.name: total for total in store.totals()}
    assert (found.spec, found.forward, found.backward) == (make_spec(), 600.0, 400.0)
    assert found.seconds > 0.0
    assert set(totals) == {"desert", "ice"}
    assert totals["desert"] == PastTotal(make_spec().env, make_spec().fidelity, found.seconds, 600.0, 400.0)


def test_a_budget_in_seconds_is_its_own_estimate() -> None:
    """Nothing needs to be known."""
    assert seconds_of(make_spec(budget="60 seconds"), []) == 60.0


def test_the_total_shares_the_runs_among_the_workers() -> None:
    """Two workers do 4, 3 and 2 seconds of work in 5; one unknown makes the total unknown."""
    assert total_seconds([4.0, 3.0, 2.0], 2) == 5.0
    assert total_seconds([4.0, None], 2) is None
    assert total_seconds([], 2) == 0.0


# An episode of 10 frames is 0.08 s, of which each costs 0.16 s, and 0.64 s with its gradient.
@pytest.mark.parametrize(
    ("method", "budget", "seconds"),
    [
        ("diffphysics-v2[restarts=8]", "5 iterations", 5 * 8 * 0.64),
        ("diffphysics-v2[restarts=8,iterations=3]", "5 iterations", 3 * 8 * 0.64),
        ("diffphysics-v2[restarts=8]", "1600 substeps", 10 * 0.64),
        ("random-v1[batch=4]", "5 iterations", 20 * 0.16),
        ("random-v1[batch=4]", "800 substeps", 10 * 0.16),
        ("cmaes-v1[population=10]", "2 iterations", 20 * 0.16),
        ("neat-v2[generations=2,population=10]", "3 iterations", 20 * 0.16),
        ("evolution-v2[generations=2,population=10]", "100000 substeps", 20 * 0.16),
        ("quality-diversity-v2[population=10]", "2 iterations", 20 * 0.16),
        ("ppo-v2[timesteps=100,buffer=64,batch=32]", "9 iterations", 2 * 0.016 * (64 + 10)),
        ("random-v1[batch=4]", "7 episodes", None),
        ("probe-v2", "2 iterations", 2 * 0.16),
    ],
)
def test_a_first_run_is_estimated_from_the_work_of_its_method(method: str, budget: str, seconds: float | None) -> None:
    """By its settings or its budget, whichever ends it; without finished runs the measured rate is all there is."""
    found = Estimator([], lambda _env, _fidelity: Measured())(make_spec(method=method, budget=budget))
    assert found is None if seconds is None else found is not None and found.basis is Basis.RATE
    assert (found and found.seconds) == (seconds and pytest.approx(seconds))


def test_finished_runs_elsewhere_correct_the_measured_rate() -> None:
    """A run of 1000 forward substeps is expected to take 2 s; it took 6, so that others take three times as long."""
    elsewhere = PastTotal(make_spec(env="ice-v1").env, make_spec().fidelity, 6.0, 1000.0, 0.0)
    estimator = Estimator([], lambda _env, _fidelity: Measured(), lambda: [elsewhere])
    assert estimator.pace == pytest.approx(3.0)
    found = estimator(make_spec(method="random-v1[batch=4]", budget="5 iterations"))
    assert found is not None
    assert found.seconds == pytest.approx(3 * 20 * 0.16)
    assert basis_text(estimator, [found, None], "an Example 9000") == (
        "1 by measured rates (an Example 9000; times 3, as finished runs took here), 1 unknown"
    )


def test_what_was_not_measured_is_not_made_up() -> None:
    """No rate of the place, or none with a gradient."""
    spec = make_spec(method="diffphysics-v2", budget="5 iterations")
    assert Estimator([])(spec) is None
    assert Estimator([], lambda _env, _fidelity: Measured(gradient_seconds=None))(spec) is None
