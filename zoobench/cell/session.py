"""Episodes of a cell frame by frame: observations, actions and rewards of a policy."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation, evaluation_of
from zoobench.cell.history import History
from zoobench.cell.motion import motion_of, with_states
from zoobench.cell.observation import Layout, ObservationModel, seen_by
from zoobench.cell.problem import Problem
from zoobench.cell.wall_gap import gaps_of, reading, told
from zoobench.errors import BudgetExhaustedError, Divergence, UsageError
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import Motion, Task

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
        evaluations: by world, where truncated, if the session keeps a history: score and metrics of its episode.
    """

    observations: Array
    rewards: Array
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    failures: dict[int, Divergence] = field(default_factory=dict)
    evaluations: dict[int, Evaluation] = field(default_factory=dict)


class Session:
    """Worlds side by side, each with its own episode, which the caller begins and controls frame by frame.

    An episode gives the same numbers bit for bit whenever it begins and whatever the other worlds simulate. Every
    substep is metered; an episode is counted at its first frame.

    Args:
        problem: the cell with its meter and budget.
        solver: of the problem's scene, for this session alone.
        keeps_history: whether episodes that reach their length are scored, for which the states of all their frames are
            kept.

    Raises:
        UsageError: the design is a design space.
    """

    def __init__(self, problem: Problem, solver: "Solver", *, keeps_history: bool = False) -> None:
        import torch

        from zoobench.sim.playback import Playback

        if problem.robot.space is not None:
            raise UsageError(
                f"The design {problem.spec.design.name!r} is a design space, and a policy needs a fixed body. "
                "Choose another design."
            )
        self._problem, self._solver = problem, solver
        self._playback = Playback(solver)
        self._observation_model = observation_model(problem)
        self._weights = self._observation_model.weights(torch.as_tensor(problem.body.occupancy))
        self._tasks = [problem.task] * solver.worlds
        self._history = History(problem.spec.frames, self._playback.rollout) if keeps_history else None
        # of robots and objects, at the start of the episode and now `[2, worlds, all particles, 3]` [m], [m/s]
        shape = (2, *self._playback.rollout.positions.shape[1:])
        self._positions, self._velocities = (torch.zeros(shape, dtype=torch.float64) for _ in range(2))
        self._starts = [self._start(world) for world in range(solver.worlds)]
        self._begun = [self._centre(world) for world in range(solver.worlds)]
        self._joined: dict[tuple[int, ...], tuple[Motion, tuple[Tensor, Tensor], NDArray[np.int64]]] = {}
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
    def layout(self) -> Layout:
        """The parts of an observation."""
        return self._observation_model.layout

    @property
    def observation_count(self) -> int:
        """Length of an observation."""
        return self._observation_model.count

    @property
    def times(self) -> Array:
        """Simulated time of every world since its episode began `[worlds]` [s]."""
        return np.asarray(self._playback.frames * FRAME_SECONDS, dtype=np.float64)

    def positions(self, world: int) -> Array:
        """Present positions of all particles of a world, the robot's first `[particle_count, 3]` [m]."""
        return self._solver.positions(world)

    def flow(self, world: int) -> Array | None:
        """Present velocity of water on a grid in a world, see `Solver.flow`."""
        return self._solver.flow(world)

    def offset(self, world: int) -> Array:
        """How far a world's arena has moved after its robot `[3]` [m]."""
        found: Array = self._solver.simulation.offsets[world].copy()
        return found

    def activity(self, world: int) -> Array:
        """Muscle activity in the last frame of a world's episode `[muscle_count]`; 0 before the first."""
        rollout, frames = self._playback.rollout, self._playback.frames
        return np.asarray(rollout.actuation[0, world] * bool(frames[world]), dtype=np.float64)

    def affords(self, frames: int, evaluations: int = 0) -> bool:
        """Whether the budget is expected to suffice for so many more frames in every world and evaluations after them.

        Substeps are estimated as in `Problem.affords`, without failures.
        """
        affordable = self._holds(frames, evaluations)
        self._problem.meter.refused |= not affordable
        return affordable

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

    def begin(
        self,
        worlds: Iterable[int] | None = None,
        *,
        lead_ins: Mapping[int, Array] = MappingProxyType({}),
        tasks: Mapping[int, Task] = MappingProxyType({}),
    ) -> Array:
        """Begin an episode in these worlds, by default in all; observations of all `[worlds, observation_count]`.

        Args:
            lead_ins: by world, activity `[frames, muscle_count]` of frames that are simulated before the episode; it
                begins with the state after them, and with the initial state if they diverge.
            tasks: by world, in place of the problem's; their additions to an observation must be as long.
        """
        chosen = range(self.worlds) if worlds is None else list(worlds)
        self._joined.clear()
        self._playback.begin(chosen)
        for world in chosen:
            if world in lead_ins:
                with self._metered():
                    self._playback.lead_in(world, lead_ins[world])
            self._tasks[world] = tasks.get(world, self._problem.task)
            self._starts[world] = self._start(world)
            self._begun[world] = self._centre(world)
            if self._history is not None:
                self._history.note(world, 0, self._playback.rollout)
        self._over[chosen] = False
        self._last[chosen] = 0.0
        self._take_states()
        return self._observations()

    def step(self, activity: Array) -> Step:
        """Simulate a control frame in every world.

        Args:
            activity: of the muscles, in [-1, 1] `[worlds, muscle_count]`; they have less of it in the time of onset.

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
        begun = self._playback.frames.tolist().count(0)
        with self._metered():
            self._playback.frame(self._risen(activity) if self._problem.robot.onset else activity)
        self._problem.meter.episodes += begun
        rollout, frames = self._playback.rollout, self._playback.frames
        failures = {world: self._told(world, one) for world, one in {**rollout.tears, **rollout.divergences}.items()}
        self.failures += len(failures)
        terminated = np.zeros(self.worlds, dtype=bool)
        if failures:
            terminated[list(failures)] = True
        truncated = ~terminated & (frames >= self._problem.spec.frames)
        work = rollout.muscle_work
        if self._history is not None:
            for world in range(self.worlds):
                self._history.note(world, int(frames[world]), rollout, work[0, world])
        self._take_states()
        rewards = self._rewards(work, np.flatnonzero(~terminated).tolist())
        for world in failures:
            rewards[world] = self._forgone(world)
        self._over, self._last = terminated | truncated, rewards
        evaluations = {world: self._evaluation(world) for world in np.flatnonzero(truncated).tolist() if self._history}
        return Step(self._observations(), rewards.copy(), terminated, truncated, failures, evaluations)

    def _risen(self, activity: Array) -> Array:
        """What muscles have of an activity in the time of onset; checked, as one of another shape might fit."""
        import torch

        strength = self._problem.robot.strength(torch.as_tensor(self.times[:, None])).numpy()
        found: Array = self._solver.check_actuation(np.asarray(activity)[None])[0] * strength
        return found

    @contextmanager
    def _metered(self) -> Iterator[None]:
        """Meter the simulation within the context."""
        meter, own, rollout = self._problem.meter, self._solver.meter, self._playback.rollout
        meter.start_clock()
        before, repeated = own.forward, sum(rollout.retries.tolist())
        yield
        meter.forward += own.forward - before
        meter.retries += sum(rollout.retries.tolist()) - repeated

    def _start(self, world: int) -> Motion:
        """The motion of a world that is about to begin, whose last state is the present one."""
        problem, place = self._problem, slice(world, world + 1)
        return motion_of(self._playback.rollout, problem.body, problem.scene, place)

    def _centre(self, world: int) -> "Tensor":
        """Centres of mass of a world that is about to begin, see `ObservationModel.centres`."""
        import torch

        present = self._playback.rollout.positions[1, world]
        return self._observation_model.centres(self._weights, torch.tensor(present, dtype=torch.float64))

    def _observations(self) -> Array:
        """Observations of all worlds `[worlds, observation_count]`."""
        import torch

        now = zip(self._playback.frames.tolist(), self._positions[1], self._velocities[1], self._begun, strict=True)
        with torch.inference_mode():
            seen = [
                self._model_of(world).observe_with(self._weights, *state).numpy() for world, state in enumerate(now)
            ]
        return np.stack(seen)

    def _model_of(self, world: int) -> ObservationModel:
        """The observations of a world, whose task may be one of its own."""
        task = self._tasks[world]
        return self._observation_model if task is self._problem.task else observation_model(self._problem, task)

    def _told(self, world: int, failure: Divergence) -> Divergence:
        """A failure in the last frame, by how near the robot has come to a side of its arena."""
        last, scene, spacing = self._start(world), self._problem.scene, self._problem.fidelity.grid_spacing
        gaps = gaps_of(last, scene, self._playback.rollout.offsets[:, world], spacing)
        return told(failure, float(gaps.min()), scene)

    def _forgone(self, world: int) -> float:
        """The reward of a world that failed: the negative rewards of its remaining frames, at the last rate."""
        left = self._problem.spec.frames - int(self._playback.frames[world]) + 1
        return left * min(0.0, float(self._last[world]))

    def _rewards(self, work: Array, worlds: list[int]) -> Array:
        """Rewards of the last frame in these worlds `[all worlds]`, the others' being 0; `work` `[1, worlds, muscles]`.

        The motion has two states, start and present. Worlds at the same frame of the same task are computed at once,
        which rounds as each alone: no sum reaches over worlds.
        """
        import torch

        rewards = np.zeros(self.worlds)
        groups: dict[tuple[int, int], list[int]] = {}
        for world in worlds:
            groups.setdefault((id(self._tasks[world]), int(self._playback.frames[world])), []).append(world)
        for (_, frame), some in groups.items():
            motion, states, numbers = self._side_by_side(tuple(some))
            motion.muscle_work.numpy()[:] = work if len(some) == self.worlds else work[:, some]
            if len(some) < self.worlds:
                for state, of_all in zip(states, (self._positions, self._velocities), strict=True):
                    of_all.numpy().take(some, axis=1, out=state.numpy())
            numbers[1] = frame
            motion.forget()
            with torch.inference_mode():
                rewards[some] = self._tasks[some[0]].reward(motion)[-1].numpy()
        return rewards

    def _side_by_side(self, worlds: tuple[int, ...]) -> "tuple[Motion, tuple[Tensor, Tensor], NDArray[np.int64]]":
        """The motion of these worlds from start to present, with its states and `numbers`; every frame writes them."""
        import torch

        if worlds not in self._joined:
            starts, shape = [self._starts[world] for world in worlds], (2, len(worlds), *self._positions.shape[2:])
            is_all, numbers = len(worlds) == self.worlds, np.zeros(2, np.int64)
            empty = torch.empty((2, *shape), dtype=torch.float64)
            states = (self._positions, self._velocities) if is_all else (empty[0], empty[1])
            motion = replace(
                with_states(starts[0], *states),
                masses=torch.cat([start.masses for start in starts]),
                occupancy=torch.cat([start.existing for start in starts]),
                muscle_work=torch.empty((1, len(worlds), self.muscle_count), dtype=torch.float64),
                numbers=torch.from_numpy(numbers),
            )
            self._joined[worlds] = motion, states, numbers
        return self._joined[worlds]

    def _evaluation(self, world: int) -> Evaluation:
        """Score and metrics of an episode that has reached its length."""
        assert self._history is not None
        frames, scene, spacing = self._problem.spec.frames, self._problem.scene, self._problem.fidelity.grid_spacing
        motion = self._history.motion(world, frames, self._starts[world])
        gaps = gaps_of(motion, scene, self._history.offsets(world, frames), spacing)
        return evaluation_of(self._tasks[world], motion, reading(gaps))

    def _take_states(self) -> None:
        """Take the present states of the robots, of worlds that begin for their starts, too."""
        rollout = self._playback.rollout
        begin = self._playback.frames == 0
        for taken, present in ((self._positions, rollout.positions), (self._velocities, rollout.velocities)):
            taken.numpy()[1] = present[1]
            if begin.any():
                taken.numpy()[0, begin] = present[1, begin]


def observation_model(problem: Problem, task: Task | None = None) -> ObservationModel:
    """The observations of the problem's robot at a task, by default the problem's."""
    seen = seen_by(problem.robot.controller, task or problem.task)
    return ObservationModel(problem.body, seen, problem.spec.frames, problem.scene.objects)


def new_session(
    problem: Problem, worlds: int | None = None, *, keeps_history: bool = False, keeps_rest: bool = True
) -> Session:
    """A session with so many worlds, by default the problem's, on the problem's meter and budget.

    `keeps_history` as in `Session`, `keeps_rest` as in `Solvers.new`.

    Raises:
        UsageError: the design is a design space, or `worlds` is less than 1.
    """
    solver = problem.solvers.new(problem.worlds if worlds is None else worlds, keeps_rest=keeps_rest)
    return Session(problem, solver, keeps_history=keeps_history)
