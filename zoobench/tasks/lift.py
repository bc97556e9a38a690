"""Lift: raise an object and hold it (Lifter of EvoGym, Bhatia et al. 2021)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.spec import Scalar
from zoobench.tasks.base import Motion
from zoobench.tasks.object_readings import object_way
from zoobench.tasks.object_task import ObjectTask

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "lift", version=2, tags=("object",))
@dataclass(frozen=True, kw_only=True)
class Lift(ObjectTask):
    """Raise an object, and hold it up.

    The reward of a frame is how far the object's centre of mass is above its start [m], below it negative. The score is
    the mean over the frames, so that what is thrown up and falls down again counts little.

    A closed loop observes the object's place, velocity and axes, relative to the robot.
    """

    unit: ClassVar[str] = "m"
    usual_settings: ClassVar[Mapping[str, Scalar]] = {"object": "ball", "object_size": 0.05, "object_place": "below"}

    def reward(self, motion: Motion) -> "Tensor":
        """Rise of the object's centre since the start, at the end of every frame `[frames, worlds]` [m]."""
        return object_way(motion)[..., 1]

    def score(self, motion: Motion) -> "Tensor":
        """The mean reward `[worlds]` [m]."""
        return self.reward(motion).mean(dim=0)
