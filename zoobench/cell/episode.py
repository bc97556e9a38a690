"""Results of an episode: the score with its metrics, and for studies the whole record."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import Failure
from zoobench.tasks.base import Metric, Motion


@dataclass(frozen=True)
class Evaluation:
    """Score and metrics of one episode with one parameter vector.

    Attributes:
        score: the task's score; -inf, for comparisons only, if the episode failed.
        metrics: the task's metrics by name, the score among them; empty if the episode failed.
        reward: `[frames]`; empty if the episode failed.
        failure: where the simulation diverged or why the design cannot be built; None if the episode has a score.
    """

    score: float
    metrics: dict[str, Metric]
    reward: Array
    failure: Failure | None = None

    def state(self) -> dict[str, Any]:
        """Plain data for a method's checkpoint; only of an episode without failure."""
        metrics = {name: [metric.value, metric.unit] for name, metric in self.metrics.items()}
        return {"score": self.score, "metrics": metrics, "reward": self.reward.tolist()}

    @classmethod
    def from_state(cls, state: dict[str, Any]) -> "Evaluation":
        """The inverse of `state`."""
        metrics = {name: Metric(value, unit) for name, (value, unit) in state["metrics"].items()}
        return cls(state["score"], metrics, np.array(state["reward"]))


@dataclass(frozen=True)
class Episode:
    """The full record of one episode, for studies that need more than the score.

    Attributes:
        gradient: of the loss by the parameters `[parameter_count]`; all NaN if it was not computed.
        record: the robot's motion, one world; None if the design cannot be built.
        actuation: muscle activity as applied `[frames, muscle_count]` [-]; empty if nothing was simulated.
        body: the robot's arrays as simulated, by the simulator's names, one world; empty if nothing was simulated.
    """

    evaluation: Evaluation
    gradient: Array
    record: Motion | None
    actuation: Array = field(default_factory=lambda: np.zeros((0, 0)))
    body: Mapping[str, Array] = field(default_factory=dict)

    @property
    def motion(self) -> Motion:
        """The robot's motion.

        Raises:
            ValueError: the design could not be built.
        """
        if self.record is None:
            raise ValueError(f"The episode has no motion. {self.evaluation.failure}")
        return self.record
