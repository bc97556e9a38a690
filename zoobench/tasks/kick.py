"""Kick: send an object away from the robot (Kick of DittoGym, Huang et al. 2024; Thrower of EvoGym)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.spec import Scalar
from zoobench.tasks.base import Motion
from zoobench.tasks.object_readings import object_way, robot_way
from zoobench.tasks.object_task import ObjectTask, along

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "kick", version=2, tags=("object", "final"))
@dataclass(frozen=True, kw_only=True)
class Kick(ObjectTask):
    """Send an object away, as far from the robot as possible; with the object on the robot's back, throw it.

    The reward of a frame is how far the object's centre of mass has come in the direction since the start, less the way
    of the robot's in any horizontal direction [m]: what is pushed or carried along does not count, and neither does a
    robot that withdraws. The score is the reward of the last frame.

    A closed loop observes the object's place, velocity and axes, relative to the robot.

    * `heading`: the direction [degrees], counter-clockwise seen from above, relative to the robot's heading at rest.
    """

    heading: float = 0.0
    unit: ClassVar[str] = "m"
    usual_settings: ClassVar[Mapping[str, Scalar]] = {"object": "ball", "object_gap": 0.0}

    def reward(self, motion: Motion) -> "Tensor":
        """Way of the object less that of the robot, until the end of every frame `[frames, worlds]` [m]."""
        import torch

        own = robot_way(motion)[..., [0, 2]]
        way: Tensor = torch.sqrt(own.square().sum(dim=-1) + _SMALL**2) - _SMALL
        return along(object_way(motion), self.heading) - way


_SMALL = 1e-6
"""[m] With which the length of a way has a derivative where it is 0."""
