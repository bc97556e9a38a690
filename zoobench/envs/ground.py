"""Firm ground: the plain case that every other environment is compared with."""

from zoobench.envs.base import LAND_ROBOT, OPEN_ARENA, Environment
from zoobench.registry import Kind, register


@register(Kind.ENV, "ground", tags=("land",))
def ground(*, friction: float = 0.5) -> Environment:
    """Firm, rough ground.

    `friction` is the Coulomb coefficient [-]; 0.5 is the "high" of the specification's table 6.
    """
    return Environment(robot=LAND_ROBOT, friction=friction, arena=OPEN_ARENA)
