"""Carry: take an object along without letting it fall (Carrier of EvoGym, Bhatia et al. 2021)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.spec import Scalar
from zoobench.tasks.base import Motion
from zoobench.tasks.object_readings import object_way
from zoobench.tasks.object_task import ObjectTask, along
from zoobench.tasks.task_place import TaskPlace

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "carry", version=3, tags=("object",))
@dataclass(frozen=True, kw_only=True)
class Carry(ObjectTask):
    """Take an object on the robot's back as far as possible in one direction, without letting it fall.

    The score is the way of the object's centre of mass in the direction until the end, less `drop_penalty` times its
    largest fall [m]: what slides off the back as the episode ends was not carried. A fall counts from `allowed_fall`
    below the start on, as a soft back sinks under its load. The reward of a frame is the same with the present fall. A
    robot at rest scores zero.

    A closed loop observes the object's place, velocity and axes, relative to the robot.

    * `heading`: the direction [degrees], counter-clockwise seen from above, relative to the robot's heading at rest.
    * `drop_penalty`: metres of way that a metre of height is worth [-].
    * `allowed_fall`: by how much the object may sink [m].
    """

    heading: float = 0.0
    drop_penalty: float = 10.0
    allowed_fall: float = 0.005
    unit: ClassVar[str] = "m"
    needs_way: ClassVar[bool] = True
    usual_settings: ClassVar[Mapping[str, Scalar]] = {"object": "sheet", "object_size": 0.16, "object_place": "back"}

    def __post_init__(self) -> None:
        if not self.drop_penalty >= 0.0:
            raise UsageError(f"A drop_penalty of {self.drop_penalty:g} is not possible. Give 0 or more.")
        if not 0.0 <= self.allowed_fall < math.inf:
            raise UsageError(f"An allowed_fall of {self.allowed_fall:g} m is not possible. Give 0 or more.")

    def fault(self, where: TaskPlace) -> str:
        """What stands on the ground beside a robot is not on it."""
        if where.object_place in ("back", "below") or where.is_raised or where.is_deep or where.is_moved:
            return ""
        return (
            f"The object is {where.object_place} on the ground, and 'carry' takes along what is on the robot. Put it "
            "on its back, as in 'ground[object=sheet,object_size=0.16,object_place=back]', or choose 'push'."
        )

    def reward(self, motion: Motion) -> "Tensor":
        """Way of the object less the penalty for its present fall `[frames, worlds]` [m]."""
        return along(object_way(motion), self.heading) - self._penalty(_fall(motion))

    def score(self, motion: Motion) -> "Tensor":
        """Way of the object until the end less the penalty for its largest fall `[worlds]` [m]."""
        return along(object_way(motion)[-1], self.heading) - self._penalty(_fall(motion).amax(dim=0))

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """The largest fall of the object, its readings, and the common readings of the robot."""
        return {"object_fall": (_fall(motion).amax(dim=0), "m"), **super().metrics(motion)}

    def _penalty(self, fall: "Tensor") -> "Tensor":
        """Of a fall [m]."""
        return self.drop_penalty * (fall - self.allowed_fall).clamp(min=0.0)


def _fall(motion: Motion) -> "Tensor":
    """How far the object is below its start at the end of every frame `[frames, worlds]` [m]."""
    return (-object_way(motion)[..., 1]).clamp(min=0.0)
