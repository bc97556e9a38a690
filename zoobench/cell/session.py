"""Episodes of a cell frame by frame: observations, actions and rewards of a policy."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.cell.motion import motion_of
from zoobench.cell.observation import ObservationModel, seen_by
from zoobench.cell.problem import Problem
from zoobench.errors import BudgetExhaustedError, Divergence, UsageError
from zoobench.spec import FRAME_SECONDS

if TYPE_CHECKING:
    from torch import Tensor

    from zoobench.sim.solver import Solver


@dataclass(frozen=True)
class Step:
    """The result of a control frame.

    Attributes:
        observations: of the state at its end, see `ObservationModel` `[worlds, observation_count]`.
        rewards: the task's `[worlds]`. Where the simulation diverged or the robot tore, the sum of the last reward over
            all remaining frames if it was negative, else 0: an early end must not be an advantage.
        terminated: whether such a failure ended the episode `[worlds]`.
        truncated: whether the episode reached its length `[worlds]`.
        failures: by world, where terminated.
    """

    observations: Array
    rewards: Array
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    failures: dict[int, Divergence] = field(default_factory=dict)


class Session:
    """Worlds side by side, each with its own episode, which the caller begins and controls frame by frame.

    An episode gives the same numbers bit for bit whenever it begins and whatever runs beside it. Every substep is
    metered; an episode is counted at its first frame.

    Args:
        problem: the cell with its meter and budget.
        solver: of the problem's scene, for this session alone.

    Raises:
        UsageError: the design is a design space.
    """

    def __init__(self, problem: Problem, solver: "Solver") -> None:
        from zoobench.sim.playback import Playback

        if problem.robot.space is not None:
            raise UsageError(
                f"The design {problem.spec.design.name!r} is a design space, and a policy needs a fixed body. "
                "Choose another design."
            )
        self._problem, self._solver = problem, solver
        self._playback = Playback(solver)
        task = seen_by(problem.robot.controller, problem.task)
        self._observation_model = ObservationModel(problem.body, task, problem.spec.frames)
        rollout = self._playback.rollout
        self._starts = [
            motion_of(rollout, problem.body, problem.density, slice(world, world + 1)) for world in range(solver.worlds)
        ]
        self._over = np.ones(solver.worlds, dtype=bool)
        self._last = np.zeros(solver.worlds)
        self.failures = 0

    @property
    def worlds(self) -> int:
        """Number of episodes side by side."""
        return self._solver.worlds

    @property
    def muscle_count(self) -> int:
        """Number of the robot's muscles."""
        return self._problem.body.muscle_count

    @property
    def observation_count(self) -> int:
        """Length of an observation."""
        return self._observation_model.count

    @property
    def times(self) -> Array:
        """Simulated time of every world since its episode began `[worlds]` [s]."""
        return np.asarray(self._playback.frames * FRAME_SECONDS, dtype=np.float64)

    def affords(self, frames: int, evaluations: int = 0) -> bool:
        """Whether the budget is expected to suffice for so many more frames in every world and evaluations after them.

        Substeps are estimated as in `Problem.affords`, without failures.
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
            # an episode is counted at its first frame
            begun = np.ceil((done + frames) / length) - np.ceil(done / length)
            return meter.episodes + int(begun.sum()) + evaluations <= budget.amount
        return meter.is_left(budget)

    def begin(self, worlds: Iterable[int] | None = None) -> Array:
        """Begin an episode in these worlds, by default in all; observations of all `[worlds, observation_count]`."""
        chosen = range(self.worlds) if worlds is None else list(worlds)
        self._playback.begin(chosen)
        self._over[chosen] = False
        self._last[chosen] = 0.0
        return self._observations()

    def step(self, activity: Array) -> Step:
        """Simulate a control frame in every world.

        Args:
            activity: of the muscles, in [-1, 1] `[worlds, muscle_count]`.

        Raises:
            UsageError: an episode is over and was not begun again, or `activity` has another shape or range.
            BudgetExhaustedError: the budget does not suffice for this frame; nothing is simulated.
        """
        if self._over.any():
            raise UsageError(f"The episode of world {int(self._over.argmax())} is over. Begin it again before a step.")
        if not self.affords(1):
            meter, budget = self._problem.meter, self._problem.spec.budget
            raise BudgetExhaustedError(
                f"The budget of {budget} does not suffice for another frame in {self.worlds} worlds: "
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
        """Simulate a frame and meter it."""
        meter, own, rollout = self._problem.meter, self._solver.meter, self._playback.rollout
        meter.start_clock()
        before, repeated = own.forward, int(rollout.retries.sum())
        begun = int((self._playback.frames == 0).sum())
        self._playback.frame(activity)
        meter.episodes += begun
        meter.forward += own.forward - before
        meter.retries += int(rollout.retries.sum()) - repeated

    def _observations(self) -> Array:
        """Of all worlds `[worlds, observation_count]`."""
        import torch

        observe, occupancy = self._observation_model.observe, torch.as_tensor(self._problem.body.occupancy)
        frames, starts = self._playback.frames.tolist(), [start.positions[1, 0] for start in self._starts]
        seen = [
            observe(frame, *self._state(world), start, occupancy).numpy()
            for world, (frame, start) in enumerate(zip(frames, starts, strict=True))
        ]
        return np.stack(seen)

    def _forgone(self, world: int) -> float:
        """The reward of a world that failed: the negative rewards of its remaining frames, at the last rate."""
        left = self._problem.spec.frames - int(self._playback.frames[world]) + 1
        return left * min(0.0, float(self._last[world]))

    def _reward(self, world: int) -> float:
        """Reward of the last frame, from a motion of two states: start and present."""
        import torch

        start = self._starts[world]
        positions, velocities = self._state(world)
        motion = replace(
            start,
            positions=torch.stack([start.positions[1], positions[None]]),
            velocities=torch.stack([start.velocities[1], velocities[None]]),
            muscle_work=torch.as_tensor(self._playback.rollout.muscle_work[:, world : world + 1]),
            numbers=torch.tensor([0, int(self._playback.frames[world])]),
        )
        return float(self._problem.task.reward(motion)[-1, 0])

    def _state(self, world: int) -> "tuple[Tensor, Tensor]":
        """Present positions [m] and velocities [m/s], `[particle_count, 3]` each."""
        import torch

        rollout = self._playback.rollout
        positions, velocities = rollout.positions[1, world], rollout.velocities[1, world]
        return torch.tensor(positions, dtype=torch.float64), torch.tensor(velocities, dtype=torch.float64)


def new_session(problem: Problem, worlds: int | None = None) -> Session:
    """A session with so many worlds, by default the problem's, on the problem's meter and budget.

    Raises:
        UsageError: the design is a design space, or `worlds` is less than 1.
    """
    return Session(problem, problem.solvers.new(problem.worlds if worlds is None else worlds))
