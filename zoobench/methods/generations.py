"""What evolutionary methods share: generations within the budget, reports, and resumption by replay."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.methods.base import Champion, RunContext, Solution, pack, report, unpack

Lesson = Sequence[Any]
"""What a breeder is told of a generation, as plain data, exact to the last bit."""


class Breeder(Protocol):
    """What makes one generation after the other.

    All that it does must follow from the run's generator and the lessons, so that these are what is stored: a run is
    resumed by teaching them again, bit for bit and without any simulation.
    """

    def ask(self) -> list[Array]:
        """The next generation, each `[parameter_count]`."""
        ...

    def lesson(self, evaluations: Sequence[Evaluation]) -> Lesson:
        """What is to be learnt from the episodes of the generation asked for last; some or all may have failed."""
        ...

    def learn(self, lesson: Lesson) -> None:
        """Take a lesson on the generation asked for last."""
        ...

    def readings(self) -> dict[str, float]:
        """For the learning curve."""
        ...

    def facts(self) -> dict[str, float]:
        """For the solution."""
        ...


def evolve(
    problem: Problem, context: RunContext, found: Callable[[], Breeder], *, population: int, generations: int = 0
) -> Solution:
    """Breed until the budget holds no further generation, or for so many generations if that is not 0.

    `found` makes the breeder, with random numbers from the context's generator alone.

    Raises:
        DivergenceError: every evaluation failed.
        BudgetExhaustedError: the budget does not hold the first generation.
    """
    state = _stored(context)
    if state:
        context.rng.bit_generator.state = state["first"]
    first = context.rng.bit_generator.state
    told: list[Lesson] = list(state.get("told", ()))
    breeder = found()
    for lesson in told:
        breeder.ask()
        breeder.learn(lesson)
    champion = Champion.from_state(state["champion"]) if state else Champion()
    if state:
        problem.meter.restore(state["meter"])
    while _goes_on(problem, population, generations):
        points = breeder.ask()
        evaluations = problem.evaluate_batch(points)
        problem.meter.iterations += 1
        for point, evaluation in zip(points, evaluations, strict=True):
            champion.offer(point, evaluation)
        told.append(breeder.lesson(evaluations))
        breeder.learn(told[-1])
        share = problem.meter.iterations / generations if generations else 0.0
        report(problem, context, champion, breeder.readings() | _readings(evaluations), share=share)
        meter = problem.meter.state()
        context.checkpoint(pack({"champion": champion.state(), "told": told, "first": first, "meter": meter}))
        if context.should_stop():
            break
    return champion.solution(iterations=problem.meter.iterations, **breeder.facts())


def scores_of(evaluations: Sequence[Evaluation]) -> list[float | None]:
    """The score of each, None for one that failed or whose score is no number."""
    return [item.score if item.failure is None and np.isfinite(item.score) else None for item in evaluations]


def _stored(context: RunContext) -> dict[str, Any]:
    data = context.restore()
    return {} if data is None else unpack(data)


def _goes_on(problem: Problem, population: int, generations: int) -> bool:
    done = problem.meter.iterations
    if done == 0 or done == generations:
        return done == 0  # with nothing affordable at all one generation is tried: the problem explains its budget
    return problem.affords(population)


def _readings(evaluations: Sequence[Evaluation]) -> dict[str, float]:
    """Best and median of a generation, for the learning curve."""
    scores = [score for score in scores_of(evaluations) if score is not None]
    return {"score_current": max(scores), "score_median": float(np.median(scores))} if scores else {}
