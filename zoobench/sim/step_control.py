"""Step control: every world takes its own steps through a control frame, and repeats it where they were too long."""

from collections.abc import Callable
from functools import partial

import numpy as np
import torch
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.errors import Divergence
from zoobench.sim.model.diagnostics import Finding, HeldMatter, Neighbours, diagnose, torn
from zoobench.sim.model.rollout import Feedback, Rollout
from zoobench.sim.model.state import IntArray
from zoobench.sim.model.step_limits import MOST_REFINEMENT, Condition, StepLimit, object_label, step_now
from zoobench.sim.model.tensors import memory
from zoobench.sim.moving_arena import MovingArena
from zoobench.sim.simulation import Simulation
from zoobench.sim.sleep import choose_sleepers
from zoobench.sim.state_recorder import StateRecorder
from zoobench.sim.tape import Tape

GrowthOf = Callable[[int], tuple[float, int]]
"""The `Neighbours.growth` of a body by the world."""


class Diagnostics:
    """The condition of all worlds at slot 0, and the particle behind each of its worst values."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim = simulation
        like = simulation.matter.x
        self._report = torch.zeros((simulation.worlds, len(Condition._fields)), dtype=like.dtype, device=like.device)
        self._culprit = torch.zeros((simulation.worlds, 4), dtype=torch.int32, device=like.device)

    def survey(self) -> list[Condition]:
        """The present condition of every world that is alive; that of a dead one is out of date."""
        sim = self._sim
        conditions = self._look()
        if not sim.scene.water:
            return conditions
        fastest = sim.matter.flow[0, :, :, :3].abs().amax((1, 2)).tolist()
        # unlike max, np.maximum keeps a NaN
        return [
            each._replace(speed=float(np.maximum(each.speed, speed)))
            for each, speed in zip(conditions, fastest, strict=True)
        ]

    def renew(self, conditions: list[Condition]) -> list[Condition]:
        """The conditions of the same states under another activity: the robot's stiffness alone depends on it."""
        robots = self._look(self._sim.matter.robot)
        return [
            each._replace(robot_stiffness=robot.robot_stiffness) for each, robot in zip(conditions, robots, strict=True)
        ]

    def limits(self) -> list[StepLimit]:
        """The step that every world could take now, and what sets it by name."""
        sim, conditions = self._sim, self.survey()
        names = ["robot"] * sim.worlds
        least = [each.robot_stiffness for each in self._look(sim.robot_count)] if sim.scene.objects else []
        for thing in sim.scene.objects:
            # of the bodies up to this one; the stiffest is that with which it does not grow any more
            so_far = [each.robot_stiffness for each in self._look(sim.scene.slice_of(thing.name).stop)]
            label = object_label(thing.name)
            names = [label if more > now else name for name, more, now in zip(names, so_far, least, strict=True)]
            least = so_far
        return [
            step_now(sim.scene, sim.fidelity, sim.frame_seconds, condition, name)
            for condition, name in zip(conditions, names, strict=True)
        ]

    def _look(self, count: int | None = None) -> list[Condition]:
        """The condition of every world, as the kernel finds it, by its first `count` particles, by default by all."""
        sim = self._sim
        sim.launcher.survey(sim.matter, sim.parameters, sim.alive, self._report, self._culprit, count)
        return [Condition(*row) for row in memory(self._report).tolist()]

    def divergence(self, world: int, frame: int, step: int, finding: Finding) -> Divergence:
        """The finding with its time, particle and place."""
        sim, particle = self._sim, finding.particle
        if particle is None:
            particle = int(self._culprit[world, finding.column])
        x, y, z = (sim.matter.x[0, world, particle].cpu().double().numpy() + sim.origins[world]).tolist()
        return Divergence(
            world, frame, step, finding.quantity, finding.value, finding.limit, particle, (x, y, z), finding.advice,
            sim.scene.owner_of(particle),
        )  # fmt: skip


