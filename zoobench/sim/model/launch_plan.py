"""The plan of a launch: its substeps in each world."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from zoobench.arrays import Array
from zoobench.sim.model.state import IntArray
from zoobench.sim.model.tensors import put


@dataclass
class LaunchPlan:
    """The substeps of a launch in each world.

    Attributes:
        slots: `[worlds, 4]` first slot read, number of substeps, and of particles awake, and 1 where the launch is the
            first of its frame; a world without substeps is unchanged.
        dt: `[worlds]` step [s].
        order: `[worlds, particles]` the particles awake, then those asleep; empty where none may sleep.
        world_substeps: of all worlds together.
    """

    slots: Tensor
    dt: Tensor
    order: Tensor

    def __post_init__(self) -> None:
        self.world_substeps = int(self.slots[:, 1].sum())
        self._on_host = self.slots.cpu().numpy(), self.dt.cpu().numpy()  # on the CPU the memory of both itself
        self._is_elsewhere = not self.slots.is_cpu

    @classmethod
    def none(cls, worlds: int, real: torch.dtype, device: str, particles: int = 0) -> Self:
        """Nothing to do in any world, of `particles` that may sleep and are awake."""
        slots, order = (torch.zeros((worlds, n), dtype=torch.int32, device=device) for n in (4, particles))
        plan = cls(slots, torch.ones(worlds, dtype=real, device=device), order)
        plan.put_to_sleep(np.zeros((worlds, particles), np.bool_))
        return plan

    def set(self, first: IntArray, counts: IntArray, dt: Array, begins: bool | NDArray[np.bool_] = True) -> None:
        """Give every world its first slot, number of substeps and step [s], and whether a frame begins, `[worlds]`."""
        slots, steps = self._on_host
        slots[:, 0], slots[:, 1], slots[:, 3], steps[:] = first, counts, begins, dt
        if self._is_elsewhere:
            put(self.slots[:, :2], slots[:, :2])
            put(self.slots[:, 3], slots[:, 3])
            put(self.dt, steps)
        self.world_substeps = sum(counts.tolist())

    @property
    def longest(self) -> int:
        """Substeps of the world that has most."""
        return int(self._on_host[0][:, 1].max())

    def put_to_sleep(self, asleep: NDArray[np.bool_]) -> None:
        """Say which of the last particles sleep `[worlds, sleepers]`; both kinds keep their order."""
        first = self.order.shape[1] - asleep.shape[1]
        slots = self._on_host[0]
        for world, sleeps in enumerate(asleep):
            awake, sleepers = np.flatnonzero(~sleeps), np.flatnonzero(sleeps)
            slots[world, 2] = first + len(awake)
            put(self.order[world, first:], first + np.concatenate([awake, sleepers]))
        if self._is_elsewhere:
            put(self.slots[:, 2], slots[:, 2])
