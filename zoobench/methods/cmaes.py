"""CMA-ES (SoftZoo's paper, F.3): an evolution strategy that adapts the covariance of all parameters."""

import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.inputs import FROM_NONE, StoredRun
from zoobench.methods.base import First, RunContext, Solution, Work
from zoobench.methods.generations import Told, evolve, scores_of
from zoobench.registry import Kind, register

SEPARABLE = 500
"""With more parameters than this the covariance is diagonal (sep-CMA-ES, Ros and Hansen 2008)."""

_QUIET = {"verbose": -9, "verb_log": 0, "verb_disp": 0, "signals_filename": None, "seed": np.nan}


@register(Kind.METHOD, "cmaes", tags=("evolution",))
@dataclass(frozen=True, kw_only=True)
class CmaEs:
    """The covariance matrix adaptation evolution strategy (Hansen and Ostermeier 2001), from a draw of the prior.

    A strategy that stagnates is replaced by a new one from a new draw. An episode that failed ranks below all others of
    its generation.

    * `sigma`: initial standard deviation of every parameter; SoftZoo's paper has 0.1.
    * `population`: individuals of a generation; SoftZoo's paper has 10.
    * `start`: a stored run; every strategy's first mean is its solution as far as that fits, the rest is drawn.
    """

    sigma: float = 0.1
    population: int = 10
    start: StoredRun = FROM_NONE

    def __post_init__(self) -> None:
        check_strategy(self.sigma, self.population)

    def work(self, frames: int) -> Work:
        """A generation."""
        return Work(frames=self.population * frames)

    def first(self, frames: int) -> First:
        """A generation."""
        return First(self.population, frames=self.population * frames)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Evolve until the budget does not suffice for another generation."""
        draw = partial(problem.initial, context.rng)
        strategies = partial(Strategies, self.sigma, self.population, draw, context.rng)
        return evolve(problem, context, strategies, population=self.population)


def check_strategy(sigma: float, population: int) -> None:
    """Check the settings of a strategy.

    Raises:
        UsageError: the deviation is not positive, or the population is too small to adapt a covariance.
    """
    if sigma <= 0 or population < 4:
        raise UsageError(
            f"sigma={sigma:g} with a population of {population} cannot adapt. "
            "Give a positive sigma and a population of at least 4."
        )


@contextmanager
def _absent(*modules: str) -> Iterator[None]:
    """Let imports within do without these modules, unless they are loaded already.

    cma takes them where they are there, for plots and surrogates that are not used here, and more than a second.
    """
    unwanted = [name for name in modules if name not in sys.modules]
    sys.modules.update(dict.fromkeys(unwanted))  # type: ignore[arg-type]  # None is what makes an import fail
    try:
        yield
    finally:
        for name in unwanted:
            del sys.modules[name]


class Strategies:
    """One strategy after the other, as an `AskAndTell`.

    Args:
        sigma, population: as in `CmaEs`.
        draw: gives the first mean of a strategy `[parameter_count]`.
        rng: source of all random numbers.
    """

    def __init__(self, sigma: float, population: int, draw: Callable[[], Array], rng: np.random.Generator) -> None:
        self._sigma, self._population, self._draw, self._rng = sigma, population, draw, rng
        self._begun = 0
        self._begin()

    def ask(self) -> list[Array]:
        """The next generation, `[parameter_count]` each."""
        if self._strategy.stop():
            self._begin()
        self._points = [np.asarray(point, dtype=np.float64) for point in self._strategy.ask()]
        return self._points

    def digest(self, evaluations: Sequence[Evaluation]) -> Told:
        """Costs: the negated scores; those of failed episodes are above all others."""
        scores = scores_of(evaluations)
        worst = max((-score for score in scores if score is not None), default=0.0) + 1.0
        return [worst if score is None else -score for score in scores]

    def tell(self, told: Told) -> None:
        """Adapt mean, covariance and step size."""
        # warnings of small populations, and of flat fitness, which leads to a restart
        with warnings.catch_warnings(action="ignore"):
            self._strategy.tell(self._points, list(told))

    def readings(self) -> dict[str, float]:
        """The step size of the present strategy."""
        return {"deviation": float(self._strategy.sigma)}

    def facts(self) -> dict[str, float]:
        """The number of strategies."""
        return {"strategies": float(self._begun)}

    def _begin(self) -> None:
        """Start a new strategy."""
        with warnings.catch_warnings(action="ignore"), _absent("matplotlib", "scipy.stats"):
            import cma

        start = self._draw()
        options = {
            **_QUIET,
            "popsize": self._population,
            "randn": lambda count, size: self._rng.standard_normal((count, size)),
            "CMA_diagonal": len(start) > SEPARABLE,
        }
        with warnings.catch_warnings(action="ignore"):
            self._strategy = cma.CMAEvolutionStrategy(start, self._sigma, options)
        self._begun += 1
