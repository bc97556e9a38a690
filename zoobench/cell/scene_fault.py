"""Whether the scene of a run with objects or obstacles can be made, before anything is simulated."""

from functools import lru_cache

from zoobench import registry
from zoobench.cell.robot import sampled
from zoobench.designs.space import DesignSpace
from zoobench.envs.base import Environment
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import FRAME_SECONDS, Ref, RunSpec


def scene_fault(spec: RunSpec) -> str:
    """Why the objects or obstacles of a run cannot be about its robot; empty if they can, or if there are none.

    A body that cannot be made is refused elsewhere.
    """
    return _fault(spec.env, spec.design, spec.fidelity, spec.frames)


def thrown_fault(env: Environment, *, is_fixed: bool) -> str:
    """Why an object cannot begin with a velocity beside a body, which may be fixed; empty if it can or does not."""
    if is_fixed or not env.objects.moves:
        return ""
    return (
        "An object cannot begin with a velocity beside the bodies of a design space, each of which comes to rest in "
        "its own episode. Choose a fixed design, or leave out object_speed and object_speed_up."
    )


@lru_cache
def _fault(env_ref: Ref, design: Ref, fidelity: Ref, frames: int) -> str:
    env = registry.create(Kind.ENV, env_ref)
    if not isinstance(env, Environment) or not (env.objects or env.obstacles):
        return ""
    grid = registry.create(Kind.FIDELITY, fidelity)
    try:
        made, body = sampled(design, grid)
    except UsageError:
        return ""
    if fault := thrown_fault(env, is_fixed=not isinstance(made, DesignSpace)):
        return fault
    try:
        env.scene(body, grid, frames * FRAME_SECONDS)
    except UsageError as error:
        return str(error)
    return ""
