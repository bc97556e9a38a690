"""Gradients through whole episodes by checkpoints and recomputation (SoftZoo, appendix E).

The backward pass takes the segments between checkpoints from the last to the first. Each is simulated again from its
checkpoint into a tape of one slot for each substep, with the kernel of the forward pass and the steps that it took, so
that the recomputed states are those of the episode bit for bit.
"""

from typing import Literal

import numpy as np
import torch

from zoobench.sim.model.rollout import FeedbackAdjoint, FloatArray, Gradient, Rollout
from zoobench.sim.model.state import IntArray, Parameters, empty_matter
from zoobench.sim.simulation import Simulation


class Adjoint:
    """One backward pass over one rollout: adjoints of its states, and the gradient that they add up to."""

    def __init__(self, simulation: Simulation, rollout: Rollout) -> None:
        self._sim = sim = simulation
        self._rollout = rollout
        worlds, robot = sim.worlds, sim.robot_count
        real, device = sim.matter.x.dtype, str(sim.matter.x.device)
        healthy = np.array([world not in rollout.divergences for world in range(worlds)])
        self._counts = rollout.counts * healthy
        # a stop takes a slot of the tape: the reverse of a frame reads the velocities before it
        self._stops = rollout.stops & healthy
        self._slots = self._counts + self._stops
        self._segments = [
            range(begin, min(begin + rollout.interval, rollout.frames))
            for begin in range(0, rollout.frames, rollout.interval)
        ]
        longest = max(int(self._slots[segment].sum(axis=0).max()) for segment in self._segments)
        self._tape = empty_matter(sim.scene, longest + 1, worlds, real, device)
        self._state = empty_matter(sim.scene, 1, worlds, real, device)
        medium = sim.scene.medium
        # a medium's mass has an adjoint only where the robot's occupancy displaces it
        weighed = sim.particle_count if medium is not None and medium.hosts is not None else robot
        self._parameters = Parameters.zeros(worlds, robot, weighed, real, device)
        self._fault = ""
        self._actuation = np.zeros(rollout.actuation.shape)
        self._membership = np.zeros(rollout.body["muscle_membership"].shape)

    def run(
        self, position_adjoint: FloatArray, velocity_adjoint: FloatArray, feedback: FeedbackAdjoint | None = None
    ) -> Gradient:
        """The gradient, from the loss's adjoints of the episode's trajectory `[frames + 1, worlds, robot, 3]` each."""
        sim, rollout, rest = self._sim, self._rollout, self._rollout.equilibration
        sim.set_body(rollout.body)
        for world in range(sim.worlds):
            sim.alive[world] = int(world not in rollout.divergences)
        self._seed(position_adjoint[rollout.frames - rest], velocity_adjoint[rollout.frames - rest])
        for segment in reversed(range(len(rollout.checkpoints))):
            self._recompute(segment)
            for frame in reversed(self._segments[segment]):
                # the loss acts on the state at the frame's beginning, and so does the feedback's actuation of the frame
                self._reverse(segment, frame)
                if frame >= rest:
                    self._seed(position_adjoint[frame - rest], velocity_adjoint[frame - rest])
                    if feedback is not None:
                        self._seed(*feedback(frame - rest, self._actuation[frame]))
        return self._collect()

    def _seed(self, positions: FloatArray, velocities: FloatArray) -> None:
        """Add to the adjoint of the robot's present state, `[worlds, robot, 3]` each."""
        sim, count = self._sim, self._sim.robot_count
        alive = sim.alive[:, None, None]
        self._state.x[0, :, :count] += sim.tensor(positions) * alive
        self._state.v[0, :, :count] += sim.tensor(velocities) * alive

    def _first_slots(self, segment: int, frame: int) -> IntArray:
        """Slot of the tape at which each world begins a frame of a segment, `[worlds]`."""
        first: IntArray = self._slots[self._segments[segment].start : frame].sum(axis=0)
        return first

    def _recompute(self, segment: int) -> None:
        sim = self._sim
        self._tape.load_slot(0, self._rollout.checkpoints[segment])
        for frame in self._segments[segment]:
            sim.set_tension(self._rollout, frame)
            first = self._first_slots(segment, frame)
            sim.advance(self._tape, first, self._counts[frame], stride=1)
            for world in np.flatnonzero(self._stops[frame]).tolist():
                self._tape.stop_after(int(first[world] + self._counts[frame, world]), world)
            self._count("recomputed", frame)

    def _reverse(self, segment: int, frame: int) -> None:
        sim = self._sim
        sim.set_tension(self._rollout, frame)
        for world in np.flatnonzero(self._stops[frame]).tolist():
            self._state.stop(0, world)  # what was stopped has no effect on what follows
        plan = sim.plan(self._first_slots(segment, frame), self._counts[frame])
        sim.launcher.reverse(self._tape, sim.parameters, plan, self._state, self._parameters)
        self._count("backward", frame)
        self._look_for_fault(frame)
        self._spread_tension(frame)

    def _count(self, kind: Literal["recomputed", "backward"], frame: int) -> None:
        at_rest = frame < self._rollout.equilibration
        self._sim.meter.count(kind, int(self._counts[frame].sum()), at_rest=at_rest)

    def _look_for_fault(self, frame: int) -> None:
        """Note the first adjoint of the state, in the order of the backward pass, that is not finite."""
        for name in () if self._fault else ("x", "v", "C", "F"):
            broken = ~torch.isfinite(getattr(self._state, name)[0]).flatten(2).all(2)
            if broken.any():
                world, particle = (int(index) for index in broken.nonzero()[0])
                step = int(self._rollout.counts[:frame, world].sum())
                self._fault = f"adjoint of {name} by substep {step}, particle {particle}, world {world}"
                return

    def _spread_tension(self, frame: int) -> None:
        """From the adjoint of a frame's tension, add to those of its actuation and of the muscle membership."""
        sim, body = self._sim, self._rollout.body
        if sim.muscle_count:
            activity = self._parameters.tension.cpu().double().numpy() * sim.scene.robot.material.muscle_strength
            self._actuation[frame] += np.einsum("wpk,wp->wk", body["muscle_membership"], activity)
            self._membership += activity[:, :, None] * self._rollout.actuation[frame][:, None, :]
            self._parameters.tension.zero_()

    def _collect(self) -> Gradient:
        sim, body = self._sim, self._rollout.body
        count, robot = sim.robot_count, sim.scene.robot

        def array(tensor: torch.Tensor) -> np.ndarray:
            return tensor.cpu().double().numpy()

        # chain rule of `Simulation.set_body`: mass = occupancy density_ratio V rho, volume = occupancy V
        mass = array(self._parameters.mass[:, :count]) * robot.volumes * robot.material.density
        volume = array(self._parameters.volume[:, :count]) * robot.volumes
        return Gradient(
            actuation=self._actuation[self._rollout.equilibration :],
            stiffness=array(self._parameters.stiffness),
            density_ratio=mass * body["occupancy"],
            occupancy=mass * body["density_ratio"] + volume - self._displaced(),
            muscle_membership=self._membership,
            fibres=array(self._parameters.fibre),
            fault=self._fault,
        )

    def _displaced(self) -> np.ndarray:
        """Derivative of the loss by the medium's share of each robot particle's place `[worlds, robot]`.

        The medium keeps the share of its volume that the robot's occupancy leaves (`state.medium_share`).
        """
        sim = self._sim
        medium, count = sim.scene.medium, sim.robot_count
        displaced = np.zeros((sim.worlds, count))
        if medium is not None and medium.hosts is not None:
            guests = medium.hosts >= 0
            mass, volume = (
                tensor[:, count:].cpu().double().numpy()[:, guests]
                for tensor in (self._parameters.mass, self._parameters.volume)
            )
            shares = (mass * medium.material.density + volume) * medium.volumes[guests]
            for world in range(sim.worlds):
                np.add.at(displaced[world], medium.hosts[guests], shares[world])
        return displaced
