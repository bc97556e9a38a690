"""Jumping: to leave the ground, as high as possible, on the spot."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, Task
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor

_DRIFT = 0.5  # of a metre of height for a metre away from the start
_SOLID = 0.5  # occupancy above which matter is solid
_EMPTY = 1e-12  # least occupancy of which a logarithm is taken
_SOFTNESS = 2e-3  # of the minimum over particles and of the maximum over frames [m]


@register(Kind.TASK, "jump", tags=("acrobatics",))
@dataclass(frozen=True, kw_only=True)
class Jump(Task):
    """Jump as high as possible on the spot.

    The reward of a frame is the height of the body's lowest particle above the lowest one at the start, less half of
    the horizontal distance of the centre of mass from its start [m]. The score is the highest reward of an episode. All
    of a body must leave the ground: one that rears up or stretches lifts its centre of mass, and scores nothing. On a
    slope steeper than 26 degrees one that walks up scores, too.

    Gradient methods maximise a smooth substitute: the minimum over the particles is -h log(sum(exp(-y / h))), the
    maximum over the frames h log(mean(exp(reward / h))), with h = 2 mm.
    """

    unit: ClassVar[str] = "m"
    needs_way: ClassVar[bool] = True

    def reward(self, motion: Motion) -> "Tensor":
        """Height of the lowest particle less half of the way from the start `[frames, worlds]` [m]."""
        return _clearance(motion) - _DRIFT * _drift(motion)

    def score(self, motion: Motion) -> "Tensor":
        """The highest reward `[worlds]` [m]."""
        return self.reward(motion).amax(dim=0)

    def objective(self, motion: Motion) -> "Tensor":
        """The smooth substitute `[worlds]` [m]."""
        import torch

        heights = motion.positions[..., 1]
        lowest = -_SOFTNESS * torch.logsumexp(motion.existing.clamp(min=_EMPTY).log() - heights / _SOFTNESS, dim=2)
        rewards = lowest[1:] - lowest[0] - _DRIFT * _drift(motion)
        # a mean, so that a body that stays where it is has 0 and not the logarithm of the number of frames
        highest: Tensor = torch.logsumexp(rewards / _SOFTNESS, dim=0) - math.log(len(rewards))
        return _SOFTNESS * highest

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """The greatest heights of lowest particle and centre of mass above the start, and the common readings."""
        height = motion.centre_of_mass()[..., 1]
        return {
            "clearance": (_clearance(motion).amax(dim=0), "m"),
            "centre_rise": ((height[1:] - height[0]).amax(dim=0), "m"),
            **common_readings(motion),
        }


def _clearance(motion: Motion) -> "Tensor":
    """Height of the lowest particle above the lowest one at the start `[frames, worlds]` [m]."""
    import torch

    lowest = torch.where(motion.existing > _SOLID, motion.positions[..., 1], torch.inf).amin(dim=2)
    return lowest[1:] - lowest[0]


def _drift(motion: Motion) -> "Tensor":
    """Horizontal distance of the centre of mass from its start `[frames, worlds]` [m]."""
    import torch

    centre = motion.centre_of_mass()[..., [0, 2]]
    away: Tensor = torch.linalg.vector_norm(centre[1:] - centre[0], dim=-1)
    return away
