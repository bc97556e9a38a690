"""Reach: bring the head, of an arm its tip, to a place (Reaching of SoMoGym, Graule et al. 2022)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, ObservedPart, Situation, Task, constant
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "reach", tags=("final",))
@dataclass(frozen=True, kw_only=True)
class Reach(Task):
    """Bring the head to a place in space by the end of the episode; the head of an arm is its tip.

    The reward of a frame is by how much the distance from the head's centre to the place has fallen since the start
    [m]; the score is that of the last frame. At the place it is the distance at the start; a robot at rest scores zero.

    A closed loop observes the way from the robot's centre of mass to the place.

    * `x`, `y`, `z`: the place, from the head's centre at the start [m]; x is ahead of the robot at rest, y up, z right.
    """

    x: float = 0.04
    y: float = 0.02
    z: float = 0.0
    unit: ClassVar[str] = "m"
    observed_parts: ClassVar[Mapping[str, ObservedPart]] = {
        "target_position": ObservedPart("body lengths", "from the centre of mass, were it the head: ahead, right, up"),
    }

    def __post_init__(self) -> None:
        if not (self.x or self.y or self.z):
            raise UsageError("The head begins at x, y and z = 0, and cannot be brought there. Give one another value.")

    def observed(self, situation: Situation) -> Mapping[str, "Tensor"]:
        """The place, from the centre of mass as it moves [body lengths], ahead, right and up."""
        import torch

        away = situation.start + constant((self.x, self.y, self.z), situation.start.dtype) - situation.centre
        seen = torch.cat([situation.components(away), away[1:2]])
        return {"target_position": seen / situation.length}

    def reward(self, motion: Motion) -> "Tensor":
        """Fall of the head's distance from the place until the end of every frame `[frames, worlds]` [m]."""
        import torch

        weights = motion.masses * motion.head
        share = (weights / weights.sum(dim=1, keepdim=True))[None, :, :, None]
        head = (motion.positions * share).sum(dim=2)
        place = constant((self.x, self.y, self.z), head.dtype)
        left = torch.linalg.vector_norm(place - (head[1:] - head[0]), dim=-1)
        fall: Tensor = torch.linalg.vector_norm(place) - left
        return fall

    def score(self, motion: Motion) -> "Tensor":
        """The reward of the last frame `[worlds]` [m]."""
        return self.reward(motion)[-1]

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """Distance from the place at the end, and the common readings."""
        import torch

        place = constant((self.x, self.y, self.z), motion.positions.dtype)
        return {
            "target_distance": (torch.linalg.vector_norm(place) - self.score(motion), "m"),
            **common_readings(motion),
        }
