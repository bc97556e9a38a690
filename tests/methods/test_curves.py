"""Learning curves of all methods."""

import itertools

import pytest

from tests.methods.toy import OWN, Context, Quadratic
from tests.methods.toy_session import Obey
from zoobench import registry
from zoobench.cell.meter import BudgetMeter
from zoobench.methods.ppo import Ppo
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref

SPENT = ("substeps", "forward_substeps", "episodes")
POLICY = Ppo(buffer=32, batch=16, epochs=1, worlds=4)


def _run(name: str, context: Context) -> BudgetMeter:
    """Run some iterations on a toy; returns the meter."""
    budget = Budget("iterations", 4)
    if "policy" in registry.get(Kind.METHOD, name).tags:
        policy = Obey(budget)
        POLICY.run(policy, context)  # type: ignore[arg-type]
        return policy.meter
    problem = Quadratic(budget, diverges=lambda params: bool(params[1] > 0.0))
    few = (("population", 8),) if "population" in registry.get(Kind.METHOD, name).parameters else ()
    registry.create(Kind.METHOD, Ref(name, params=few)).run(problem, context)
    return problem.meter


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name == "quality-diversity" else ()) for name in OWN]
)
def test_every_iteration_has_the_best_score_and_all_that_it_took(name: str) -> None:
    """Steps count iterations, the best score never falls, and the last point agrees with the meter."""
    context = Context(1)
    meter = _run(name, context)
    points = [(step, metrics) for step, metrics in context.curve if "substeps" in metrics]
    assert [step for step, _ in points] == list(range(1, meter.iterations + 1))
    assert len(context.seconds) == len(points)
    best = [metrics["score"] for _, metrics in points if "score" in metrics]
    assert best
    assert best == sorted(best)
    assert best[-1] == max(metrics["score_current"] for _, metrics in points if "score_current" in metrics)
    spent = [[metrics[currency] for currency in SPENT] for _, metrics in points]
    assert all(before < after for pair in itertools.pairwise(spent) for before, after in zip(*pair, strict=True))
    assert spent[-1] == [meter.substeps, meter.forward, meter.episodes]
    assert context.seconds == sorted(context.seconds)


@pytest.mark.parametrize("name", OWN)
def test_an_iteration_is_reported_before_its_checkpoint(name: str) -> None:
    """A run killed between the two loses no point of its curve."""

    class Ordered(Context):
        told: list[str]

        def report(self, step: int, **metrics: float) -> None:
            self.told.append("report")
            super().report(step, **metrics)

        def checkpoint(self, data: bytes) -> None:
            self.told.append("checkpoint")
            super().checkpoint(data)

    context = Ordered()
    context.told = []
    _run(name, context)
    assert [key for key, _ in itertools.groupby(context.told)] == ["report", "checkpoint"] * 4
