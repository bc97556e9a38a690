"""Velocity tracking (SoftZoo's paper, A.3): heading and speed of a moving target."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, ObservedPart, Situation, target_at, targets_of
from zoobench.tasks.heading import heading, heading_error
from zoobench.tasks.path_task import PathTask
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor

# of success, both on average over the episode
_SPEED_TOLERANCE = 0.2  # relative to the target's speed
_HEADING_TOLERANCE = math.radians(15.0)


@register(Kind.TASK, "velocity-tracking", version=2, tags=("locomotion", "path", "error"), added=("target",))
@dataclass(frozen=True, kw_only=True)
class VelocityTracking(PathTask):
    """Match heading and speed of a target that moves along a path.

    The target's velocity u is the first derivative of a path of quintic polynomials. With the robot's heading h and the
    mean velocity s of its particles along h, the reward of a frame is

        -((1 - w) |s - |u|| + w (|u| - h . u))  [m/s].

    The first term is the error of the magnitude, the second that of the direction, |u| (1 - cos angle). Zero is
    perfect. The score is the mean over frames.

    A closed loop observes the target's velocity in body lengths per second: its components ahead and right of the
    robot's present heading.

    * `path`: straight, arc (to the left), s-curve or random.
    * `speed`: of the target, after a run-up of 0.4 s from rest [m/s].
    * `direction_weight`: w in [0, 1]; SoftZoo's paper weights direction more.
    * `path_seed`: of the random path.
    * `target`: a CSV file with the columns t [s], x and z [m] (ahead and to the right) instead of `path` and `speed`.
    """

    direction_weight: float = 0.9
    unit: ClassVar[str] = "m/s"
    needs_way: ClassVar[bool] = True
    observed_parts: ClassVar[Mapping[str, ObservedPart]] = {
        "target_velocity": ObservedPart("body lengths/s", "ahead, right"),
    }

    def __post_init__(self) -> None:
        if not 0.0 <= self.direction_weight <= 1.0:
            raise UsageError(f"A direction weight of {self.direction_weight:g} is out of range. Give 0 to 1.")
        super().__post_init__()

    def targets(self, motion: Motion) -> "Tensor":
        """Velocity of the target at every state `[frames + 1, 3]` [m/s]."""
        return targets_of(self.route, motion).velocity

    def observed(self, situation: Situation) -> Mapping[str, "Tensor"]:
        """Velocity of the target [body lengths/s], ahead and right."""
        velocity = target_at(self.route, situation.time).velocity
        return {"target_velocity": situation.components(velocity) / situation.length}

    def reward(self, motion: Motion) -> "Tensor":
        """The negated errors of speed and direction at the end of every frame `[frames, worlds]` [m/s]."""
        import torch

        target = self.targets(motion)[1:, None]
        speed = torch.linalg.vector_norm(target, dim=-1)
        ahead = heading(motion, first=1)
        magnitude = (_speed_along(motion, ahead) - speed).abs()
        direction = speed - (ahead * target).sum(dim=-1)
        penalty: Tensor = (1.0 - self.direction_weight) * magnitude + self.direction_weight * direction
        return -penalty

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """Errors of speed and heading, success, and the common readings.

        `success` is 1 if the mean speed along the heading is within 20 % of the target's and `heading_error` is at most
        15 degrees.
        """
        import torch

        target = self.targets(motion)[1:]
        wanted = torch.linalg.vector_norm(target, dim=-1)[:, None]
        speed = _speed_along(motion, heading(motion, first=1))
        angle = heading_error(motion, target)
        error = (speed.mean(dim=0) - wanted.mean()).abs()
        success = (error <= _SPEED_TOLERANCE * wanted.mean()) & (angle <= _HEADING_TOLERANCE)
        return {
            "speed_error": ((speed - wanted).abs().mean(dim=0), "m/s"),
            "heading_error": (angle, "rad"),
            "success": (success.to(angle.dtype), "1"),
            **common_readings(motion),
        }


def _speed_along(motion: Motion, ahead: "Tensor") -> "Tensor":
    """Mean velocity of the particles along the heading `[frames, worlds]` [m/s]."""
    return motion.mean_over_existing((motion.velocities[1:] * ahead[:, :, None]).sum(dim=-1))
