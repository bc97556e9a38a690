"""The tape: the states between the substeps of an episode, or of a part of it, and the momenta of their nodes."""

import weakref

import numpy as np

from zoobench.sim.kernels.layout import START
from zoobench.sim.launcher import kept_fields
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.state import IntArray, Matter
from zoobench.sim.simulation import Simulation


class Tape:
    """Slots for the states of all worlds, of which each world takes its own number.

    Memory is taken by the slots that were written, and kept for the next episode.

    Args:
        simulation: of the states; its launcher keeps the momenta.
        slots: the number of slots.

    Attributes:
        states: of the slots.
    """

    def __init__(self, simulation: Simulation, slots: int) -> None:
        self.slots = slots
        self.states = simulation.matter.extended(slots)
        self._launcher = simulation.launcher
        self._launcher.keep(slots * nodes_per_slot(simulation.scene, simulation.fidelity))
        self._owner: weakref.ref[Rollout] | None = None
        self._segment = 0

    def __del__(self) -> None:
        """Free the memory at once: compiled launches refer to their first tensors until garbage is collected."""
        for tensor in self.states.tensors():
            tensor.data = tensor.new_empty(0)

    def fits(self, slots: IntArray) -> bool:
        """Whether the worlds can take so many slots `[worlds]` after the first."""
        return max(slots.tolist(), default=0) < self.slots

    def begin(self, state: Matter, rollout: Rollout | None = None, segment: int = 0) -> None:
        """Write a state into the first slot, and note whose segment is to follow; no whole segment if None."""
        self.states.load_slot(0, state)
        self.states.window[0, :, START] = self._launcher.first_kept()
        self._owner = None if rollout is None else weakref.ref(rollout)
        self._segment = segment

    def holds(self, rollout: Rollout, segment: int) -> bool:
        """Whether the states of this segment of the rollout are on it."""
        return self._owner is not None and self._owner() is rollout and self._segment == segment

    def write_after(self, slot: int, world: int, state: Matter) -> None:
        """Write a world's state at slot 0 of another state after a slot; the place of kept momenta goes on."""
        kept = self.states.window[slot, world, START:].clone()
        for target, source in zip(self.states.tensors(), state.tensors(), strict=True):
            target[slot + 1, world] = source[0, world]
        self.states.window[slot + 1, world, START:] = kept

    def stop_after(self, slots: IntArray, worlds: IntArray) -> None:
        """Write some worlds at their slots `[worlds]` into the next, without motion."""
        for world in worlds.tolist():
            self.states.stop_after(int(slots[world]), world)


def nodes_per_slot(scene: Scene, fidelity: Fidelity) -> int:
    """Grid nodes of one world whose momenta a slot has room for: a window with a node around it."""
    places = np.concatenate([bed.positions for bed in (scene.elastic, scene.medium) if bed is not None])
    cells = np.ceil(np.ptp(places, axis=0) / fidelity.grid_spacing)
    return int(np.prod(cells + fidelity.spline.width + 2))


def bytes_per_slot(scene: Scene, fidelity: Fidelity, like: Matter) -> int:
    """Memory of one slot for such a state, with its nodes' momenta [bytes]; of a robot in its rest frame that of its
    nodes, since the rows of the particles are written between frames alone."""
    if like.nodes.numel():
        return like.nodes[0].numel() * like.nodes.element_size()
    nodes = nodes_per_slot(scene, fidelity) * kept_fields(scene, fidelity) * like.state.shape[1]
    return like.bytes_per_slot() + nodes * 4 * like.state.element_size()
