"""Requirements on every method: budget, reproducibility and resumption."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from tests.methods.toy import OWN, Context, Quadratic
from tests.methods.toy_session import Obey
from zoobench import registry
from zoobench.cell.meter import BudgetMeter
from zoobench.errors import BudgetExhaustedError, DivergenceError, UsageError
from zoobench.methods.base import Solution
from zoobench.registry import Kind
from zoobench.spec import Budget, BudgetKind, Ref

# one that trains a policy decides on frames: what a parabola can tell of others is in test_ppo.py
METHODS = [name for name in OWN if "policy" not in registry.get(Kind.METHOD, name).tags]
SMALL = {"evolution": "evolution[generations=0]", "ppo": "ppo[buffer=32,batch=16,epochs=2,worlds=4]"}

# what the error says of settings that mean nothing
REFUSED = {
    "cannot adapt": (
        "cmaes[sigma=0.0] cmaes[population=2] evolution[sigma=0.0] evolution[population=3] "
        "quality-diversity[sigma=0.0] quality-diversity[population=3]"
    ),
    "cannot be used": "diffphysics[lr=0.0] diffphysics[restarts=0] diffphysics[iterations=-1] diffphysics[clip=0.0]",
    "no evolution": "evolution[generations=-1] neat[population=1] neat[generations=-1]",
    "[Gg]ive": (
        "ppo[lr=0.0] ppo[timesteps=-1] ppo[discount=1.5] ppo[gae=-0.1] ppo[worlds=3] ppo[batch=1] ppo[batch=4096]"
    ),
    "is empty": "quality-diversity[cells=0]",
    "at least 1": "random[batch=0]",
}

AMOUNTS = {"substeps": (400, 2500), "episodes": (20, 120), "iterations": (2, 9), "seconds": (0.4, 2.5)}
"""Budgets to draw from, of which the least holds an iteration of every method."""


class Watcher(Context):
    """A context that records the cost at each checkpoint."""

    def __init__(self, meter: BudgetMeter, kind: BudgetKind) -> None:
        super().__init__()
        self._meter, self._kind = meter, kind
        self.spent = [0.0]

    def checkpoint(self, data: bytes) -> None:
        super().checkpoint(data)
        self.spent.append(self._meter.spent(self._kind))


def _toy(name: str, budget: Budget) -> Quadratic | Obey:
    return Quadratic(budget) if name in METHODS else Obey(budget)


def _run(name: str, problem: Quadratic | Obey, context: Context) -> Solution:
    method = registry.create(Kind.METHOD, Ref.parse(SMALL.get(name, name)))
    solution: Solution = method.run(problem, context)
    return solution


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        # one that trains a policy takes as long as all others together
        pytest.param(name, kind, marks=() if name in METHODS or kind == "episodes" else pytest.mark.slow)
        for kind in AMOUNTS
        for name in OWN
    ],
)
def test_the_budget_is_honoured_exactly(name: str, kind: BudgetKind, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever it is: never more than allowed, and less than one more iteration is left over.

    Wall time cannot be known beforehand: no iteration begins after its end. Here a substep takes a millisecond.
    """
    for amount in np.random.default_rng(3).uniform(*AMOUNTS[kind], 2):
        budget = Budget(kind, float(amount) if kind == "seconds" else int(amount))
        problem = _toy(name, budget)
        clock = SimpleNamespace(perf_counter=lambda meter=problem.meter: 1e-3 * meter.substeps)
        monkeypatch.setattr("zoobench.cell.meter.time", clock)
        context = Watcher(problem.meter, kind)
        _run(name, problem, context)
        spent, iteration = problem.meter.spent(kind), max(np.diff(context.spent))
        if kind == "seconds":
            assert 0.0 <= spent - budget.amount < iteration
        else:
            assert 0.0 <= budget.amount - spent < iteration
        assert context.fractions == sorted(context.fractions)


@pytest.mark.parametrize("name", METHODS)
def test_wall_time_ends_a_run(name: str) -> None:
    """By the real clock, on a busy machine as well, which may not get through the first buffer of a policy."""
    problem = _toy(name, Budget("seconds", 0.1))
    _run(name, problem, Context())
    assert 0.1 <= problem.meter.seconds < 5.0


@pytest.mark.parametrize("name", OWN)
def test_two_runs_agree_bit_for_bit(name: str) -> None:
    """The same seed gives the same curve and solution, whatever was drawn before; another seed does not."""
    runs = []
    for seed in (5, 5, 6):
        context = Context(seed)
        runs.append((_run(name, _toy(name, Budget("iterations", 6)), context), context.curve))
        torch.rand(3)
        np.random.rand(3)
    np.testing.assert_array_equal(runs[0][0].params, runs[1][0].params)
    assert runs[0][1] == runs[1][1]
    assert runs[0][1] != runs[2][1]


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("stop", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_an_interrupted_run_goes_on_bit_for_bit(name: str, stop: int) -> None:
    """Evaluations, curve and solution are those of an uninterrupted run."""

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


@pytest.mark.parametrize("name", OWN)
def test_a_run_restored_at_its_end_evaluates_nothing_more(name: str) -> None:
    """A run killed after its last checkpoint gives the same result at once."""
    context = Context()
    expected = _run(name, _toy(name, Budget("iterations", 4)), context)
    problem = _toy(name, Budget("iterations", 4))
    result = _run(name, problem, Context(stored=context.stored))
    assert not problem.seen
    np.testing.assert_array_equal(result.params, expected.params)
    assert result.facts == expected.facts


@pytest.mark.parametrize("name", OWN)
def test_a_run_in_which_everything_diverged_says_so(name: str) -> None:
    """It is DIVERGED and has no score; all iterations are in its curve."""
    context, budget = Context(), Budget("iterations", 3)
    problem = Quadratic(budget, diverges=lambda params: True) if name in METHODS else Obey(budget, limit=0.0)
    with pytest.raises(DivergenceError, match="det F"):
        _run(name, problem, context)
    assert context.curve[-1][0] == 3
    values = [value for _, metrics in context.curve for value in metrics.values()]
    assert values
    assert all(math.isfinite(value) for value in values)


@pytest.mark.parametrize("name", METHODS)
def test_a_diverged_episode_cannot_win(name: str) -> None:
    """Half of the space diverges: the solution is in the other half, and failures are counted."""
    problem = Quadratic(Budget("iterations", 20), diverges=lambda params: bool(params[1] > 0.0))
    solution = _run(name, problem, Context(1))
    assert solution.params[1] <= 0.0
    assert solution.evaluation.failure is None
    assert solution.facts["diverged_evaluations"] == sum(params[1] > 0.0 for params in problem.seen) > 0


@pytest.mark.parametrize("name", OWN)
def test_a_budget_too_small_for_anything_is_an_error(name: str) -> None:
    """Nothing is simulated, and the message names the budget."""
    problem = _toy(name, Budget("substeps", 5))
    with pytest.raises(BudgetExhaustedError):
        _run(name, problem, Context())
    assert problem.meter.substeps == 0


@pytest.mark.parametrize(
    ("message", "method"), [(message, method) for message, methods in REFUSED.items() for method in methods.split()]
)
def test_settings_that_mean_nothing_are_refused(message: str, method: str) -> None:
    """The error says which, before anything runs."""
    with pytest.raises(UsageError, match=message):
        registry.create(Kind.METHOD, Ref.parse(method))
