"""Co-design by evolution alone (specification F.3): HyperNEAT for the body and CMA-ES for the controller, in one
population."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.methods.base import RunContext, Solution
from zoobench.methods.cmaes import Strategies, check_strategy
from zoobench.methods.generations import Lesson, evolve
from zoobench.methods.hyperneat import Bodies, check_generations
from zoobench.registry import Kind, register


@register(Kind.METHOD, "evolution", tags=("evolution", "sites"))
@dataclass(frozen=True, kw_only=True)
class Evolution:
    """Bodies by HyperNEAT and controllers by CMA-ES, which share one population and its episodes.

    Individual i of a generation has the i-th body of the one and the i-th controller of the other, and both learn from
    its score; neither waits for the other. With a controller that has no parameters this is `neat`; a body that is
    what it is has `cmaes`.

    * `sigma`: initial standard deviation of the controller's parameters; the specification has 0.1.
    * `population`: individuals of a generation; the specification has 10.
    * `generations`: the specification has 100; 0 for as many as the budget holds.
    """

    sigma: float = 0.1
    population: int = 10
    generations: int = 100

    def __post_init__(self) -> None:
        check_strategy(self.sigma, self.population)
        check_generations(self.population, self.generations)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Evolve until generations or budget are spent.

        Raises:
            UsageError: the design is no space with a row of parameters for every site.
            DivergenceError, BudgetExhaustedError: as of every method.
        """

        def found() -> _Couples:
            return _Couples(self, problem, context.rng)

        return evolve(problem, context, found, population=self.population, generations=self.generations)


class _Couples:
    """Bodies and controllers side by side: a `Breeder`. Each part takes its own lesson from the same episodes."""

    def __init__(self, method: Evolution, problem: Problem, rng: np.random.Generator) -> None:
        count = problem.robot.control_count
        self._bodies = Bodies(problem, rng, method.population)
        self._controls = (
            Strategies(method.sigma, method.population, lambda: problem.initial(rng)[:count], rng) if count else None
        )

    def ask(self) -> list[Array]:
        """The next generation, each `[parameter_count]`."""
        bodies = self._bodies.ask()
        if self._controls is None:
            return bodies
        return [np.concatenate(couple) for couple in zip(self._controls.ask(), bodies, strict=True)]

    def lesson(self, evaluations: Sequence[Evaluation]) -> Lesson:
        """Of the bodies, then of the controllers."""
        return [part.lesson(evaluations) for part in self._parts()]

    def learn(self, lesson: Lesson) -> None:
        """Give each its own."""
        for part, own in zip(self._parts(), lesson, strict=True):
            part.learn(own)

    def readings(self) -> dict[str, float]:
        """Of both."""
        return {name: value for part in self._parts() for name, value in part.readings().items()}

    def facts(self) -> dict[str, float]:
        """Of both."""
        return {name: value for part in self._parts() for name, value in part.facts().items()}

    def _parts(self) -> "list[Bodies | Strategies]":
        return [self._bodies] if self._controls is None else [self._bodies, self._controls]
