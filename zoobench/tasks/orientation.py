"""How a deforming body lies: which way is up, as seen from its own frame."""

from typing import TYPE_CHECKING

from zoobench.tasks.base import Motion
from zoobench.tasks.heading import rotation

if TYPE_CHECKING:
    from torch import Tensor


def up_direction(motion: Motion) -> "Tensor":
    """Unit vector upward in the frame of the body in every state `[frames + 1, worlds, 3]`: ahead, up, to the right.

    (0, 1, 0) in the first state. The frame turns with the rotation of the masses that fits their present positions
    best to those of the first state, as in `heading`. Turning about the vertical does not change it.
    """
    return motion.once("up_direction", lambda: up_after(motion, motion.positions))


def up_after(motion: Motion, positions: "Tensor") -> "Tensor":
    """As `up_direction`, for any positions `[states, worlds, particle_count, 3]` of the motion's particles."""
    import torch

    share = (motion.masses / motion.masses.sum(dim=1, keepdim=True))[None, ..., None]
    first = motion.positions[:1] - (share * motion.positions[:1]).sum(dim=2, keepdim=True)
    now = share * (positions - (share * positions).sum(dim=2, keepdim=True))
    moments = torch.stack([(now * first[..., axis, None]).sum(dim=2) for axis in range(3)], dim=-1)
    turned = rotation(moments.detach())
    if moments.requires_grad:
        with_gradient = rotation(moments)  # whose last digits are others, and a score has the same bits either way
        turned = turned + (with_gradient - with_gradient.detach())
    return turned[..., 1, :]
