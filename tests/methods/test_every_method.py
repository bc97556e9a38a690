"""What every method owes: its budget, its reproducibility, its going on after an interruption."""

import math

import numpy as np
import pytest

from tests.methods.toy import Context, Quadratic
from zoobench import registry
from zoobench.errors import BudgetExhaustedError, DivergenceError
from zoobench.methods.base import Solution
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref

# one that trains a policy decides on frames, of which the toy has none: it is tested in test_ppo.py
METHODS = [name for name in registry.names(Kind.METHOD) if "policy" not in registry.get(Kind.METHOD, name).tags]


def _run(name: str, problem: Quadratic, context: Context) -> Solution:
    solution: Solution = registry.create(Kind.METHOD, Ref(name)).run(problem, context)
    return solution


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("kind", ["substeps", "episodes", "iterations"])
def test_the_budget_is_honoured(name: str, kind: str) -> None:
    """Never more than allowed, and no room left for another iteration."""
    amount = {"substeps": 2000, "episodes": 100, "iterations": 7}[kind]
    problem, context = Quadratic(Budget(kind, amount)), Context()
    _run(name, problem, context)
    batch = 8
    assert problem.meter.spent(kind) <= amount
    assert not problem.affords(batch, gradient=problem.meter.backward > 0)
    assert context.fractions == sorted(context.fractions)


@pytest.mark.parametrize("name", METHODS)
def test_two_runs_agree_bit_for_bit(name: str) -> None:
    """Same seed, same curve and same solution; another seed, another."""
    runs = []
    for seed in (5, 5, 6):
        context = Context(seed)
        runs.append((_run(name, Quadratic(Budget("iterations", 6)), context), context.curve))
    np.testing.assert_array_equal(runs[0][0].params, runs[1][0].params)
    assert runs[0][1] == runs[1][1]
    assert runs[0][1] != runs[2][1]


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("stop", [1, 3])
def test_an_interrupted_run_goes_on_bit_for_bit(name: str, stop: int) -> None:
    """Stopped and restored in a new process's place: the same evaluations, curve and solution as in one piece."""

    def breaks(params: np.ndarray) -> bool:
        return bool(params[0] > 1.0)  # some restarts retreat, so the generator's state matters

    whole_problem, whole = Quadratic(Budget("substeps", 3000), breaks=breaks), Context(2)
    expected = _run(name, whole_problem, whole)
    first, second = Context(2, stop_after=stop), Context(99)
    _run(name, Quadratic(Budget("substeps", 3000), breaks=breaks), first)
    second.stored = first.stored
    problem = Quadratic(Budget("substeps", 3000), breaks=breaks)
    result = _run(name, problem, second)
    np.testing.assert_array_equal(result.params, expected.params)
    assert result.evaluation.score == expected.evaluation.score
    assert result.evaluation.metrics == expected.evaluation.metrics
    assert result.facts == expected.facts
    assert first.curve + second.curve == whole.curve
    assert problem.meter.substeps == whole_problem.meter.substeps


@pytest.mark.parametrize("name", METHODS)
def test_a_run_restored_at_its_end_evaluates_nothing_more(name: str) -> None:
    """A run killed between its last checkpoint and its end gives the same result at once."""
    context = Context()
    expected = _run(name, Quadratic(Budget("iterations", 4)), context)
    problem = Quadratic(Budget("iterations", 4))
    result = _run(name, problem, Context(stored=context.stored))
    assert not problem.seen
    np.testing.assert_array_equal(result.params, expected.params)


@pytest.mark.parametrize("name", METHODS)
def test_a_run_in_which_everything_diverged_says_so(name: str) -> None:
    """It is DIVERGED, not a score of minus infinity."""
    context = Context()
    with pytest.raises(DivergenceError, match="det F"):
        _run(name, Quadratic(Budget("iterations", 3), diverges=lambda params: True), context)
    values = [value for _, metrics in context.curve for value in metrics.values()]
    assert values
    assert all(math.isfinite(value) for value in values)


@pytest.mark.parametrize("name", METHODS)
def test_a_diverged_episode_cannot_win(name: str) -> None:
    """Half of the space diverges: the solution lies in the other half and the rest is counted."""
    problem = Quadratic(Budget("iterations", 20), diverges=lambda params: bool(params[1] > 0.0))
    solution = _run(name, problem, Context(1))
    assert solution.params[1] <= 0.0
    assert solution.evaluation.failure is None
    assert solution.facts["diverged_evaluations"] == sum(params[1] > 0.0 for params in problem.seen) > 0


@pytest.mark.parametrize("name", METHODS)
def test_a_budget_too_small_for_anything_is_an_error(name: str) -> None:
    """Nothing is simulated and the problem explains the budget."""
    with pytest.raises(BudgetExhaustedError):
        _run(name, Quadratic(Budget("substeps", 5)), Context())
