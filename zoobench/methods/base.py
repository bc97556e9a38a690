"""The protocol of methods, which maximise a problem's score within its budget and can be interrupted."""

import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.errors import Displaced, Divergence, DivergenceError, Failure, Unbuildable, UsageError
from zoobench.methods.archive import Archive


class RunContext(Protocol):
    """Random numbers, reports and checkpoints of one run."""

    rng: np.random.Generator

    def report(self, step: int, **metrics: float) -> None:
        """Put a point on the learning curve."""

    def milestone(self, step: int, score: float, params: Array) -> None:
        """Keep the best parameters `[parameter_count]` after so many iterations, and their score."""

    def checkpoint(self, data: bytes) -> None:
        """Replace the stored state; all earlier reports are stored with it."""

    def restore(self) -> bytes | None:
        """The stored state; None in a new run."""

    def should_stop(self) -> bool:
        """Whether the method is to return after this iteration."""

    def progress(self, fraction: float, score: float | None) -> None:
        """Report the completed fraction of the run, in [0, 1], and the best score so far."""


@dataclass(frozen=True)
class Solution:
    """The solution of a run.

    Attributes:
        params: the best parameters `[parameter_count]`.
        evaluation: their episode.
        facts: counts and readings of the method itself, such as clipped gradients.
        archive: further solutions, of a method that collects them; stored with the run.
    """

    params: Array
    evaluation: Evaluation
    facts: Mapping[str, float] = field(default_factory=dict)
    archive: Archive | None = None


class Work(NamedTuple):
    """The frames that an iteration of a method simulates, by its settings alone: for estimates of time.

    Attributes:
        frames: control frames without a gradient.
        gradient_frames: control frames with their gradient.
        iterations: how many the settings ask for; 0 for as many as the budget allows.
    """

    frames: float = 0.0
    gradient_frames: float = 0.0
    iterations: int = 0


class First(NamedTuple):
    """The least that the first iteration of a method takes, by its settings alone.

    Attributes:
        episodes: that are begun.
        frames: control frames without a gradient, which the method asks the budget for before it simulates any.
        gradient_frames: the same with their gradient.
    """

    episodes: int
    frames: int = 0
    gradient_frames: int = 0


