"""Cells of smoke size for any registered component."""

from collections.abc import Mapping
from typing import Any

from zoobench import registry
from zoobench.cell.firm_ground import usual_task
from zoobench.errors import UnknownNameError
from zoobench.registry import KINDS, Kind
from zoobench.spec import Budget, Ref, RunSpec, Scalar

DOUBLE = "smoke[precision=64]"
"""The fidelity of checks with a gradient, in double precision."""

WITH_OBJECT = "ground[object=box,object_gap=0]"
"""The environment of most tasks with an object, where none is named: a few frames are not enough to go to one further
away, which has no gradient then."""

_CLIMBED = {"object": "box"}
"""In place of a slope, for which kernels would be compiled."""

_RESOLVED: Mapping[str, Scalar] = {"sheet": 0.32, "ball": 0.0625}
"""Sizes of objects with two cells across at smoke, where a task's own are smaller [m]."""

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

    Those not named are a caterpillar's that crawls on the ground with a sine basis, by random search. A task for which
    bare ground is not enough has the object that it is for, which touches the robot; what is below a robot is below a
    gripper. A robot that is held at its base reaches for a place.

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
    if Kind.TASK.noun not in names:
        chosen[Kind.TASK] = Ref(usual_task(chosen[Kind.DESIGN]))
    if Kind.ENV.noun not in names:
        chosen[Kind.ENV] = _surroundings(chosen[Kind.TASK])
        if Kind.DESIGN.noun not in names and chosen[Kind.ENV].kwargs.get("object_place") == "below":
            chosen[Kind.DESIGN] = Ref("gripper")
    refs: dict[str, Any] = {axis: registry.resolve(kind, chosen[kind]) for axis, kind in KINDS.items()}
    return RunSpec(**refs, seed=seed, budget=budget or Budget("substeps", 1e9), frames=frames)


def _surroundings(task: Ref) -> Ref:
    """The ground with what a task is for, as far as a few frames at smoke have to do with it."""
    settings = dict(registry.get(Kind.TASK, task.name, task.version).usual_settings)
    if settings and "object" not in settings:
        settings = dict(_CLIMBED)
    if settings and "object_place" not in settings:
        settings["object_gap"] = 0.0
    if settings.get("object") in _RESOLVED:
        settings["object_size"] = _RESOLVED[str(settings["object"])]
    return Ref("ground", 0, tuple(sorted(settings.items())))
