"""Cells of smoke size for any registered component."""

from typing import Any

from zoobench import registry
from zoobench.errors import UnknownNameError
from zoobench.registry import KINDS, Kind
from zoobench.spec import Budget, Ref, RunSpec

DOUBLE = "smoke[precision=64]"
"""The fidelity of checks with a gradient, in double precision."""

WITH_OBJECT = "ground[object=box,object_gap=0]"
"""The environment of tasks with an object, where none is named: a few frames are not enough to go to one further away,
which has no gradient then."""

_DEFAULTS = {
    Kind.ENV: "ground",
    Kind.TASK: "movement-speed",
    Kind.DESIGN: "caterpillar",
    Kind.CONTROLLER: "sine-basis",
    Kind.METHOD: "random",
    Kind.FIDELITY: "smoke",
}


def small_cell(budget: Budget | None = None, frames: int = 6, seed: int = 0, **names: str) -> RunSpec:
    """A resolved spec; axes are named by the kind's noun: `small_cell(environment="ice", fidelity=DOUBLE)`.

    Those not named are a caterpillar's that crawls on the ground with a sine basis, by random search; a task with an
    object has a box on the ground ahead, which touches the robot.

    Args:
        budget: without limit by default.
        frames: control frames of an episode.
        seed: of the run.
        names: `environment`, `task`, `design`, `controller`, `method` and `fidelity`, as on the command line.

    Raises:
        UnknownNameError: no axis or component has this name.
        UsageError: a parameter is not possible.
    """
    if unknown := sorted(names.keys() - {kind.noun for kind in _DEFAULTS}):
        raise UnknownNameError("axis", unknown[0], [kind.noun for kind in _DEFAULTS])
    chosen = {kind: Ref.parse(names.get(kind.noun, text)) for kind, text in _DEFAULTS.items()}
    task = chosen[Kind.TASK]
    if Kind.ENV.noun not in names and registry.get(Kind.TASK, task.name, task.version).needs_object:
        chosen[Kind.ENV] = Ref.parse(WITH_OBJECT)
    refs: dict[str, Any] = {axis: registry.resolve(kind, chosen[kind]) for axis, kind in KINDS.items()}
    return RunSpec(**refs, seed=seed, budget=budget or Budget("substeps", 1e9), frames=frames)
