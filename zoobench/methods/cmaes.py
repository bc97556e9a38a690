"""CMA-ES (specification F.3): evolution strategy with an adapted covariance, for all parameters at once."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from zoobench.episode import Evaluation
from zoobench.errors import UsageError
from zoobench.methods.base import Array, Champion, RunContext, Solution, pack, unpack
from zoobench.problem import Problem
from zoobench.registry import Kind, register

_SEPARABLE = 500
"""Parameters from which on the covariance is kept diagonal (sep-CMA-ES, Ros and Hansen 2008)."""

_QUIET = {"verbose": -9, "verb_log": 0, "verb_disp": 0, "signals_filename": None, "seed": np.nan}


@register(Kind.METHOD, "cmaes", tags=("evolution",))
@dataclass(frozen=True, kw_only=True)
class CmaEs:
    """The covariance matrix adaptation evolution strategy (Hansen and Ostermeier 2001), from a draw of the prior.

    Where a strategy has stagnated, a new one starts from a new draw. An episode that diverged is worse than all others
    of its generation.

    * `sigma`: initial standard deviation of every parameter; the specification has 0.1.
    * `population`: individuals of a generation; the specification has 10.
    """

    sigma: float = 0.1
    population: int = 10

    def __post_init__(self) -> None:
        if self.sigma <= 0 or self.population < 4:
            raise UsageError(
                f"sigma={self.sigma:g} with a population of {self.population} cannot adapt. "
                "Give a positive sigma and a population of at least 4."
            )

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Evolve until the budget holds no further generation."""
        stored = context.restore()
        lineage = _Lineage(self, problem, context) if stored is None else _Lineage.again(self, problem, context, stored)
        while problem.affords(self.population) or not problem.meter.episodes:
            points = lineage.ask()
            evaluations = problem.evaluate_batch(points)
            problem.meter.iterations += 1
            lineage.tell(points, evaluations)
            self._report(problem, context, lineage, evaluations)
            context.checkpoint(pack(lineage.state(problem)))
            if context.should_stop():
                break
        return lineage.champion.solution(iterations=problem.meter.iterations, strategies=lineage.strategies)

    @staticmethod
    def _report(problem: Problem, context: RunContext, lineage: "_Lineage", evaluations: Sequence[Evaluation]) -> None:
        meter, champion = problem.meter, lineage.champion
        readings = {"substeps": float(meter.substeps), "diverged": float(champion.diverged)}
        readings["deviation"] = lineage.deviation
        if champion.score is not None:
            readings["score"] = champion.score
        scores = [item.score for item in evaluations if item.failure is None]
        if scores:
            readings |= {"score_current": max(scores), "score_median": float(np.median(scores))}
        context.report(meter.iterations, **readings)
        context.progress(meter.fraction(problem.spec.budget), champion.score)


class _Lineage:
    """Strategies one after the other, and the best individual of all.

    All that happens follows from the generator's first state and the costs told, so that these are what is stored: a
    run is resumed by telling them again, bit for bit and without any simulation.
    """

    def __init__(self, method: CmaEs, problem: Problem, context: RunContext) -> None:
        self._method, self._problem, self._rng = method, problem, context.rng
        self._first = context.rng.bit_generator.state
        self._told: list[list[float]] = []
        self.champion = Champion()
        self.strategies = 0
        self._begin()

    @property
    def deviation(self) -> float:
        """The present strategy's step size."""
        return float(self._strategy.sigma)

    def ask(self) -> list[Array]:
        """The next generation, each `[parameter_count]`."""
        if self._strategy.stop():
            self._begin()
        return [np.asarray(point, dtype=np.float64) for point in self._strategy.ask()]

    def tell(self, points: Sequence[Array], evaluations: Sequence[Evaluation]) -> None:
        """What became of the generation."""
        for point, evaluation in zip(points, evaluations, strict=True):
            self.champion.offer(point, evaluation)
        finite = [-item.score for item in evaluations if item.failure is None]
        worst = max(finite, default=0.0) + 1.0
        self._learn(points, [worst if item.failure is not None else -item.score for item in evaluations])

    def _learn(self, points: Sequence[Array], costs: list[float]) -> None:
        self._told.append(costs)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on populations that it finds small, and flat fitness: restarts answer it
            self._strategy.tell(list(points), costs)

    def _begin(self) -> None:
        """A new strategy, which draws its random numbers from the run's generator."""
        import cma

        start = self._problem.initial(self._rng)
        options = {
            **_QUIET,
            "popsize": self._method.population,
            "randn": lambda count, size: self._rng.standard_normal((count, size)),
            "CMA_diagonal": len(start) > _SEPARABLE,
        }
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._strategy = cma.CMAEvolutionStrategy(start, self._method.sigma, options)
        self.strategies += 1

    def state(self, problem: Problem) -> dict[str, Any]:
        """Plain data for a checkpoint."""
        champion, meter = self.champion.state(), problem.meter.state()
        return {"champion": champion, "told": self._told, "first": self._first, "meter": meter}

    @classmethod
    def again(cls, method: CmaEs, problem: Problem, context: RunContext, stored: bytes) -> "_Lineage":
        """The inverse of `state`; sets the problem's meter and the context's generator, too."""
        state = unpack(stored)
        context.rng.bit_generator.state = state["first"]
        lineage = cls(method, problem, context)
        for costs in state["told"]:
            lineage._learn(lineage.ask(), costs)
        lineage.champion = Champion.from_state(state["champion"])
        problem.meter.restore(state["meter"])
        return lineage
