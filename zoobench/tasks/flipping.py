"""Flipping: forward somersaults."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, Task
from zoobench.tasks.orientation import up_after, up_direction
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "flip", tags=("acrobatics",))
@dataclass(frozen=True, kw_only=True)
class Flip(Task):
    """Turn head over heels, forward, as often as possible.

    The score is the angle by which the body has pitched forward at the end of the episode, beyond half turns [rad]; a
    backward somersault counts as negative. It is the sum over the frames of u x u', where u and u' are the direction
    upward before and after a frame, seen in the frame of the body and projected on its plane of ahead and up. Where
    the body rolls over its side, the projection is short and little is counted; turning about the vertical counts as
    nothing. The frame of the body is that of the best fit to its first state, so that a body that changes its shape to
    and fro gains nothing.

    The reward of a frame is the angle that the present velocities turn the body in a frame [rad]; these add up to the
    score up to their discretisation.
    """

    unit: ClassVar[str] = "rad"

    def reward(self, motion: Motion) -> "Tensor":
        """Forward pitch in the time of a frame at its final velocities `[frames, worlds]` [rad]."""
        before = up_after(motion, motion.positions[1:] - motion.frame_seconds * motion.velocities[1:])
        return _forward(before, up_direction(motion)[1:])

    def score(self, motion: Motion) -> "Tensor":
        """The angle of forward pitch at the end `[worlds]` [rad]."""
        up = up_direction(motion)
        return _forward(up[:-1], up[1:]).sum(dim=0)

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """How far the body was from upright at most, whichever way, and the common readings."""
        import torch

        up = up_direction(motion)
        tilt = torch.atan2(torch.linalg.vector_norm(up[..., [0, 2]], dim=-1), up[..., 1])
        return {"greatest_tilt": (tilt.amax(dim=0), "rad"), **common_readings(motion)}


def _forward(before: "Tensor", after: "Tensor") -> "Tensor":
    """The angle from one direction upward to the next, weighted by their lengths in the plane of ahead and up [rad].

    A body that pitches forward sees the upward direction turn from up to behind.
    """
    return before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]
