"""Random search: the baseline of all methods."""

from bisect import bisect
from dataclasses import dataclass

from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.methods.base import First, RunContext, Solution, Work, keep, report, resume
from zoobench.registry import Kind, register


@register(Kind.METHOD, "random", tags=("baseline",))
@dataclass(frozen=True, kw_only=True)
class RandomSearch:
    """Draw parameters from the prior and keep the best, until the budget is spent.

    * `batch`: draws of one iteration, evaluated side by side.
    """

    batch: int = 8

    def __post_init__(self) -> None:
        if self.batch < 1:
            raise UsageError(f"A batch of {self.batch} draws is empty. Give at least 1.")

    def work(self, frames: int) -> Work:
        """A batch."""
        return Work(frames=self.batch * frames)

    def first(self, frames: int) -> First:
        """A draw, to which the batch may be reduced."""
        return First(1, frames=frames)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Draw, evaluate and keep the best; the last batch is reduced to fit the budget."""
        incumbent = resume(problem, context)
        sizes = range(1, self.batch + 1)
        while (
            size := bisect(sizes, False, key=lambda count: not problem.affords(count))
        ) or not problem.meter.episodes:
            # the first draw is always tried, so that the problem reports a budget too small for it
            draws = [problem.initial(context.rng) for _ in range(max(size, 1))]
            evaluations = problem.evaluate_batch(draws)
            for params, evaluation in zip(draws, evaluations, strict=True):
                incumbent.offer(params, evaluation)
            problem.meter.iterations += 1
            current = max(item.score for item in evaluations)
            report(problem, context, incumbent, {"score_current": current} if current > -float("inf") else {})
            keep(problem, context, incumbent)
            if context.should_stop():
                break
        return incumbent.solution(iterations=problem.meter.iterations)
