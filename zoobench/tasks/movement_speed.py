"""Movement speed (specification A.1): as fast as possible along one direction."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, Task
from zoobench.tasks.heading import heading_error
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "movement-speed", tags=("locomotion",))
@dataclass(frozen=True, kw_only=True)
class MovementSpeed(Task):
    """Move as fast as possible along one direction.

    The score is the velocity of the particles, averaged by occupancy, projected on the target direction and averaged
    over the frames [m/s].

    * `heading`: the target direction [degrees], counter-clockwise seen from above, relative to the robot's heading at
      rest.
    """

    heading: float = 0.0
    unit: ClassVar[str] = "m/s"

    def reward(self, motion: Motion) -> "Tensor":
        """Mean particle velocity along the target at the end of every frame `[frames, worlds]` [m/s]."""
        return (motion.mean_over_existing(motion.velocities[1:]) * self._target(motion)).sum(dim=-1)

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """The heading's deviation from the target direction, and the common readings."""
        return {"heading_error": (heading_error(motion, self._target(motion)), "rad"), **common_readings(motion)}

    def _target(self, motion: Motion) -> "Tensor":
        angle = math.radians(self.heading)
        return motion.velocities.new_tensor([math.cos(angle), 0.0, -math.sin(angle)])
