"""A result is what the harness has seen: whatever a method gives is held against the simulator."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from zoobench.cell.meter import BudgetMeter
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.harness.child import ChildContext, Orders, RunOutcome, solve
from zoobench.harness.repetition import repeated
from zoobench.methods.base import RunContext, Solution
from zoobench.methods.random_search import RandomSearch
from zoobench.spec import Budget, Ref
from zoobench.testing import small_cell

SPEC = small_cell(budget=Budget("iterations", 1), method="random[batch=2]")
Change = Callable[[Solution], Solution]


class _Wire:
    """Takes messages and keeps none."""

    def send(self, kind: str, **contents: Any) -> None:
        """Nothing."""


def _solve(monkeypatch: pytest.MonkeyPatch, change: Change, meddle: Callable[..., None] | None = None) -> RunOutcome:
    """Do a run whose method changes its solution at the end, and before does something with problem and context."""

    def run(method: RandomSearch, problem: Problem, context: RunContext) -> Solution:
        solution = search(method, problem, context)
        if meddle:
            meddle(problem, context)
        return change(solution)

    search = RandomSearch.run
    monkeypatch.setattr(RandomSearch, "run", run)
    monkeypatch.setattr("zoobench.cell.references.reference_scores", lambda *_: {})
    return solve(SPEC, ChildContext(SPEC, _Wire(), None, Orders()))  # type: ignore[arg-type]


def _scored(score: float) -> Change:
    return lambda solution: replace(solution, evaluation=replace(solution.evaluation, score=score))


def test_an_honest_solution_keeps_every_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """Score, readings and counts are those of the method, and no budget pays for the repetition."""
    seen: list[Solution] = []
    outcome = _solve(monkeypatch, lambda solution: seen.append(solution) or solution)
    finals = {name: value for name, value, _ in outcome.finals}
    (solution,) = seen
    assert finals["score"] == solution.evaluation.score
    assert solution.evaluation.metrics == {
        name: replace(metric, value=finals[name]) for name, metric in solution.evaluation.metrics.items()
    }
    assert finals["episodes"] == 2.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_scored(1e9), "given with the score 1000000000.0"),
        (lambda solution: replace(solution, params=solution.params[:3]), r"shape \(3,\)"),
        (lambda solution: replace(solution, params=0.9 * solution.params), "simulated once more"),
        (lambda solution: replace(solution, params=solution.params * np.nan), "parameter 0 = nan"),
        (lambda solution: replace(solution, params=solution.params.astype(str)), "Correct the method"),
        (lambda solution: replace(solution, facts={"distance": 1.0}), "'distance'"),
    ],
)
def test_a_solution_that_does_not_repeat_is_none(monkeypatch: pytest.MonkeyPatch, change: Change, words: str) -> None:
    """Whether it is forged or a mistake."""
    with pytest.raises(UsageError, match=words):
        _solve(monkeypatch, change)


def test_a_score_may_differ_by_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next number is another."""
    with pytest.raises(UsageError, match="simulated once more"):
        _solve(monkeypatch, lambda each: _scored(float(np.nextafter(each.evaluation.score, 9.0)))(each))


@pytest.mark.parametrize(
    ("name", "value"), [("episodes", -1e30), ("iterations", -1), ("forward", 2.5), ("backward", float("nan"))]
)
def test_a_meter_that_was_not_counted_is_refused(monkeypatch: pytest.MonkeyPatch, name: str, value: float) -> None:
    """Episodes that were never spent make no method cheaper."""
    with pytest.raises(UsageError, match=re.escape(f"{value!r} {name}")):
        _solve(monkeypatch, lambda each: each, lambda problem, _: setattr(problem.meter, name, value))


@pytest.mark.parametrize("params", [np.zeros(3), np.zeros((2, 2)), np.full(90, np.inf)])
def test_a_milestone_is_checked_when_it_comes(monkeypatch: pytest.MonkeyPatch, params: Any) -> None:
    """A run of days does not end with the news that its first milestone was none."""
    with pytest.raises(UsageError, match="Correct the method"):
        _solve(monkeypatch, lambda each: each, lambda _, context: context.milestone(1, 0.5, params))


def test_on_a_gpu_nothing_is_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its last digits differ from run to run; what can be checked is."""

    class OnGpu:
        spec = replace(SPEC, fidelity=Ref.parse("smoke[device=cuda]"))
        parameter_count, meter = 2, BudgetMeter()

    class Evaluated:
        score, metrics = 1.0, {"distance": 0.0}

    solution = Solution(np.zeros(2), Evaluated())  # type: ignore[arg-type]
    assert repeated(OnGpu(), solution) is solution  # type: ignore[arg-type]
    with pytest.raises(UsageError):
        repeated(OnGpu(), replace(solution, params=np.zeros(3)))  # type: ignore[arg-type]
