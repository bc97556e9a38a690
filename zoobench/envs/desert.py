"""Desert: a bed of dry sand."""

from zoobench.envs.base import BED_THICKNESS, Environment, bed_environment
from zoobench.envs.bed import Bed
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.objects import NO_OBJECTS, Objects
from zoobench.envs.physics import LAND, Elasticity, Physics
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.registry import Kind, register
from zoobench.sim.model.laws.sand import SandMaterial

# E and nu of SoftZoo's reference implementation, whose media all have the density of water
SAND = Elasticity(medium_density=1600.0)


@register(
    Kind.ENV, "desert", version=7, tags=("land", "granular"), added=("elasticity", "physics", "profile", "objects")
)
def desert(
    *,
    friction: float = 0.5,
    slip: bool = True,
    robot_friction: float = 0.5,
    thickness: float = BED_THICKNESS,
    length: float = 0.3125,
    width: float = 0.3125,
    friction_angle: float = 45.0,
    elasticity: Elasticity = SAND,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = LAND,
    objects: Objects = NO_OBJECTS,
) -> Environment:
    """A bed of dry sand on rough ground.

    The bed has no end: the part around the robot is simulated, and goes with it. It is as large as the robot needs to
    turn, or larger if asked for. Where it is not level, it stays where it is, and is as long as the episode needs at
    0.5 m/s.

    * `friction`: Coulomb coefficient of the ground under the sand [-].
    * `slip`: whether robot and sand have velocity fields of their own; else the sand sticks to the robot.
    * `robot_friction`: Coulomb coefficient between them where they slip [-].
    * `thickness`: of the bed [m], a whole number of cells: where a bed ends within a cell, gaits go a quarter to a half
      less far.
    * `length`, `width`: of the part of the bed that is simulated at a time, along x and z, at least [m].
    * `friction_angle`: of the sand, in triaxial compression [degrees]; 45 in SoftZoo's reference.
    """
    material = SandMaterial(*elasticity.constants, friction_angle=friction_angle)
    return bed_environment(
        Bed(material, thickness, robot_friction if slip else None),
        friction=friction,
        size=(length, width),
        physics=physics,
        hills=hills,
        profile=profile,
        objects=objects,
    )
