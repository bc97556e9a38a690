"""Snow: a light bed that hardens under compression."""

from zoobench.envs.base import BED_THICKNESS, Environment, bed_environment
from zoobench.envs.bed import Bed
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.objects import NO_OBJECTS, Objects
from zoobench.envs.physics import LAND, Elasticity, Physics
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.registry import Kind, register
from zoobench.sim.model.laws.snow import SnowMaterial

# nu, theta_c, theta_s and rho of Stomakhin et al. 2013, table 2; E 1e5 Pa as in SoftZoo's reference implementation
SNOW = Elasticity(medium_density=400.0)


@register(
    Kind.ENV,
    "snow",
    version=8,
    tags=("land", "plastic"),
    added=("elasticity", "physics", "profile", "critical_compression", "critical_stretch", "objects"),
)
def snow(
    *,
    friction: float = 0.5,
    slip: bool = True,
    robot_friction: float = 0.5,
    thickness: float = BED_THICKNESS,
    length: float = 0.3125,
    width: float = 0.3125,
    hardening: float = 10.0,
    critical_compression: float = 2.5e-2,
    critical_stretch: float = 7.5e-3,
    elasticity: Elasticity = SNOW,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = LAND,
    objects: Objects = NO_OBJECTS,
) -> Environment:
    """A bed of snow on rough ground.

    The bed has no end, as in `desert`.

    * `friction`: Coulomb coefficient of the ground under the snow [-].
    * `slip`: whether robot and snow have velocity fields of their own; else the snow sticks to the robot.
    * `robot_friction`: Coulomb coefficient between them where they slip [-].
    * `thickness`: of the bed [m], a whole number of cells: where a bed ends within a cell, gaits go a quarter to a half
      less far.
    * `length`, `width`: of the part of the bed that is simulated at a time, along x and z, at least [m].
    * `hardening`: xi of Stomakhin et al. 2013 [-]; 1 in SoftZoo's reference.
    * `critical_compression`: theta_c, the elastic compression at which it yields [-].
    * `critical_stretch`: theta_s, the elastic extension at which it yields [-]; 4.5e-3 in SoftZoo's reference.
    """
    material = SnowMaterial(
        *elasticity.constants,
        critical_compression=critical_compression,
        critical_stretch=critical_stretch,
        hardening=hardening,
    )
    return bed_environment(
        Bed(material, thickness, robot_friction if slip else None),
        friction=friction,
        size=(length, width),
        physics=physics,
        hills=hills,
        profile=profile,
        objects=objects,
    )
