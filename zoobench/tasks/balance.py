"""Balancing: to stand on the tail and stay up."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, Task
from zoobench.tasks.orientation import up_direction
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor

_LEAST_COSINE = 1e-6  # of a body that stands upright exactly, whose elevation has no derivative


@register(Kind.TASK, "balance", tags=("acrobatics",))
@dataclass(frozen=True, kw_only=True)
class BalanceTask(Task):
    """Raise the head above the tail, and stay up.

    The score is the elevation of the direction ahead above the horizontal, averaged over the frames [rad]: pi / 2 for
    a body that stands on its tail throughout. The direction is that of the body's frame, which fits best to its first
    state, so that a head on a bent neck counts in part only, and a body that falls over backward is at zero again.
    """

    unit: ClassVar[str] = "rad"

    def reward(self, motion: Motion) -> "Tensor":
        """The elevation of the body at the end of every frame `[frames, worlds]` [rad]."""
        import torch

        up = up_direction(motion)[1:]
        level = (up[..., 1] ** 2 + up[..., 2] ** 2).clamp(min=_LEAST_COSINE**2).sqrt()
        return torch.atan2(up[..., 0], level)

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """The greatest elevation and that at the end, and the common readings."""
        elevation = self.reward(motion)
        return {
            "greatest_elevation": (elevation.amax(dim=0), "rad"),
            "final_elevation": (elevation[-1], "rad"),
            **common_readings(motion),
        }
