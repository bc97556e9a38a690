"""Differentiable physics (SoftZoo's paper, F.1): Adam on the simulator's gradient from several random starts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.inputs import FROM_NONE, StoredRun
from zoobench.methods.adam import Adam
from zoobench.methods.base import First, Incumbent, RunContext, Solution, Work, keep, report, resume, unpack
from zoobench.methods.generations import goes_on
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.METHOD, "diffphysics", version=2, tags=("gradient",))
@dataclass(frozen=True, kw_only=True)
class DiffPhysics:
    """Gradient ascent with Adam (Kingma and Ba 2015) through the simulator from several random starts.

    * `lr`: Adam's learning rate; SoftZoo's paper has 0.1 for animals, 0.01 elsewhere.
    * `iterations`: steps of every restart, 0 for as many as the budget allows; SoftZoo's paper has 30 for animals.
    * `restarts`: random starts, run side by side; SoftZoo's paper has 8. The solution is the best point of all, and
      the best score of each restart is stored with it.
    * `start`: a stored run; all restarts begin at its solution as far as that fits, the rest is drawn. Restarts that
      would begin at the same point are merged.
    * `clip`: gradients with a larger norm are scaled to this norm and counted.

    A restart whose episode failed or whose gradient is not finite makes no step. It moves half of the way back to its
    own best point, or starts again from the prior if it has none or is there already. Both are counted.
    """

    lr: float = 0.1
    iterations: int = 0
    restarts: int = 8
    clip: float = 1.0
    start: StoredRun = FROM_NONE

    def __post_init__(self) -> None:
        if self.lr <= 0 or self.clip <= 0 or self.restarts < 1 or self.iterations < 0:
            raise UsageError(
                f"lr={self.lr:g}, clip={self.clip:g}, restarts={self.restarts}, iterations={self.iterations} "
                "cannot be used. Give a positive lr and clip, at least 1 restart and 0 or more iterations."
            )

    def work(self, frames: int) -> Work:
        """A gradient of every restart."""
        return Work(gradient_frames=self.restarts * frames, iterations=self.iterations)

    def first(self, frames: int) -> First:
        """A gradient of every restart; those from one start may all be the same."""
        count = 1 if self.start else self.restarts
        return First(count, gradient_frames=count * frames)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Ascend until the iterations or the budget are spent; the first iteration is always tried."""
        if (stored := context.restore()) is not None:
            ascent = _Ascent.from_state(self, unpack(stored), resume(problem, context))
        else:
            ascent = _Ascent(self, _distinct([problem.initial(context.rng) for _ in range(self.restarts)]))
        while goes_on(problem, len(ascent.points), self.iterations, gradient=True):
            results = problem.loss_and_grad_batch(ascent.points)
            problem.meter.iterations += 1
            ascent.step(results, lambda: problem.initial(context.rng))
            self._report(problem, context, ascent, results)
            keep(problem, context, ascent.incumbent, **ascent.state())
            if context.should_stop():
                break
        facts = {**ascent.counts(), **ascent.best_scores()}
        return ascent.incumbent.solution(iterations=problem.meter.iterations, **facts)

    def _report(
        self, problem: Problem, context: RunContext, ascent: "_Ascent", results: Sequence[tuple[Evaluation, Array]]
    ) -> None:
        readings = ascent.counts()
        norms = [norm for _, gradient in results if np.isfinite(norm := _length(gradient))]
        scores = {i: item.score for i, (item, _) in enumerate(results) if item.failure is None}
        if scores:
            readings["score_current"] = max(scores.values())
        if norms:
            readings["gradient_norm"] = float(np.median(norms))
        readings.update({f"restart_{i}": score for i, score in scores.items()})
        share = problem.meter.iterations / self.iterations if self.iterations else 0.0
        report(problem, context, ascent.incumbent, readings, share=share)


def _distinct(points: Sequence[Array]) -> list[Array]:
    """The points without repetitions."""
    return [point for index, point in enumerate(points) if not any(map(partial(np.array_equal, point), points[:index]))]


def _length(gradient: Array) -> float:
    """The norm of a gradient; not finite if the gradient is not, or if the norm overflows."""
    with np.errstate(over="ignore"):
        return float(np.linalg.norm(gradient))


class _Ascent:
    """The restarts of one run: points, Adam's moments, and the incumbent of each."""

    def __init__(self, method: DiffPhysics, points: Sequence[Array]) -> None:
        import torch

        self._clip = method.clip
        self._rate = method.lr
        self._points: list[Tensor] = [torch.tensor(point) for point in points]
        self._adams = [Adam(self._rate) for _ in points]
        self.incumbent = Incumbent()
        self._own_best = [Incumbent() for _ in points]
        self._clipped = 0
        self._unusable = 0

    @property
    def points(self) -> list[Array]:
        """The present points of the restarts, `[parameter_count]` each."""
        return [point.numpy().copy() for point in self._points]

    def counts(self) -> dict[str, float]:
        """Counts of clipped gradients, and of gradients that were not finite although their episode did not fail."""
        return {"clipped_gradients": float(self._clipped), "nonfinite_gradients": float(self._unusable)}

    def best_scores(self) -> dict[str, float]:
        """The best score of each restart that has one."""
        scores = {f"restart_{index}_best": best.score for index, best in enumerate(self._own_best)}
        return {name: score for name, score in scores.items() if score is not None}

    def step(self, results: Sequence[tuple[Evaluation, Array]], draw: Callable[[], Array]) -> None:
        """Update incumbents and points by the results at `points`."""
        import torch

        for index, (evaluation, gradient) in enumerate(results):
            point = self._points[index]
            self.incumbent.offer(self.points[index], evaluation)
            self._own_best[index].offer(self.points[index], evaluation)
            healthy = evaluation.failure is None and bool(np.isfinite(_length(gradient)))
            self._unusable += int(not healthy and evaluation.failure is None)
            if healthy:
                self._adams[index].step(point, torch.as_tensor(self._clipped_gradient(gradient)))
            else:
                self._retreat(index, draw)

    def _clipped_gradient(self, gradient: Array) -> Array:
        norm = _length(gradient)
        if norm <= self._clip:
            return gradient
        self._clipped += 1
        return gradient * (self._clip / norm)

    def _retreat(self, index: int, draw: Callable[[], Array]) -> None:
        import torch

        here, best = self.points[index], self._own_best[index].params
        if best is None or np.array_equal(here, best):
            self._adams[index] = Adam(self._rate)  # the moments belong to another point
            target = draw()
        else:
            target = (here + best) / 2
        self._points[index].copy_(torch.as_tensor(target))

    def state(self) -> dict[str, Any]:
        """Plain data to continue from bit for bit, without the incumbent."""
        return {
            "points": self._points,
            "adam": {"state": {index: adam.state() for index, adam in enumerate(self._adams)}},
            "own_best": [best.state() for best in self._own_best],
            "clipped": self._clipped,
            "unusable": self._unusable,
        }

    @classmethod
    def from_state(cls, method: DiffPhysics, state: Mapping[str, Any], incumbent: Incumbent) -> "_Ascent":
        """The inverse of `state`."""
        ascent = cls(method, [point.numpy() for point in state["points"]])
        moments = state["adam"]["state"]
        ascent._adams = [Adam.from_state(method.lr, moments.get(index, {})) for index in range(len(ascent._points))]
        ascent.incumbent = incumbent
        ascent._own_best = [Incumbent.from_state(best) for best in state["own_best"]]
        ascent._clipped, ascent._unusable = state["clipped"], state["unusable"]
        return ascent
