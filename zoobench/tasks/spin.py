"""Spin: turn an object about the vertical (in-hand manipulation and pen spinner of SoMoGym, Graule et al. 2022)."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion
from zoobench.tasks.object_readings import object_turn
from zoobench.tasks.object_task import ObjectTask

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "spin", version=2, tags=("object", "final"))
@dataclass(frozen=True, kw_only=True)
class Spin(ObjectTask):
    """Turn an object about the vertical, counter-clockwise seen from above.

    The reward of a frame is by how much the object has turned since the start [rad]; turns add up, and back turns are
    taken off. The score is that of the last frame. A robot at rest scores zero.

    A closed loop observes the object's place, velocity and axes, relative to the robot.
    """

    unit: ClassVar[str] = "rad"

    def reward(self, motion: Motion) -> "Tensor":
        """Turn of the object since the start, at the end of every frame `[frames, worlds]` [rad]."""
        return object_turn(motion)
