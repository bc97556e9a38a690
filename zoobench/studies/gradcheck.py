"""`zoobench gradcheck`: is the gradient the slope? Adjoints against central differences, in double precision.

Users of differentiable simulators complain of gradients that are silently wrong; this settles it for any cell, group of
parameters and horizon. Beyond some horizon contact and chaos make the path so crooked that a difference quotient means
nothing: the error grows there though the gradient is exact, and the gradient's own norm says how fast.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.problem import FRAME_SECONDS
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from zoobench.sim.rollout import Gradient, Rollout

Array = NDArray[np.float64]

GROUPS = ("actuation", "stiffness", "density_ratio", "occupancy", "muscle_membership", "fibres")
HORIZONS = (10, 50, 200)
TOLERANCE = 1e-4
JUDGED_HORIZON = 100
"""Substeps up to which the error must stay within the tolerance; what lies beyond is shown, not judged."""

_WIDTHS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
_FLOOR = 1e-3  # of |gradient| |direction|: a direction almost along the level set has no relative error worth the name


@dataclass(frozen=True)
class GradRow:
    """One directional derivative.

    Attributes:
        group: of parameters; the direction is random within it.
        substeps: the horizon, whole control frames.
        gradient_norm: of the objective by the whole group.
        derivative, difference: along the direction, by the adjoint and by the best central difference.
        relative_error: between them.
        fault: where the first adjoint that is not finite was met, or empty.
    """

    env: str
    task: str
    group: str
    substeps: int
    gradient_norm: float
    derivative: float
    difference: float
    relative_error: float
    fault: str

    @property
    def is_right(self) -> bool:
        """Within the tolerance, or beyond the horizon that is judged."""
        return not self.fault and (self.relative_error <= TOLERANCE or self.substeps > JUDGED_HORIZON)


def gradcheck(
    envs: Sequence[Ref],
    tasks: Sequence[Ref],
    *,
    design: Ref = Ref("caterpillar"),  # noqa: B008  (frozen)
    controller: Ref = Ref("sine-basis"),  # noqa: B008
    fidelity: Ref = Ref("smoke"),  # noqa: B008
    horizons: Iterable[int] = HORIZONS,
    seed: int = 0,
) -> Iterator[GradRow]:
    """Check every environment and task, one row per parameter group and horizon [substeps], as they are done.

    Raises:
        UnknownNameError, UsageError: a name or a horizon that cannot be used.
    """
    horizons = sorted(set(horizons))
    if not horizons or horizons[0] < 1:
        raise UsageError(f"Horizons of {horizons} substeps cannot be checked. Give positive numbers.")
    for env in envs:
        for task in tasks:
            cell = _Cell(env, task, design, controller, fidelity)
            frames = sorted({-(-substeps // cell.substeps_per_frame) for substeps in horizons})
            for count in frames:
                yield from cell.rows(count, np.random.default_rng(seed))


class _Cell:
    """One environment and task, simulated in double precision with the design's arrays as free parameters."""

    def __init__(self, env: Ref, task: Ref, design: Ref, controller: Ref, fidelity: Ref) -> None:
        from zoobench.sim.solver import Solver

        environment = registry.create(Kind.ENV, env)
        grid = replace(registry.create(Kind.FIDELITY, fidelity), precision=64)
        self._env, self._task = env.name, registry.create(Kind.TASK, task)
        self._controller = registry.create(Kind.CONTROLLER, controller)
        self._task_name = task.name
        body = registry.create(Kind.DESIGN, design).body(grid)
        scene = environment.scene(body, grid)
        start = Solver(scene, grid).settle(environment.settling_frames) if environment.settling_frames else None
        # bounds a little beyond the design's own values, so that there is a slope on both sides
        self._solver = Solver(scene, grid, gradients=True, start=start, stiffness_max=1.1, density_ratio_min=0.9)
        self._masses = body.masses(environment.robot.density)
        self._base = {
            "stiffness": scene.robot.stiffness[None],
            "density_ratio": scene.robot.density_ratio[None],
            "occupancy": 0.9 * scene.robot.occupancy[None],
            "muscle_membership": scene.robot.muscle_membership[None],
            "fibres": scene.robot.fibres[None],
        }

    @property
    def substeps_per_frame(self) -> int:
        """Substeps of a control frame."""
        return self._solver.substeps_per_frame

    def rows(self, frames: int, rng: np.random.Generator) -> Iterator[GradRow]:
        """All groups at one horizon."""
        base = {"actuation": self._actuation(frames, rng), **self._base}
        gradient = self._gradient(base)
        for group in GROUPS:
            slope = getattr(gradient, group)
            direction = rng.normal(size=slope.shape)
            direction /= np.abs(direction).max()
            exact = float((slope * direction).sum())
            floor = _FLOOR * float(np.linalg.norm(slope) * np.linalg.norm(direction))
            quotients = [self._quotient(base, group, direction, width) for width in _WIDTHS]
            best = min(quotients, key=lambda quotient: abs(quotient - exact))
            yield GradRow(
                env=self._env,
                task=self._task_name,
                group=group,
                substeps=frames * self.substeps_per_frame,
                gradient_norm=float(np.linalg.norm(slope)),
                derivative=exact,
                difference=best,
                relative_error=abs(best - exact) / max(abs(best), floor, np.finfo(float).tiny),
                fault=gradient.fault,
            )

    def _actuation(self, frames: int, rng: np.random.Generator) -> Array:
        import torch

        count = self._solver.muscle_count
        params = torch.as_tensor(self._controller.initial(rng, count))[None]
        times = torch.arange(frames, dtype=torch.float64) * FRAME_SECONDS
        actuation: Array = 0.9 * self._controller.actuation(params, times, count).numpy()
        return actuation

    def _run(self, arrays: dict[str, Array]) -> "Rollout":
        from zoobench.errors import DivergenceError
        from zoobench.sim.solver import BodyState

        body = BodyState(**{name: value for name, value in arrays.items() if name != "actuation"})
        rollout = self._solver.run(arrays["actuation"], body)
        if rollout.divergences:
            raise DivergenceError(rollout.divergences[0])
        return rollout

    def _motion(self, rollout: "Rollout", *, leaf: bool) -> Motion:
        import torch

        path = [torch.as_tensor(a).requires_grad_(leaf) for a in (rollout.positions, rollout.velocities)]
        return Motion(path[0], path[1], torch.as_tensor(self._masses)[None], FRAME_SECONDS)

    def _gradient(self, arrays: dict[str, Array]) -> "Gradient":
        import torch

        rollout = self._run(arrays)
        motion = self._motion(rollout, leaf=True)
        pulls = torch.autograd.grad(
            self._task.objective(motion).sum(),
            (motion.positions, motion.velocities),
            allow_unused=True,
            materialize_grads=True,
        )
        return self._solver.backward(rollout, pulls[0].numpy(), pulls[1].numpy())

    def _quotient(self, base: dict[str, Array], group: str, direction: Array, width: float) -> float:
        values = []
        for sign in (1.0, -1.0):
            rollout = self._run({**base, group: base[group] + sign * width * direction})
            values.append(float(self._task.objective(self._motion(rollout, leaf=False)).sum()))
        return (values[0] - values[1]) / (2 * width)
