"""Clay: a soft plastic solid."""

from zoobench.envs.base import BED_THICKNESS, Environment, bed_environment
from zoobench.envs.bed import Bed
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.objects import NO_OBJECTS, Objects
from zoobench.envs.physics import LAND, Elasticity, Physics
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.registry import Kind, register
from zoobench.sim.model.laws.clay import ClayMaterial

# E and nu of SoftZoo's reference implementation, whose media all have the density of water
CLAY = Elasticity(medium_density=1800.0)


_PROVISIONAL = (
    "on clay of 800 Pa trained gaits of four animals move and turn at standard within 18 and 35 % of their speeds at "
    "fine (caterpillar, baby seal and panda within 6 and 12 %), at draft within 26 and 34 %; paths were not measured, "
    "and softer clay is not resolved"
)


@register(
    Kind.ENV, "clay", version=9, tags=("land", "plastic"), added=("elasticity", "physics", "profile", "objects"),
    provisional=_PROVISIONAL,
)  # fmt: skip
def clay(
    *,
    friction: float = 0.5,
    slip: bool = True,
    robot_friction: float = 0.5,
    thickness: float = BED_THICKNESS,
    length: float = 0.3125,
    width: float = 0.3125,
    yield_stress: float = 800.0,
    elasticity: Elasticity = CLAY,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = LAND,
    objects: Objects = NO_OBJECTS,
) -> Environment:
    """A bed of soft clay on rough ground.

    The bed has no end, as in `desert`.

    * `friction`: Coulomb coefficient of the ground under the clay [-].
    * `slip`: whether robot and clay have velocity fields of their own; else the clay sticks to the robot.
    * `robot_friction`: Coulomb coefficient between them where they slip [-].
    * `thickness`: of the bed [m], a whole number of cells: where a bed ends within a cell, gaits go a quarter to a half
      less far.
    * `length`, `width`: of the part of the bed that is simulated at a time, along x and z, at least [m].
    * `yield_stress`: norm of the deviatoric stress at which it flows [Pa]; soft natural clays have several thousand.
      200 in SoftZoo's reference, which bears little more than robots weigh, and on a coarse grid too much.
    """
    material = ClayMaterial(*elasticity.constants, yield_stress=yield_stress)
    return bed_environment(
        Bed(material, thickness, robot_friction if slip else None),
        friction=friction,
        size=(length, width),
        physics=physics,
        hills=hills,
        profile=profile,
        objects=objects,
    )
