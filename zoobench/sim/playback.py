"""Worlds that a caller takes from control frame to control frame, each begun on its own."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from zoobench.sim.model.rollout import FloatArray
from zoobench.sim.model.state import BodyState
from zoobench.sim.solver import Solver


class Playback:
    """A solver's worlds, for a caller that chooses the actuation of a frame after the last one has ended.

    A world goes through the same states as in `Solver.run`, bit for bit, whenever it was begun and whatever the others
    do.

    Args:
        solver: must not be used otherwise meanwhile.
        body: as in `Solver.run`.

    Attributes:
        rollout: of the last frame alone: the states before and after it, its substeps, and the divergences and tears of
            the worlds since they were begun, at the frames and substeps of their own episodes.
        frames, substeps: taken since a world was begun `[worlds]`.
    """

    def __init__(self, solver: Solver, body: BodyState | None = None) -> None:
        self._solver, self._sim = solver, solver.simulation
        self.rollout, self._step_control = solver.begin(np.zeros((1, solver.worlds, solver.muscle_count)), body)
        self.frames = np.zeros(solver.worlds, np.int64)
        self.substeps = np.zeros(solver.worlds, np.int64)
        self._goes_on = False  # whether every world is where the last frame left it
        self.begin(range(solver.worlds))

    def begin(self, worlds: Iterable[int]) -> None:
        """Put these worlds back to the initial state."""
        for world in worlds:
            self._sim.restart(world)
            self.frames[world] = self.substeps[world] = 0
            self.rollout.divergences.pop(world, None)
            self.rollout.tears.pop(world, None)
        self._goes_on = False
        self._sim.record(self.rollout, 1)

    def lead_in(self, world: int, actuation: FloatArray) -> None:
        """Take one world through control frames before its episode, which begins with the state after them.

        The others stay where they are. A world that diverges or tears is put back to the initial state.

        Args:
            actuation: `[frames, muscles]` in [-1, 1].
        """
        alive = self._sim.alive.clone()
        self._sim.alive.zero_()
        self._sim.alive[world] = 1
        self._goes_on = False
        for row in np.asarray(actuation):
            self.frame(np.tile(row, (self._solver.worlds, 1)))
        alive[world] = 1
        self._sim.alive.copy_(alive)
        self._goes_on = False
        self.frames[world] = self.substeps[world] = 0
        if world in self.rollout.divergences or world in self.rollout.tears:
            self.begin([world])

    def frame(self, actuation: FloatArray) -> None:
        """Move on by a control frame; a world that has diverged is not moved.

        Args:
            actuation: `[worlds, muscles]` in [-1, 1].

        Raises:
            UsageError: an actuation of another shape, out of range or not finite.
        """
        rollout = self.rollout
        rollout.actuation[:] = self._solver.check_actuation(np.asarray(actuation)[None])
        for recorded in (rollout.positions, rollout.velocities, rollout.muscle_potential, rollout.offsets):
            recorded[0] = recorded[1]
        known = [(found, set(found)) for found in (rollout.divergences, rollout.tears)]
        self._step_control.ready(0, goes_on=self._goes_on)
        self._step_control.frame(0)
        self._goes_on = True
        self._sim.record(rollout, 1)
        for found, earlier in known:
            for world in found.keys() - earlier:
                before = int(self.substeps[world])
                found[world] = replace(found[world], frame=int(self.frames[world]), step=before + found[world].step)
        self.frames += rollout.counts[0] > 0
        self.substeps += rollout.counts[0]
