"""Registration of the cells with Gymnasium."""

from itertools import product

import gymnasium
from gymnasium.envs.registration import namespace, register

from zoobench import registry
from zoobench.cell.firm_ground import HELD
from zoobench.registry import Kind
from zoobench.spec import Ref

_NAMESPACE = "zoobench"
FRAMES = 200
"""Control frames of an episode."""


def register_envs() -> None:
    """Register every possible combination of environment, body and task once.

    A task with an object has a box ahead of the robot, or below one that hangs, where an environment takes objects;
    nothing hangs in the water that an environment has by default, which takes no objects.
    """
    wet = {name for name in registry.names(Kind.ENV) if registry.create(Kind.ENV, Ref(name)).is_deep}
    for env, design, task in product(registry.names(Kind.ENV), _bodies(), _tasks()):
        name = name_of(env, design, task)
        is_with_object = registry.get(Kind.TASK, task).needs_object
        hangs = HELD in registry.get(Kind.DESIGN, design).tags
        is_impossible = is_with_object and "object" not in registry.get(Kind.ENV, env).parameters
        if is_impossible or ((hangs or is_with_object) and env in wet) or f"{_NAMESPACE}/{name}" in gymnasium.registry:
            continue
        settings = f"[object=box{',object_place=below' * hangs}]" * is_with_object
        with namespace(_NAMESPACE):
            register(
                id=name,
                entry_point="zoobench.gym.single:ZooEnv",
                vector_entry_point="zoobench.gym.vector:ZooVectorEnv",
                max_episode_steps=FRAMES,
                kwargs={"env": f"{env}{settings}", "design": design, "task": task},
            )


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
