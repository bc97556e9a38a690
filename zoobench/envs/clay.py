"""Clay: a soft plastic solid."""

from zoobench.envs.base import Environment, solid_bed_environment
from zoobench.envs.bed import SOLID_BED, SolidBed
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
    yield_stress: float = 800.0,
    bed: SolidBed = SOLID_BED,
    elasticity: Elasticity = CLAY,
    hills: Hills = LEVEL,
    profile: Profile = LEVEL_WAY,
    physics: Physics = LAND,
    objects: Objects = NO_OBJECTS,
) -> Environment:
    """A bed of soft clay on rough ground.

    The bed has no end, as in `desert`.

    * `yield_stress`: norm of the deviatoric stress at which it flows [Pa]; soft natural clays have several thousand.
      200 in SoftZoo's reference, which bears little more than robots weigh, and on a coarse grid too much.
    """
    material = ClayMaterial(*elasticity.constants, yield_stress=yield_stress)
    return solid_bed_environment(material, bed, physics=physics, hills=hills, profile=profile, objects=objects)