class StepControl:
    """Takes the worlds of one episode through its frames.

    A world's step follows from its condition at the beginning of the frame. If `diagnose` refuses the state at the end
    of the frame, that world is put back and repeats it with half the step, again and again down to `MOST_REFINEMENT`
    times below the declared step. A replay or a fixed step is followed without a second try.

    Attributes:
        recorder: of the states for the gradient.

    Args:
        replay: whose substeps to take, and whose matter asleep to have sleep; None to choose them.
        feedback: fills the rollout's actuation frame by frame; None if it is complete.
        tape: for the states of a rollout whose gradient may be asked for.
    """

    def __init__(
        self,
        simulation: Simulation,
        rollout: Rollout,
        replay: Rollout | None = None,
        feedback: Feedback | None = None,
        tape: Tape | None = None,
    ) -> None:
        self._sim, self._rollout = simulation, rollout
        self.recorder = StateRecorder(simulation, rollout, tape)
        self._replay = replay
        self._schedule = None if replay is None else replay.counts
        if replay is None and simulation.fidelity.step:
            self._schedule = np.full_like(rollout.counts, simulation.limit.substeps_per_frame)
        self._most = MOST_REFINEMENT * simulation.limit.substeps_per_frame
        self._before = simulation.matter.copy_slot(0)
        moves = simulation.scene.follows and simulation.fidelity.robot == "mpm"  # a robot in its rest frame needs none
        self._arena = MovingArena(simulation) if moves else None
        self._diagnostics = Diagnostics(simulation)
        self._held = HeldMatter(simulation.scene) if simulation.scene.robot.drive is not None else None
        self._feedback = feedback
        self._conditions: list[Condition] = []
        self.ready(0)

    def ready(self, frame: int, *, goes_on: bool = False) -> None:
        """Apply the actuation of a frame that is about to begin, and survey the state that its step follows from.

        `frame` does so itself at its end, for the frame after it.

        Args:
            goes_on: whether the state is that at the end of the last frame, in all worlds.
        """
        self._close_loop(frame)
        self._sim.set_tension(self._rollout, frame)
        self._conditions = self._diagnostics.renew(self._conditions) if goes_on else self._diagnostics.survey()

    def frame(self, frame: int) -> None:
        """One control frame of every world alive; one that diverges is put back to before it and marked dead."""
        sim, rollout = self._sim, self._rollout
        self.recorder.begin()
        self._follow(frame)
        self._before.load_slot(0, sim.matter)
        if frame >= rollout.equilibration:
            rollout.asleep[frame] = choose_sleepers(sim) if self._replay is None else self._replay.asleep[frame]
        sim.put_to_sleep(rollout.asleep[frame])
        counts = self._choose(frame)
        rollout.counts[frame] = counts
        pending = counts
        while substeps := sum(pending.tolist()):
            self.recorder.advance(frame, pending)
            sim.meter.count("forward", substeps, at_rest=frame < rollout.equilibration)
            # one survey serves both the check of this frame and the step of the next: the stiffness that it reports is
            # that under the actuation to come
            if frame + 1 < rollout.frames:
                self._close_loop(frame + 1)
                sim.set_tension(rollout, frame + 1)
            self._conditions = self._diagnostics.survey()
            if not (failures := self._failures(frame)):
                break
            pending = self._put_back(frame, failures)
            if pending.any():
                sim.set_tension(rollout, frame)
        growths = self._growths()
        for world, (count, condition) in enumerate(zip(counts.tolist(), self._conditions, strict=True)):
            if count:
                self._check_tears(world, frame, condition, growths)
                self._check_base(world, frame)
                rollout.guarded[world] += int(condition.guarded)
                rollout.smallest_j[world] = min(rollout.smallest_j[world], condition.smallest_j)

    def _follow(self, frame: int) -> None:
        """Move the arenas of worlds alive after their robots, before a frame of the episode."""
        sim, rollout = self._sim, self._rollout
        if self._arena is None or frame < rollout.equilibration:
            return
        moved = []
        for world in np.flatnonzero(sim.is_alive()).tolist():
            rollout.moves.pop((frame, world), None)
            if self._replay is None:
                moves = self._arena.follow(world)
            elif moves := self._replay.moves.get((frame, world), []):
                self._arena.repeat(world, moves)
            if moves:
                rollout.moves[frame, world] = moves
                moved.append(world)
        self.recorder.move(frame, moved)

    def _close_loop(self, frame: int) -> None:
        """The feedback's actuation of a frame that is about to begin; none in a world whose state is not finite."""
        if self._feedback is not None:
            self._sim.record_motion(self._rollout, frame)
            state = self._rollout.positions[frame], self._rollout.velocities[frame]
            self._rollout.actuation[frame] = np.nan_to_num(self._feedback(frame, *state))

    def _put_back(self, frame: int, failures: dict[int, Finding]) -> IntArray:
        """Put failed worlds back to before the frame.

        Returns:
            substeps to repeat it with `[worlds]`, 0 where there is nothing to repeat or the world has diverged.
        """
        sim, rollout = self._sim, self._rollout
        pending = np.zeros(sim.worlds, np.int64)
        for world, finding in failures.items():
            taken = int(rollout.counts[frame, world])
            if self._schedule is None and taken < self._most:
                rollout.counts[frame, world] = pending[world] = min(2 * taken, self._most)
                rollout.retries[world] += 1
            else:
                step = int(rollout.counts[: frame + 1, world].sum())
                rollout.divergences[world] = self._diagnostics.divergence(world, frame, step, finding)
                sim.alive[world] = 0
            sim.matter.copy_world(world, self._before)
        return pending

    def _choose(self, frame: int) -> IntArray:
        """Substeps of every world in this frame, 0 for a dead one."""
        sim = self._sim
        if self._schedule is not None:
            return np.where(sim.is_alive(), self._schedule[frame], 0).astype(np.int64)
        limits = [
            step_now(sim.scene, sim.fidelity, sim.frame_seconds, condition).substeps_per_frame if alive else 0
            for alive, condition in zip(sim.is_alive().tolist(), self._conditions, strict=True)
        ]
        return np.minimum(limits, self._most)

    def _growths(self) -> dict[str, GrowthOf]:
        """`Neighbours.growth` of every body in a world's present state; on a GPU it is found there, of all worlds."""
        sim = self._sim
        present, found = self._rollout.body["occupancy"] > 0.5, dict[str, GrowthOf]()
        for name, neighbours in sim.neighbours.items():
            own = sim.scene.slice_of(name)
            if sim.matter.state.is_cpu:
                found[name] = partial(
                    _growth_of, neighbours, sim.matter.robot_rows(0, 1)[:, own, 0, :3], present[:, own]
                )
            else:
                found[name] = neighbours.growths(sim.matter.x[0, :, own], present[:, own]).__getitem__
        return found

    def _check_tears(self, world: int, frame: int, condition: Condition, growths: dict[str, GrowthOf]) -> None:
        """Note a world in which the robot or an object has torn, by the growth of its neighbours' distances."""
        sim, rollout = self._sim, self._rollout
        if world in rollout.tears:
            return
        # in its rest frame no gap opens between cells, which share their nodes, however far they are stretched
        stretch = 0.0 if sim.fidelity.robot == "lagrangian" else condition.stretch
        for name, growth_of in growths.items():
            growth, particle = growth_of(world)
            cell = sim.fidelity.grid_spacing / (sim.scene.bodies[name].edge or sim.fidelity.particle_edge)
            particle += sim.scene.slice_of(name).start
            if finding := torn(growth, particle, stretch, cell, name):
                step = int(rollout.counts[: frame + 1, world].sum())
                rollout.tears[world] = self._diagnostics.divergence(world, frame, step, finding)
                return

    def _check_base(self, world: int, frame: int) -> None:
        """Note a world in which a base that moves has gone into the ground or into a body that is held."""
        sim, rollout = self._sim, self._rollout
        if self._held is None or world in rollout.tears:
            return
        driven = sim.driven
        places = sim.matter.x[0, world, driven].double().cpu().numpy() + sim.origins[world]
        if finding := self._held.entered(places, driven):
            step = int(rollout.counts[: frame + 1, world].sum())
            rollout.tears[world] = self._diagnostics.divergence(world, frame, step, finding)

    def _failures(self, frame: int) -> dict[int, Finding]:
        """The finding of every world alive whose state after the frame is refused."""
        sim = self._sim
        failures = {}
        states = zip(sim.is_alive().tolist(), self._rollout.counts[frame].tolist(), self._conditions, strict=True)
        for world, (alive, count, condition) in enumerate(states):
            if alive:
                finding = diagnose(condition, sim.frame_seconds / count, sim.fidelity.grid_spacing)
                if finding is not None:
                    failures[world] = finding
        return failures


def _growth_of(neighbours: Neighbours, places: Array, present: NDArray[np.bool_], world: int) -> tuple[float, int]:
    """`Neighbours.growth` of a world, from those of all of them."""
    return neighbours.growth(places[world], present[world])
