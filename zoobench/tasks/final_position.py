"""Final position: to be at a place in the end, however the robot gets there."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, ObservedPart, Situation, Task, constant
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "final-position", tags=("locomotion", "final", "error"))
@dataclass(frozen=True, kw_only=True)
class FinalPosition(Task):
    """Be at a place when the episode ends.

    The score is the negated horizontal distance from the centre of mass to the place at the end of the last frame [m];
    zero is perfect. The reward of a frame is the same distance at its end, so that methods that learn from rewards are
    shown the way; it is not the mean reward that counts, but the last.

    A closed loop observes the place relative to the centre of mass, ahead and right.

    * `x`, `z`: the place, from the centre of mass at the start [m]; x is ahead at rest, z to the right.
    """

    x: float = 0.1
    z: float = 0.0
    unit: ClassVar[str] = "m"
    needs_way: ClassVar[bool] = True
    observed_parts: ClassVar[Mapping[str, ObservedPart]] = {
        "target_position": ObservedPart("body lengths", "from the centre of mass: ahead, right"),
    }

    def observed(self, situation: Situation) -> Mapping[str, "Tensor"]:
        """The place relative to the centre of mass [body lengths], ahead and right."""
        away = situation.start + constant((self.x, 0.0, self.z), situation.start.dtype) - situation.centre
        return {"target_position": situation.components(away) / situation.length}

    def reward(self, motion: Motion) -> "Tensor":
        """The negated horizontal distance to the place at the end of every frame `[frames, worlds]` [m]."""
        import torch

        centre = motion.centre_of_mass()
        error = (centre[1:] - centre[0] - constant((self.x, 0.0, self.z), centre.dtype))[..., [0, 2]]
        distance: Tensor = torch.linalg.vector_norm(error, dim=-1)
        return -distance

    def score(self, motion: Motion) -> "Tensor":
        """The reward of the last frame `[worlds]` [m]."""
        return self.reward(motion)[-1]

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """The nearest approach to the place, and the common readings."""
        return {"nearest_distance": (-self.reward(motion).amax(dim=0), "m"), **common_readings(motion)}
