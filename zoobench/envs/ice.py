"""Ice: the ground without a grip."""

from zoobench.envs.base import LAND_ROBOT, OPEN_ARENA, Environment
from zoobench.registry import Kind, register


@register(Kind.ENV, "ice", tags=("land",))
def ice(*, friction: float = 0.05) -> Environment:
    """Firm, slippery ground.

    `friction` is the Coulomb coefficient [-]; 0.05 is the "low" of the specification's table 6.
    """
    return Environment(robot=LAND_ROBOT, friction=friction, arena=OPEN_ARENA)
