"""Turning (SoftZoo's paper, A.2): rotate counter-clockwise as fast as possible."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, Task
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor

_AXIS_RADIUS = 1e-9  # [m] nearer to the axis a particle has no tangent: its velocity counts as zero, without gradient


@register(Kind.TASK, "turning", tags=("locomotion",))
@dataclass(frozen=True, kw_only=True)
class Turning(Task):
    """Turn counter-clockwise, seen from above, as fast as possible.

    With r the position relative to the centre of mass and e_y the upward direction, every particle's velocity is
    projected on its tangent (e_y x r) / |e_y x r|. The score is the mean by occupancy over the particles, averaged over
    the frames [m/s].
    """

    unit: ClassVar[str] = "m/s"
    needs_sides: ClassVar[bool] = True

    def reward(self, motion: Motion) -> "Tensor":
        """Mean tangential velocity at the end of every frame `[frames, worlds]` [m/s]."""
        return motion.once("tangential_velocity", lambda: _tangential_velocity(motion))

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """Tangential velocity, net angle of rotation, and the common readings."""
        return {
            "tangential_velocity": (self.score(motion), "m/s"),
            "heading_angle": (net_rotation(motion), "rad"),
            **common_readings(motion),
        }


def _tangential_velocity(motion: Motion) -> "Tensor":
    """See `Turning.reward`."""
    import torch

    relative = motion.positions[1:] - motion.centre_of_mass()[1:, :, None, :]
    x, z = relative[..., 0], relative[..., 2]  # e_y x r = (z, 0, -x)
    squared = z**2 + x**2
    off_axis = squared > _AXIS_RADIUS**2
    # the inner `where` avoids sqrt(0), whose infinite derivative would make the masked gradient NaN
    distance = torch.where(off_axis, squared, 1.0).sqrt()
    velocities = motion.velocities[1:]
    tangential = z / distance * velocities[..., 0] - x / distance * velocities[..., 2]
    return motion.mean_over_existing(torch.where(off_axis, tangential, 0.0))


def net_rotation(motion: Motion) -> "Tensor":
    """Net angle of rotation about e_y since the start, counter-clockwise, beyond half turns `[worlds]` [rad].

    The sum over frames of the rotation about the centre of mass that fits the masses best (two-dimensional Procrustes
    problem). A frame must rotate by less than half a turn.
    """
    import torch

    centre, masses = motion.centre_of_mass(), motion.masses[None]
    x, z = (motion.positions[..., axis] - centre[..., axis, None] for axis in (0, 2))
    # counter-clockwise from above takes x to -z
    sine = ((z[:-1] * x[1:] - x[:-1] * z[1:]) * masses).sum(dim=2)
    cosine = ((x[:-1] * x[1:] + z[:-1] * z[1:]) * masses).sum(dim=2)
    return torch.atan2(sine, cosine).sum(dim=0)
