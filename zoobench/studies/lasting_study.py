"""Lasting: the solution of a run over several times its own frames, at its own fidelity."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.db.rows import StudyRow
from zoobench.errors import Divergence, Failure, UsageError
from zoobench.inputs import named_runs, run_name, solution_in
from zoobench.registry import KINDS, Kind
from zoobench.sim.model.diagnostics import TORN
from zoobench.spec import Budget, Ref, RunSpec, is_at_wall
from zoobench.tasks.quantities import quantity_of

AT_A_WALL, TURNED_AWAY = "at a wall", "turned away"


@dataclass(frozen=True)
class LastingRow:
    """One long episode of a stored solution.

    Attributes:
        run, key: number of the run that found the solution, or its name if it is published, and its key.
        task, frames: of the episode.
        score: over all of them; None without one.
        end: how the episode of the robot ended, empty if it went on: `at a wall`, `turned away`, `torn in frame 252`,
            `diverged in frame 252`, or why there is no such episode.
        wall_gap: smallest distance from a side of the arena [cells]; None if nothing was simulated.
        home_gap: the same over the run's own frames; None if the long episode does not begin with them.
    """

    run: int | str
    key: str
    task: str
    frames: int
    score: float | None
    end: str
    wall_gap: float | None
    home_gap: float | None
    unit: str

    @property
    def title(self) -> str:
        """The run, for people."""
        return f"run {self.run}" if isinstance(self.run, int) else self.run

    @property
    def result(self) -> str:
        """Score and end, for people."""
        score = "" if self.score is None else quantity_of(Ref.parse(self.task), self.unit).text(self.score)
        return ", ".join(filter(None, (score, self.end)))


def lasting(run: int | str, spec: RunSpec, parameters: Sequence[float], times: int) -> LastingRow:
    """Simulate the solution of a run for `times` its frames, without learning anything.

    A policy that observes the time left of its episode is given that of the long one, whose beginning then is not the
    episode that it was found in. A controller that is a table of frames has none beyond it, and a target may leave the
    arena: then nothing is simulated, and `end` says why.

    Raises:
        UsageError: a component of the run is not installed any more in its version.
    """
    for kind, ref in ((kind, getattr(spec, axis)) for axis, kind in KINDS.items() if kind is not Kind.METHOD):
        registry.get(kind, ref.name, ref.version)
    frames = times * spec.frames
    row = LastingRow(run, spec.key(), str(spec.task), frames, None, _fault(spec, frames), None, None, "")
    if row.end:
        return row
    try:
        problem = Problem(replace(spec, frames=frames, budget=Budget("episodes", 1)), worlds=1)
        episode = problem.episode(np.array(parameters))
    except UsageError as error:
        return replace(row, end=f"not defined: {error}")
    found = episode.evaluation
    if episode.recorded is None:
        return replace(row, end=f"not defined: {found.failure}")
    gaps, last = episode.recorded.wall_gaps, _last_state(found.failure, frames)
    goes_on = not any(name == "time_left" for name, _ in problem.robot.layout)
    gap = float(gaps[: last + 1].min())
    return replace(
        row,
        score=found.score if found.failure is None else None,
        end=_end(found, gap, spec.frames),
        wall_gap=gap,
        home_gap=float(gaps[: spec.frames + 1].min()) if goes_on and last >= spec.frames else None,
        unit=problem.task.unit,
    )


def stored(row: LastingRow) -> StudyRow:
    """The row as the database keeps it."""
    return StudyRow(row.title, "NONE" if row.score is None else "OK", asdict(row))


def _fault(spec: RunSpec, frames: int) -> str:
    """Why a controller has nothing to do in so many frames; empty if it has.

    That of a stored gait counts as it was when it was found.
    """
    stored_in = named_runs(spec.controller)
    controller = solution_in(run_name(stored_in[0])).spec.controller if stored_in else spec.controller
    length = getattr(registry.create(Kind.CONTROLLER, controller), "frames", frames)
    return f"not defined: its table has {length} frames" if length < frames else ""


def _last_state(failure: Failure | None, frames: int) -> int:
    """The last state in which the robot was whole and its motion that of the simulation."""
    return min(failure.frame + 1, frames) if isinstance(failure, Divergence) else frames


def _end(found: Evaluation, gap: float, frames: int) -> str:
    """How an episode with this smallest `gap` from a side [cells] ended; `frames` is the length of the robot's own."""
    failure = found.failure
    if is_at_wall(gap):
        return AT_A_WALL
    if isinstance(failure, Divergence):
        return f"{'torn' if failure.quantity == TORN else 'diverged'} in frame {failure.frame}"
    return TURNED_AWAY if _turned_away(found.reward, frames) else ""


def _turned_away(reward: Array, frames: int) -> bool:
    """Whether a robot that did what the task asks for in its own frames did the contrary in the last as many.

    That is a mean reward above zero and then below it: for the speeds of tasks without a target, motion against the
    direction that is asked for. The rewards of tasks with a target are errors, never above zero.
    """
    return bool(reward[:frames].mean() > 0.0 > reward[-frames:].mean())
