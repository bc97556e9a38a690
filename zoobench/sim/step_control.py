"""Step control: every world takes its own steps through a control frame, and goes back where they were too long."""

from typing import TYPE_CHECKING

import numpy as np
import torch

from zoobench.errors import Divergence
from zoobench.sim.model.diagnostics import Finding, judge, largest_separation, separation, torn
from zoobench.sim.model.state import IntArray
from zoobench.sim.model.step_limits import MOST_REFINEMENT, Condition, StepLimit, step_now

if TYPE_CHECKING:
    from zoobench.sim.model.rollout import Feedback, Rollout
    from zoobench.sim.solver import Solver


class Diagnostics:
    """Looks at all worlds at slot 0: their condition, and the particle behind each of its worst values."""

    def __init__(self, solver: "Solver") -> None:
        self._solver = solver
        like = solver.matter.x
        self._report = torch.zeros((solver.worlds, len(Condition._fields)), dtype=like.dtype, device=like.device)
        self._culprit = torch.zeros((solver.worlds, 5), dtype=torch.int32, device=like.device)

    def look(self) -> list[Condition]:
        """The condition of every world that is alive; that of a dead one is out of date."""
        solver = self._solver
        solver.launcher.survey(solver.matter, solver.parameters, solver.alive, self._report, self._culprit)
        return [Condition(*row) for row in self._report.tolist()]

    def limits(self) -> list[StepLimit]:
        """The step that every world could take now."""
        solver = self._solver
        return [step_now(solver.scene, solver.fidelity, solver.frame_seconds, found) for found in self.look()]

    def divergence(self, world: int, frame: int, step: int, found: Finding) -> Divergence:
        """The finding with the time, particle and place that belong to it."""
        solver = self._solver
        particle = int(self._culprit[world, found.column])
        x, y, z = (solver.matter.x[0, world, particle].cpu().double().numpy() + solver.origin).tolist()
        return Divergence(
            world, frame, step, found.quantity, found.value, found.limit, particle, (x, y, z), found.advice
        )


class StepControl:
    """Takes the worlds of one episode through its frames.

    A world's step follows from its condition at the beginning of the frame. If the frame ends in a state that means
    nothing, that world is put back and repeats it with half the step, again and again down to `MOST_REFINEMENT` times
    below the declared step. A schedule or a fixed step is followed as it is, without a second try.

    Args:
        schedule: `[frames, worlds]` substeps to take; None to choose them.
        feedback: fills the rollout's actuation as it goes; None if it is there already.
    """

    def __init__(
        self,
        solver: "Solver",
        rollout: "Rollout",
        schedule: IntArray | None = None,
        feedback: "Feedback | None" = None,
    ) -> None:
        self._solver, self._rollout = solver, rollout
        self._schedule = schedule
        if schedule is None and solver.fidelity.step:
            self._schedule = np.full_like(rollout.counts, solver.substeps_per_frame)
        self._most = MOST_REFINEMENT * solver.substeps_per_frame
        self._before = solver.matter.copy_slot(0)
        self._diagnostics = Diagnostics(solver)
        self._feedback = feedback
        self.ready(0)

    def ready(self, frame: int) -> None:
        """Take up the actuation of a frame that is about to begin, and survey the state that its step follows from.

        `frame` does so itself at its end, for the frame after it.
        """
        self._react(frame)
        self._solver.set_tension(self._rollout, frame)
        self._conditions = self._diagnostics.look()

    def frame(self, frame: int) -> None:
        """One control frame of every world alive; those that cannot be saved are taken out, as they were before it."""
        solver, rollout = self._solver, self._rollout
        self._before.load_slot(0, solver.matter)
        counts = self._choose(frame)
        rollout.counts[frame] = counts
        pending = counts
        while pending.any():
            solver.advance(solver.matter, np.zeros_like(pending), pending, stride=0)
            solver.meter.forward += int(pending.sum())
            # the survey is also the look ahead: its stiffness is that of the actuation to come
            coming = min(frame + 1, rollout.frames - 1)
            if coming > frame:
                self._react(coming)
            solver.set_tension(rollout, coming)
            self._conditions = self._diagnostics.look()
            pending = self._go_back(frame, self._failures(frame))
            if pending.any():
                solver.set_tension(rollout, frame)
        for world, condition in enumerate(self._conditions):
            if counts[world]:
                self._look_for_tears(world, frame, condition)
                rollout.guarded[world] += int(condition.guarded)
                rollout.smallest_j[world] = min(rollout.smallest_j[world], condition.smallest_j)

    def _react(self, frame: int) -> None:
        """The actuation of a frame that is about to begin; none in a world whose state means nothing."""
        if self._feedback is not None:
            self._solver.record(self._rollout, frame)
            felt = self._rollout.positions[frame], self._rollout.velocities[frame]
            self._rollout.actuation[frame] = np.nan_to_num(self._feedback(frame, *felt))

    def _go_back(self, frame: int, failed: dict[int, Finding]) -> IntArray:
        """Put failed worlds back to before the frame; substeps to repeat it with, 0 for the others and the given up."""
        solver, rollout = self._solver, self._rollout
        pending = np.zeros(solver.worlds, np.int64)
        for world, finding in failed.items():
            taken = int(rollout.counts[frame, world])
            if self._schedule is None and taken < self._most:
                rollout.counts[frame, world] = pending[world] = min(2 * taken, self._most)
                rollout.retries[world] += 1
            else:
                step = int(rollout.counts[: frame + 1, world].sum())
                rollout.divergences[world] = self._diagnostics.divergence(world, frame, step, finding)
                solver.alive[world] = 0
            solver.matter.copy_world(world, self._before)
        return pending

    def _choose(self, frame: int) -> IntArray:
        """Substeps of every world in this frame, 0 for a dead one."""
        solver = self._solver
        if self._schedule is not None:
            counts = self._schedule[frame]
        else:
            counts = np.array([self._substeps(world) for world in range(solver.worlds)])
        living: IntArray = counts * solver.alive.cpu().numpy()
        return living

    def _substeps(self, world: int) -> int:
        solver = self._solver
        if not int(solver.alive[world]):
            return 0
        found = step_now(solver.scene, solver.fidelity, solver.frame_seconds, self._conditions[world])
        return min(found.substeps_per_frame, self._most)

    def _look_for_tears(self, world: int, frame: int, condition: Condition) -> None:
        """The distances are measured only where some F is stretched as far, which neighbours do not part without."""
        solver, rollout = self._solver, self._rollout
        if world in rollout.tears or condition.stretch <= largest_separation(solver.fidelity):
            return
        there = rollout.body["occupancy"][world] > 0.5
        now = solver.matter.x[0, world, : solver.robot_count].cpu().double().numpy()
        if finding := torn(separation(solver.scene.robot.positions[there], now[there]), solver.fidelity):
            step = int(rollout.counts[: frame + 1, world].sum())
            rollout.tears[world] = self._diagnostics.divergence(world, frame, step, finding)

    def _failures(self, frame: int) -> dict[int, Finding]:
        solver = self._solver
        found = {}
        for world, condition in enumerate(self._conditions):
            if int(solver.alive[world]):
                dt = solver.frame_seconds / int(self._rollout.counts[frame, world])
                finding = judge(condition, dt, solver.fidelity.grid_spacing)
                if finding is not None:
                    found[world] = finding
        return found
