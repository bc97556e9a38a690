"""Results of an episode: the score with its metrics, and for studies the whole record."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.errors import Failure
from zoobench.sim.model.scene import Scene
from zoobench.tasks.base import Metric, Motion, Task


@dataclass(frozen=True)
class Evaluation:
    """Score and metrics of one episode with one parameter vector.

    Attributes:
        score: the task's score; -inf, for comparisons only, if the episode failed.
        metrics: the task's metrics by name, the score among them; empty if the episode failed.
        reward: `[frames]`; empty if the episode failed.
        failure: where the simulation diverged, why the design cannot be built, or which object did not stay where it
            was put; None if the episode has a score.
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


def evaluation_of(task: Task, motion: Motion, more: Mapping[str, Metric] = MappingProxyType({})) -> Evaluation:
    """Score, reward and metrics of the motion of one world that did not fail, and `more` metrics besides the task's."""
    import torch

    with torch.no_grad():
        score = float(task.score(motion))
        reward = task.reward(motion)[:, 0].numpy().copy()
        readings = task.metrics(motion)
    metrics = {name: Metric(float(value), unit) for name, (value, unit) in readings.items()}
    return Evaluation(score, {**metrics, **more, "score": Metric(score, task.unit)}, reward)


@dataclass(frozen=True)
class Record:
    """The record of an episode of one world.

    Attributes:
        motion: of the robot.
        actuation: muscle activity as applied `[frames, muscle_count]` [-].
        body: the robot at rest.
        scene: the body in its environment.
        offsets: how far its arena had moved after the robot at frame boundaries `[frames + 1, 3]` [m].
        wall_gaps: of the robot from the sides of the arena at the states of its motion `[frames + 1]` [cells].
    """

    motion: Motion
    actuation: Array
    body: Body
    scene: Scene
    offsets: Array
    wall_gaps: Array


@dataclass(frozen=True)
class Episode:
    """Result and record of one episode, for studies that need more than the score.

    Attributes:
        gradient: of the loss by the parameters `[parameter_count]`; all NaN if it was not computed.
        recorded: None if the design cannot be built.
    """

    evaluation: Evaluation
    gradient: Array
    recorded: Record | None

    @property
    def record(self) -> Record:
        """The record.

        Raises:
            ValueError: the design could not be built.
        """
        if self.recorded is None:
            raise ValueError(f"Nothing was simulated. {self.evaluation.failure}")
        return self.recorded
