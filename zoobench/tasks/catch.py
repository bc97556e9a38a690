"""Catch: keep an object that comes flying off the ground (Catcher of EvoGym, Bhatia et al. 2021)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.spec import Scalar
from zoobench.tasks.base import Motion
from zoobench.tasks.object_readings import object_way
from zoobench.tasks.object_task import ObjectTask
from zoobench.tasks.readings import late_mean
from zoobench.tasks.task_place import TaskPlace

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "catch", version=2, tags=("object",))
@dataclass(frozen=True, kw_only=True)
class Catch(ObjectTask):
    """Catch an object that is thrown, as by `ground[object=ball,object_speed=0.5,object_speed_up=1]`, and hold it up.

    The reward of a frame is how far the object's centre of mass is above its start on the ground [m]. The score is the
    mean over the last quarter of the episode, when it has long fallen down again: a robot at rest scores zero, unless
    the object stays on its back, or the episode is so short that it still flies then.

    A closed loop observes the object's place, velocity and axes, relative to the robot.
    """

    unit: ClassVar[str] = "m"
    usual_settings: ClassVar[Mapping[str, Scalar]] = {
        "object": "ball",
        "object_gap": 0.15,
        "object_speed": 0.6,
        "object_speed_up": 1.2,
    }

    def fault(self, where: TaskPlace) -> str:
        """What lies still is not caught."""
        if where.is_thrown:
            return ""
        return (
            "Nothing is thrown that could be caught. Give the object a velocity, as in "
            "'ground[object=ball,object_gap=0.15,object_speed=0.6,object_speed_up=1.2]', or choose 'lift'."
        )

    def reward(self, motion: Motion) -> "Tensor":
        """Rise of the object's centre since the start, at the end of every frame `[frames, worlds]` [m]."""
        return object_way(motion)[..., 1]

    def score(self, motion: Motion) -> "Tensor":
        """The mean reward of the last quarter `[worlds]` [m]."""
        return late_mean(self.reward(motion))
