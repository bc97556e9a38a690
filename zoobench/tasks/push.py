"""Push: move an object (Pusher of EvoGym, Bhatia et al. 2021, in three dimensions)."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion
from zoobench.tasks.object_readings import object_way
from zoobench.tasks.object_task import ObjectTask, along

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "push", version=2, tags=("object", "final"))
@dataclass(frozen=True, kw_only=True)
class Push(ObjectTask):
    """Move an object as far as possible in one direction; with the object behind, drag it.

    The reward of a frame is how far the object's centre of mass has come since the start [m], and the score is that of
    the last frame. A robot at rest scores zero, unless the object moves by itself.

    A closed loop observes the object's place, velocity and axes, relative to the robot.

    * `heading`: the direction [degrees], counter-clockwise seen from above, relative to the robot's heading at rest.
    """

    heading: float = 0.0
    unit: ClassVar[str] = "m"

    def reward(self, motion: Motion) -> "Tensor":
        """Way of the object in the direction until the end of every frame `[frames, worlds]` [m]."""
        return along(object_way(motion), self.heading)
