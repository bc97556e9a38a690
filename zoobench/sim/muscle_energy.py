"""Active energy of the muscles at frame boundaries, of many frames at a time."""

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from zoobench.arrays import Array
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.state import Matter, Parameters

_MOST_BYTES = 1 << 18
"""Memory of the deformations that wait: as much as a processor's second cache holds."""


class _Members(NamedTuple):
    """The particles of all muscles in all worlds.

    Attributes:
        membership: of which they were found `[worlds, robot, muscles]` [-].
        particles: their places among those of all worlds `[members]`.
        bins: and of their muscles among those of all worlds.
        shares: their memberships.
    """

    membership: Array
    particles: NDArray[np.int64]
    bins: NDArray[np.int64]
    shares: Array

    @classmethod
    def of(cls, membership: Array) -> "_Members":
        """Those with a membership above zero."""
        _, robot, muscles = membership.shape
        world, particle, muscle = found = membership.nonzero()
        return cls(membership, world * robot + particle, world * muscles + muscle, membership[found])


class MuscleEnergy:
    """Computes `Rollout.muscle_potential` from the deformations that it is given, together where they are small.

    A few hundred particles take less time than the calls of a dozen functions on them.

    Args:
        strength: of the muscles [Pa].
    """

    def __init__(self, strength: float) -> None:
        self._half = 0.5 * strength
        self._there = torch.zeros(0), torch.zeros(0)  # of fibres and energies, on the simulation's device
        self._fibre: Array = np.zeros(0)
        self._energy: Array = np.zeros(0)
        self._rollout: Rollout | None = None
        self._frames: list[int] = []
        self._waiting: Array = np.zeros(0)
        self._members: _Members | None = None

    def set_body(self, parameters: Parameters) -> None:
        """Take fibres and volumes of the particles from here on."""
        count = parameters.robot
        fibre, energy = parameters.fibre.double(), self._half * parameters.volume[:, :count].double()
        self._there = fibre, energy
        self._fibre = fibre.cpu().numpy().transpose(2, 0, 1)[:, None, None].copy()
        self._energy = energy.cpu().numpy()
        self._members = None

    def note(self, rollout: Rollout, frame: int, matter: Matter) -> None:
        """Take the present state on the CPU for that at the beginning of a frame; `finish` is to follow."""
        columns = matter.robot_rows(5, 8)
        if rollout is not self._rollout:
            self.finish()
            self._rollout = rollout
            room = max(1, _MOST_BYTES // columns.nbytes), *columns.shape
            if self._waiting.shape != room:
                self._waiting = np.empty(room, columns.dtype)
        self._waiting[len(self._frames)] = columns
        self._frames.append(frame)
        if len(self._frames) == len(self._waiting):
            self._write(rollout)

    def finish(self) -> None:
        """Write the potentials of all frames that were noted into their rollout."""
        if self._rollout is not None:
            self._write(self._rollout)
            self._rollout = None

    def _write(self, rollout: Rollout) -> None:
        """Active energy per unit of activity `[worlds, muscles]` [J] of each frame; see `Rollout.muscle_work`."""
        # of F by column and row `[3, 3, frames, worlds, robot]`
        columns = self._waiting[: len(self._frames), ..., :3].transpose(3, 4, 0, 1, 2).astype(float, order="C")
        # sums and products of our own, in this order: the libraries' products are rounded by the processor's make
        stretched = columns[0] * self._fibre[0]
        stretched += columns[1] * self._fibre[1]
        stretched += columns[2] * self._fibre[2]
        stretched *= stretched
        density = self._energy * (stretched[0] + stretched[1] + stretched[2])
        members, potential = self._members_of(rollout.body["muscle_membership"]), rollout.muscle_potential
        for frame, each in zip(self._frames, density, strict=True):
            energy = np.bincount(members.bins, members.shares * each.take(members.particles), potential[0].size)
            potential[frame] = energy.reshape(potential[0].shape)
        self._frames.clear()

    def potential(self, membership: Tensor, F: Tensor) -> Array:
        """Active energy per unit of activity `[worlds, muscles]` [J] of one state, computed where it is.

        Args:
            membership: of the muscles `[worlds, robot, muscles]` [-].
            F: deformation gradients `[worlds, robot, 3, 3]` [-].
        """
        fibre, energy = self._there
        density = energy * (F.double() @ fibre[..., None]).square().sum((2, 3))
        found: Array = (membership * density[..., None]).sum(1).cpu().numpy()
        return found

    def _members_of(self, membership: Array) -> _Members:
        """Those of the muscles of a rollout; frames that are recorded one by one share them."""
        if self._members is None or self._members.membership is not membership:
            self._members = _Members.of(membership)
        return self._members
