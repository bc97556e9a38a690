"""One environment and task as a differentiable function of all its parameters, in double precision."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.closed_loop import FeedbackLoops
from zoobench.cell.motion import BODY_ARRAYS, MotionAdjoint, motion_of
from zoobench.cell.robot import Built, Draft, Robot
from zoobench.controllers.base import ClosedLoop
from zoobench.envs.base import Environment
from zoobench.errors import DivergenceError, SceneError, Unbuildable
from zoobench.registry import Kind
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.state import IntArray
from zoobench.sim.solver import BodyState, Solver
from zoobench.spec import FRAME_SECONDS, Ref
from zoobench.tasks.base import Motion

Arrays = dict[str, Array]

GROUPS = ("actuation", "controller", *BODY_ARRAYS, "design")
"""Groups of parameters; `controller` are those of a closed loop, which gives the actuation, and `design` those of a
design space, which gives the body's arrays."""

NUDGE = 1e-6
"""Displacement of the initial state whose growth is followed [grid spacings]."""


class GradientCase:
    """One environment and task with the design's arrays as free parameters.

    Raises:
        UnknownNameError, UsageError: a name or a parameter that cannot be used.
    """

    def __init__(
        self,
        env: Ref,
        task: Ref,
        design: Ref = Ref("caterpillar"),  # noqa: B008  (frozen)
        controller: Ref = Ref("sine-basis"),  # noqa: B008
        fidelity: Ref = Ref("smoke"),  # noqa: B008
        seed: int = 0,
    ) -> None:
        environment: Environment = registry.create(Kind.ENV, env)
        grid = environment.simulated(replace(registry.create(Kind.FIDELITY, fidelity), precision=64))
        self.env, self.task = str(env), str(task)
        self._task = registry.create(Kind.TASK, task)
        self._robot = Robot.of(design, controller, grid, task, environment)
        self._parameters = self._robot.initial(np.random.default_rng(seed))
        self._kept = self._draft({}).existing  # differences are taken of the same particles
        self._body = self._build({}).body
        scene = environment.scene(self._body, grid)
        start = equilibrated(scene, grid, environment.equilibration_frames, frame_seconds=FRAME_SECONDS)
        # bounds a little beyond the design's own values, so that both one-sided derivatives exist
        self._solver = Solver(
            scene,
            grid,
            frame_seconds=FRAME_SECONDS,
            gradients=True,
            start=start,
            stiffness_max=1.1 * float(scene.robot.stiffness.max()),
            density_ratio_min=0.9 * float(scene.robot.density_ratio.min()),
        )
        self._density = environment.robot.density
        self._arrays = {
            "stiffness": scene.robot.stiffness[None],
            "density_ratio": scene.robot.density_ratio[None],
            "occupancy": 0.9 * scene.robot.occupancy[None],
            "muscle_membership": scene.robot.muscle_membership[None],
            "fibres": scene.robot.fibres[None],
        }

    def frames(self, horizons: Sequence[int]) -> list[int]:
        """The smallest numbers of control frames that reach the horizons [substeps], without repetition."""
        longest = max(horizons)
        frames = -(-longest // self._solver.substeps_per_frame)
        taken = np.cumsum(self.run(self.base(frames)).counts[:, 0])
        while taken[-1] < longest:  # worlds take longer steps than declared where their state allows it
            frames = -(-frames * longest // int(taken[-1]))
            taken = np.cumsum(self.run(self.base(frames)).counts[:, 0])
        return sorted({int(np.searchsorted(taken, horizon)) + 1 for horizon in horizons})

    def base(self, frames: int) -> Arrays:
        """The parameters about which derivatives are taken, by group.

        Of the controller: the actuation, or the parameters of a closed loop (the actuation is then zero). Of the body:
        the design's arrays, or the parameters of a design space.
        """
        control, design = np.split(self._parameters, [self._robot.control_count])
        groups = self._arrays if self._robot.space is None else {"design": design}
        if isinstance(self._robot.controller, ClosedLoop):
            return {"actuation": np.zeros((frames, 1, self._solver.muscle_count)), "controller": control, **groups}
        return {"actuation": 0.9 * self._build({}, frames).activity.detach().numpy(), **groups}

    def run(self, arrays: Arrays, replay: Rollout | None = None) -> Rollout:
        """An episode with these parameters; `replay` prescribes the substeps and the matter asleep of every frame.

        Raises:
            DivergenceError: the simulation diverged.
        """
        built, frames = self._build(arrays), len(arrays["actuation"])
        body = {name: arrays[name] for name in BODY_ARRAYS if name in arrays}
        body |= {name: value.detach().numpy() for name, value in built.matter.items()}
        loops = FeedbackLoops.of(self._robot, [built], self._task, frames, self._solver.scene.objects)
        feedback = loops.act if loops else None
        rollout = self._solver.run(arrays["actuation"], BodyState(**body), replay=replay, feedback=feedback)
        if rollout.divergences:
            raise DivergenceError(rollout.divergences[0])
        return rollout

    def objective(self, rollout: Rollout) -> float:
        """The task's objective for a rollout."""
        return float(self._task.objective(self._motion(rollout, leaf=False)).sum())

    def objective_near(self, base: Arrays, replay: Rollout, group: str, shift: Array) -> float:
        """The objective with one group of parameters shifted, as `replay` prescribes; NaN if it diverges."""
        try:
            return self.objective(self.run({**base, group: base[group] + shift}, replay))
        except DivergenceError:
            return np.nan

    def gradient(self, rollout: Rollout, arrays: Arrays) -> tuple[Arrays, str]:
        """The gradient of the objective by every group of parameters in `arrays`, and where it is not finite."""
        built, count = self._build(arrays), self._robot.control_count
        objects, frames = self._solver.scene.objects, len(arrays["actuation"])
        loops = FeedbackLoops.of(self._robot, [built], self._task, frames, objects)
        motion = self._motion(rollout, leaf=True)
        direct = MotionAdjoint.of(self._task.objective(motion).sum(), motion)
        feedback = loops.adjoint(rollout) if loops else None
        found = self._solver.backward(rollout, direct.positions, direct.velocities, feedback, direct.muscle_work)
        by_body = direct.by_arrays(found, rollout, self._body, self._density)
        gradients = {"actuation": found.actuation, **by_body}
        parameters = built.gradient({name: gradients[name][0] for name in built.matter})
        if loops:
            parameters += loops.gradients[0]
            del gradients["actuation"]
        gradients["controller"], gradients["design"] = np.split(parameters, [count])
        return {name: gradient for name, gradient in gradients.items() if name in arrays}, found.fault

    def separation(self, frames: int, rng: np.random.Generator, nudge: float = NUDGE) -> tuple[IntArray, Array]:
        """Separation of two episodes whose initial states differ by `nudge` grid spacings, in the same substeps.

        Returns:
            substeps done `[frames + 1]`, and the root mean square distance of the robot's particles `[frames + 1]` [m].
        """
        solver = self._solver
        rollout = self.run(self.base(frames))
        shift = rng.normal(size=(solver.particle_count, 3))
        shift *= nudge * solver.fidelity.grid_spacing / np.sqrt((shift[: solver.robot_count] ** 2).sum(1).mean())
        robot = {name: values[:, : solver.robot_count] for name, values in rollout.body.items()}
        solver.reset(BodyState(**robot))
        solver.matter.x[0, 0] += solver.simulation.tensor(shift)
        solver.simulation.refresh_window()
        apart = [self._distance(rollout, 0)]
        for frame, count in enumerate(rollout.counts[:, 0].tolist()):
            solver.simulation.set_tension(rollout, frame)
            solver.substeps(count, FRAME_SECONDS / count)
            apart.append(self._distance(rollout, frame + 1))
        return np.concatenate([[0], np.cumsum(rollout.counts[:, 0])]), np.array(apart)

    def _distance(self, rollout: Rollout, frame: int) -> float:
        solver = self._solver
        here, there = (places[: solver.robot_count] for places in (solver.positions(0), rollout.positions[frame, 0]))
        return float(np.sqrt(((here - there) ** 2).sum(1).mean()))

    def _motion(self, rollout: Rollout, *, leaf: bool) -> Motion:
        return motion_of(rollout, self._body, self._solver.scene, gradient=leaf)

    def _build(self, arrays: Arrays, frames: int = 0) -> Built:
        """The relaxed robot for groups of parameters; errors as of `_draft`."""
        return self._draft(arrays, frames).relaxed(self._kept)

    def _draft(self, arrays: Arrays, frames: int = 0) -> Draft:
        """The robot for groups of parameters; those of controller and design space are random where not given.

        Raises:
            SceneError: the robot cannot be built.
        """
        control, design = np.split(self._parameters, [self._robot.control_count])
        row = np.concatenate([arrays.get("controller", control), arrays.get("design", design)])
        times = torch.arange(frames, dtype=torch.float64) * FRAME_SECONDS
        draft = self._robot.draft(torch.tensor(row[None], requires_grad=True), times)
        if draft.fault:
            raise SceneError(str(Unbuildable(draft.fault)))
        return draft
