"""Co-design by evolution (SoftZoo's paper, F.3): HyperNEAT for the body and CMA-ES for the controller."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.methods.base import First, RunContext, Solution, Work
from zoobench.methods.cmaes import Strategies, check_strategy
from zoobench.methods.generations import Told, evolve
from zoobench.methods.hyperneat import Bodies, check_generations
from zoobench.registry import Kind, register


@register(Kind.METHOD, "evolution", version=2, tags=("evolution", "sites"))
@dataclass(frozen=True, kw_only=True)
class Evolution:
    """Bodies by HyperNEAT and controllers by CMA-ES, evaluated together in one population.

    Individual i of a generation has the i-th body and the i-th controller, and its score is told to both optimisers.
    With a controller without parameters this is `neat`; for a fixed body use `cmaes`.

    * `sigma`: initial standard deviation of the controller's parameters; SoftZoo's paper has 0.1.
    * `population`: individuals of a generation; SoftZoo's paper has 10.
    * `generations`: 100 in SoftZoo's paper; 0 for as many as the budget allows.
    """

    sigma: float = 0.1
    population: int = 10
    generations: int = 100

    def __post_init__(self) -> None:
        check_strategy(self.sigma, self.population)
        check_generations(self.population, self.generations)

    def work(self, frames: int) -> Work:
        """A generation."""
        return Work(frames=self.population * frames, iterations=self.generations)

    def first(self, frames: int) -> First:
        """A generation."""
        return First(self.population, frames=self.population * frames)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Evolve until the generations or the budget are spent.

        Raises:
            UsageError: the design is not a design space with a row of parameters for every site.
            DivergenceError, BudgetExhaustedError: as for every method.
        """
        pairs = partial(_Pairs, self, problem, context.rng)
        return evolve(problem, context, pairs, population=self.population, generations=self.generations)


class _Pairs:
    """Pairs of body and controller, as an `AskAndTell`; both optimisers are told of the same episodes."""

    def __init__(self, method: Evolution, problem: Problem, rng: np.random.Generator) -> None:
        count = problem.robot.control_count
        self._bodies = Bodies(problem, rng, method.population)
        self._controls = (
            Strategies(method.sigma, method.population, lambda: problem.initial(rng)[:count], rng) if count else None
        )

    def ask(self) -> list[Array]:
        """The next generation, `[parameter_count]` each."""
        bodies = self._bodies.ask()
        if self._controls is None:
            return bodies
        return [np.concatenate(pair) for pair in zip(self._controls.ask(), bodies, strict=True)]

    def digest(self, evaluations: Sequence[Evaluation]) -> Told:
        """The digest of the bodies, then that of the controllers."""
        return [part.digest(evaluations) for part in self._parts()]

    def tell(self, told: Told) -> None:
        """Tell each optimiser its own digest."""
        for part, own in zip(self._parts(), told, strict=True):
            part.tell(own)

    def readings(self) -> dict[str, float]:
        """The readings of both."""
        return {name: value for part in self._parts() for name, value in part.readings().items()}

    def facts(self) -> dict[str, float]:
        """The facts of both."""
        return {name: value for part in self._parts() for name, value in part.facts().items()}

    def _parts(self) -> "list[Bodies | Strategies]":
        return [self._bodies] if self._controls is None else [self._bodies, self._controls]
