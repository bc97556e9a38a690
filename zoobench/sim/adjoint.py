"""Gradients through whole episodes: stored states every N substeps, the rest recomputed (appendix E).

The reverse walks the segments between checkpoints backwards. Each is simulated again from its checkpoint into a tape of
N + 1 slots with the kernel of the forward pass, so that the recomputed states are those of the episode bit for bit.
"""

from typing import TYPE_CHECKING

import numpy as np
import torch

from zoobench.sim.rollout import FloatArray, Gradient, Rollout
from zoobench.sim.state import Parameters, empty_matter

if TYPE_CHECKING:
    from zoobench.sim.solver import Solver


class Adjoint:
    """One backward pass over one rollout."""

    def __init__(self, solver: "Solver", rollout: Rollout) -> None:
        self._solver, self._rollout = solver, rollout
        worlds, robot = solver.worlds, solver.robot_count
        real, device = solver.matter.x.dtype, str(solver.matter.x.device)
        self._tape = empty_matter(solver.scene, rollout.interval + 1, worlds, real, device)
        self._state = empty_matter(solver.scene, 1, worlds, real, device)
        self._parameters = Parameters.zeros(worlds, robot, solver.particle_count, real, device)
        self._fault = ""
        self._actuation = np.zeros(rollout.actuation.shape)
        self._membership = np.zeros(rollout.body["muscle_membership"].shape)

    def run(self, position_adjoint: FloatArray, velocity_adjoint: FloatArray) -> Gradient:
        """Walk back from the last frame to the first; `[frames + 1, worlds, robot, 3]` each."""
        solver, rollout = self._solver, self._rollout
        solver.set_body(rollout.body)
        for world in range(solver.worlds):
            solver.alive[world] = int(world not in rollout.divergences)
        self._seed(rollout.frames, position_adjoint, velocity_adjoint)
        for segment in reversed(range(len(rollout.checkpoints))):
            begin = segment * rollout.interval
            end = min(begin + rollout.interval, rollout.substeps)
            self._recompute(segment, begin, end)
            self._reverse(begin, end, position_adjoint, velocity_adjoint)
        return self._collect()

    def _seed(self, frame: int, position_adjoint: FloatArray, velocity_adjoint: FloatArray) -> None:
        solver, count = self._solver, self._solver.robot_count
        alive = solver.alive[:, None, None]
        self._state.x[0, :, :count] += solver.tensor(position_adjoint[frame]) * alive
        self._state.v[0, :, :count] += solver.tensor(velocity_adjoint[frame]) * alive

    def _pieces(self, begin: int, end: int) -> list[tuple[int, int, int]]:
        """(frame, first substep, count) of the stretches of a segment that share a control frame."""
        n = self._solver.substeps_per_frame
        return [
            (frame, max(begin, frame * n), min(end, (frame + 1) * n) - max(begin, frame * n))
            for frame in range(begin // n, (end - 1) // n + 1)
        ]

    def _recompute(self, segment: int, begin: int, end: int) -> None:
        solver = self._solver
        self._tape.load_slot(0, self._rollout.checkpoints[segment])
        for frame, first, count in self._pieces(begin, end):
            solver.set_tension(self._rollout, frame)
            solver.advance(self._tape, first - begin, 1, count)
        solver.meter.recomputed += (end - begin) * int(solver.alive.sum())

    def _reverse(self, begin: int, end: int, position_adjoint: FloatArray, velocity_adjoint: FloatArray) -> None:
        solver = self._solver
        for frame, first, count in reversed(self._pieces(begin, end)):
            solver.set_tension(self._rollout, frame)
            solver.launcher.reverse(
                self._tape,
                solver.parameters,
                solver.alive,
                self._state,
                self._parameters,
                first - begin,
                count,
            )
            self._look_for_fault(first)
            if first == frame * solver.substeps_per_frame:
                self._spread_tension(frame)
                self._seed(frame, position_adjoint, velocity_adjoint)
        solver.meter.backward += (end - begin) * int(solver.alive.sum())

    def _look_for_fault(self, step: int) -> None:
        """Name the first adjoint of the state that is not finite, going backwards."""
        for name in () if self._fault else ("x", "v", "C", "F"):
            broken = ~torch.isfinite(getattr(self._state, name)[0]).flatten(2).all(2)
            if broken.any():
                world, particle = (int(index) for index in broken.nonzero()[0])
                self._fault = f"adjoint of {name} at substep {step}, particle {particle}, world {world}"
                return

    def _spread_tension(self, frame: int) -> None:
        """Pull on the tension of a whole frame to pulls on its actuation and on the muscle membership.

        Not piece by piece: the order of the additions, and with it the last bit, would follow the checkpoints.
        """
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
            occupancy=mass * body["density_ratio"] + volume,
            muscle_membership=self._membership,
            fibres=array(self._parameters.fibre[0]),
            fault=self._fault,
        )