class Method(Protocol):
    """An optimiser.

    One that needs gradients is registered with the tag `gradient`; cells without gradients are skipped with a reason.
    It may have `work(frames: int) -> Work`, the work of an iteration with episodes of so many control frames; without
    it `zoobench run --dry-run` has nothing to estimate from before the first run is done. It may have
    `first(frames: int) -> First`, by which a budget that does not suffice for the first iteration is refused before the
    run.
    """

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Spend the problem's budget and return the best solution; continues from `context.restore()` if that is given.

        Raises:
            DivergenceError: every evaluation failed.
            BudgetExhaustedError: the budget does not suffice for the first iteration.
        """


_FAILURES: dict[str, type[Failure]] = {kind.__name__: kind for kind in (Divergence, Unbuildable, Displaced)}


@dataclass
class Incumbent:
    """The best solution so far; failed evaluations and scores that are not finite are never taken."""

    params: Array | None = None
    evaluation: Evaluation | None = None
    diverged: int = 0
    last_failure: Failure | None = None
    unscored: int = 0  # evaluations that did not fail and have no finite score

    @property
    def score(self) -> float | None:
        """Its score; None while every evaluation has failed."""
        return None if self.evaluation is None else self.evaluation.score

    def offer(self, params: Array, evaluation: Evaluation) -> None:
        """Take these parameters if they score better; of equal scores the earlier stays."""
        if evaluation.failure is not None:
            self.diverged += 1
            self.last_failure = evaluation.failure
        elif np.isfinite(evaluation.score) and (self.score is None or evaluation.score > self.score):
            self.params, self.evaluation = params.copy(), evaluation
        elif not np.isfinite(evaluation.score):
            self.unscored += 1

    def solution(self, **facts: float) -> Solution:
        """The solution of an ended run.

        Raises:
            UsageError: no score was finite, though some evaluations did not fail.
            DivergenceError: every evaluation failed.
        """
        if self.params is None or self.evaluation is None:
            if self.unscored:
                raise UsageError(
                    f"{self.unscored} evaluations ended well with a score that is NaN or infinite, and none with a "
                    "finite one. Correct the task."
                )
            if self.last_failure is None:
                raise ValueError("A solution was asked for before anything was evaluated.")
            raise DivergenceError(self.last_failure)
        return Solution(self.params, self.evaluation, {"diverged_evaluations": self.diverged, **facts})

    def state(self) -> dict[str, Any]:
        """Plain data for a checkpoint."""
        last = self.last_failure
        return {
            "params": None if self.params is None else self.params.tolist(),
            "evaluation": None if self.evaluation is None else self.evaluation.state(),
            "diverged": self.diverged,
            "unscored": self.unscored,
            "last_failure": None if last is None else [type(last).__name__, vars(last)],
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> "Incumbent":
        """The inverse of `state`."""
        params, evaluation, last = state["params"], state["evaluation"], state["last_failure"]
        return cls(
            None if params is None else np.array(params),
            None if evaluation is None else Evaluation.from_state(evaluation),
            state["diverged"],
            None if last is None else _FAILURES[last[0]](**last[1]),
            state.get("unscored", 0),
        )


def report(
    problem: Problem,
    context: RunContext,
    incumbent: Incumbent,
    readings: Mapping[str, float] = MappingProxyType({}),
    *,
    share: float = 0.0,
) -> None:
    """Report an iteration and the progress of the run; every method calls this before it checkpoints.

    So that methods can be compared at equal cost, every point of the learning curve holds the best `score` so far, if
    there is one, and its cost: `substeps` and of these the `forward_substeps`, `episodes`, `seconds` of wall time, and
    the number of `diverged` evaluations. All but the seconds are reproducible. After some iterations the best
    parameters are kept.

    Args:
        readings: further values of the method.
        share: the completed part of the work that the method's settings ask for, in [0, 1]; 0 if they set no end.
    """
    meter = problem.meter
    spent = {
        "substeps": float(meter.substeps),
        "forward_substeps": float(meter.forward),
        "episodes": float(meter.episodes),
        "seconds": meter.seconds,
    }
    best = {} if incumbent.score is None else {"score": incumbent.score}
    context.report(meter.iterations, **spent, **best, diverged=float(incumbent.diverged), **readings)
    if incumbent.params is not None and incumbent.score is not None and is_milestone(meter.iterations):
        context.milestone(meter.iterations, incumbent.score, incumbent.params)
    context.progress(min(1.0, max(share, meter.fraction(problem.spec.budget))), incumbent.score)


def is_milestone(iteration: int) -> bool:
    """Whether the best parameters are kept after this iteration: 1, 2, 4, 8, so that there are few however many."""
    return iteration > 0 and iteration & (iteration - 1) == 0


def resume(problem: Problem, context: RunContext) -> Incumbent:
    """The incumbent stored by `keep`, with meter and generator restored; an empty one in a new run."""
    if (stored := context.restore()) is None:
        return Incumbent()
    state = unpack(stored)
    problem.meter.restore(state["meter"])
    context.rng.bit_generator.state = state["rng"]
    return Incumbent.from_state(state["champion"])


def keep(problem: Problem, context: RunContext, incumbent: Incumbent, **state: Any) -> None:
    """Checkpoint the incumbent, meter and generator, and further `state` of the method as plain data."""
    meter, rng = problem.meter.state(), context.rng.bit_generator.state
    context.checkpoint(pack({"champion": incumbent.state(), "meter": meter, "rng": rng, **state}))


def pack(state: Mapping[str, Any]) -> bytes:
    """Tensors, numbers, text, and lists and dictionaries of them as bytes, bit for bit."""
    import torch

    buffer = io.BytesIO()
    torch.save(dict(state), buffer)
    return buffer.getvalue()


def unpack(data: bytes) -> dict[str, Any]:
    """The inverse of `pack`; refuses anything but plain data."""
    import torch

    state: dict[str, Any] = torch.load(io.BytesIO(data), weights_only=True)
    return state
