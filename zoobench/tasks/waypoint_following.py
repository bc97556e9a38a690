"""Waypoint following (SoftZoo's paper, A.4): the position of a moving target."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, ObservedPart, Situation, target_at, targets_of
from zoobench.tasks.heading import heading_error
from zoobench.tasks.path_task import PathTask
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "waypoint-following", tags=("locomotion", "path", "error"), added=("target",))
@dataclass(frozen=True, kw_only=True)
class WaypointFollowing(PathTask):
    """Follow a target that moves along a path.

    The path of quintic polynomials begins at the robot's centre of mass. The reward of a frame is the negated
    horizontal distance from the centre of mass to the target [m]; the vertical distance does not count, since hills and
    waves lift a robot. The score is the mean over frames; zero is perfect.

    A closed loop observes the target's position relative to the centre of mass, in body lengths, and its velocity, in
    body lengths per second: components ahead and right of the robot's present heading.

    * `path`: straight, arc (to the left), s-curve or random.
    * `speed`: of the target, after a run-up of 0.4 s from rest [m/s].
    * `tolerance`: largest distance at which an episode is a success [m].
    * `path_seed`: of the random path.
    * `target`: a CSV file with the columns t [s], x and z [m] (ahead and to the right) instead of `path` and `speed`.
    """

    tolerance: float = 0.02
    unit: ClassVar[str] = "m"
    needs_way: ClassVar[bool] = True
    observed_parts: ClassVar[Mapping[str, ObservedPart]] = {
        "target_position": ObservedPart("body lengths", "from the centre of mass: ahead, right"),
        "target_velocity": ObservedPart("body lengths/s", "ahead, right"),
    }

    def __post_init__(self) -> None:
        if not self.tolerance > 0.0:
            raise UsageError(f"A tolerance of {self.tolerance:g} m cannot be met. Give a positive tolerance.")
        super().__post_init__()

    def targets(self, motion: Motion) -> "Tensor":
        """The waypoint at every state `[frames + 1, worlds, 3]` [m]."""
        return motion.centre_of_mass()[0] + targets_of(self.route, motion).position[:, None]

    def observed(self, situation: Situation) -> Mapping[str, "Tensor"]:
        """Position relative to the centre of mass [body lengths] and velocity [body lengths/s], ahead and right."""
        target = target_at(self.route, situation.time)
        away = situation.start + target.position - situation.centre
        return {
            "target_position": situation.components(away) / situation.length,
            "target_velocity": situation.components(target.velocity) / situation.length,
        }

    def reward(self, motion: Motion) -> "Tensor":
        """The negated horizontal distance to the waypoint at the end of every frame `[frames, worlds]` [m]."""
        import torch

        error = (motion.centre_of_mass() - self.targets(motion))[1:, :, ::2].contiguous()
        distance: Tensor = torch.linalg.vector_norm(error, dim=-1)
        return -distance

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """Errors of position and heading, success, and the common readings.

        `rms_error` is the root mean square of the distances over time, `heading_error` the angle to the path's
        direction. `success` is 1 if no distance exceeds the tolerance.
        """
        import torch

        distances = -self.reward(motion)
        directions = targets_of(self.route, motion).velocity[1:]
        return {
            # the norm's root is exact; torch's own comes from a library that rounds by the processor's make
            "rms_error": (torch.linalg.vector_norm(distances, dim=0) / math.sqrt(len(distances)), "m"),
            "final_error": (distances[-1], "m"),
            "heading_error": (heading_error(motion, directions), "rad"),
            "success": ((distances.amax(dim=0) <= self.tolerance).to(distances.dtype), "1"),
            **common_readings(motion),
        }
