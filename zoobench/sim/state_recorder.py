"""The recorder of the states that an episode's gradient needs, while it is simulated."""

import numpy as np

from zoobench.sim.model.rollout import Rollout, Segment
from zoobench.sim.model.segmentation import share
from zoobench.sim.model.state import IntArray
from zoobench.sim.simulation import Simulation
from zoobench.sim.tape import Tape


class StateRecorder:
    """Takes the worlds of an episode through their substeps, and stores the states that `Segmentation` asks for.

    An episode of one segment is written onto the tape, each world at its own slots, and `Simulation.matter` follows
    frame by frame. Should it become too long for the tape by steps finer than declared, a second segment begins with
    the frame that does not fit, of which no state but its first is stored.

    Args:
        tape: None for a rollout without gradients.
    """

    def __init__(self, simulation: Simulation, rollout: Rollout, tape: Tape | None) -> None:
        self._sim, self._rollout = simulation, rollout
        storage = rollout.segmentation
        self._frames, self._pieces = (storage.frames, storage.pieces) if storage else (0, 1)
        self._tape = tape if self._frames >= rollout.frames else None  # for as long as the episode fits
        self._at_start = np.zeros(simulation.worlds, np.int64)  # slots of the present frame's beginning
        self._slots = self._at_start.copy()  # and of the present states
        if self._tape is not None:
            rollout.segments.append(Segment(0, 0, simulation.matter.copy_slot(0)))
            self._tape.begin(simulation.matter, rollout)

    def begin(self) -> None:
        """A frame begins."""
        self._at_start[:] = self._slots

    def advance(self, frame: int, counts: IntArray) -> None:
        """A whole frame of so many substeps in every world `[worlds]`, none where 0.

        Called again for the same frame it repeats it in the worlds that were put back to its beginning.
        """
        self._leave_tape_if_full(frame, counts)
        if self._tape is not None:
            worlds = counts.nonzero()[0]
            self._slots[worlds] = (self._at_start + counts)[worlds]
            self._sim.advance(self._tape.states, self._at_start, counts, stride=1)
            self._sim.matter.load_worlds(worlds, self._tape.states, self._slots[worlds])
            return
        for piece in range(self._pieces):
            self._keep(frame, piece, counts)
            part = share(counts, piece, self._pieces)
            if part.any():
                self._sim.advance(self._sim.matter, np.zeros_like(part), part, stride=0, whole=counts)

    def move(self, frame: int, worlds: list[int]) -> None:
        """Note that the arenas of some worlds were moved, before the first substep of a frame."""
        if self._tape is None or not worlds:
            return
        if not self._tape.fits(self._at_start[worlds] + 1):
            self._rollout.segments.append(Segment(frame, 0, self._sim.matter.copy_slot(0)))
            self._tape = None
            return
        for world in worlds:
            self._tape.write_after(int(self._at_start[world]), world, self._sim.matter)
        self._at_start[worlds] += 1
        self._slots[worlds] += 1

    def stop(self, frame: int) -> None:
        """Note the stops after a frame; `Simulation.matter` has been stopped already."""
        if self._tape is not None:
            stopped = np.flatnonzero(self._rollout.stops[frame] & (self._rollout.counts[frame] > 0))
            self._tape.stop_after(self._slots, stopped)
            self._slots[stopped] += 1

    def _leave_tape_if_full(self, frame: int, counts: IntArray) -> None:
        last = (self._at_start + counts)[counts > 0] + int(frame < self._rollout.equilibration)  # a stop may follow
        if self._tape is not None and not self._tape.fits(last):
            if frame:
                self._rollout.segments.append(Segment(frame, 0, self._tape.states.at(self._at_start)))
            self._tape = None

    def _keep(self, frame: int, piece: int, counts: IntArray) -> None:
        """Store the present state if a segment begins here; of a frame that is repeated, of the worlds that do so."""
        if not self._frames or frame % self._frames:
            return
        known = next((one for one in self._rollout.segments[-self._pieces :] if one[:2] == (frame, piece)), None)
        if known is None:
            self._rollout.segments.append(Segment(frame, piece, self._sim.matter.copy_slot(0)))
        else:
            for world in np.flatnonzero(counts).tolist():
                known.start.copy_world(world, self._sim.matter)
