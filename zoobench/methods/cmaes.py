"""CMA-ES (specification F.3): evolution strategy with an adapted covariance, for all parameters at once."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.inputs import FROM_NONE, StoredRun
from zoobench.methods.base import RunContext, Solution
from zoobench.methods.generations import Lesson, evolve, scores_of
from zoobench.registry import Kind, register

SEPARABLE = 500
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
    * `start`: a stored run, whose solution is every strategy's first mean, as far as it fits; what does not is drawn.
    """

    sigma: float = 0.1
    population: int = 10
    start: StoredRun = FROM_NONE

    def __post_init__(self) -> None:
        check_strategy(self.sigma, self.population)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Evolve until the budget holds no further generation."""

        def found() -> Strategies:
            return Strategies(self.sigma, self.population, lambda: problem.initial(context.rng), context.rng)

        return evolve(problem, context, found, population=self.population)


def check_strategy(sigma: float, population: int) -> None:
    """Refuse settings by which a covariance cannot be adapted.

    Raises:
        UsageError: the deviation is not positive or the population too small.
    """
    if sigma <= 0 or population < 4:
        raise UsageError(
            f"sigma={sigma:g} with a population of {population} cannot adapt. "
            "Give a positive sigma and a population of at least 4."
        )


class Strategies:
    """Strategies one after the other: a `Breeder`.

    Args:
        sigma, population: as of `CmaEs`.
        draw: where a strategy starts `[parameter_count]`.
        rng: what all random numbers come from.
    """

    def __init__(self, sigma: float, population: int, draw: Callable[[], Array], rng: np.random.Generator) -> None:
        self._sigma, self._population, self._draw, self._rng = sigma, population, draw, rng
        self._begun = 0
        self._begin()

    def ask(self) -> list[Array]:
        """The next generation, each `[parameter_count]`."""
        if self._strategy.stop():
            self._begin()
        self._points = [np.asarray(point, dtype=np.float64) for point in self._strategy.ask()]
        return self._points

    def lesson(self, evaluations: Sequence[Evaluation]) -> Lesson:
        """Costs: minus the scores, and for what failed worse than all others."""
        scores = scores_of(evaluations)
        worst = max((-score for score in scores if score is not None), default=0.0) + 1.0
        return [worst if score is None else -score for score in scores]

    def learn(self, lesson: Lesson) -> None:
        """Adapt to costs."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on populations that it finds small, and flat fitness: restarts answer it
            self._strategy.tell(self._points, list(lesson))

    def readings(self) -> dict[str, float]:
        """The present strategy's step size."""
        return {"deviation": float(self._strategy.sigma)}

    def facts(self) -> dict[str, float]:
        """How many strategies there were."""
        return {"strategies": float(self._begun)}

    def _begin(self) -> None:
        """A new strategy, which draws its random numbers from the run's generator."""
        import cma

        start = self._draw()
        options = {
            **_QUIET,
            "popsize": self._population,
            "randn": lambda count, size: self._rng.standard_normal((count, size)),
            "CMA_diagonal": len(start) > SEPARABLE,
        }
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._strategy = cma.CMAEvolutionStrategy(start, self._sigma, options)
        self._begun += 1
