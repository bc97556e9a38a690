"""The tape: the states between the substeps of an episode, or of a part of it."""

import math
import weakref

import numpy as np
import torch
from torch import Tensor

from zoobench.sim import runtime
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.state import IntArray, Matter

_ALIGNMENT = 64
"""Of the tensors, for vectors of every width [bytes]."""


class Tape:
    """Slots for the states of all worlds, of which each world takes its own number.

    Memory is taken by the slots that were written, and kept for the next episode.

    Args:
        like: a state of the scene.
        slots: the number of slots.

    Attributes:
        states: of the slots.
    """

    def __init__(self, like: Matter, slots: int) -> None:
        self.slots = slots
        self.states = like.extended(slots, _zeros)
        self._owner: weakref.ref[Rollout] | None = None
        self._segment = 0

    def __del__(self) -> None:
        """Free the memory at once: what Taichi compiled refers to its first tensors until garbage is collected."""
        for tensor in self.states.tensors():
            tensor.data = tensor.new_empty(0)

    @staticmethod
    def bytes_per_slot(like: Matter) -> int:
        """Memory of one slot for such a state [bytes]."""
        return like.bytes_per_slot()

    def fits(self, slots: IntArray) -> bool:
        """Whether the worlds can take so many slots `[worlds]` after the first."""
        return int(slots.max(initial=0)) < self.slots

    def begin(self, state: Matter, rollout: Rollout | None = None, segment: int = 0) -> None:
        """Write a state into the first slot, and note whose segment is to follow; no whole segment if None."""
        self.states.load_slot(0, state)
        self._owner = None if rollout is None else weakref.ref(rollout)
        self._segment = segment

    def holds(self, rollout: Rollout, segment: int) -> bool:
        """Whether the states of this segment of the rollout are on it."""
        return self._owner is not None and self._owner() is rollout and self._segment == segment

    def stop_after(self, slots: IntArray, worlds: IntArray) -> None:
        """Write some worlds at their slots `[worlds]` into the next, without motion."""
        for world in worlds.tolist():
            self.states.stop_after(int(slots[world]), world)


def _zeros(shape: tuple[int, ...], like: Tensor) -> Tensor:
    """Zeros of a tensor's type, aligned, that take no memory on the CPU before they are touched; torch's do."""
    if like.device.type != "cpu":
        return torch.zeros(shape, dtype=like.dtype, device=like.device)
    size = math.prod(shape) * like.element_size()
    room = np.zeros(size + _ALIGNMENT, np.uint8)
    begin = -room.ctypes.data % _ALIGNMENT
    kind = np.int32 if like.dtype == torch.int32 else runtime.host_real(like.dtype)
    return torch.from_numpy(room[begin : begin + size].view(kind).reshape(shape))
