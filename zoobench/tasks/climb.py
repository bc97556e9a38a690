"""Climb: gain height and keep it (Climber of EvoGym, Bhatia et al. 2021)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.spec import Scalar
from zoobench.tasks.base import Motion, Task
from zoobench.tasks.readings import common_readings, late_mean
from zoobench.tasks.task_place import TaskPlace

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "climb", tags=("locomotion", "final"))
@dataclass(frozen=True, kw_only=True)
class Climb(Task):
    """Gain height: on a slope, on steps, or in a shaft between two walls.

    The reward of a frame is how far the centre of mass is above its start [m]. The score is the mean over the last
    quarter of the episode, so that a jump at its end does not count for a climb.
    """

    unit: ClassVar[str] = "m"
    needs_way: ClassVar[bool] = True
    usual_settings: ClassVar[Mapping[str, Scalar]] = {"slope": 10.0}

    def fault(self, where: TaskPlace) -> str:
        """Level ground with nothing on it has nothing to climb."""
        if not where.is_flat:
            return ""
        return (
            "Nothing is there to climb on level ground. Give a slope, steps, hills or an obstacle, as in "
            "'ground[slope=10]' or 'ground[obstacle=shaft,obstacle_distance=0]'."
        )

    def reward(self, motion: Motion) -> "Tensor":
        """Height gained until the end of every frame `[frames, worlds]` [m]."""
        height = motion.centre_of_mass()[..., 1]
        return height[1:] - height[0]

    def score(self, motion: Motion) -> "Tensor":
        """The mean reward of the last quarter `[worlds]` [m]."""
        return late_mean(self.reward(motion))

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """The greatest height gained, and the common readings."""
        return {"greatest_height": (self.reward(motion).amax(dim=0), "m"), **common_readings(motion)}
