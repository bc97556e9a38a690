"""Solutions somewhere else: what a run has found, in other environments, tasks and fidelities."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from zoobench.cell.problem import Problem
from zoobench.db.rows import StudyRow
from zoobench.errors import UsageError
from zoobench.spec import Budget, Ref, RunSpec

STUDY = "transfer"
"""Under which name the rows are kept."""


@dataclass(frozen=True)
class TransferRow:
    """One episode of a stored solution.

    Attributes:
        run: whose solution it is.
        design, method, seed: of the run.
        home: environment, task and fidelity for which it was found.
        env, task, fidelity: in which it was tried.
        frames: length of the episode.
        score: None where the simulation diverged.
        unit: of the score.
        reason: why there is no score, or empty.
    """

    run: int
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
    def is_home(self) -> bool:
        """Whether it was tried where it was found."""
        return self.home == (self.env, self.task, self.fidelity)


@dataclass(frozen=True)
class Places:
    """Where to try solutions: every combination; None for where each was found.

    Attributes:
        envs, tasks, fidelities: resolved references.
    """

    envs: Sequence[Ref] | None = None
    tasks: Sequence[Ref] | None = None
    fidelities: Sequence[Ref] | None = None

    def of(self, spec: RunSpec) -> Iterator[RunSpec]:
        """The cells in which the solution of a run is to be tried."""
        axes = (self.envs or [spec.env], self.tasks or [spec.task], self.fidelities or [spec.fidelity])
        for env, task, fidelity in itertools.product(*axes):
            yield replace(spec, env=env, task=task, fidelity=fidelity, budget=Budget("episodes", 1))


def transfer(run: int, spec: RunSpec, parameters: Sequence[float], places: Places) -> Iterator[TransferRow]:
    """Try a solution everywhere, one episode in each place.

    Raises:
        UsageError: its parameters do not fit a place's fidelity, by which the body of a design space is described.
    """
    home = (str(spec.env), str(spec.task), str(spec.fidelity))
    for cell in places.of(spec):
        problem = Problem(cell, worlds=1)
        if problem.parameter_count != len(parameters):
            raise UsageError(
                f"The {len(parameters)} parameters of run {run} do not fit {spec.design.name} at {cell.fidelity}, "
                f"where it takes {problem.parameter_count}. Keep to the run's own fidelity, {spec.fidelity}."
            )
        found = problem.evaluate(np.array(parameters))
        yield TransferRow(
            run=run,
            design=str(spec.design),
            method=str(spec.method),
            seed=spec.seed,
            home=home,
            env=str(cell.env),
            task=str(cell.task),
            fidelity=str(cell.fidelity),
            frames=cell.frames,
            score=found.score if math.isfinite(found.score) else None,
            unit=problem.task.unit,
            reason="" if found.failure is None else str(found.failure),
        )


def stored(row: TransferRow) -> StudyRow:
    """As it is kept."""
    return StudyRow(f"run {row.run} in {row.env}", "DIVERGED" if row.score is None else "OK", asdict(row))
