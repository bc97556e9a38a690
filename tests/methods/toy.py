"""A problem with a known optimum, and a run context in memory."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.episode import Episode, Evaluation
from zoobench.cell.meter import BudgetMeter
from zoobench.errors import BudgetExhaustedError, Divergence
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec
from zoobench.tasks.base import Metric
from zoobench.testing import MemoryContext

Context = MemoryContext
Rule = Callable[[Array], bool]

OPTIMUM = np.array([0.7, -1.2, 0.4, 2.0])
EPISODE = 10

OWN = [name for name in registry.names(Kind.METHOD) if not registry.get(Kind.METHOD, name).required]
"""Methods that need no file of a user; one that does is tested with files, in test_external.py."""


def _never(params: Array) -> bool:
    return False


class OneSite:
    """A design space with one row of parameters, patterns as they are: occupancy, stiffness and muscles."""

    def sites(self, body: object) -> Array:
        return np.ones((1, 7))

    def painted(self, patterns: Array) -> Array:
        return np.delete(patterns, 1, axis=1).ravel()  # not the share


class Quadratic:
    """score = 1 - |parameters - OPTIMUM|^2, behind the same meter as `zoobench.cell.problem.Problem`.

    The first parameter is a controller's, the others a design space's. `diverges` and `breaks` are called with the
    parameters: the episode blows up, or its gradient is NaN.
    """

    parameter_count = len(OPTIMUM)
    body = SimpleNamespace(muscle_count=1, volumes=np.ones(1))
    robot = SimpleNamespace(control_count=1, space=OneSite(), site_space=OneSite())

    def __init__(self, budget: Budget, diverges: Rule = _never, breaks: Rule = _never) -> None:
        names = ("ground", "toy", "toy", "toy", "toy", "toy")
        env, task, design, controller, method, fidelity = (Ref(name, 1) for name in names)
        self.spec = RunSpec(env, task, design, controller, method, 0, budget, fidelity, 1)
        self.meter = BudgetMeter()
        self.seen: list[Array] = []
        self._diverges, self._breaks = diverges, breaks

    def initial(self, rng: np.random.Generator) -> Array:
        return rng.normal(size=self.parameter_count)

    def affords(self, count: int = 1, *, gradient: bool = False) -> bool:
        budget = self.spec.budget
        if budget.kind == "substeps":
            return self.meter.substeps + count * EPISODE * (2 if gradient else 1) <= budget.amount
        if budget.kind == "episodes":
            return self.meter.episodes + count <= budget.amount
        return self.meter.is_left(budget)

    def evaluate_batch(self, batch: Sequence[Array]) -> list[Evaluation]:
        return [evaluation for evaluation, _ in self._all(batch, gradient=False)]

    def loss_and_grad_batch(self, batch: Sequence[Array]) -> list[tuple[Evaluation, Array]]:
        return self._all(batch, gradient=True)

    def episode(self, parameters: Array, *, gradient: bool = False) -> Episode:
        (evaluation, derivative), *_ = self._all([parameters], gradient=gradient)
        return Episode(evaluation, derivative, None)

    def _all(self, batch: Sequence[Array], *, gradient: bool) -> list[tuple[Evaluation, Array]]:
        if not self.affords(len(batch), gradient=gradient):
            raise BudgetExhaustedError("The toy's budget is spent.")
        self.meter.start_clock()
        self.meter.episodes += len(batch)
        self.meter.forward += EPISODE * len(batch)
        if gradient:
            self.meter.backward += EPISODE * len(batch)
        return [self._one(np.array(params)) for params in batch]

    def _one(self, params: Array) -> tuple[Evaluation, Array]:
        self.seen.append(params)
        if self._diverges(params):
            divergence = Divergence(0, 0, 1, "det F", -1.0, 0.0, 0, (0.0, 0.0, 0.0), "Try something else.")
            return Evaluation(-math.inf, {}, np.zeros(0), divergence), np.full(len(params), math.nan)
        score = 1.0 - float(((params - OPTIMUM) ** 2).sum())
        gradient = np.full(len(params), math.nan) if self._breaks(params) else 2.0 * (params - OPTIMUM)
        shape = {
            name: Metric(value, "1")
            for name, value in zip(("body_volume", "elongation"), shape_of(params), strict=True)
        }
        return Evaluation(score, {**shape, "score": Metric(score, "m/s")}, np.array([score])), gradient


def shape_of(params: Array) -> tuple[float, float]:
    """Volume and elongation assigned to parameters, in [0, 1]."""
    volume, elongation = 0.5 + np.arctan(params[1:3]) / math.pi
    return float(volume), float(elongation)


class Rosenbrock(Quadratic):
    """score = 1 - sum 100 (y - x^2)^2 + (1 - x)^2, in a valley that bends towards the optimum at ones."""

    def _one(self, params: Array) -> tuple[Evaluation, Array]:
        evaluation, _ = super()._one(params)
        x, y = params[:-1], params[1:]
        cost = float((100.0 * (y - x**2) ** 2 + (1.0 - x) ** 2).sum())
        gradient = np.zeros(len(params))
        gradient[:-1] += -400.0 * x * (y - x**2) - 2.0 * (1.0 - x)
        gradient[1:] += 200.0 * (y - x**2)
        return replace(evaluation, score=1.0 - cost), gradient
