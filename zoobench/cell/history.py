"""The trajectories of a session's worlds since their episodes began, from which an episode is scored as a whole one."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.motion import with_states
from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from zoobench.sim.model.rollout import Rollout


class History:
    """The states of every world at the boundaries of its control frames, and the work of its muscles.

    Args:
        frames: length of an episode.
        rollout: of the present frame, whose shapes and precision are taken.
    """

    def __init__(self, frames: int, rollout: "Rollout") -> None:
        _, worlds, count, _ = rollout.positions.shape
        self._positions = np.zeros((worlds, frames + 1, count, 3), rollout.positions.dtype)
        self._velocities = np.zeros_like(self._positions)
        self._offsets = np.zeros((worlds, frames + 1, 3))
        self._work = np.zeros((worlds, frames, rollout.actuation.shape[2]))

    def note(self, world: int, frame: int, rollout: "Rollout", work: Array | None = None) -> None:
        """Take the present state of a world for that after so many frames of its episode.

        Args:
            work: of its muscles in the frame that ends then `[muscle_count]` [J]; None at the start.
        """
        self._positions[world, frame] = rollout.positions[1, world]
        self._velocities[world, frame] = rollout.velocities[1, world]
        self._offsets[world, frame] = rollout.offsets[1, world]
        if work is not None:
            self._work[world, frame - 1] = work

    def offsets(self, world: int, frames: int) -> Array:
        """How far a world's arena had moved after its robot in these frames `[frames + 1, 3]` [m]."""
        return self._offsets[world, : frames + 1]

    def motion(self, world: int, frames: int, like: Motion) -> Motion:
        """The motion of a world through the first frames of its episode; masses and labels are those of another."""
        import torch

        def tensor(values: np.ndarray) -> torch.Tensor:
            return torch.tensor(values[:, None], dtype=torch.float64)

        return replace(
            with_states(like, *(tensor(of_all[world, : frames + 1]) for of_all in (self._positions, self._velocities))),
            muscle_work=tensor(self._work[world, :frames]),
            numbers=None,
        )
