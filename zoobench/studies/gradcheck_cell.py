"""One environment and task as a function of all its parameters, in double precision, for `gradcheck`."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench import registry
from zoobench.motion import motion_of
from zoobench.problem import FRAME_SECONDS
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from zoobench.designs.base import Body
    from zoobench.envs.base import Environment
    from zoobench.sim.rollout import Gradient, Rollout
    from zoobench.sim.solver import BodyState

Array = NDArray[np.float64]
Arrays = dict[str, Array]
Counts = NDArray[np.int64]

GROUPS = ("actuation", "stiffness", "density_ratio", "occupancy", "muscle_membership", "fibres")

NUDGE = 1e-6
"""Displacement of the initial state whose growth is followed, as a share of the grid spacing."""


def cells(
    envs: Sequence[Ref],
    tasks: Sequence[Ref],
    *,
    design: Ref = Ref("caterpillar"),  # noqa: B008  (frozen)
    controller: Ref = Ref("sine-basis"),  # noqa: B008
    fidelity: Ref = Ref("smoke"),  # noqa: B008
    seed: int = 0,
) -> Iterator["Cell"]:
    """Every environment with every task.

    Raises:
        UnknownNameError, UsageError: a name or a parameter that cannot be used.
    """
    for env in envs:
        for task in tasks:
            yield Cell(env, task, design, controller, fidelity, seed)


class Cell:
    """One environment and task with the design's arrays as free parameters."""

    def __init__(self, env: Ref, task: Ref, design: Ref, controller: Ref, fidelity: Ref, seed: int) -> None:
        from zoobench.sim.settled import settled
        from zoobench.sim.solver import Solver

        environment: Environment = registry.create(Kind.ENV, env)
        grid = replace(registry.create(Kind.FIDELITY, fidelity), precision=64)
        self.env, self.task = str(env), str(task)
        self._task = registry.create(Kind.TASK, task)
        self._body: Body = registry.create(Kind.DESIGN, design).body(grid)
        scene = environment.scene(self._body, grid)
        start = settled(scene, grid, environment.settling_frames, frame_seconds=FRAME_SECONDS)
        # bounds a little beyond the design's own values, so that there is a slope on both sides
        self._solver = Solver(
            scene,
            grid,
            frame_seconds=FRAME_SECONDS,
            gradients=True,
            start=start,
            stiffness_max=1.1,
            density_ratio_min=0.9,
        )
        self._masses = self._body.masses(environment.robot.density)
        self._controller = registry.create(Kind.CONTROLLER, controller)
        self._parameters = self._controller.initial(np.random.default_rng(seed), self._solver.muscle_count)
        self._design = {
            "stiffness": scene.robot.stiffness[None],
            "density_ratio": scene.robot.density_ratio[None],
            "occupancy": 0.9 * scene.robot.occupancy[None],
            "muscle_membership": scene.robot.muscle_membership[None],
            "fibres": scene.robot.fibres[None],
        }

    def frames(self, horizons: Sequence[int]) -> list[int]:
        """The numbers of control frames that just reach the horizons [substeps], each once."""
        longest = max(horizons)
        frames = -(-longest // self._solver.substeps_per_frame)
        taken = np.cumsum(self.run(self.base(frames)).counts[:, 0])
        while taken[-1] < longest:  # worlds take longer steps than declared where their state allows it
            frames = -(-frames * longest // int(taken[-1]))
            taken = np.cumsum(self.run(self.base(frames)).counts[:, 0])
        return sorted({int(np.searchsorted(taken, horizon)) + 1 for horizon in horizons})

    def base(self, frames: int) -> Arrays:
        """The parameters about which derivatives are taken: the design's arrays, and a controller's actuation."""
        import torch

        count = self._solver.muscle_count
        times = torch.arange(frames, dtype=torch.float64) * FRAME_SECONDS
        parameters = torch.as_tensor(self._parameters)[None]
        return {"actuation": 0.9 * self._controller.actuation(parameters, times, count).numpy(), **self._design}

    def run(self, arrays: Arrays, schedule: Counts | None = None) -> "Rollout":
        """An episode with these parameters, in steps of its own choice or as another took them.

        Raises:
            DivergenceError: it blew up.
        """
        from zoobench.errors import DivergenceError
        from zoobench.sim.solver import BodyState

        body = BodyState(**{name: value for name, value in arrays.items() if name != "actuation"})
        rollout = self._solver.run(arrays["actuation"], body, schedule=schedule)
        if rollout.divergences:
            raise DivergenceError(rollout.divergences[0])
        return rollout

    def objective(self, rollout: "Rollout") -> float:
        """The task's objective."""
        return float(self._task.objective(self._motion(rollout, leaf=False)).sum())

    def objective_near(self, base: Arrays, counts: Counts, group: str, shift: Array) -> float:
        """The objective with one group of parameters shifted, in the steps of the base; NaN if that blew up."""
        from zoobench.errors import DivergenceError

        try:
            return self.objective(self.run({**base, group: base[group] + shift}, counts))
        except DivergenceError:
            return np.nan

    def gradient(self, rollout: "Rollout") -> "Gradient":
        """Of the objective, by all parameters."""
        import torch

        motion = self._motion(rollout, leaf=True)
        pulls = torch.autograd.grad(
            self._task.objective(motion).sum(),
            (motion.positions, motion.velocities),
            allow_unused=True,
            materialize_grads=True,
        )
        return self._solver.backward(rollout, pulls[0].numpy(), pulls[1].numpy())

    def separation(self, frames: int, rng: np.random.Generator, nudge: float = NUDGE) -> tuple[Counts, Array]:
        """How two episodes part whose initial states differ by `nudge` grid spacings, in the steps of the one.

        Returns:
            substeps done `[frames + 1]`, and the root mean square distance of the robot's particles `[frames + 1]` [m].
        """
        solver = self._solver
        rollout = self.run(self.base(frames))
        shift = rng.normal(size=(solver.particle_count, 3))
        shift *= nudge * solver.fidelity.grid_spacing / np.sqrt((shift[: solver.robot_count] ** 2).sum(1).mean())
        solver.reset(_body_state(rollout))
        solver.matter.x[0, 0] += solver.tensor(shift)
        solver.refresh_window()
        apart = [self._distance(rollout, 0)]
        for frame, count in enumerate(rollout.counts[:, 0].tolist()):
            solver.set_tension(rollout, frame)
            solver.substeps(count, FRAME_SECONDS / count)
            apart.append(self._distance(rollout, frame + 1))
        return np.concatenate([[0], np.cumsum(rollout.counts[:, 0])]), np.array(apart)

    def _distance(self, rollout: "Rollout", frame: int) -> float:
        solver = self._solver
        here = solver.matter.x[0, 0, : solver.robot_count].numpy() + solver.origin
        return float(np.sqrt(((here - rollout.positions[frame, 0]) ** 2).sum(1).mean()))

    def _motion(self, rollout: "Rollout", *, leaf: bool) -> Motion:
        return motion_of(rollout, self._body, self._masses, slice(None), FRAME_SECONDS, gradient=leaf)


def _body_state(rollout: "Rollout") -> "BodyState":
    from zoobench.sim.solver import BodyState

    return BodyState(**rollout.body)
