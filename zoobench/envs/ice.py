"""Ice: firm ground with little friction."""

from zoobench.envs.base import Environment, firm_environment
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.objects import NO_OBJECTS, Objects
from zoobench.envs.obstacles import NO_OBSTACLES, Obstacles
from zoobench.envs.physics import LAND, SKINNED, Contact, Physics
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.registry import Kind, register


@register(Kind.ENV, "ice", version=4, tags=("land",), added=("physics", "profile", "contact", "objects", "obstacles"))
def ice(
    *,
    friction: float = 0.05,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = LAND,
    contact: Contact = SKINNED,
    objects: Objects = NO_OBJECTS,
    obstacles: Obstacles = NO_OBSTACLES,
) -> Environment:
    """Firm, slippery ground.

    * `friction`: Coulomb coefficient [-]; 0.05 is "low" in table 6 of SoftZoo's paper.
    """
    return firm_environment(
        friction=friction,
        hills=hills,
        profile=profile,
        physics=physics,
        contact=contact,
        objects=objects,
        obstacles=obstacles,
    )
