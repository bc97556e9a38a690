"""From the simulator to the tasks: how the robot moved, as tensors."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from zoobench.designs.base import Body
from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from torch import Tensor

    from zoobench.sim.rollout import Rollout


def motion_of(
    rollout: "Rollout",
    body: Body,
    masses: NDArray[np.float64],
    worlds: slice,
    frame_seconds: float,
    *,
    gradient: bool = False,
) -> Motion:
    """How the robot moved in some worlds of a rollout, in double precision.

    Args:
        rollout: an episode.
        body: of the robot, at rest.
        masses: `[particle_count]` of its particles [kg].
        worlds: which.
        frame_seconds: length of a control frame [s].
        gradient: whether positions and velocities are leaves of a gradient.
    """
    import torch

    def tensor(values: NDArray[Any], leaf: bool = False) -> "Tensor":
        return torch.tensor(values, dtype=torch.float64, requires_grad=leaf)

    positions = rollout.positions[:, worlds]
    return Motion(
        positions=tensor(positions, gradient),
        velocities=tensor(rollout.velocities[:, worlds], gradient),
        masses=tensor(np.tile(masses, (positions.shape[1], 1))),
        frame_seconds=frame_seconds,
        rest=tensor(body.positions),
        head=tensor(body.head),
        tail=tensor(body.tail),
        muscle_work=tensor(rollout.muscle_work[:, worlds]),
    )
