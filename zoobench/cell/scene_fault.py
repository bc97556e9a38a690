"""Whether the scene of a run with objects or obstacles can be made, before anything is simulated."""

from functools import lru_cache

from zoobench import registry
from zoobench.cell.robot import sampled
from zoobench.envs.base import Environment
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import FRAME_SECONDS, Ref, RunSpec


def scene_fault(spec: RunSpec) -> str:
    """Why the objects or obstacles of a run cannot be about its robot; empty if they can, or if there are none.

    A body that cannot be made is refused elsewhere.
    """
    return _fault(spec.env, spec.design, spec.fidelity, spec.frames)


@lru_cache
def _fault(env_ref: Ref, design: Ref, fidelity: Ref, frames: int) -> str:
    env = registry.create(Kind.ENV, env_ref)
    if not isinstance(env, Environment) or not (env.objects or env.obstacles):
        return ""
    grid = registry.create(Kind.FIDELITY, fidelity)
    try:
        _, body = sampled(design, grid)
    except UsageError:
        return ""
    try:
        env.scene(body, grid, frames * FRAME_SECONDS)
    except UsageError as error:
        return str(error)
    return ""
