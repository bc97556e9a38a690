"""How an episode begins: as the benchmark's, or with pose, phase, path or the environment's physics drawn at random."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, cast, get_args

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.cell.task_fault import task_fault
from zoobench.controllers.base import WAVE_RATE
from zoobench.errors import UsageError
from zoobench.gym.drawn_physics import DrawnPhysics, Values, with_physics
from zoobench.registry import Kind
from zoobench.spec import Ref, RunSpec, Scalar
from zoobench.tasks.base import Task

Drawn = Literal["pose", "phase", "path"]

_LEAD_IN = 10
"""Control frames of random activity before an episode with a drawn pose."""

_TRIES = 100
"""Paths that may be drawn until one has room in the arena."""


@dataclass(frozen=True)
class Beginning:
    """How an episode begins.

    Attributes:
        time: of the waves at its start [s].
        lead_in: muscle activity of the frames before it `[frames, muscle_count]`; empty for none.
        task: None for the problem's.
        physics: parameters of the environment that are others than the problem's, by name.
    """

    time: float = 0.0
    lead_in: Array | None = None
    task: Task | None = None
    physics: Mapping[str, Scalar] = field(default_factory=dict)


class Beginnings:
    """Draws the beginnings of a problem's episodes.

    * `pose`: the robot has moved for ten frames before, each muscle with an activity of its own in [-1, 1];
    * `phase`: the waves begin at any time of their slow period;
    * `path`: the target's path is a random one, see `path` and `path_seed` of the task.

    Args:
        problem: whose episodes they are.
        drawn: the random parts; the rest is as in the benchmark.
        physics: parameters of the environment that are drawn, see `zoobench.gym.drawn_physics.Values`.

    Attributes:
        physics: the random parameters of the environment.

    Raises:
        UnknownNameError: the environment does not have a parameter that is to be drawn.
        UsageError: something else is to be drawn, or a path of a task that has none by formula.
    """

    def __init__(
        self, problem: Problem, drawn: Iterable[str] = (), physics: Mapping[str, Values] | None = None
    ) -> None:
        self._problem = problem
        self.physics = DrawnPhysics.of(problem.spec.env, {} if physics is None else physics)
        self._drawn = {cast("Drawn", drawn)} if isinstance(drawn, str) else set(cast("Iterable[Drawn]", drawn))
        if unknown := sorted(self._drawn - set(get_args(Drawn))):
            raise UsageError(f"{unknown[0]!r} cannot be drawn. Choose among {', '.join(get_args(Drawn))}.")
        task = registry.get(Kind.TASK, problem.spec.task.name, problem.spec.task.version)
        if "path" in self._drawn and ("path_seed" not in task.parameters or problem.spec.task.kwargs.get("target")):
            raise UsageError(f"The task {str(task.ref)!r} has no path that could be drawn. Leave 'path' out.")

    def draw(self, rng: np.random.Generator) -> Beginning:
        """The next beginning.

        Raises:
            UsageError: no random path has room in the arena.
        """
        physics = self.physics.draw(rng)
        muscles = self._problem.body.muscle_count
        return Beginning(
            time=rng.uniform(0.0, 2.0 * np.pi / WAVE_RATE) if "phase" in self._drawn else 0.0,
            lead_in=np.tile(rng.uniform(-1.0, 1.0, muscles), (_LEAD_IN, 1)) if "pose" in self._drawn else None,
            task=self._task(with_physics(self._problem.spec, physics), rng) if "path" in self._drawn else None,
            physics=physics,
        )

    def _task(self, spec: RunSpec, rng: np.random.Generator) -> Task:
        """A task with a random path that has room in the cell."""
        for _ in range(_TRIES):
            params = {**spec.task.kwargs, "path": "random", "path_seed": int(rng.integers(2**31))}
            ref = registry.resolve(Kind.TASK, Ref(spec.task.name, spec.task.version, tuple(sorted(params.items()))))
            if not (fault := task_fault(replace(spec, task=ref))):
                task: Task = registry.create(Kind.TASK, ref)
                return task
        raise UsageError(f"None of {_TRIES} random paths fits into the arena. {fault}")
