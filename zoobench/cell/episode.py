"""What an evaluation gives back: the score with its readings, and for a study the whole episode."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import Failure
from zoobench.tasks.base import Metric, Motion


@dataclass(frozen=True)
class Evaluation:
    """What one episode with one set of parameters gave.

    Attributes:
        score: the task's score; -inf if there is none, which is for comparing only.
        metrics: the task's readings by name, the score with its unit among them; none then.
        reward: `[frames]`; empty then.
        failure: where the simulation blew up or why the design cannot be built, or None.
    """

    score: float
    metrics: dict[str, Metric]
    reward: Array
    failure: Failure | None = None

    def state(self) -> dict[str, Any]:
        """Plain data for a method's checkpoint; only for an episode that has a score."""
        metrics = {name: [metric.value, metric.unit] for name, metric in self.metrics.items()}
        return {"score": self.score, "metrics": metrics, "reward": self.reward.tolist()}

    @classmethod
    def from_state(cls, state: dict[str, Any]) -> "Evaluation":
        """The inverse of `state`."""
        metrics = {name: Metric(value, unit) for name, (value, unit) in state["metrics"].items()}
        return cls(state["score"], metrics, np.array(state["reward"]))


@dataclass(frozen=True)
class Episode:
    """One episode in full, for a study that looks at more than the score.

    Attributes:
        gradient: gradient `[parameter_count]` of the loss; all NaN without one.
        record: how the robot moved, one world; None of a design that cannot be built.
        actuation: activity of every muscle as it was applied `[frames, muscle_count]` [-]; empty then.
        body: the robot's arrays as they were simulated, by the simulator's names, one world; none then.
    """

    evaluation: Evaluation
    gradient: Array
    record: Motion | None
    actuation: Array = field(default_factory=lambda: np.zeros((0, 0)))
    body: Mapping[str, Array] = field(default_factory=dict)

    @property
    def motion(self) -> Motion:
        """How the robot moved.

        Raises:
            ValueError: the design could not be built, so that nothing moved.
        """
        if self.record is None:
            raise ValueError(f"Nothing moved. {self.evaluation.failure}")
        return self.record
