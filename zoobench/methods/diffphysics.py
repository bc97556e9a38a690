"""Differentiable physics (specification F.1): Adam on the simulator's gradient from several random starts."""

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
from zoobench.methods.base import Champion, RunContext, Solution, pack, report, unpack
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.METHOD, "diffphysics", tags=("gradient",))
@dataclass(frozen=True, kw_only=True)
class DiffPhysics:
    """Gradient ascent with Adam through the simulator from several random starts; the best point met is kept.

    * `lr`: Adam's learning rate; the specification has 0.1 for animals, 0.01 elsewhere.
    * `iterations`: steps of every restart, 0 for as many as the budget holds; the specification has 30 for
      animals.
    * `restarts`: random starts, run side by side; the specification has 8. The best is the result, and the best score
      of each is kept with it.
    * `start`: a stored run, whose solution is where all restarts begin, as far as it fits; what does not is drawn.
      Restarts that would begin at the same point are one.
    * `clip`: a longer gradient is scaled back to this length before Adam sees it, and counted.

    A restart whose episode diverged or whose gradient is not finite makes no step: it goes half of the way
    back to its own best point, or starts anew from the prior if it has none or stands on it. Both are
    counted.
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
                "is no ascent. Give a positive lr and clip, at least 1 restart and 0 or more iterations."
            )

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Climb until iterations or budget are spent; the budget must hold the first iteration."""
        if (stored := context.restore()) is not None:
            ascent = _Ascent.from_state(self, unpack(stored), problem, context)
        else:
            ascent = _Ascent(self, _distinct([problem.initial(context.rng) for _ in range(self.restarts)]))
        while self._goes_on(problem, len(ascent.points)):
            results = problem.loss_and_grad_batch(ascent.points)
            problem.meter.iterations += 1
            ascent.step(results, lambda: problem.initial(context.rng))
            self._report(problem, context, ascent, results)
            context.checkpoint(pack(ascent.state(problem, context)))
            if context.should_stop():
                break
        facts = {**ascent.counts(), **ascent.best_scores()}
        return ascent.champion.solution(iterations=problem.meter.iterations, **facts)

    def _goes_on(self, problem: Problem, restarts: int) -> bool:
        done = problem.meter.iterations
        if done == 0 or done == self.iterations:
            return done == 0
        return problem.affords(restarts, gradient=True)

    def _report(
        self,
        problem: Problem,
        context: RunContext,
        ascent: "_Ascent",
        results: Sequence[tuple[Evaluation, Array]],
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
        report(problem, context, ascent.champion, readings, share=share)


def _distinct(points: Sequence[Array]) -> list[Array]:
    """The points, each once."""
    return [point for index, point in enumerate(points) if not any(map(partial(np.array_equal, point), points[:index]))]


def _length(gradient: Array) -> float:
    """Of a gradient; not finite if the gradient is not, or if its length is beyond all numbers."""
    with np.errstate(over="ignore"):
        return float(np.linalg.norm(gradient))


class _Ascent:
    """All restarts of one run: where they are, Adam's memory, and the best of each."""

    def __init__(self, method: DiffPhysics, points: Sequence[Array]) -> None:
        import torch

        self._clip = method.clip
        self._points: list[Tensor] = [torch.tensor(point, requires_grad=True) for point in points]
        # One group for each restart: Adam passes over a restart without a gradient, its memory untouched.
        self._adam = torch.optim.Adam([{"params": [point]} for point in self._points], lr=method.lr)
        self.champion = Champion()
        self._own_best = [Champion() for _ in points]
        self._clipped = 0
        self._unusable = 0

    @property
    def points(self) -> list[Array]:
        """Where the restarts stand, each `[parameter_count]`."""
        return [point.detach().numpy().copy() for point in self._points]

    def counts(self) -> dict[str, float]:
        """How many gradients were clipped, and how many were not finite though their episode was healthy."""
        return {"clipped_gradients": float(self._clipped), "nonfinite_gradients": float(self._unusable)}

    def best_scores(self) -> dict[str, float]:
        """The best score of each restart that has one: how much the start decides."""
        scores = {f"restart_{index}_best": best.score for index, best in enumerate(self._own_best)}
        return {name: score for name, score in scores.items() if score is not None}

    def step(self, results: Sequence[tuple[Evaluation, Array]], draw: Callable[[], Array]) -> None:
        """Take the results at `points` into account and move on."""
        import torch

        retreating = []
        for index, (evaluation, gradient) in enumerate(results):
            point = self._points[index]
            self.champion.offer(self.points[index], evaluation)
            self._own_best[index].offer(self.points[index], evaluation)
            healthy = evaluation.failure is None and bool(np.isfinite(_length(gradient)))
            point.grad = torch.as_tensor(self._clipped_gradient(gradient)) if healthy else None
            self._unusable += int(not healthy and evaluation.failure is None)
            if not healthy:
                retreating.append(index)
        self._adam.step()
        for index in retreating:
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
            self._adam.state.pop(self._points[index], None)  # what Adam remembers is of another place
            target = draw()
        else:
            target = (here + best) / 2
        with torch.no_grad():
            self._points[index].copy_(torch.as_tensor(target))

    def state(self, problem: Problem, context: RunContext) -> dict[str, Any]:
        """Everything needed to go on bit for bit."""
        return {
            "points": [point.detach() for point in self._points],
            "adam": self._adam.state_dict(),
            "champion": self.champion.state(),
            "own_best": [best.state() for best in self._own_best],
            "clipped": self._clipped,
            "unusable": self._unusable,
            "meter": problem.meter.state(),
            "rng": context.rng.bit_generator.state,
        }

    @classmethod
    def from_state(
        cls, method: DiffPhysics, state: Mapping[str, Any], problem: Problem, context: RunContext
    ) -> "_Ascent":
        """The inverse of `state`; sets the problem's meter and the context's generator, too."""
        ascent = cls(method, [point.numpy() for point in state["points"]])
        ascent._adam.load_state_dict(state["adam"])
        ascent.champion = Champion.from_state(state["champion"])
        ascent._own_best = [Champion.from_state(best) for best in state["own_best"]]
        ascent._clipped, ascent._unusable = state["clipped"], state["unusable"]
        problem.meter.restore(state["meter"])
        context.rng.bit_generator.state = state["rng"]
        return ascent
