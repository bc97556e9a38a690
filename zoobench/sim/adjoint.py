"""Gradients through whole episodes: stored states every few frames, the rest recomputed (SoftZoo, appendix E).

The reverse walks the segments between checkpoints backwards. Each is simulated again from its checkpoint into a tape of
one slot for each substep with the kernel of the forward pass and the steps that it took, so that the recomputed states
are those of the episode bit for bit.
"""

from typing import TYPE_CHECKING

import numpy as np
import torch

from zoobench.sim.model.rollout import FeedbackAdjoint, FloatArray, Gradient, Rollout
from zoobench.sim.model.state import IntArray, Parameters, empty_matter

if TYPE_CHECKING:
    from zoobench.sim.solver import Solver


class Adjoint:
    """One backward pass over one rollout."""

    def __init__(self, solver: "Solver", rollout: Rollout) -> None:
        self._solver, self._rollout = solver, rollout
        worlds, robot = solver.worlds, solver.robot_count
        real, device = solver.matter.x.dtype, str(solver.matter.x.device)
        healthy = np.array([world not in rollout.divergences for world in range(worlds)])
        self._counts = rollout.counts * healthy
        self._segments = [
            range(begin, min(begin + rollout.interval, rollout.frames))
            for begin in range(0, rollout.frames, rollout.interval)
        ]
        longest = max(int(self._counts[segment].sum(axis=0).max()) for segment in self._segments)
        self._tape = empty_matter(solver.scene, longest + 1, worlds, real, device)
        self._state = empty_matter(solver.scene, 1, worlds, real, device)
        medium = solver.scene.medium
        # the mass of a medium depends on nothing, unless it gives way to the robot's
        weighed = solver.particle_count if medium is not None and medium.hosts is not None else robot
        self._parameters = Parameters.zeros(worlds, robot, weighed, real, device)
        self._fault = ""
        self._actuation = np.zeros(rollout.actuation.shape)
        self._membership = np.zeros(rollout.body["muscle_membership"].shape)

    def run(
        self, position_adjoint: FloatArray, velocity_adjoint: FloatArray, feedback: FeedbackAdjoint | None = None
    ) -> Gradient:
        """Walk back from the last frame to the first; `[frames + 1, worlds, robot, 3]` each."""
        solver, rollout = self._solver, self._rollout
        solver.set_body(rollout.body)
        for world in range(solver.worlds):
            solver.alive[world] = int(world not in rollout.divergences)
        self._seed(rollout.frames, position_adjoint, velocity_adjoint)
        for segment in reversed(range(len(rollout.checkpoints))):
            self._recompute(segment)
            for frame in reversed(self._segments[segment]):
                self._reverse(segment, frame)
                self._seed(frame, position_adjoint, velocity_adjoint)
                if feedback is not None:
                    self._seed_state(*feedback(frame, self._actuation[frame]))
        return self._collect()

    def _seed(self, frame: int, position_adjoint: FloatArray, velocity_adjoint: FloatArray) -> None:
        self._seed_state(position_adjoint[frame], velocity_adjoint[frame])

    def _seed_state(self, positions: FloatArray, velocities: FloatArray) -> None:
        """Add pulls on the robot's present state, `[worlds, robot, 3]` each."""
        solver, count = self._solver, self._solver.robot_count
        alive = solver.alive[:, None, None]
        self._state.x[0, :, :count] += solver.tensor(positions) * alive
        self._state.v[0, :, :count] += solver.tensor(velocities) * alive

    def _first_slots(self, segment: int, frame: int) -> IntArray:
        """Slot of the tape at which each world begins a frame of a segment, `[worlds]`."""
        first: IntArray = self._counts[self._segments[segment].start : frame].sum(axis=0)
        return first

    def _recompute(self, segment: int) -> None:
        solver = self._solver
        self._tape.load_slot(0, self._rollout.checkpoints[segment])
        for frame in self._segments[segment]:
            solver.set_tension(self._rollout, frame)
            solver.advance(self._tape, self._first_slots(segment, frame), self._counts[frame], stride=1)
            solver.meter.recomputed += int(self._counts[frame].sum())

    def _reverse(self, segment: int, frame: int) -> None:
        solver = self._solver
        solver.set_tension(self._rollout, frame)
        plan = solver.plan(self._first_slots(segment, frame), self._counts[frame])
        solver.launcher.reverse(self._tape, solver.parameters, plan, self._state, self._parameters)
        solver.meter.backward += int(self._counts[frame].sum())
        self._look_for_fault(frame)
        self._spread_tension(frame)

    def _look_for_fault(self, frame: int) -> None:
        """Name the first adjoint of the state that is not finite, going backwards."""
        for name in () if self._fault else ("x", "v", "C", "F"):
            broken = ~torch.isfinite(getattr(self._state, name)[0]).flatten(2).all(2)
            if broken.any():
                world, particle = (int(index) for index in broken.nonzero()[0])
                step = int(self._rollout.counts[:frame, world].sum())
                self._fault = f"adjoint of {name} by substep {step}, particle {particle}, world {world}"
                return

    def _spread_tension(self, frame: int) -> None:
        """Pull on the tension of a frame to pulls on its actuation and on the muscle membership."""
        solver, body = self._solver, self._rollout.body
        if solver.muscle_count:
            pull = self._parameters.tension.cpu().double().numpy() * solver.scene.robot.material.muscle_strength
            self._actuation[frame] += np.einsum("wpk,wp->wk", body["muscle_membership"], pull)
            self._membership += pull[:, :, None] * self._rollout.actuation[frame][:, None, :]
            self._parameters.tension.zero_()

    def _collect(self) -> Gradient:
        solver, body = self._solver, self._rollout.body
        count, robot = solver.robot_count, solver.scene.robot

        def array(tensor: torch.Tensor) -> np.ndarray:
            return tensor.cpu().double().numpy()

        mass = array(self._parameters.mass[:, :count]) * robot.volumes * robot.material.density
        volume = array(self._parameters.volume[:, :count]) * robot.volumes
        return Gradient(
            actuation=self._actuation,
            stiffness=array(self._parameters.stiffness),
            density_ratio=mass * body["occupancy"],
            occupancy=mass * body["density_ratio"] + volume - self._displaced(),
            muscle_membership=self._membership,
            fibres=array(self._parameters.fibre[0]),
            fault=self._fault,
        )

    def _displaced(self) -> np.ndarray:
        """What the medium that shares the robot's place would be worth there, by the robot's particles
        `[worlds, robot]`."""
        solver = self._solver
        medium, count = solver.scene.medium, solver.robot_count
        worth = np.zeros((solver.worlds, count))
        if medium is not None and medium.hosts is not None:
            guests = medium.hosts >= 0
            mass, volume = (
                tensor[:, count:].cpu().double().numpy()[:, guests]
                for tensor in (self._parameters.mass, self._parameters.volume)
            )
            pulls = (mass * medium.material.density + volume) * medium.volumes[guests]
            for world in range(solver.worlds):
                np.add.at(worth[world], medium.hosts[guests], pulls[world])
        return worth
