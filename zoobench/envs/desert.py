"""Desert: a bed of dry sand."""

from zoobench.envs.base import Environment, solid_bed_environment
from zoobench.envs.bed import SOLID_BED, SolidBed
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
    friction_angle: float = 45.0,
    bed: SolidBed = SOLID_BED,
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

    * `friction_angle`: of the sand, in triaxial compression [degrees]; 45 in SoftZoo's reference.
    """
    material = SandMaterial(*elasticity.constants, friction_angle=friction_angle)
    return solid_bed_environment(material, bed, physics=physics, hills=hills, profile=profile, objects=objects)
