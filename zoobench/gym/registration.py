"""Registration of the cells with Gymnasium."""

from itertools import product

import gymnasium
from gymnasium.envs.registration import namespace, register

from zoobench import registry
from zoobench.cell.firm_ground import GRIPPER, HELD
from zoobench.cell.task_fault import sense_fault
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref

_NAMESPACE = "zoobench"
FRAMES = 200
"""Control frames of an episode."""


def register_envs() -> None:
    """Register every combination of environment, body and task that makes sense once.

    Where a bare environment is not enough for a task, it has the task's usual settings: what is carried lies on the
    robot's back, what is caught is thrown, and a slope is climbed. What others have ahead is below a gripper.
    """
    for env, task in product(registry.names(Kind.ENV), _tasks()):
        places: dict[frozenset[str], str] = {}
        for design in _bodies():
            hanging = registry.get(Kind.DESIGN, design).tags & {HELD, GRIPPER}
            if hanging not in places:
                places[hanging] = _place(env, task, design, grips=GRIPPER in hanging)
            name = name_of(env, design, task)
            if not places[hanging] or f"{_NAMESPACE}/{name}" in gymnasium.registry:
                continue
            with namespace(_NAMESPACE):
                register(
                    id=name,
                    entry_point="zoobench.gym.single:ZooEnv",
                    vector_entry_point="zoobench.gym.vector:ZooVectorEnv",
                    max_episode_steps=FRAMES,
                    kwargs={"env": places[hanging], "design": design, "task": task},
                )


def _place(env: str, task: str, design: str, *, grips: bool) -> str:
    """The environment in which a task makes sense for a design, bare or with settings; empty if there is none."""
    if HELD in registry.get(Kind.DESIGN, design).tags and registry.create(Kind.ENV, Ref(env)).is_deep:
        return ""
    usual = dict(registry.get(Kind.TASK, task).usual_settings)
    if grips and "object" in usual and usual.keys() <= {"object", "object_gap"}:
        usual = {"object": usual["object"], "object_place": "below"}
    # below a robot there is room under a gripper alone, and a gripper works there alone
    is_possible = grips == (usual.get("object_place") == "below") or "object" not in usual
    for settings in ({}, usual) if is_possible else ({},):
        ref = Ref(env, 0, tuple(sorted(settings.items())))
        try:
            if not sense_fault(ref, Ref(task), Ref(design)):
                return str(ref)
        except UsageError:  # it takes no such settings
            continue
    return ""


def name_of(env: str, design: str, task: str) -> str:
    """A name such as `Desert-BabySeal-Turning-v0`, from names in kebab case."""
    words = ("".join(part.capitalize() for part in name.split("-")) for name in (env, design, task))
    return "-".join(words) + "-v0"


def _bodies() -> list[str]:
    """Designs with a fixed body and no required parameter: neither design spaces nor bodies from a file."""
    components = (registry.get(Kind.DESIGN, name) for name in registry.names(Kind.DESIGN))
    return [component.name for component in components if "space" not in component.tags and not component.required]


def _tasks() -> list[str]:
    """Tasks that are complete without settings; another one names when making, as in `task="mix[turning=1]"`."""
    return [name for name in registry.names(Kind.TASK) if not registry.get(Kind.TASK, name).needs_settings]
