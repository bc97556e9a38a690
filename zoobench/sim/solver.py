"""The differentiable MLS-MPM solver: scene, design and actuation in; the robot's trajectory and its gradient out."""

import math
from collections.abc import Callable

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import DivergenceError, SceneError, UsageError
from zoobench.sim import runtime
from zoobench.sim.adjoint import Adjoint
from zoobench.sim.memory_budget import memory_share
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rest_cells import RestCells
from zoobench.sim.model.rollout import Feedback, FeedbackAdjoint, FloatArray, Gradient, Rollout, SubstepMeter
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.segmentation import Segmentation, segment, whole_bytes, whole_frames
from zoobench.sim.model.state import BodyState, Matter, Parameters, empty_matter, with_objects
from zoobench.sim.model.step_limits import StepLimit, choose_step
from zoobench.sim.model.tensors import LARGEST_ARRAY
from zoobench.sim.relaxation import Relaxation, delayed
from zoobench.sim.simulation import Simulation
from zoobench.sim.step_control import Diagnostics, StepControl
from zoobench.sim.tape import Tape, bytes_per_slot

__all__ = ["BodyState", "Gradient", "Rollout", "Solver", "SubstepMeter"]


class Solver:
    """Simulates one scene in a number of independent worlds that differ in body parameters and actuation.

    Args:
        scene: robot, medium, ground and arena; its effects decide which kernels are compiled.
        fidelity: the numerical settings.
        worlds: number of copies that are simulated side by side (on the CPU in turn, on one thread).
        frame_seconds: length of a control frame [s], a whole number of substeps of which every world takes its own.
        gradients: keep states so that `backward` can follow `run`.
        stiffness_max, density_ratio_min: bounds that a design may reach; the step is safe up to them.
        checkpoint_interval: frames between checkpoints; chosen by the memory if None.
        memory: size that all states and the trajectory may take together [bytes], by which it is chosen how many are
            kept for the gradient, and how many simulated again; `memory_share` if None. No result depends on it.
        start: the state of one world at time zero, as `equilibrate` gives it; the scene's own if None.
        parallel: all worlds at once, with atomic adds but for robots in their rest frame; the default on CUDA only.

    Attributes:
        simulation: the tensors and the launcher, for those who take the steps themselves.
        limit: the declared step, safe up to the bounds and `LARGEST_STRETCH`; `dt` and `substeps_per_frame` are its.
            A world takes longer or shorter ones as its state allows or demands.
        origin: the grid's first node [m], from which the positions of `matter` are measured.

    Raises:
        SceneError: the arena has more grid nodes than can be held, or on a GPU matter fills more.
        StepSizeError: the fidelity asks for a fixed step that is unsafe.
    """

    def __init__(
        self,
        scene: Scene,
        fidelity: Fidelity,
        *,
        worlds: int = 1,
        frame_seconds: float = 0.008,
        gradients: bool = False,
        stiffness_max: float = 1.0,
        density_ratio_min: float = 1.0,
        checkpoint_interval: int | None = None,
        memory: int | None = None,
        start: Matter | None = None,
        parallel: bool | None = None,
    ) -> None:
        if worlds < 1:
            raise UsageError(f"{worlds} worlds were asked for. Give at least 1.")
        self._stiffness_max, self._density_ratio_min = stiffness_max, density_ratio_min
        self.gradients = gradients
        self.checkpoint_interval = checkpoint_interval
        self._memory = memory_share(fidelity.device) if memory is None and gradients else memory or 0
        self._tape: Tape | None = None
        self.limit = choose_step(
            scene, fidelity, frame_seconds, stiffness_max=stiffness_max, density_ratio_min=density_ratio_min
        )
        self.dt, self.substeps_per_frame = self.limit.dt, self.limit.substeps_per_frame
        simulation = Simulation(
            scene, fidelity, worlds, self.limit,
            frame_seconds=frame_seconds, start=start, parallel=parallel,
        )  # fmt: skip
        self.simulation = simulation
        self.scene, self.fidelity, self.worlds, self.frame_seconds = scene, fidelity, worlds, frame_seconds
        self.robot_count, self.particle_count = simulation.robot_count, simulation.particle_count
        self.muscle_count = simulation.muscle_count
        self.launcher, self.meter, self.origin = simulation.launcher, simulation.meter, simulation.origin

    @property
    def matter(self) -> Matter:
        """The present state of all worlds, one slot."""
        return self.simulation.matter

    @property
    def parameters(self) -> Parameters:
        """Mass, volume, stiffness, fibres and tension of the particles."""
        return self.simulation.parameters

    def positions(self, world: int) -> Array:
        """Present positions of all particles of a world, the robot's first `[particle_count, 3]` [m]."""
        found: Array = self.matter.x[0, world].double().cpu().numpy() + self.simulation.origins[world]
        return found

    def flow(self, world: int) -> Array | None:
        """Present velocity of water on a grid on the lower faces of its cells `[nx, ny, nz, 3]` [m/s], or None."""
        if self.scene.water is None:
            return None
        cells = self.scene.cells(self.fidelity.grid_spacing)
        found: Array = self.matter.flow[0, world, :, :3].double().cpu().numpy().reshape(*cells, 3)
        return found

    def run(
        self,
        actuation: FloatArray,
        body: BodyState | None = None,
        progress: Callable[[int], None] | None = None,
        replay: Rollout | None = None,
        feedback: Feedback | None = None,
        equilibration: int = 0,
    ) -> Rollout:
        """Simulate an episode from the scene's initial state, or from the state of rest that follows from it.

        Args:
            actuation: `[frames, worlds, muscles]` in [-1, 1], held through each control frame.
            body: the design's arrays where they differ from the scene's robot.
            progress: called with the number of frames done, 0 at the beginning.
            replay: an earlier rollout, whose substeps to take and whose matter asleep to have sleep, from its
                equilibration on; None to choose them.
            feedback: gives each frame's actuation from the state at its beginning, in place of `actuation`.
            equilibration: frames in which the worlds come to rest before the episode, as in `equilibrate`. They are the
                first of the rollout, and its gradient is the derivative through them, too.

        Raises:
            UsageError: an array of another shape, out of range or not finite, or a rollout that cannot be replayed.
        """
        rollout, control = self.begin(actuation, body, replay, feedback, equilibration)
        relaxation = Relaxation(self.simulation)
        if progress is not None and not equilibration:
            progress(0)
        for frame in range(rollout.frames):
            control.frame(frame)
            if frame < equilibration:
                rollout.stops[frame] = relaxation.damp(is_last=frame == equilibration - 1)
                control.recorder.stop(frame)
            self.simulation.record(rollout, frame + 1, goes_on=True)
            if frame == equilibration - 1:
                control.ready(equilibration)
            if progress is not None and frame >= equilibration - 1:
                progress(frame + 1 - equilibration)
            if not self.simulation.is_alive().any():
                self.simulation.finish_records()
                for recorded in (rollout.positions, rollout.velocities, rollout.muscle_potential, rollout.offsets):
                    recorded[frame + 2 :] = recorded[frame + 1]
                break
        self.simulation.finish_records()
        return rollout

    def begin(
        self,
        actuation: FloatArray,
        body: BodyState | None = None,
        replay: Rollout | None = None,
        feedback: Feedback | None = None,
        equilibration: int = 0,
    ) -> tuple[Rollout, StepControl]:
        """An episode at its first frame, and the control of its steps; arguments and errors as of `run`."""
        rest = np.zeros((equilibration, self.worlds, self.muscle_count))
        actuation = np.concatenate([rest, self.check_actuation(actuation)])
        if feedback is not None and equilibration:
            feedback = delayed(feedback, equilibration)
        if replay is not None:
            self._check_replay(replay, len(actuation))
        rollout = self._new_rollout(actuation, self._rewind(body), equilibration)
        tape = None
        if self.gradients:
            rollout.segmentation = self._segmentation(rollout)
            tape = self._tape_of(rollout.segmentation)
        self.simulation.record(rollout, 0)
        return rollout, StepControl(self.simulation, rollout, replay, feedback, tape)

    def equilibrate(self, frames: int) -> Matter:
        """The first world's state after `frames` frames with all muscles at rest, under dynamic relaxation.

        Raises:
            DivergenceError: the scene diverges.
        """
        rest = np.zeros((frames, self.worlds, self.muscle_count))
        rollout = self._new_rollout(rest, self._rewind(None), equilibration=frames)
        control, relaxation = StepControl(self.simulation, rollout), Relaxation(self.simulation)
        for frame in range(frames):
            control.frame(frame)
            if rollout.divergences:
                raise DivergenceError(next(iter(rollout.divergences.values())))
            relaxation.damp(is_last=frame == frames - 1)
        return self.matter.world(0)

    def start_at(self, state: Matter) -> None:
        """Begin all episodes from here on at a state of one world."""
        self.simulation.start_at(state)

    def backward(
        self,
        rollout: Rollout,
        position_adjoint: FloatArray,
        velocity_adjoint: FloatArray,
        feedback: FeedbackAdjoint | None = None,
        work_adjoint: Array | None = None,
    ) -> Gradient:
        """The gradient of a loss from its adjoints of the episode's trajectory, `[frames + 1, worlds, robot, 3]` each.

        The states of the solver's last rollout may still be on the tape; those of an earlier one are computed again.

        Args:
            feedback: adjoint of the feedback that the rollout was made with.
            work_adjoint: the loss's adjoint of `Rollout.muscle_work` `[frames, worlds, muscles]` [1/J]; none if it is
                0, and nothing is computed for it then.

        Raises:
            UsageError: the solver was made without gradients.
        """
        trajectory = np.asarray(position_adjoint), np.asarray(velocity_adjoint)
        return self.adjoint(rollout).run(*trajectory, feedback, work_adjoint)

    def adjoint(self, rollout: Rollout) -> Adjoint:
        """The backward pass of a rollout, not yet run; errors as of `backward`."""
        if not self.gradients or rollout.segmentation is None:
            raise UsageError("This solver keeps no states. Make it with gradients=True.")
        return Adjoint(self.simulation, rollout, self._tape_of(rollout.segmentation))

    def release(self) -> None:
        """Free the memory of the tape; rollouts that are held can still be differentiated."""
        self._tape = None
        self.launcher.keep(0)

    def reset(self, body: BodyState | None = None) -> None:
        """Go back to the initial state with all muscles at rest, for a caller that moves on by `substeps`."""
        self._rewind(body)

    def substeps(self, count: int, dt: float | None = None) -> None:
        """Move `matter` on by `count` steps of `dt` [s], the declared one if None.

        Nothing is recorded, metered or checked for divergence, and no step is repeated.
        """
        self.simulation.substeps(count, dt or self.dt)

    def current_limit(self) -> list[StepLimit]:
        """The step that each world could take now, by its actuation, stretch, hardening and motion."""
        return Diagnostics(self.simulation).limits()

    def _rewind(self, body: BodyState | None) -> dict[str, Array]:
        """Set the body and go back to the initial state; returns the body's complete arrays."""
        arrays = (body or BodyState()).filled(self.scene, self.worlds)
        self._check_body(arrays)
        arrays = with_objects(arrays, self.scene)
        self.simulation.set_body(arrays)
        self.simulation.rewind()
        return arrays

    def _check_body(self, arrays: dict[str, Array]) -> None:
        bounds = {
            "stiffness": (0.0, max(self._stiffness_max, float(self.scene.robot.stiffness.max()))),
            "density_ratio": (min(self._density_ratio_min, float(self.scene.robot.density_ratio.min())), math.inf),
            "occupancy": (0.0, 1.0),
        }
        shapes = BodyState().filled(self.scene, self.worlds)
        for name, value in arrays.items():
            if value.shape != shapes[name].shape:
                raise UsageError(f"The body's {name} have shape {value.shape}; {shapes[name].shape} was expected.")
            low, high = bounds.get(name, (-math.inf, math.inf))
            if not ((value >= low) & (value <= high) & np.isfinite(value)).all():
                raise UsageError(
                    f"The body's {name} range from {value.min():.4g} to {value.max():.4g}; {low:g} to {high:g} was "
                    "declared when the solver was made, and the step is only safe there."
                )
        if not (arrays["occupancy"].max(1) > 0).all():
            raise SceneError("A world's body is empty: no particle has an occupancy above 0.")

    def check_actuation(self, actuation: FloatArray) -> FloatArray:
        """The actuation `[frames, worlds, muscles]` in double precision.

        Raises:
            UsageError: another shape, out of [-1, 1], or not finite.
        """
        actuation = np.asarray(actuation, dtype=np.float64)
        expected = (self.worlds, self.muscle_count)
        if actuation.ndim != 3 or actuation.shape[1:] != expected or not len(actuation):
            raise UsageError(
                f"The actuation has shape {actuation.shape}; (frames, {expected[0]}, {expected[1]}) was expected."
            )
        if not (np.abs(actuation) <= 1.0).all():
            raise UsageError("The actuation holds values outside [-1, 1] or not finite. Check the controller.")
        return actuation

    def _check_replay(self, replay: Rollout, frames: int) -> None:
        counts, expected = replay.counts, (frames, self.worlds)
        if counts.shape != expected or counts.min() < 1:
            raise UsageError(
                f"The rollout to replay has substeps of shape {counts.shape}, the smallest {counts.min()}; those of "
                f"shape {expected} and at least 1 were expected, from a rollout without divergences."
            )
        sleepers = (*expected, self.simulation.sleepers)
        if replay.asleep.shape != sleepers:
            raise UsageError(
                f"The rollout to replay has matter asleep of shape {replay.asleep.shape}; {sleepers} was expected. "
                f"Replay it in the scene and with the fidelity's sleep that it was made with."
            )

    def _new_rollout(self, actuation: FloatArray, arrays: dict[str, Array], equilibration: int = 0) -> Rollout:
        frames = len(actuation)
        elastic = self.simulation.elastic_count
        shape = (frames + 1, self.worlds, elastic, 3)
        kind = runtime.host_real(self.matter.x.dtype)
        return Rollout(
            positions=np.zeros(shape, kind),
            velocities=np.zeros(shape, kind),
            actuation=actuation.copy(),
            tension=np.zeros((frames, self.worlds, elastic), kind),
            muscle_potential=np.zeros((frames + 1, self.worlds, self.muscle_count)),
            body=arrays,
            divergences={},
            tears={},
            counts=np.zeros((frames, self.worlds), np.int64),
            retries=np.zeros(self.worlds, np.int64),
            guarded=np.zeros(self.worlds, np.int64),
            smallest_j=np.full(self.worlds, np.inf),
            stops=np.zeros((frames, self.worlds), bool),
            asleep=np.zeros((frames, self.worlds, self.simulation.sleepers), bool),
            offsets=np.zeros((frames + 1, self.worlds, 3)),
            equilibration=equilibration,
        )

    def _segmentation(self, rollout: Rollout) -> Segmentation:
        """The states of an episode to store; its substeps are counted as declared."""
        frames, substeps, rest = rollout.frames, self.substeps_per_frame, rollout.equilibration
        if self.checkpoint_interval is not None:
            return whole_frames(min(self.checkpoint_interval, frames), substeps + int(rest > 0))
        state, slot = self.matter.bytes_per_slot(), bytes_per_slot(self.scene, self.fidelity, self.matter)
        most = LARGEST_ARRAY // self.matter.state[0].numel()  # slots that can be addressed
        return segment(
            frames, substeps, rest,
            budget=min(self._memory, most * slot), slot_bytes=slot, state_bytes=state,
            other_bytes=self.worlds * _trajectory_bytes(self.scene, self.fidelity, frames),
        )  # fmt: skip

    def _tape_of(self, segmentation: Segmentation) -> Tape:
        """The tape, which is kept from one rollout to the next of its length."""
        if self._tape is None or self._tape.slots != segmentation.slots:
            self._tape = None  # its memory is freed before more is taken
            self._tape = Tape(self.simulation, segmentation.slots)
        return self._tape


def episode_memory(scene: Scene, fidelity: Fidelity, frames: int, substeps: int) -> int:
    """Memory of a gradient of an episode of one world with all its states [bytes].

    Args:
        frames, substeps: of the episode.
    """
    real, cells = runtime.real(fidelity.precision), scene.water_cells(fidelity.grid_spacing)
    nodes = 0 if fidelity.robot == "mpm" else len(RestCells.of(scene.robot, fidelity).places)
    matter = empty_matter(scene, 1, 1, real, "meta", cells, nodes)  # shapes without memory
    slot, state = bytes_per_slot(scene, fidelity, matter), matter.bytes_per_slot()
    return whole_bytes(substeps + 1, slot, state) + _trajectory_bytes(scene, fidelity, frames)


def _trajectory_bytes(scene: Scene, fidelity: Fidelity, frames: int) -> int:
    """Memory of the trajectory of one world, of its adjoints in double precision, of tensions with theirs, and of the
    record of sleep [bytes]."""
    number, per_particle = fidelity.precision // 8, (frames + 1) * scene.elastic.particle_count
    trajectory = per_particle * (2 * 3 * (number + 8) + 2 * number)
    return trajectory + (frames * scene.particle_count if fidelity.sleep else 0)
