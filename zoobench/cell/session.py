"""Worlds of a cell taken from control frame to control frame: what a policy feels, does and gets for it."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.cell.motion import motion_of
from zoobench.cell.observation import ObservationModel
from zoobench.cell.problem import Problem
from zoobench.controllers.base import observation_count
from zoobench.errors import BudgetExhaustedError, Divergence, UsageError
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from torch import Tensor

    from zoobench.sim.solver import Solver


@dataclass(frozen=True)
class Step:
    """What a control frame brought.

    Attributes:
        observations: of the state at its end, see `ObservationModel` `[worlds, observation_count]`.
        rewards: the task's `[worlds]`. Where the simulation blew up or the robot came apart, the last one before it for
            every frame that is left, if it was negative, and else 0: to end an episode early must not pay.
        terminated: where that ended the episode `[worlds]`.
        truncated: where the episode reached its length `[worlds]`.
        failures: why, in the worlds that terminated.
    """

    observations: Array
    rewards: Array
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    failures: dict[int, Divergence] = field(default_factory=dict)


class Session:
    """Worlds side by side, each in an episode of its own that the caller begins and decides on frame by frame.

    An episode gives the same numbers, to the last bit, whenever it is begun and whatever runs beside it. Every substep
    is metered, and an episode with its first frame.

    Args:
        problem: the cell with its meter and budget.
        solver: of the problem's scene; nobody else may use it.

    Raises:
        UsageError: the body has a form that depends on parameters.
    """

    def __init__(self, problem: Problem, solver: "Solver") -> None:
        from zoobench.sim.playback import Playback

        if problem.robot.space is not None:
            raise UsageError(
                f"The design {problem.spec.design.name!r} has no form before it is given parameters, and a policy "
                "moves a body that is there. Choose a design that is no design space."
            )
        self._problem, self._solver = problem, solver
        self._playback = Playback(solver)
        self._observation_model = ObservationModel(problem.body)
        rollout = self._playback.rollout
        self._starts = [
            motion_of(rollout, problem.body, problem.density, slice(world, world + 1)) for world in range(solver.worlds)
        ]
        self._over = np.ones(solver.worlds, dtype=bool)
        self._last = np.zeros(solver.worlds)
        self.failures = 0

    @property
    def worlds(self) -> int:
        """How many episodes run side by side."""
        return self._solver.worlds

    @property
    def muscle_count(self) -> int:
        """Muscles of the robot."""
        return self._problem.body.muscle_count

    @property
    def observation_count(self) -> int:
        """Numbers of an observation."""
        return observation_count(self.muscle_count)

    @property
    def times(self) -> Array:
        """Simulated time of every world since its episode began `[worlds]` [s]."""
        return np.asarray(self._playback.frames * FRAME_SECONDS, dtype=np.float64)

    def affords(self, frames: int, evaluations: int = 0) -> bool:
        """Whether the budget is expected to hold so many more frames in every world, and evaluations after them.

        Substeps are expected as in `Problem.affords`, and no episode is expected to fail.
        """
        held = self._holds(frames, evaluations)
        self._problem.meter.refused |= not held
        return held

    def _holds(self, frames: int, evaluations: int) -> bool:
        budget, meter = self._problem.spec.budget, self._problem.meter
        length = self._problem.spec.frames
        if budget.kind == "substeps":
            cost = self._problem.expected_substeps
            return meter.substeps + frames * self.worlds * cost // length + evaluations * cost <= budget.amount
        if budget.kind == "episodes":
            done = np.where(self._over, 0, self._playback.frames)
            # an episode counts from its first frame on
            begun = np.ceil((done + frames) / length) - np.ceil(done / length)
            return meter.episodes + int(begun.sum()) + evaluations <= budget.amount
        return meter.is_left(budget)

    def begin(self, worlds: Iterable[int] | None = None) -> Array:
        """Begin an episode in these worlds, in all if None; what is felt in all `[worlds, observation_count]`."""
        chosen = range(self.worlds) if worlds is None else list(worlds)
        self._playback.begin(chosen)
        self._over[chosen] = False
        self._last[chosen] = 0.0
        return self._observations()

    def step(self, activity: Array) -> Step:
        """Take every world through a control frame.

        Args:
            activity: of the muscles, in [-1, 1] `[worlds, muscle_count]`.

        Raises:
            UsageError: an episode is over and was not begun again, or activities of another shape, out of range or not
                finite.
            BudgetExhaustedError: the budget does not hold this frame; none is simulated then.
        """
        if self._over.any():
            raise UsageError(f"The episode of world {int(self._over.argmax())} is over. Begin it again before a step.")
        if not self.affords(1):
            meter, budget = self._problem.meter, self._problem.spec.budget
            raise BudgetExhaustedError(
                f"The budget of {budget} does not hold another frame in {self.worlds} worlds: "
                f"{meter.spent(budget.kind):,.6g} are spent. Give a larger budget."
            )
        self._advance(activity)
        rollout = self._playback.rollout
        failures = {**rollout.tears, **rollout.divergences}
        self.failures += len(failures)
        terminated = np.array([world in failures for world in range(self.worlds)])
        truncated = ~terminated & (self._playback.frames >= self._problem.spec.frames)
        rewards = [self._forgone(world) if world in failures else self._reward(world) for world in range(self.worlds)]
        self._over, self._last = terminated | truncated, np.array(rewards)
        return Step(self._observations(), np.array(rewards), terminated, truncated, failures)

    def _advance(self, activity: Array) -> None:
        """A frame, and what it cost."""
        meter, own, rollout = self._problem.meter, self._solver.meter, self._playback.rollout
        meter.start_clock()
        before, repeated = own.forward, int(rollout.retries.sum())
        begun = int((self._playback.frames == 0).sum())
        self._playback.frame(activity)
        meter.episodes += begun
        meter.forward += own.forward - before
        meter.retries += int(rollout.retries.sum()) - repeated

    def _observations(self) -> Array:
        return np.stack([self._feel(world) for world in range(self.worlds)])

    def _feel(self, world: int) -> Array:
        import torch

        start = self._starts[world]
        positions, velocities = self._state(world)
        presence = torch.as_tensor(self._problem.body.occupancy)
        felt: Array = self._observation_model.observe(positions, velocities, start.positions[1, 0], presence).numpy()
        return felt

    def _reward(self, world: int) -> float:
        """Of the last frame, from a motion of two states: the start, and now."""
        return float(self._problem.task.reward(self._motion(world))[-1, 0])

    def _forgone(self, world: int) -> float:
        """What a world that failed would have lost by going on as it was."""
        left = self._problem.spec.frames - int(self._playback.frames[world]) + 1
        return left * min(0.0, float(self._last[world]))

    def _motion(self, world: int) -> Motion:
        import torch

        start = self._starts[world]
        positions, velocities = self._state(world)
        return replace(
            start,
            positions=torch.stack([start.positions[1], positions[None]]),
            velocities=torch.stack([start.velocities[1], velocities[None]]),
            muscle_work=torch.as_tensor(self._playback.rollout.muscle_work[:, world : world + 1]),
            numbers=torch.tensor([0, int(self._playback.frames[world])]),
        )

    def _state(self, world: int) -> "tuple[Tensor, Tensor]":
        """Positions and velocities now `[particle_count, 3]`."""
        import torch

        rollout = self._playback.rollout
        positions, velocities = (path[1, world] for path in (rollout.positions, rollout.velocities))
        return torch.tensor(positions, dtype=torch.float64), torch.tensor(velocities, dtype=torch.float64)


def new_session(problem: Problem, worlds: int | None = None) -> Session:
    """Worlds of a problem to be taken from frame to frame, as many as the problem's if None; on its meter and budget.

    Raises:
        UsageError: the body has a form that depends on parameters, or there are no worlds.
    """
    return Session(problem, problem.new_solver(problem.worlds if worlds is None else worlds))
