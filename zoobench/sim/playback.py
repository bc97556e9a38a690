"""Worlds that a caller takes from control frame to control frame, with a clock for each."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from zoobench.sim.model.rollout import FloatArray
from zoobench.sim.solver import BodyState, Solver


class Playback:
    """A solver's worlds, for a caller that decides on the actuation of a frame when it knows how the last one ended.

    A world goes through the same states as in `Solver.run`, to the last bit, whenever it was begun and whatever the
    others do.

    Args:
        solver: nobody else may use it meanwhile.
        body: as in `Solver.run`.

    Attributes:
        rollout: of the last frame alone: states before and after it, what it took, and the divergences and tears of the
            worlds since they were begun, with the frames and substeps of the episode that they belong to.
        frames, substeps: taken since a world was begun `[worlds]`.
    """

    def __init__(self, solver: Solver, body: BodyState | None = None) -> None:
        self._solver = solver
        self.rollout, self._step_control = solver.begin(np.zeros((1, solver.worlds, solver.muscle_count)), body)
        self.frames = np.zeros(solver.worlds, np.int64)
        self.substeps = np.zeros(solver.worlds, np.int64)
        self.begin(range(solver.worlds))

    def begin(self, worlds: Iterable[int]) -> None:
        """Put these worlds back to the initial state."""
        for world in worlds:
            self._solver.restart(world)
            self.frames[world] = self.substeps[world] = 0
            self.rollout.divergences.pop(world, None)
            self.rollout.tears.pop(world, None)
        self._solver.record(self.rollout, 1)

    def frame(self, actuation: FloatArray) -> None:
        """Move on by a control frame; a world that has diverged stays as it is.

        Args:
            actuation: `[worlds, muscles]` in [-1, 1].

        Raises:
            UsageError: an actuation of another shape, out of range or not finite.
        """
        rollout = self.rollout
        rollout.actuation[:] = self._solver.check_actuation(np.asarray(actuation)[None])
        for path in (rollout.positions, rollout.velocities, rollout.muscle_potential):
            path[0] = path[1]
        known = [(found, set(found)) for found in (rollout.divergences, rollout.tears)]
        self._step_control.ready(0)
        self._step_control.frame(0)
        self._solver.record(rollout, 1)
        for found, earlier in known:
            for world in found.keys() - earlier:
                before = int(self.substeps[world])
                found[world] = replace(found[world], frame=int(self.frames[world]), step=before + found[world].step)
        self.frames += rollout.counts[0] > 0
        self.substeps += rollout.counts[0]
