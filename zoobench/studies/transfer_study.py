"""Transfer: the solution of a run in other environments, tasks and fidelities."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from zoobench.cell.firm_ground import firm_ground_fault
from zoobench.cell.problem import Problem
from zoobench.cell.robot import Robot
from zoobench.cell.scene_fault import scene_fault
from zoobench.cell.task_fault import task_fault
from zoobench.db.rows import StudyRow
from zoobench.errors import UsageError
from zoobench.spec import Budget, Ref, RunSpec
from zoobench.tasks.quantities import quantity_of


class MisfitError(UsageError):
    """The parameters of a solution are not as many as a target takes."""


@dataclass(frozen=True)
class TransferRow:
    """One episode of a stored solution.

    Attributes:
        run: number of the run that found the solution, or its name if it is published.
        design, method, seed: of that run.
        home: environment, task and fidelity of that run.
        env, task, fidelity, frames: of the episode.
        score: None where the simulation diverged.
        reason: for the missing score, or empty.
    """

    run: int | str
    design: str
    method: str
    seed: int
    home: tuple[str, str, str]
    env: str
    task: str
    fidelity: str
    frames: int
    score: float | None
    unit: str
    reason: str

    @property
    def title(self) -> str:
        """The run, for people."""
        return _title(self.run)

    @property
    def result(self) -> str:
        """The score, or why there is none, for people."""
        return self.reason if self.score is None else quantity_of(Ref.parse(self.task), self.unit).text(self.score)


@dataclass(frozen=True)
class TransferTargets:
    """Environments, tasks and fidelities in which to try solutions, as resolved references.

    Every combination is tried; None stands for the run's own.
    """

    envs: Sequence[Ref] | None = None
    tasks: Sequence[Ref] | None = None
    fidelities: Sequence[Ref] | None = None

    def of(self, spec: RunSpec) -> Iterator[RunSpec]:
        """The episodes to try for a run."""
        axes = (self.envs or [spec.env], self.tasks or [spec.task], self.fidelities or [spec.fidelity])
        for env, task, fidelity in itertools.product(*axes):
            yield replace(spec, env=env, task=task, fidelity=fidelity, budget=Budget("episodes", 1))


def transfer(
    run: int | str, spec: RunSpec, parameters: Sequence[float], targets: TransferTargets
) -> Iterator[TransferRow]:
    """Try the solution of a run in every target, one episode each.

    Raises:
        MisfitError: the parameters do not fit a target: those of a design space may depend on the fidelity.
        UsageError: a closed loop observes something else of the task.
    """
    for cell in targets.of(spec):
        yield tried(run, spec, parameters, cell)


def tried(run: int | str, spec: RunSpec, parameters: Sequence[float], cell: RunSpec) -> TransferRow:
    """Try the solution of a run in a cell; raises as `transfer`."""
    problem = Problem(cell, worlds=1)
    _check_fit(run, spec, len(parameters), cell, problem.robot)
    found = problem.evaluate(np.array(parameters))
    return TransferRow(
        run=run,
        design=str(spec.design),
        method=str(spec.method),
        seed=spec.seed,
        home=(str(spec.env), str(spec.task), str(spec.fidelity)),
        env=str(cell.env),
        task=str(cell.task),
        fidelity=str(cell.fidelity),
        frames=cell.frames,
        score=found.score if math.isfinite(found.score) else None,
        unit=problem.task.unit,
        reason="" if found.failure is None else str(found.failure),
    )


def transfer_fault(run: int | str, spec: RunSpec, parameters: Sequence[float], cell: RunSpec) -> str:
    """Why the solution of a run cannot be tried in a cell, before anything is simulated; empty if it can."""
    try:
        if fault := task_fault(cell) or firm_ground_fault(cell) or scene_fault(cell):
            return fault
        _check_fit(run, spec, len(parameters), cell, Robot.of_run(cell))
    except UsageError as error:
        return str(error)
    return ""


def _check_fit(run: int | str, spec: RunSpec, count: int, cell: RunSpec, robot: Robot) -> None:
    """Raise UsageError if the solution's parameters do not fit the cell's robot, or mean something else there."""
    if cell.task != spec.task:
        home = Robot.of_run(replace(cell, task=spec.task))
        if home.layout != robot.layout:
            raise UsageError(
                f"The controller {spec.controller.name} of {_title(run)} observes {home.senses}; at {cell.task.name} "
                f"it would be given {robot.senses}. Keep to the task {spec.task.name}."
            )
    if robot.parameter_count != count:
        raise MisfitError(
            f"The {count} parameters of {_title(run)} do not fit {spec.design.name} at {cell.fidelity}, where it takes "
            f"{robot.parameter_count}. Keep to the run's own fidelity, {spec.fidelity}."
        )


def _title(run: int | str) -> str:
    return f"run {run}" if isinstance(run, int) else run


def stored(row: TransferRow) -> StudyRow:
    """The row as the database keeps it."""
    return StudyRow(f"{row.title} in {row.env}", "DIVERGED" if row.score is None else "OK", asdict(row))
