"""Gradients through whole episodes from the tape, by checkpoints and recomputation where it is too short (SoftZoo,
appendix E).

The backward pass takes the segments of the episode from the last to the first. One whose states are not on the tape any
more is simulated again from its checkpoint onto the tape, with the kernel of the forward pass and the steps that it
took, so that the recomputed states are those of the episode bit for bit. One that is too long for the tape is taken by
halves, the later one first, from a state in its middle.
"""

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import torch

from zoobench.arrays import Array
from zoobench.sim import runtime
from zoobench.sim.model.rollout import ArenaMove, FeedbackAdjoint, FloatArray, Gradient, Rollout
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.segmentation import Part, halves, share
from zoobench.sim.model.state import IntArray, Matter, Parameters, empty_matter
from zoobench.sim.model.tensors import fetch, memory
from zoobench.sim.moving_arena import carry_out, end_adjoint
from zoobench.sim.simulation import Simulation
from zoobench.sim.tape import Tape
from zoobench.sim.work_adjoint import WorkAdjoint


class Adjoint:
    """One backward pass over one rollout: adjoints of its states, and the gradient that they add up to."""

    def __init__(self, simulation: Simulation, rollout: Rollout, tape: Tape) -> None:
        self._sim = sim = simulation
        self._rollout, self._tape = rollout, tape
        worlds, robot = sim.worlds, sim.elastic_count
        real, device = sim.matter.x.dtype, str(sim.matter.x.device)
        healthy = np.array([world not in rollout.divergences for world in range(worlds)])
        self._counts, self._stops = rollout.counts * healthy, rollout.stops & healthy
        self._moves = np.zeros_like(self._counts)  # after a frame
        for frame, world in rollout.moves:
            self._moves[frame - 1, world] = healthy[world]
        cells, nodes = sim.matter.flow.shape[2], sim.matter.nodes.shape[2]
        self._state = empty_matter(sim.scene, 1, worlds, real, device, cells, nodes)
        medium = sim.scene.medium
        # a medium's mass has an adjoint only where the robot's occupancy displaces it
        weighed = sim.particle_count if medium is not None and medium.hosts is not None else robot
        self._parameters = Parameters.zeros(worlds, robot, weighed, real, device)
        self._fault = ""
        self._tension = np.zeros((rollout.frames, worlds, robot), runtime.host_real(real))
        self._actuation = np.zeros(rollout.actuation.shape)
        self._work: WorkAdjoint | None = None

    def run(
        self,
        position_adjoint: FloatArray,
        velocity_adjoint: FloatArray,
        feedback: FeedbackAdjoint | None = None,
        work_adjoint: Array | None = None,
    ) -> Gradient:
        """The gradient, from the loss's adjoints of the episode; arguments as of `Solver.backward`."""
        sim, rollout, rest = self._sim, self._rollout, self._rollout.equilibration
        sim.set_body(rollout.body)
        for world in range(sim.worlds):
            sim.alive[world] = int(world not in rollout.divergences)
        if work_adjoint is not None and work_adjoint.any():
            self._work = WorkAdjoint(sim, rollout, work_adjoint)
        seeds = self._seeds(position_adjoint, velocity_adjoint)
        self._seed(seeds[rollout.frames - rest])
        for number, segment in reversed(list(enumerate(rollout.segments))):
            for frame in self._reversed(segment.start, self._parts(number), number):
                # the loss acts on the state at the frame's beginning, and so does the feedback's actuation of the frame
                self._look_for_fault(frame)
                self._take_tension(frame)
                if frame >= rest:
                    self._seed(seeds[frame - rest])
                    if feedback is not None:
                        more = feedback(frame - rest, self._actuation[frame])
                        self._seed(self._seeds(*more))
        return self._collect()

    def _parts(self, number: int) -> list[Part]:
        """The launches of a segment, of a frame or a piece of one each."""
        rollout, pieces = self._rollout, self._rollout.segmentation.pieces if self._rollout.segmentation else 1
        places = [(segment.frame, segment.piece) for segment in rollout.segments] + [(rollout.frames, 0)]
        (frame, piece), end = places[number], places[number + 1]
        parts = []
        while (frame, piece) < end:
            counts = share(self._counts[frame], piece, pieces)
            stops = self._stops[frame] * (piece == pieces - 1)
            begins = self._counts[frame] * piece // pieces == 0
            moves = self._moves[frame] * (piece == pieces - 1)
            parts.append(Part(frame, counts, stops, moves, piece == 0, begins))
            frame, piece = (frame, piece + 1) if piece + 1 < pieces else (frame + 1, 0)
        return parts

    def _reversed(self, start: Matter, parts: list[Part], segment: int | None = None) -> Iterator[int]:
        """Take the adjoint of the state back through some launches; gives every frame whose beginning it has reached.

        Args:
            start: the state before the first of them.
            segment: the number of the segment that they are.
        """
        if not self._tape.fits(np.sum([part.slots for part in parts], axis=0)):
            early, late = halves(parts)
            yield from self._reversed(self._passed(start, early), late)
            yield from self._reversed(start, early)
            return
        first = np.cumsum([np.zeros_like(parts[0].slots), *(part.slots for part in parts[:-1])], axis=0)
        if segment is None or not self._tape.holds(self._rollout, segment):
            self._recompute(start, parts, first, segment)
        for part, slots in zip(reversed(parts), reversed(first), strict=True):
            self._reverse(part, slots)
            if part.is_first:
                yield part.frame

    def _passed(self, start: Matter, parts: list[Part]) -> Matter:
        """The state after some launches."""
        state = start.copy_slot(0)
        for part in parts:
            self._advance(state, np.zeros_like(part.counts), part, stride=0)
            for world in np.flatnonzero(part.stops).tolist():
                state.stop(0, world)
            for world, move in self._moves_after(part):
                carry_out(self._sim, state, 0, world, move)
        return state

    def _moves_after(self, part: Part) -> list[tuple[int, ArenaMove]]:
        """Moves of the arenas after some launches, with their worlds, in their order."""
        moved, moves = np.flatnonzero(part.moves).tolist(), self._rollout.moves
        return [(world, move) for world in moved for move in moves[part.frame + 1, world]]

    def _recompute(self, start: Matter, parts: list[Part], first: IntArray, segment: int | None) -> None:
        """Simulate some launches onto the tape, each from its first slots `[worlds]` on."""
        self._tape.begin(start, None if segment is None else self._rollout, segment or 0)
        for part, slots in zip(parts, first, strict=True):
            self._advance(self._tape.states, slots, part, stride=1)
            self._tape.stop_after(slots + part.counts, np.flatnonzero(part.stops))
            last = slots + part.slots
            for world in np.flatnonzero(part.moves).tolist():
                self._tape.states.copy_after(int(last[world]) - 1, world)
            for world, move in self._moves_after(part):
                carry_out(self._sim, self._tape.states, int(last[world]), world, move)

    def _advance(self, states: Matter, first: IntArray, part: Part, stride: int) -> None:
        sim = self._sim
        sim.repeat_tension(self._rollout, part.frame)
        sim.put_to_sleep(self._rollout.asleep[part.frame])
        sim.advance(states, first, part.counts, stride=stride, whole=self._counts[part.frame])
        sim.meter.recomputed += int(part.counts.sum())

    def _reverse(self, part: Part, first: IntArray) -> None:
        sim = self._sim
        self._seed_work(part.frame + 1, first + part.slots)
        sim.repeat_tension(self._rollout, part.frame)
        for world, move in reversed(self._moves_after(part)):
            end_adjoint(sim, self._state, world, move)
        for world in part.stops.nonzero()[0].tolist():
            self._state.stop(0, world)  # stopped motion has no effect on later states
        sim.put_to_sleep(self._rollout.asleep[part.frame])
        plan = sim.plan(first, part.counts, self._counts[part.frame], begins=part.begins)
        sim.launcher.reverse(self._tape.states, sim.parameters, plan, self._state, self._parameters)
        sim.meter.count("backward", plan.world_substeps, at_rest=part.frame < self._rollout.equilibration)
        if part.is_first:
            self._seed_work(part.frame, first)

    def _seed_work(self, frame: int, slots: IntArray) -> None:
        """Add what the loss of the muscles' work has by the state at the beginning of a frame, once for each state.

        Args:
            slots: of the tape where the worlds have that state, or a later one if it was added already `[worlds]`.
        """
        if self._work is not None and self._work.awaits(frame):
            deformation = self._tape.states.F[torch.as_tensor(slots), torch.arange(self._sim.worlds)]
            found = self._work.by_state(frame, deformation)
            self._sim.launcher.add_deformation(self._state, found.deformation)
            self._parameters.fibre[...] += found.fibre
            self._parameters.volume[:, : self._sim.elastic_count] += found.volume

    def _seeds(self, positions: FloatArray, velocities: FloatArray) -> Any:
        """Adjoints of places and velocities `[..., worlds, robot, 3]` as the state has them, 0 in worlds not alive."""
        adjoints = self._sim.tensor(positions), self._sim.tensor(velocities)
        seeds = memory(adjoints[0].new_zeros((*positions.shape[:-1], 2, 4)))
        seeds[..., 0, :3], seeds[..., 1, :3] = map(memory, adjoints)
        seeds[..., self._sim.is_alive() == 0, :, :, :] = 0.0
        return seeds

    def _seed(self, seeds: Any) -> None:
        """Add to the adjoint of the robot's present state, `[worlds, robot, 2, 4]`; see `memory`."""
        state = self._state.memory[0, :, : self._sim.elastic_count, :2]
        state += seeds

    def _look_for_fault(self, frame: int) -> None:
        """Note the first adjoint of the state, in the order of the backward pass, that is not finite."""
        if self._fault or self._is_finite():
            return
        looked = [(name, "particle", getattr(self._state, name)[0]) for name in ("x", "v", "C", "F")]
        looked.append(("x or v", "node", self._state.nodes[0, :, :, :2]))
        for name, bearer, adjoint in looked:
            broken = ~torch.isfinite(adjoint).flatten(2).all(2)
            if broken.any():
                world, number = (int(index) for index in broken.nonzero()[0])
                step = int(self._rollout.counts[:frame, world].sum())
                self._fault = f"adjoint of {name} by substep {step}, {bearer} {number}, world {world}"
                return

    def _is_finite(self) -> bool:
        """Whether the adjoint of the state is finite for sure: one look at all of it, whose squares do not overflow."""
        state, nodes = self._state.memory, self._state.nodes
        of_nodes = float(nodes[..., :2, :].square().sum()) if nodes.numel() else 0.0
        return math.isfinite(of_nodes + (np.vdot(state, state) if isinstance(state, np.ndarray) else state.sum()))

    def _take_tension(self, frame: int) -> None:
        """Take the adjoint of a frame's tension, from which follow those of its actuation and the muscle membership."""
        tension = self._parameters.tension
        if self._sim.muscle_count and frame >= self._rollout.equilibration:
            self._actuation[frame] = self._sim.by_actuation(self._rollout, self._parameters)
            if self._work is not None:
                self._actuation[frame] += self._work.actuation[frame]
        fetch(self._tension[frame], tension)
        tension.zero_()
        self._parameters.fibre[:, self._sim.driven] = 0.0

    def _collect(self) -> Gradient:
        sim, body = self._sim, self._rollout.body
        count, robot, rest = sim.robot_count, sim.scene.robot, self._rollout.equilibration
        body = {name: array[:, :count] for name, array in body.items()}

        def array(tensor: torch.Tensor) -> np.ndarray:
            return tensor.cpu().double().numpy()

        # chain rule of `Simulation.set_body`: mass = occupancy density_ratio V rho, volume = occupancy V
        mass = array(self._parameters.mass[:, :count]) * robot.volumes * robot.material.density
        volume = array(self._parameters.volume[:, :count]) * robot.volumes
        return Gradient(
            actuation=self._actuation[rest:],
            stiffness=array(self._parameters.stiffness)[:, :count],
            density_ratio=mass * body["occupancy"],
            occupancy=mass * body["density_ratio"] + volume - self._displaced(),
            by_membership=partial(_by_membership, self._tension, self._rollout, sim.scene, self._work),
            fibres=array(self._parameters.fibre)[:, :count],
            fault=self._fault,
        )

    def _displaced(self) -> np.ndarray:
        """Derivative of the loss by the medium's share of each robot particle's place `[worlds, robot]`.

        The medium keeps the share of its volume that the robot's occupancy leaves (`state.medium_share`).
        """
        sim = self._sim
        medium, count = sim.scene.medium, sim.elastic_count
        displaced = np.zeros((sim.worlds, sim.robot_count))
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


def _by_activity(tension: FloatArray, scene: Scene) -> Array:
    """Derivative of the loss by the activity of each particle `[worlds, robot]`, from that by its tension."""
    return tension.astype(float) * scene.robot.material.muscle_strength


def _by_membership(tension: FloatArray, rollout: Rollout, scene: Scene, work: WorkAdjoint | None) -> Array:
    """Derivative of the loss by the muscle membership `[worlds, robot, muscles]`, from that by all tensions and that
    by the muscles' work."""
    found = np.zeros(rollout.body["muscle_membership"].shape)
    if work is not None:
        found += work.membership()
    for frame in reversed(range(rollout.frames if rollout.actuation.size else 0)):
        found += _by_activity(tension[frame], scene)[:, :, None] * rollout.actuation[frame][:, None, :]
    return found[:, : scene.robot.particle_count]
