"""Shallow water: a robot wading on rough ground."""

from zoobench.envs.base import Environment, Stance, bed_environment
from zoobench.envs.bed import Bed
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.physics import FRESH_WATER, LAND, Physics, Water
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.registry import Kind, register

_PROVISIONAL = (
    "its water is a layer of one to three cells in which no wave is resolved, and as thick as the ocean's (nothing is "
    "left of a current of 20 mm/s after 0.2 s), so that moving in it is not wading"
)


@register(
    Kind.ENV, "shallow-water", version=7, tags=("land", "fluid"), added=("water", "hills", "profile", "physics"),
    provisional=_PROVISIONAL,
)  # fmt: skip
def shallow_water(
    *,
    friction: float = 0.5,
    depth: float = 0.02,
    length: float = 0.625,
    width: float = 0.375,
    bulk_modulus: float = 2e4,
    water: Water = FRESH_WATER,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = LAND,
) -> Environment:
    """Knee-deep water on rough ground, in which the robot stands.

    The water fills the arena from wall to wall. It is twice as long and wide as the solid beds because waves are
    reflected by the walls: in a tank half as large they change a robot's speed by more than the noise floor.

    * `friction`: Coulomb coefficient of the ground [-].
    * `depth`: of the water above the lowest ground [m].
    * `length`, `width`: of water and arena along x and z [m].
    * `bulk_modulus`: K [Pa]. At 2e4 the water is compressed by 1 % at the bottom, and the speed of sound, 4.5 m/s, is
      ten times that of any robot.
    """
    return bed_environment(
        Bed(water.material(bulk_modulus), depth),
        friction=friction,
        size=(length, width),
        physics=physics,
        hills=hills,
        profile=profile,
        stance=Stance.WADING,
    )
