"""The differentiable MLS-MPM solver: scenes, worlds and control frames in; the robot's path and its gradient out."""

import math
from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from zoobench.errors import DivergenceError, SceneError, UsageError
from zoobench.sim import runtime
from zoobench.sim.adjoint import Adjoint
from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.launcher import Launcher
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rollout import Feedback, FeedbackAdjoint, FloatArray, Gradient, Rollout, SubstepMeter
from zoobench.sim.model.scene import Effect, Scene
from zoobench.sim.model.state import BodyState, IntArray, LaunchPlan, Matter, Parameters, initial_matter, medium_share
from zoobench.sim.model.step_limits import StepLimit, choose_step
from zoobench.sim.step_control import Diagnostics, StepControl

__all__ = ["BodyState", "Gradient", "Rollout", "Solver", "SubstepMeter"]


class Solver:
    """Simulates one scene in a number of independent worlds that differ in body parameters and actuation.

    Args:
        scene: what is simulated; its effects decide what is compiled.
        fidelity: how finely.
        worlds: how many copies run side by side (on the CPU in turn, on one thread).
        frame_seconds: length of a control frame [s], a whole number of substeps of which every world takes its own.
        gradients: keep checkpoints so that `backward` can follow `run`.
        stiffness_max, density_ratio_min: bounds that a design may reach; the step is safe up to them.
        checkpoint_interval: frames between stored states; what stores the fewest states if not given.
        memory_budget: bytes that checkpoints and the recomputed segment may take; sets the interval where given.
        device: `cpu`, or `cuda` where there is one.
        start: the state of one world at time zero, as `equilibrate` gives it; the scene's own if None.
        parallel: all worlds at once with atomic adds; the default on CUDA only, where it pays.

    Attributes:
        limit: the declared step, safe up to the bounds and the stretch that are meant; `dt` and
            `substeps_per_frame` are its. A world takes longer or shorter ones as its state allows or demands.

    Raises:
        SceneError: the arena has more grid nodes than can be held.
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
        memory_budget: int | None = None,
        start: Matter | None = None,
        device: runtime.Device = "cpu",
        parallel: bool | None = None,
    ) -> None:
        if worlds < 1:
            raise UsageError(f"{worlds} worlds were asked for. Give at least 1.")
        self._generation = runtime.start(fidelity.precision, device)
        self._real = runtime.real(fidelity.precision)
        self._device = device
        self.scene, self.fidelity, self.worlds = scene, fidelity, worlds
        self.gradients = gradients
        self.checkpoint_interval, self.memory_budget = checkpoint_interval, memory_budget
        self.frame_seconds = frame_seconds
        self.limit = choose_step(
            scene, fidelity, frame_seconds, stiffness_max=stiffness_max, density_ratio_min=density_ratio_min
        )
        self._stiffness_max, self._density_ratio_min = stiffness_max, density_ratio_min
        self.dt, self.substeps_per_frame = self.limit.dt, self.limit.substeps_per_frame
        self.effects = scene.effects
        self.meter = SubstepMeter()
        self.launcher = Launcher(
            scene,
            fidelity,
            worlds,
            self._real,
            device,
            device == "cuda" if parallel is None else parallel,
        )
        self.origin = np.array(scene.lower) - WALL_NODES * fidelity.grid_spacing
        self.matter = initial_matter(scene, worlds, self.origin, self._real, device)
        self.refresh_window()
        if start is not None:
            self.matter.load_slot(0, start)
        self._start = self.matter.copy_slot(0)
        self.parameters = Parameters.zeros(worlds, self.robot_count, self.particle_count, self._real, device)
        self.alive = torch.ones(worlds, dtype=torch.int32, device=device)
        self._plan = LaunchPlan.none(worlds, self._real, device)
        self.set_body(BodyState().filled(scene, worlds))

    @property
    def robot_count(self) -> int:
        """Particles of the robot."""
        return self.scene.robot.particle_count

    @property
    def particle_count(self) -> int:
        """Particles of one world."""
        return self.scene.particle_count

    @property
    def muscle_count(self) -> int:
        """Muscles of the robot; 0 if the scene calls for no muscle effect."""
        return self.scene.robot.muscle_count if Effect.MUSCLE in self.effects else 0

    def run(
        self,
        actuation: FloatArray,
        body: BodyState | None = None,
        progress: Callable[[int], None] | None = None,
        schedule: IntArray | None = None,
        feedback: Feedback | None = None,
    ) -> Rollout:
        """Simulate an episode from the scene's initial state.

        Args:
            actuation: `[frames, worlds, muscles]` in [-1, 1], held through each control frame.
            body: the design's arrays where they differ from the scene's robot.
            progress: called with the number of frames done.
            schedule: `[frames, worlds]` substeps to take, the `counts` of an earlier rollout; None to choose them.
            feedback: gives each frame's actuation from the state at its beginning; that of `actuation` is not used.

        Raises:
            UsageError: an array of another shape, out of range or not finite.
        """
        rollout, control = self.begin(actuation, body, schedule, feedback)
        for frame in range(rollout.frames):
            if rollout.interval and frame % rollout.interval == 0:
                rollout.checkpoints.append(self.matter.copy_slot(0))
            control.frame(frame)
            self.record(rollout, frame + 1)
            if progress is not None:
                progress(frame + 1)
            if not self.alive.any():
                self._repeat_last(rollout, frame + 1)
                break
        return rollout

    def begin(
        self,
        actuation: FloatArray,
        body: BodyState | None = None,
        schedule: IntArray | None = None,
        feedback: Feedback | None = None,
    ) -> tuple[Rollout, StepControl]:
        """An episode that has only begun, and what takes it through its frames; arguments and errors as of `run`."""
        self._check_runtime()
        actuation = self.check_actuation(actuation)
        arrays = (body or BodyState()).filled(self.scene, self.worlds)
        self._check_body(arrays)
        self.set_body(arrays)
        if schedule is not None:
            schedule = self._check_schedule(np.asarray(schedule), len(actuation))
        rollout = self._new_rollout(actuation, arrays)
        self._rewind()
        self.record(rollout, 0)
        return rollout, StepControl(self, rollout, schedule, feedback)

    def restart(self, world: int) -> None:
        """Put one world back to the initial state, alive; the others stay as they are."""
        self.matter.copy_world(world, self._start)
        self.alive[world] = 1

    def equilibrate(self, frames: int) -> Matter:
        """The first world's state after `frames` frames of rest under damping; nothing of it is metered.

        Dynamic relaxation: all matter is stopped whenever its kinetic energy has passed a peak, so that what the
        loads do not hold in motion comes to rest in a few periods of its slowest wave (Barnes 1999).

        Raises:
            DivergenceError: the scene does not come to rest but blows up.
        """
        self._check_runtime()
        rollout = self._new_rollout(
            np.zeros((frames, self.worlds, self.muscle_count)), BodyState().filled(self.scene, self.worlds)
        )
        self.set_body(rollout.body)
        self._rewind()
        control = StepControl(self, rollout)
        energy = 0.0
        for frame in range(frames):
            control.frame(frame)
            if rollout.divergences:
                raise DivergenceError(next(iter(rollout.divergences.values())))
            before, energy = energy, float((self.parameters.mass[:, :, None] * self.matter.v[0] ** 2).sum())
            if energy < before or frame == frames - 1:
                self.matter.v.zero_()
                self.matter.C.zero_()
                energy = 0.0
        return Matter(*(tensor[:, :1].clone() for tensor in self.matter.tensors()))

    def backward(
        self,
        rollout: Rollout,
        position_adjoint: FloatArray,
        velocity_adjoint: FloatArray,
        feedback: FeedbackAdjoint | None = None,
    ) -> Gradient:
        """Derivatives of a scalar whose derivatives by the path are given, `[frames + 1, worlds, robot, 3]` each.

        A rollout with a feedback needs its adjoint.

        Raises:
            UsageError: the solver was made without gradients.
        """
        self._check_runtime()
        if not self.gradients:
            raise UsageError("This solver keeps no checkpoints. Make it with gradients=True.")
        return Adjoint(self, rollout).run(np.asarray(position_adjoint), np.asarray(velocity_adjoint), feedback)

    def reset(self, body: BodyState | None = None) -> None:
        """Go back to the initial state at rest of all muscles, for a study that moves on by `substeps`."""
        self._check_runtime()
        arrays = (body or BodyState()).filled(self.scene, self.worlds)
        self._check_body(arrays)
        self.set_body(arrays)
        self._rewind()

    def substeps(self, count: int, dt: float | None = None) -> None:
        """Move `matter` (slot 0) on by `count` steps `dt` [s], the declared one if None, whatever comes of it.

        No record, no check, no second try.
        """
        self._plan.set(
            np.zeros(self.worlds, np.int64), np.full(self.worlds, count), np.full(self.worlds, dt or self.dt)
        )
        self.launcher.advance(self.matter, self.parameters, self._plan, 0)

    def current_limit(self) -> list[StepLimit]:
        """The step that each world could take now, by its actuation, stretch, hardening and motion."""
        return Diagnostics(self).limits()

    def _rewind(self) -> None:
        self.matter.load_slot(0, self._start)
        self.alive.fill_(1)
        self.parameters.tension.zero_()

    def plan(self, first: IntArray, counts: IntArray) -> LaunchPlan:
        """What to launch for frames of `counts` substeps from the slots `first` on, `[worlds]` each."""
        self._plan.set(first, counts, self.frame_seconds / np.maximum(counts, 1))
        return self._plan

    def advance(self, matter: Matter, first: IntArray, counts: IntArray, stride: int) -> None:
        """A frame of `counts` substeps from the slots `first` on, `[worlds]` each, to `stride` slots further."""
        self.launcher.advance(matter, self.parameters, self.plan(first, counts), stride)

    def refresh_window(self) -> None:
        """Find the grid nodes that the particles touch, after their positions were set from outside."""
        width = self.fidelity.spline.width
        base = torch.floor(self.matter.x[0] / self.fidelity.grid_spacing - (0.5 * width - 1.0)).int()
        self.matter.window[0, :, :3] = base.amin(1)
        self.matter.window[0, :, 3:] = base.amax(1) + width

    def set_body(self, arrays: dict[str, NDArray[np.float64]]) -> None:
        """Give the particles mass, volume, stiffness and fibres from a design's complete arrays."""
        robot, medium, count = self.scene.robot, self.scene.medium, self.robot_count
        volume = arrays["occupancy"] * robot.volumes
        mass = volume * arrays["density_ratio"] * robot.material.density
        self.parameters.volume[:, :count] = self.tensor(volume)
        self.parameters.mass[:, :count] = self.tensor(mass)
        self.parameters.stiffness[:] = self.tensor(arrays["stiffness"])
        self.parameters.fibre[0] = self.tensor(arrays["fibres"])
        if medium is not None:
            room = medium.volumes * medium_share(medium, arrays["occupancy"])
            self.parameters.volume[:, count:] = self.tensor(room)
            self.parameters.mass[:, count:] = self.tensor(room * medium.material.density)

    def _check_body(self, arrays: dict[str, NDArray[np.float64]]) -> None:
        bounds = {
            "stiffness": (0.0, max(self._stiffness_max, float(self.scene.robot.stiffness.max()))),
            "density_ratio": (
                min(self._density_ratio_min, float(self.scene.robot.density_ratio.min())),
                math.inf,
            ),
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

    def _check_schedule(self, schedule: IntArray, frames: int) -> IntArray:
        expected = (frames, self.worlds)
        if schedule.shape != expected or schedule.dtype.kind not in "iu" or schedule.min() < 1:
            raise UsageError(
                f"The schedule has shape {schedule.shape}, type {schedule.dtype} and smallest entry {schedule.min()}; "
                f"whole numbers from 1 on of shape {expected} were expected, from a rollout without divergences."
            )
        return schedule

    def _check_runtime(self) -> None:
        if self._generation != runtime.generation():
            raise UsageError("The runtime was restarted with another precision. Make a new solver.")

    def _new_rollout(self, actuation: FloatArray, arrays: dict[str, NDArray[np.float64]]) -> Rollout:
        frames = len(actuation)
        shape = (frames + 1, self.worlds, self.robot_count, 3)
        kind = runtime.host_real(self._real)
        return Rollout(
            positions=np.zeros(shape, kind),
            velocities=np.zeros(shape, kind),
            actuation=actuation.copy(),
            muscle_potential=np.zeros((frames + 1, self.worlds, self.muscle_count)),
            body=arrays,
            divergences={},
            tears={},
            counts=np.zeros((frames, self.worlds), np.int64),
            retries=np.zeros(self.worlds, np.int64),
            guarded=np.zeros(self.worlds, np.int64),
            smallest_j=np.full(self.worlds, np.inf),
            interval=self._choose_interval(frames) if self.gradients else 0,
        )

    def _choose_interval(self, frames: int) -> int:
        """Frames between checkpoints; the states to store are counted with the declared substeps."""
        if self.checkpoint_interval is not None:
            return min(self.checkpoint_interval, frames)
        intervals = range(1, frames + 1)
        needed = [interval * self.substeps_per_frame + 1 + math.ceil(frames / interval) for interval in intervals]
        if self.memory_budget is None:
            return intervals[int(np.argmin(needed))]
        states = self.memory_budget // self.matter.bytes_per_slot()
        if min(needed) > states:
            raise UsageError(
                f"Gradients of {frames} frames need at least {min(needed)} stored states of "
                f"{self.matter.bytes_per_slot()} bytes; the memory budget holds {states}. Give more memory or fewer "
                "frames."
            )
        return max(interval for interval, count in zip(intervals, needed, strict=True) if count <= states)

    def set_tension(self, rollout: Rollout, frame: int) -> None:
        """Apply a control frame's actuation: the active stress of every robot particle."""
        if self.muscle_count:
            share = np.einsum("wpk,wk->wp", rollout.body["muscle_membership"], rollout.actuation[frame])
            self.parameters.tension[:] = self.tensor(share * self.scene.robot.material.muscle_strength)

    def record(self, rollout: Rollout, frame: int) -> None:
        """Put the robot's present state into the rollout as that at the beginning of a frame."""
        count = self.robot_count
        rollout.positions[frame] = self.matter.x[0, :, :count].cpu().numpy() + self.origin
        rollout.velocities[frame] = self.matter.v[0, :, :count].cpu().numpy()
        if self.muscle_count:
            rollout.muscle_potential[frame] = self._muscle_potential(rollout)

    def _muscle_potential(self, rollout: Rollout) -> NDArray[np.float64]:
        """Active energy per unit of activity, `[worlds, muscles]` [J]; see `Rollout.muscle_work`."""
        deformation = self.matter.F[0, :, : self.robot_count].double()
        stretched = torch.einsum("wpij,wpj->wpi", deformation, self.parameters.fibre[0].double())
        volume = self.parameters.volume[:, : self.robot_count].double()
        density = 0.5 * self.scene.robot.material.muscle_strength * volume * (stretched**2).sum(dim=-1)
        potential: NDArray[np.float64] = np.einsum(
            "wpk,wp->wk", rollout.body["muscle_membership"], density.cpu().numpy()
        )
        return potential

    @staticmethod
    def _repeat_last(rollout: Rollout, frame: int) -> None:
        rollout.positions[frame + 1 :] = rollout.positions[frame]
        rollout.velocities[frame + 1 :] = rollout.velocities[frame]
        rollout.muscle_potential[frame + 1 :] = rollout.muscle_potential[frame]

    def tensor(self, value: FloatArray) -> Tensor:
        """An array in the simulation's precision on its device."""
        return torch.as_tensor(np.ascontiguousarray(value), dtype=self._real, device=self._device)
