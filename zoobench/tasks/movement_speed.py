"""Movement speed (SoftZoo's paper, A.1): as fast as possible along one direction."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, ObservedPart, Situation, Task
from zoobench.tasks.heading import direction, heading_error
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "movement-speed", tags=("locomotion",))
@dataclass(frozen=True, kw_only=True)
class MovementSpeed(Task):
    """Move as fast as possible along one direction.

    The score is the velocity of the particles, averaged by occupancy, projected on the target direction and averaged
    over the frames [m/s].

    A closed loop observes the target direction: its components ahead and right of the robot's present heading.

    * `heading`: the target direction [degrees], counter-clockwise seen from above, relative to the robot's heading at
      rest.
    """

    heading: float = 0.0
    unit: ClassVar[str] = "m/s"
    needs_way: ClassVar[bool] = True
    observed_parts: ClassVar[Mapping[str, ObservedPart]] = {
        "target_direction": ObservedPart("-", "unit vector: ahead, right"),
    }

    def observed(self, situation: Situation) -> Mapping[str, "Tensor"]:
        """The target direction, ahead and right."""
        return {"target_direction": situation.components(self._target(situation.centre))}

    def reward(self, motion: Motion) -> "Tensor":
        """Mean particle velocity along the target at the end of every frame `[frames, worlds]` [m/s]."""
        ahead = self._target(motion.velocities)
        return (motion.mean_over_existing(motion.velocities[1:]) * ahead).sum(dim=-1)

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """The heading's deviation from the target direction, and the common readings."""
        return {
            "heading_error": (heading_error(motion, self._target(motion.velocities)), "rad"),
            **common_readings(motion),
        }

    def _target(self, like: "Tensor") -> "Tensor":
        """The unit vector `[3]`, in the precision of another tensor."""
        return direction(self.heading, like.dtype)
