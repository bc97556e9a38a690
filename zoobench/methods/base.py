"""What a method is: it makes a problem's score large within its budget, and can be interrupted."""

import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.errors import Divergence, DivergenceError, Failure, Unbuildable
from zoobench.methods.archive import Archive


class RunContext(Protocol):
    """The world outside of the physics, as a method sees it."""

    rng: np.random.Generator

    def report(self, step: int, **metrics: float) -> None:
        """Put a point on the learning curve."""
        ...

    def checkpoint(self, data: bytes) -> None:
        """Replace the stored state; everything reported before becomes durable with it."""
        ...

    def restore(self) -> bytes | None:
        """The stored state, or None in a fresh run."""
        ...

    def should_stop(self) -> bool:
        """Whether somebody asks the method to return after this iteration."""
        ...

    def progress(self, fraction: float, score: float | None) -> None:
        """Say how far the run is, in [0, 1], and the best score so far."""
        ...


@dataclass(frozen=True)
class Solution:
    """What a method found.

    Attributes:
        params: the best parameters `[parameter_count]`.
        evaluation: the episode in which they were measured.
        facts: counts and readings of the method itself, such as gradients clipped.
        archive: what was found beside the best, of a method that looks for that; kept with the run.
    """

    params: Array
    evaluation: Evaluation
    facts: Mapping[str, float] = field(default_factory=dict)
    archive: Archive | None = None


class Method(Protocol):
    """An optimiser.

    One that asks for gradients is registered with the tag `gradient`: cells that have none are skipped with the reason.
    """

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Spend the problem's budget and return the best found; goes on from `context.restore()` if there is
        one.

        Raises:
            DivergenceError: every evaluation diverged.
            BudgetExhaustedError: the budget does not hold the first iteration.
        """
        ...


_FAILURES: dict[str, type[Failure]] = {kind.__name__: kind for kind in (Divergence, Unbuildable)}


@dataclass
class Champion:
    """The best evaluation so far; one that failed, or whose score is no number, never wins."""

    params: Array | None = None
    evaluation: Evaluation | None = None
    diverged: int = 0
    last_failure: Failure | None = None

    @property
    def score(self) -> float | None:
        """Its score, None while every evaluation diverged."""
        return None if self.evaluation is None else self.evaluation.score

    def offer(self, params: Array, evaluation: Evaluation) -> None:
        """Take it if it is better; the earlier one wins a tie."""
        if evaluation.failure is not None:
            self.diverged += 1
            self.last_failure = evaluation.failure
        elif np.isfinite(evaluation.score) and (self.score is None or evaluation.score > self.score):
            self.params, self.evaluation = params.copy(), evaluation

    def solution(self, **facts: float) -> Solution:
        """The end of a run.

        Raises:
            DivergenceError: every evaluation diverged.
        """
        if self.params is None or self.evaluation is None:
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
            "last_failure": None if last is None else [type(last).__name__, vars(last)],
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> "Champion":
        """The inverse of `state`."""
        params, evaluation, last = state["params"], state["evaluation"], state["last_failure"]
        return cls(
            None if params is None else np.array(params),
            None if evaluation is None else Evaluation.from_state(evaluation),
            state["diverged"],
            None if last is None else _FAILURES[last[0]](**last[1]),
        )


def report(
    problem: Problem,
    context: RunContext,
    champion: Champion,
    readings: Mapping[str, float] = MappingProxyType({}),
    *,
    share: float = 0.0,
) -> None:
    """Put an iteration on the learning curve and say how far the run is; every method does so before it checkpoints.

    So that all methods can be compared by whatever is spent, a point holds the best `score` so far, if there is one,
    with what it took: `substeps` and of these the `forward_substeps`, `episodes`, `seconds` of wall time, and how many
    evaluations `diverged`. All but the seconds are the same in every run of a spec.

    Args:
        readings: what else the method has to say of the iteration.
        share: how much is done of what the method's own settings ask for, in [0, 1]; 0 if these ask for no end.
    """
    meter = problem.meter
    spent = {
        "substeps": float(meter.substeps),
        "forward_substeps": float(meter.forward),
        "episodes": float(meter.episodes),
        "seconds": meter.seconds,
    }
    best = {} if champion.score is None else {"score": champion.score}
    context.report(meter.iterations, **spent, **best, diverged=float(champion.diverged), **readings)
    context.progress(min(1.0, max(share, meter.fraction(problem.spec.budget))), champion.score)


def resume(problem: Problem, context: RunContext) -> Champion:
    """Where `keep` left off: the champion, with meter and generator put back; a new one in a fresh run."""
    if (stored := context.restore()) is None:
        return Champion()
    state = unpack(stored)
    problem.meter.restore(state["meter"])
    context.rng.bit_generator.state = state["rng"]
    return Champion.from_state(state["champion"])


def keep(problem: Problem, context: RunContext, champion: Champion) -> None:
    """Checkpoint a method that carries no more than its champion from one iteration to the next."""
    meter, rng = problem.meter.state(), context.rng.bit_generator.state
    context.checkpoint(pack({"champion": champion.state(), "meter": meter, "rng": rng}))


def pack(state: Mapping[str, Any]) -> bytes:
    """Tensors, numbers, text, lists and dicts of them as bytes, exact to the last bit."""
    import torch

    buffer = io.BytesIO()
    torch.save(dict(state), buffer)
    return buffer.getvalue()


def unpack(data: bytes) -> dict[str, Any]:
    """The inverse of `pack`; refuses anything that is no plain data."""
    import torch

    state: dict[str, Any] = torch.load(io.BytesIO(data), weights_only=True)
    return state
