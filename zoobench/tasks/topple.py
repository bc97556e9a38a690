"""Topple: upset an object (BeamToppler of EvoGym, Bhatia et al. 2021)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.spec import Scalar
from zoobench.tasks.base import Motion
from zoobench.tasks.object_readings import object_tilt
from zoobench.tasks.object_task import ObjectTask

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "topple", version=2, tags=("object", "final"))
@dataclass(frozen=True, kw_only=True)
class Topple(ObjectTask):
    """Upset an object, best a `column`.

    The reward of a frame is by how much the object's upright axis has tilted from the vertical since the start, in any
    direction [rad]: a quarter turn is 1.57. The score is that of the last frame, so that an object that only sways
    does not count. A robot at rest scores zero, unless the object moves by itself.

    A closed loop observes the object's place, velocity and axes, relative to the robot.
    """

    unit: ClassVar[str] = "rad"
    usual_settings: ClassVar[Mapping[str, Scalar]] = {"object": "column", "object_size": 0.16, "object_gap": 0.0}

    def reward(self, motion: Motion) -> "Tensor":
        """Tilt of the object since the start, at the end of every frame `[frames, worlds]` [rad]."""
        tilt = object_tilt(motion)
        return tilt[1:] - tilt[0]
