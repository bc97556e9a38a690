"""The loop of evolutionary methods: generations within the budget, reports, and resumption by replay."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.methods.base import Incumbent, RunContext, Solution, pack, report, unpack

Told = Sequence[Any]
"""The result of a generation for the optimiser, as plain data that a checkpoint stores bit for bit."""


class AskAndTell(Protocol):
    """An optimiser with an ask-and-tell interface.

    Its state must follow from the run's generator and the results it is told alone. A checkpoint stores these, and a
    run is resumed bit for bit by replaying them without any simulation.
    """

    def ask(self) -> list[Array]:
        """The next generation, `[parameter_count]` each."""

    def digest(self, evaluations: Sequence[Evaluation]) -> Told:
        """The result of the last generation asked for, from its episodes; some or all may have failed."""

    def tell(self, told: Told) -> None:
        """Update by the digest of the last generation asked for."""

    def readings(self) -> dict[str, float]:
        """Values for the learning curve."""

    def facts(self) -> dict[str, float]:
        """Values for the solution; by default the readings at the end."""
        return self.readings()


def evolve(
    problem: Problem, context: RunContext, create: Callable[[], AskAndTell], *, population: int, generations: int = 0
) -> Solution:
    """Evolve until the budget does not suffice for another generation, or for `generations` if that is not 0.

    `create` makes the optimiser; all its random numbers come from the context's generator. A robot without parameters
    is evaluated once.

    Raises:
        DivergenceError: every evaluation failed.
        BudgetExhaustedError: the budget does not suffice for the first generation.
    """
    if not problem.parameter_count:
        create, population, generations = _Fixed, 1, 1
    stored = context.restore()
    state = {} if stored is None else unpack(stored)
    if state:
        context.rng.bit_generator.state = state["first"]
    first = context.rng.bit_generator.state
    history: list[Told] = list(state.get("told", ()))
    optimiser = create()
    for told in history:
        optimiser.ask()
        optimiser.tell(told)
    incumbent = Incumbent.from_state(state["champion"]) if state else Incumbent()
    if state:
        problem.meter.restore(state["meter"])
    while goes_on(problem, population, generations):
        points = optimiser.ask()
        evaluations = problem.evaluate_batch(points)
        problem.meter.iterations += 1
        for point, evaluation in zip(points, evaluations, strict=True):
            incumbent.offer(point, evaluation)
        history.append(optimiser.digest(evaluations))
        optimiser.tell(history[-1])
        share = problem.meter.iterations / generations if generations else 0.0
        report(problem, context, incumbent, optimiser.readings() | _readings(evaluations), share=share)
        meter = problem.meter.state()
        context.checkpoint(pack({"champion": incumbent.state(), "told": history, "first": first, "meter": meter}))
        if context.should_stop():
            break
    return incumbent.solution(iterations=problem.meter.iterations, **optimiser.facts())


def scores_of(evaluations: Sequence[Evaluation]) -> list[float | None]:
    """The scores; None where an episode failed or the score is not finite."""
    return [item.score if item.failure is None and np.isfinite(item.score) else None for item in evaluations]


def goes_on(problem: Problem, evaluations: int, iterations: int, *, gradient: bool = False) -> bool:
    """Whether another iteration of so many evaluations is affordable, and fewer than `iterations`, if not 0, are done.

    The first is always tried, so that the problem reports a budget too small for it.
    """
    done = problem.meter.iterations
    if done == 0 or done == iterations:
        return done == 0
    return problem.affords(evaluations, gradient=gradient)


class _Fixed:
    """An `AskAndTell` where nothing is to be found: there are no parameters."""

    def ask(self) -> list[Array]:
        return [np.zeros(0)]

    def digest(self, evaluations: Sequence[Evaluation]) -> Told:
        return scores_of(evaluations)

    def tell(self, told: Told) -> None: ...

    def readings(self) -> dict[str, float]:
        return {}

    facts = readings


def _readings(evaluations: Sequence[Evaluation]) -> dict[str, float]:
    """Best and median score of a generation."""
    scores = [score for score in scores_of(evaluations) if score is not None]
    return {"score_current": max(scores), "score_median": float(np.median(scores))} if scores else {}
