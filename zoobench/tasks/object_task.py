"""The base of tasks with an object: what they observe and report."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from zoobench.spec import Scalar
from zoobench.tasks.base import Motion, ObservedPart, Situation, Task
from zoobench.tasks.heading import direction
from zoobench.tasks.object_readings import OBJECT_PARTS, object_readings, object_seen

if TYPE_CHECKING:
    from torch import Tensor


class ObjectTask(Task):
    """A task with the first object of the environment, whose score is the reward of the last frame."""

    needs_object: ClassVar[bool] = True
    usual_settings: ClassVar[Mapping[str, Scalar]] = {"object": "box"}
    observed_parts: ClassVar[Mapping[str, ObservedPart]] = OBJECT_PARTS

    def observed(self, situation: Situation) -> Mapping[str, "Tensor"]:
        """Place, velocity and axes of the object, see `OBJECT_PARTS`."""
        return object_seen(situation)

    def score(self, motion: Motion) -> "Tensor":
        """The reward of the last frame `[worlds]`."""
        return self.reward(motion)[-1]

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """Readings of the object, and the common readings of the robot."""
        return object_readings(motion)


def along(way: "Tensor", heading: float) -> "Tensor":
    """The component of horizontal ways `[..., 3]` in a direction `[...]`.

    Args:
        heading: counter-clockwise seen from above, 0 ahead of the robot at rest [degrees].
    """
    component: Tensor = (way * direction(heading, way.dtype)).sum(dim=-1)
    return component
